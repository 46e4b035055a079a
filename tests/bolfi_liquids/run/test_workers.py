"""Processes that share long work."""

import os
import signal
import subprocess
import sys
import time
from contextlib import suppress

import pytest

from bolfi_liquids.run.workers import processes

WORKING = """
import os, signal, time
from bolfi_liquids.run.workers import processes

# these tests may themselves be run where it is ignored
signal.signal(signal.SIGINT, signal.default_int_handler)
with processes(2) as pool:
    pool.submit(time.sleep, 300)
    assert pool.submit(os.getpid).result() != os.getpid()
    print("started", flush=True)
    time.sleep(300)
"""
"""One of its workers is busy then, the other idle."""


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
