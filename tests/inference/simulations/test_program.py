"""Simulators that are programs: real ones, which are written here and run."""

import os
import pickle
import random
import signal
import subprocess
import sys
import time
from concurrent.futures import ProcessPoolExecutor, ThreadPoolExecutor
from contextlib import nullcontext
from multiprocessing import get_context

import numpy as np
import numpyro.distributions as dist
import pytest
from bolfi_liquids.inference import Program
from bolfi_liquids.inference.simulations import Compute, Job, run_missing
from bolfi_liquids.inference.simulations.failures import FailureKind, timed_out

from bolfi_liquids import inference

JOBS = [Job({"start": 1.0 + i, "rate": 0.1 / (i + 1)}, seed=i) for i in range(4)]
DAYS = np.arange(10)
DECAY = """
import sys, tomllib
import random
with open(sys.argv[1], "rb") as file:
    given = tomllib.load(file)
noise = random.Random(given["seed"])
with open(sys.argv[2], "w") as file:
    for day in range(10):
        print(given["start"] * 2.0 ** (-given["rate"] * day) + noise.gauss(0.0, 0.1), file=file)
"""
SHELL = """#!/bin/sh
# prints a * b and the seed
echo "warming up" >&2
echo "$1 $2 $3"
"""


@pytest.fixture
def here(tmp_path, monkeypatch):
    """A folder with two programs, from which the tests start them."""
    (tmp_path / "decay.py").write_text(DECAY)
    (tmp_path / "echo").write_text(SHELL)
    (tmp_path / "echo").chmod(0o755)
    monkeypatch.chdir(tmp_path)
    return tmp_path


def expected(job):
    """What decay.py writes."""
    noise = random.Random(job.seed)
    start, rate = job.theta.values()
    return np.array([start * 2.0 ** (-rate * day) + noise.gauss(0.0, 0.1) for day in range(10)])


def made(program, jobs=JOBS, **how):
    return run_missing(program, jobs, Compute(**how))


def one(program, theta, seed=0, **how):
    (found,) = made(program, [Job(theta, seed)], **how)
    return found


@pytest.fixture
def decay(here):
    return Program(f"{sys.executable} ./decay.py {{in}} {{out}}")


def test_it_reads_what_the_program_wrote_bit_for_bit(decay):
    for job, run in zip(JOBS, made(decay), strict=True):
        assert run.error is None
        np.testing.assert_array_equal(run.signal, expected(job))


def test_threads_and_processes_give_the_same_bits(decay):
    with ThreadPoolExecutor(3) as pool:
        by_threads = made(decay, executor=pool)
    with ProcessPoolExecutor(1, mp_context=get_context("spawn")) as pool:
        by_process = made(decay, JOBS[:1], executor=pool)
    for job, run in zip(JOBS + JOBS[:1], by_threads + by_process, strict=True):
        np.testing.assert_array_equal(run.signal, expected(job))
    theta = {name: np.array([job.theta[name] for job in JOBS]) for name in JOBS[0].theta}
    batch = pickle.loads(pickle.dumps(decay))(theta, np.arange(4))
    np.testing.assert_array_equal(batch, [expected(job) for job in JOBS])


def test_arguments_formats_and_what_is_printed(here, monkeypatch):
    program = Program("./echo {a} {b:.2f} {seed}")
    monkeypatch.chdir("/")  # paths are those from where it was made
    run = one(program, {"a": 1 / 3, "b": 2 / 3}, 7)
    np.testing.assert_array_equal(run.signal, [1 / 3, 0.67, 7.0])


def test_quoted_words_stay_one_and_no_shell_reads_them(here):
    program = Program("sh -c 'echo $# ; echo {a}' name '; exit 3' '$(exit 3)'")
    np.testing.assert_array_equal(one(program, {"a": 0.25}).signal, [2.0, 0.25])


def test_input_by_a_template_and_by_functions(here):
    by_template = Program("cp {in} {out}", write="{a} 2.0\n{seed} 4.0\n")
    np.testing.assert_array_equal(one(by_template, {"a": 0.5}, 3).signal, [[0.5, 2.0], [3.0, 4.0]])

    def write(directory, theta, seed):
        (directory / "a.csv").write_text(f"{theta['a']},{seed}")

    def read(directory):
        return np.loadtxt(directory / "b.csv", delimiter=",")

    by_function = Program("cp a.csv b.csv", write=write, read=read)
    np.testing.assert_array_equal(one(by_function, {"a": 0.5}, 3).signal, [0.5, 3.0])


def test_each_run_starts_in_an_empty_directory_that_goes(here):
    def read(directory):
        count, place = (directory / "stdout").read_text().split()
        places.add(place)
        return [float(count), float(os.path.samefile(place, directory)), len(places)]

    places = set()
    runs = made(Program("sh -c 'ls | grep -vc ^std; pwd' {start} {rate}", read=read))
    np.testing.assert_array_equal(
        [run.signal for run in runs], [[0.0, 1.0, n] for n in (1.0, 2.0, 3.0, 4.0)]
    )
    assert not any(map(os.path.exists, places))
    assert sorted(os.listdir(here)) == ["decay.py", "echo"]


def test_an_output_of_another_shape_is_no_signal(here):
    (run,) = run_missing(Program("echo {a} 1 2"), [Job({"a": 0.5}, 3)], Compute(), (2,))
    assert run.error.kind is FailureKind.UNUSABLE
    assert run.error.text == (
        "simulate must return one signal of shape (2,), got (3,) for {'a': 0.5}, seed 3"
    )


@pytest.mark.parametrize(
    ("command", "told"),
    [
        ("sh -c 'echo {a}; echo lost the mesh >&2; exit 3'", r"exit code 3; .*lost the mesh"),
        ("sh -c 'echo {a} >&2; kill -SEGV $$'", r"signal SIGSEGV; stderr ends:\n0.5"),
        ("sh -c 'echo {a} >&2' {out}", r"`out` must hold numbers, got 'nothing'.*0.5"),
        ("sh -c 'echo diverged at {a}'", r"could not convert string 'diverged'"),
        ("echo 1", r"parameters must all be in braces .* got \['a'\]"),
        ("echo {a} {b}", r"names in braces must be among .* got \['b'\]"),
    ],
)
def test_a_run_that_fails_says_why(here, command, told):
    run = one(Program(command), {"a": 0.5})
    assert run.signal is None and run.error is not None
    assert run.error.kind is FailureKind.RAISED
    with pytest.raises(RuntimeError, match=f"(?s){told}"):
        raise RuntimeError(run.error.text)


def test_the_end_of_stderr_is_kept_and_the_files_where_wanted(here):
    command = (
        "sh -c 'for i in $(seq 100); do echo line $i >&2; done; echo {a} >{out}; exit 1' x {out}"
    )
    program = Program(command, keep="failed")
    run = one(program, {"a": 0.5})
    assert "line 96\nline 97\nline 98\nline 99\nline 100" in run.error.text
    assert "line 95" not in run.error.text
    (kept,) = (here / "failed").iterdir()
    assert str(kept) in run.error.text
    assert (kept / "out").read_text() == "0.5\n" and "line 1\n" in (kept / "stderr").read_text()
    assert one(Program("echo {a}", keep="failed"), {"a": 0.5}).error is None
    assert len(list((here / "failed").iterdir())) == 1


def test_files_that_cannot_be_kept_do_not_hide_why_a_run_failed(here):
    (here / "file").touch()
    for keep, command in (("failed", "mkfifo {a}; echo lost >&2"), ("file", "echo {a} lost >&2")):
        run = one(Program(f"sh -c '{command}; exit 3'", keep=keep), {"a": 0.5})
        assert "exit code 3; not all of its files could be kept" in run.error.text
        assert "lost" in run.error.text
    (kept,) = (here / "failed").iterdir()
    assert (kept / "stderr").read_text() == "lost\n"


def ended(pid, within=10.0):
    """Whether a process has ended; one that nobody has waited for counts."""
    last = time.monotonic() + within
    while time.monotonic() < last:
        try:
            with open(f"/proc/{pid}/stat") as file:
                if file.read().rpartition(")")[2].split()[0] in "ZX":
                    return True
        except FileNotFoundError:
            return True
        time.sleep(0.01)
    return False


@pytest.mark.parametrize("code", [0, 3])
def test_nothing_goes_on_after_its_program(here, code):
    run = one(
        Program(f"sh -c 'sleep 600 & echo $! >{here}/pid; echo {{a}}; exit {code}'"), {"a": 1}
    )
    assert (run.error is None) == (code == 0)
    assert ended((here / "pid").read_text().strip())


def test_programs_share_a_bank_without_mixing_their_runs(here):
    prior = inference.Prior({"a": dist.Uniform(0.0, 1.0)})
    how = {"bank": here / "runs.sqlite", "budget": 8, "warn": False, "progress": False}
    fits = [inference.fit(Program(f"echo {text}"), prior, [0.5], **how) for text in ("{a}", "1{a}")]
    assert fits[0].best != fits[1].best


@pytest.mark.parametrize("command", ["echo {}", "echo {a.real}", "echo {a:{width}}", "echo {0}"])
def test_braces_without_a_plain_name_are_refused(command):
    with pytest.raises(ValueError, match="command must have names in braces"):
        Program(command)


@pytest.mark.parametrize("workers", [None, 2])
def test_what_hangs_is_killed_with_its_children(here, workers):
    """The child of the program ignores what can be ignored."""
    hangs = "sh -c 'trap \"\" TERM INT HUP; sleep 600 & echo $! $$ >pids; wait' {a}"
    program = Program(hangs, keep="failed")
    jobs = [Job({"a": float(i)}, 0) for i in range(2)]
    started = time.monotonic()
    if workers is None:
        runs = made(program, jobs, timeout=0.3)
    else:
        with ThreadPoolExecutor(workers) as pool:
            runs = made(program, jobs, timeout=0.3, executor=pool)
    assert [run.error for run in runs] == [timed_out(0.3)] * 2
    assert time.monotonic() - started < 20.0
    for kept in (here / "failed").iterdir():
        for pid in (kept / "pids").read_text().split():
            assert ended(pid)


@pytest.mark.parametrize("how", [signal.SIGTERM, signal.SIGKILL])
def test_nothing_goes_on_after_python_is_killed(here, how):
    code = (
        "from bolfi_liquids.inference.simulations.program import Program; "
        f"Program('sh -c \"echo $$ >{here}/pid; mv {here}/pid {here}/started; sleep 600\"')"
        ".simulate({}, 0)"
    )
    started = here / "started"
    with subprocess.Popen([sys.executable, "-c", code]) as python:
        while not started.exists():
            time.sleep(0.01)
        python.send_signal(how)
    assert ended(started.read_text().strip())


def test_a_misspelt_parameter_costs_no_simulation(here):
    prior = inference.Prior({"rate": dist.Uniform(0.0, 1.0)})
    for command, told in {
        "touch {rat}": "names in braces.*rat",
        "touch b": "parameters",
        "touch {rate:d}": "formats in braces.*{rate:d}.*'d'",
        "touch {rate} {out:.2f}": "formats in braces.*{out:.2f}",
    }.items():
        program = Program(f"{command} {here}/ran")
        for make in (
            lambda program: inference.fit(program, prior, [0.5], progress=False),
            lambda program: inference.FitPipeline(program, prior),
        ):
            with pytest.raises(ValueError, match=told):
                make(program)
    assert not (here / "ran").exists()


@pytest.mark.parametrize("pool", [None, ThreadPoolExecutor])
@pytest.mark.parametrize("command", ["no-such-program {a}", "./nowhere {a}", "./decay.py {a}"])
def test_a_program_that_is_not_there_is_refused_and_not_tried(here, pool, command):
    program = Program(command, keep="failed")
    prior = inference.Prior({"a": dist.Uniform(0.0, 1.0)})
    with pool(2) if pool else nullcontext() as executor:
        with pytest.raises(ValueError, match="^command must begin with a program"):
            inference.fit(program, prior, [0.5], executor=executor, progress=False)
    assert not (here / "failed").exists()


def test_what_a_bank_holds_needs_no_program(here):
    program, jobs = Program("./echo {a} {seed}"), [Job({"a": 0.5}, 3)]
    with inference.SimulationBank() as bank:
        (first,) = made(program, jobs, bank=bank)
        (here / "echo").unlink()
        (again,) = made(program, jobs, bank=bank)
    np.testing.assert_array_equal(again.signal, first.signal)


def test_a_program_may_be_written_for_each_run(here):
    def write(directory, theta, seed):
        (directory / "bin").mkdir()
        (directory / "bin" / "model").write_text(SHELL)
        (directory / "bin" / "model").chmod(0o755)

    run = one(Program("bin/model {a} 1", write=write), {"a": 0.5})
    assert run.signal is not None and run.signal.tolist() == [0.5, 1.0]


def test_a_person_s_interrupt_ends_the_program(here, monkeypatch):
    """As Ctrl-C in the engine's process, which the program's group does not hear."""

    class Interrupted(subprocess.Popen):
        def wait(self, timeout=None):
            if not interrupted:
                interrupted.append(self.pid)
                raise KeyboardInterrupt
            return super().wait(timeout)

    interrupted = []
    monkeypatch.setattr(subprocess, "Popen", Interrupted)
    with pytest.raises(KeyboardInterrupt):
        Program("sleep 60{seed}").simulate({}, 0)
    assert ended(*interrupted)


def test_a_fit_of_a_program_is_that_of_its_function(decay):
    prior = inference.Prior({"start": dist.Uniform(1.0, 4.0), "rate": dist.Uniform(0.0, 0.5)})
    observed = expected(Job({"start": 2.0, "rate": 0.2}, 99))
    quick = {"budget": 12, "confirm": 0, "noise": 0, "progress": False, "warn": False}
    with ThreadPoolExecutor(2) as pool:
        fit = inference.fit(decay, prior, observed, executor=pool, timeout=60, **quick)
    function = inference.fit(
        lambda theta, seed: expected(Job(theta, seed)), prior, observed, vectorised=False, **quick
    )
    np.testing.assert_array_equal(fit.history.signals, function.history.signals)
    np.testing.assert_array_equal(fit.history.theta, function.history.theta)
