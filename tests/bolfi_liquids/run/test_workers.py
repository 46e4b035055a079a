"""Processes that share long work, and what may be given in their place."""

import os
import signal
import subprocess
import sys
import time
from concurrent.futures import ThreadPoolExecutor
from contextlib import suppress
from multiprocessing import active_children

import pytest
from distributed import LocalCluster

import bolfi_liquids as bl
from bolfi_liquids.cli.options import ComputeOptions
from bolfi_liquids.run.compute import background_process, open_compute, processes

WORKING = """
import os, signal, time
from bolfi_liquids.run.compute import processes

# these tests may themselves be run where it is ignored
signal.signal(signal.SIGINT, signal.default_int_handler)
with processes(2) as pool:
    pool.submit(time.sleep, 300)
    assert pool.submit(os.getpid).result() != os.getpid()
    print("started", flush=True)
    time.sleep(300)
"""
"""One of its workers is busy then, the other idle."""

IN_BACKGROUND = """
import os, signal, time
from bolfi_liquids.run.compute import background_process

with background_process(0) as pool:
    pool.submit(os.getpid).result()
    pool.submit(time.sleep, 300)
    os.kill(os.getpid(), signal.SIGKILL)
"""


@pytest.fixture
def working():
    """A process with two workers, in a group of its own, as a terminal starts it."""
    with subprocess.Popen(
        [sys.executable, "-c", WORKING],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        start_new_session=True,
    ) as run:
        assert run.stdout is not None
        assert run.stdout.readline() == b"started\n"
        try:
            yield run
        finally:
            with suppress(ProcessLookupError):
                os.killpg(run.pid, signal.SIGKILL)


def test_workers_busy_or_idle_end_with_a_parent_that_is_killed(working):
    working.kill()
    rest, _ = working.communicate(timeout=60.0)  # until nobody holds the pipe
    assert rest == b""


def test_workers_end_on_ctrl_c_without_a_word(working):
    os.killpg(working.pid, signal.SIGINT)
    _, said = working.communicate(timeout=60.0)
    assert said.decode().count("Traceback") == 1  # the parent's own
    assert said.decode().endswith("KeyboardInterrupt\n")


def test_workers_go_on_where_ctrl_c_is_ignored():
    told = signal.signal(signal.SIGINT, signal.SIG_IGN)
    try:
        with processes(2) as pool:
            assert pool is not None
            os.kill(pool.submit(os.getpid).result(), signal.SIGINT)
            assert pool.submit(pow, 2, 3).result(60.0) == 8
    finally:
        signal.signal(signal.SIGINT, told)


def test_a_process_in_the_background_ends_with_a_parent_that_is_killed():
    # `run` returns when nobody holds the pipe
    killed = subprocess.run(
        [sys.executable, "-c", IN_BACKGROUND], stdout=subprocess.PIPE, timeout=200
    )
    assert killed.returncode == -signal.SIGKILL


def test_a_process_in_the_background_gives_way_and_leaves_ctrl_c_to_its_parent():
    with background_process(3) as pool:
        pid = pool.submit(os.getpid).result()
        here = os.getpriority(os.PRIO_PROCESS, 0)
        assert os.getpriority(os.PRIO_PROCESS, pid) == min(here + 3, 19)
        os.kill(pid, signal.SIGINT)
        assert pool.submit(os.getpid).result() == pid


def test_work_in_the_background_is_given_up():
    began = time.monotonic()
    with background_process(0) as pool:
        pid = pool.submit(os.getpid).result()
        pool.submit(time.sleep, 300)
    assert time.monotonic() - began < 200
    assert pid not in {child.pid for child in active_children()}


def test_work_is_waited_for_where_there_was_no_error():
    with processes(2) as pool:
        assert pool is not None
        asked = [pool.submit(pow, 2, power) for power in range(9)]
    assert [one.result(0.0) for one in asked] == [2**power for power in range(9)]


def test_work_is_given_up_where_there_was_an_error():
    began = time.perf_counter()
    with pytest.raises(KeyError), processes(2) as pool:
        assert pool is not None
        busy = [pool.submit(time.sleep, 300)]
        assert pool.submit(int).result() == 0  # by the other worker
        busy += [pool.submit(time.sleep, 300) for _ in range(4)]
        raise KeyError
    assert time.perf_counter() - began < 60.0
    assert all(future.done() for future in busy)


@pytest.mark.parametrize("threads", [1, 2])
def test_workers_of_dask_have_one_thread_each(threads):
    cluster = LocalCluster(
        processes=False,
        n_workers=1,
        threads_per_worker=threads,
        protocol="tcp://",
        dashboard_address=":0",
    )
    with cluster, cluster.get_client() as client:
        for given in (client, client.get_executor(), cluster.scheduler_address):
            if threads == 1:
                with open_compute(given) as compute:
                    assert compute.executor.submit(pow, 2, 3).result(60.0) == 8
                continue
            with pytest.raises(ValueError, match="--nthreads 1"), open_compute(given):
                pass
        if threads > 1:
            with pytest.raises(ValueError, match="--nthreads 1"):
                with ComputeOptions(1, cluster.scheduler_address).opened():
                    pass


UNUSABLE = {
    "threads": {"executor": ThreadPoolExecutor(2)},
    "no executor": {"executor": 4},
    "negative": {"timeout": -1},
    "text": {"timeout": "60"},
}


@pytest.mark.parametrize("given", UNUSABLE.values(), ids=UNUSABLE)
def test_every_call_that_simulates_refuses_what_cannot(
    calibration, short_recording, tmp_path, given
):
    before = sorted(calibration.path.iterdir())
    how = {"progress": False, **given}
    calls = [
        lambda: bl.calibrate(short_recording, out=tmp_path / "run", **how),
        lambda: bl.choose_pour(calibration, **how),
        lambda: bl.criticise(calibration, **how),
        lambda: bl.simulate_stir(**how),
        lambda: bl.simulate_pour(**how),
    ]
    for call in calls:
        with pytest.raises(ValueError) as refused:
            call()
        assert "timeout" not in given or refused.value.where == "timeout"
    assert sorted(calibration.path.iterdir()) == before and not (tmp_path / "run").exists()
