"""Replicates: stored, resumed, run in parallel, and honest about failures."""

import os
import runpy
import signal
import sqlite3
import subprocess
import sys
import time
from concurrent.futures import ThreadPoolExecutor
from contextlib import closing
from dataclasses import dataclass

import numpy as np
import numpyro.distributions as dist
import pytest
from bolfi_liquids.inference.simulations.failures import FailureKind

from bolfi_liquids import inference

PRIOR = inference.Prior({"a": dist.Normal(0.0, 1.0), "b": dist.Uniform(0.0, 1.0)})

SCRIPT = """
import sys, time
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
import numpy as np
import numpyro.distributions as dist
from bolfi_liquids import inference

@dataclass(frozen=True)
class Logged:
    log: str
    def __call__(self, observed, seed):
        time.sleep(0.1)
        with open(self.log, "a") as file:
            file.write(f"{seed}\\n")
        return {"a": observed[0] + np.random.default_rng(seed).normal(size=31)}

def simulate(theta, seeds):
    return theta["a"][:, None] + np.random.default_rng(seeds[0]).normal(size=(1, 1))

log, store, out = sys.argv[1:]
prior = inference.Prior({"a": dist.Normal(0.0, 1.0)})
with ThreadPoolExecutor(2) as pool:
    made = inference.replicates(
        Logged(log), simulate, prior, 24, draws=31, independent=True, executor=pool, store=store,
        identity="a",
    )
np.save(out, made.draws)
"""


def simulate(theta, seeds):
    noise = np.stack([np.random.default_rng(seed).normal(size=4) for seed in seeds])
    return theta["a"][:, None] + theta["b"][:, None] + noise


@dataclass(frozen=True)
class Guess:
    """Draws around the data; fails where their mean exceeds `fails_above`."""

    fails_above: float = np.inf
    n: int = 31

    def __call__(self, observed, seed):
        if observed.mean() > self.fails_above:
            raise ArithmeticError("too high")
        rng = np.random.default_rng(seed)
        return {"a": rng.normal(observed.mean(), 1.0, self.n), "b": rng.random(self.n)}


def run(pipeline=None, n=12, simulate=simulate, prior=PRIOR, **options):
    options = {"draws": 15, "independent": True, "identity": "a b", "progress": False} | options
    return inference.replicates(pipeline or Guess(), simulate, prior, n, **options)


def test_truths_come_from_the_prior_and_data_from_the_truths():
    made = run(n=400)
    u = PRIOR.to_unit(PRIOR.to_dict(made.truth))
    assert np.abs(u.mean(0) - 0.5).max() < 4 * np.sqrt(1 / 12 / 400)
    observed = np.stack([r.observed for r in made.finished])
    residual = (observed - made.truth.sum(-1, keepdims=True)).ravel()
    assert abs(residual.std() - 1.0) < 4 / np.sqrt(2 * residual.size)
    assert abs(np.corrcoef(observed[1:, 0], observed[:-1, 0])[0, 1]) < 0.2  # seeds differ


def test_more_replicates_leave_the_first_as_they_were():
    few, many = run(n=5), run(n=9)
    np.testing.assert_array_equal(few.draws, many.draws[:5])
    assert not np.array_equal(run(n=5, seed=1).draws, few.draws)


def test_an_executor_changes_nothing():
    with ThreadPoolExecutor(3) as pool:
        np.testing.assert_array_equal(run(executor=pool).draws, run().draws)


def test_measurement_noise_is_added_to_what_is_simulated():
    plain, noisy = run(), run(observe=lambda signal, rng: signal + rng.normal(0, 9.0, 4))
    observed = [np.stack([r.observed for r in made.finished]) for made in (plain, noisy)]
    added = observed[1] - observed[0]
    assert 5.0 < added.std() < 13.0


@pytest.mark.slow
def test_killed_and_repeated_equals_undisturbed(tmp_path, monkeypatch):
    """SIGKILL after the eighth replicate or later; only what was running is run again."""

    script, log = tmp_path / "run.py", tmp_path / "killed.log"
    script.write_text(SCRIPT)

    def arguments(name):
        return [str(script), *(str(tmp_path / f"{name}.{end}") for end in ("log", "sqlite", "npy"))]

    def start():
        return subprocess.Popen([sys.executable, *arguments("killed")])

    def ran():
        return len(log.read_text().split()) if log.exists() else 0

    victim, deadline = start(), time.monotonic() + 60.0
    while ran() < 8 and time.monotonic() < deadline:
        time.sleep(0.01)
    os.kill(victim.pid, signal.SIGKILL)
    assert victim.wait() == -signal.SIGKILL
    before = ran()
    assert 8 <= before < 24
    with closing(sqlite3.connect(tmp_path / "killed.sqlite")) as connection:
        stored = connection.execute("SELECT count(*) FROM replicate").fetchone()[0]
    assert before - 4 <= stored <= before  # two were running, two may have been on their way
    resumed = start()
    monkeypatch.setattr(sys, "argv", arguments("whole"))
    runpy.run_path(str(script))
    assert resumed.wait() == 0
    assert ran() == before + 24 - stored
    killed, undisturbed = (np.load(tmp_path / f"{name}.npy") for name in ("killed", "whole"))
    np.testing.assert_array_equal(killed, undisturbed)


def test_a_store_refuses_other_settings_and_welcomes_more_replicates(tmp_path):
    store = tmp_path / "r.sqlite"
    first = run(n=2, store=store, timeout=60.0)
    for changed, named in (
        ({"seed": 1}, "seed"),
        ({"draws": 7}, "draws"),
        ({"independent": False}, "independent"),
        ({"pipeline": Guess(n=20)}, "pipeline"),
        ({"identity": "new code"}, "identity"),
        ({"observe": lambda signal, rng: signal}, "observe"),
        (
            {"prior": inference.Prior({"a": dist.Normal(0.0, 2.0), "b": dist.Uniform(0.0, 1.0)})},
            "prior",
        ),
    ):
        with pytest.raises(ValueError, match=rf"other settings .*\({named}: stored"):
            run(n=2, store=store, **changed)
    long, other = "x" * 60 + "a" + "z" * 60, "x" * 60 + "b" + "z" * 60
    run(n=2, store=tmp_path / "long.sqlite", identity=long)
    with pytest.raises(
        ValueError, match=r"identity: stored \.\.\.x+az+\.\.\., now \.\.\.x+bz+\.\.\.\)"
    ):
        run(n=2, store=tmp_path / "long.sqlite", identity=other)
    again = run(n=4, store=store)  # of another time limit, which decides no draw
    assert len(again) == 4
    np.testing.assert_array_equal(again.draws[:2], first.draws)


def test_other_files_are_refused_and_left_alone(tmp_path):
    text, bank = tmp_path / "notes.txt", tmp_path / "bank.sqlite"
    text.write_text("not a database, but long enough to be read as a header of one " * 20)
    inference.SimulationBank(bank).close()
    before = text.read_bytes(), bank.read_bytes()
    for path in (text, bank):
        with pytest.raises(ValueError, match="not a replicate store"):
            run(store=path)
    assert (text.read_bytes(), bank.read_bytes()) == before


def test_failures_are_kept_counted_and_tried_again_on_request(tmp_path):
    store = tmp_path / "r.sqlite"
    first = run(Guess(fails_above=0.5), n=40, store=store)
    again = run(Guess(fails_above=0.5), n=40, store=store)
    assert 5 < len(first.failed) < 35 and first.errors == again.errors
    (said,) = set(first.errors.values())
    assert said.startswith("pipeline: ArithmeticError: too high")
    assert f"{len(first.failed)} of 40 replicates failed" in inference.sbc(first).warnings[0]
    few = run(Guess(fails_above=3.0), n=200)  # too few to hide a fault
    assert 0 < len(few.failed) < 7 and few.warnings == []
    connection = sqlite3.connect(store)
    connection.execute("UPDATE replicate SET error = 'disk full' WHERE error IS NOT NULL")
    connection.commit()
    connection.close()
    assert {one.error.text for one in run(Guess(0.5), n=40, store=store).failed} == {"disk full"}
    assert run(Guess(0.5), n=40, store=store, retry=True).errors == first.errors


def test_a_simulator_that_fails_is_not_the_pipelines_fault():
    def broken(theta, seeds):
        if theta["a"][0] > 0:
            raise OSError("no disk")
        return np.full((1, 4), np.nan)

    made = run(n=20, simulate=broken)
    assert {one.stage for one in made.failed} == {"simulator"}
    assert {one.error.kind for one in made.failed} == {FailureKind.RAISED, FailureKind.NOT_FINITE}
    assert any("OSError: no disk" in said for said in made.errors.values())
    for check in (inference.sbc, inference.coverage, inference.tarp):
        with pytest.raises(ValueError, match="no replicate finished"):
            check(made)


def test_replicates_beside_unusable_ones_are_kept_and_these_are_tried_again(tmp_path):
    def at_times_no_signal(theta, seeds):
        return np.zeros(()) if theta["a"][0] > 0.5 else simulate(theta, seeds)

    def made(told):
        return run(
            n=30, simulate=at_times_no_signal, progress=told.append, store=tmp_path / "r.sqlite"
        )

    ran, ran_again = [], []
    first, again = made(ran), made(ran_again)
    assert 4 < len(first.failed) < 26 and first.errors == again.errors
    assert {one.error.kind for one in again.failed} == {FailureKind.UNUSABLE}
    assert len(ran) == 30 and len(ran_again) == len(first.failed)
    np.testing.assert_array_equal(first.draws, again.draws)


def test_a_simulator_that_takes_too_long_costs_its_replicate():
    def slow(theta, seeds):
        time.sleep(0.2 * (theta["a"][0] > 0))
        return simulate(theta, seeds)

    made, plain = run(simulate=slow, timeout=0.1), run()
    late = plain.truth[:, 0] > 0
    assert set(made.errors) == set(np.flatnonzero(late)) and len(made) == (~late).sum()
    assert {one.error.kind for one in made.failed} == {FailureKind.TIMEOUT}
    np.testing.assert_array_equal(made.draws, plain.draws[~late])


def test_progress_is_told_of_every_replicate(capsys):
    told = []
    run(n=3, progress=told.append)
    assert told == [1] * 3 and capsys.readouterr() == ("", "")


def test_draws_that_are_not_finite_are_a_failure():
    made = run(lambda observed, seed: {"a": np.full(9, np.nan), "b": np.ones(9)}, n=2)
    assert {(one.stage, one.error.kind) for one in made.failed} == {
        ("pipeline", FailureKind.NOT_FINITE)
    }


def test_what_would_fail_for_every_replicate_stops_the_run():
    """A pipeline of the wrong form, and arguments that make no sense."""
    for wrong, named in (
        ({"pipeline": lambda observed, seed: {"a": np.zeros(9)}}, "parameters"),
        ({"pipeline": lambda observed, seed: np.zeros(9)}, "draws"),
        ({"n": 0}, "n must"),
        ({"draws": 0}, "draws"),
        ({"seed": -1}, "seed"),
        ({"timeout": 0}, "timeout"),
        ({"executor": 3}, "executor"),
        ({"observe": 3}, "observe"),
        ({"simulate": 3}, "simulate"),
        ({"simulate": None}, "simulate is needed"),
        ({"prior": None}, "prior is needed"),
    ):
        with pytest.raises(ValueError, match=named):
            run(**wrong)
