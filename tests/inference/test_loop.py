"""The whole loop: budget, bank, progress, refused input."""

import re
import threading
import time
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import jax
import numpy as np
import pandas as pd
import pytest
import xarray as xr
from bolfi_liquids.inference.simulations.job import simulation_seed

from bolfi_liquids import inference


def test_recovers_the_truth(line_fit, prior):
    """Twenty simulations place the best within 4 % of each prior's width.

    The exact posterior of the line (noise sd 0.05, 30 samples) has sd 0.03 in the slope, 1.5 %
    of its width, and 0.018 in the offset, 1.8 %: the test allows about two of them.
    """
    error = prior.to_unit(line_fit.best) - prior.to_unit({"slope": 0.3, "offset": 0.6})
    assert np.abs(error).max() < 0.04


def test_rounds_seeds_and_seconds_are_reported(line_fit):
    runs = line_fit.simulations
    np.testing.assert_array_equal(runs["round"], np.repeat(np.arange(5), 4))
    assert len(np.unique(runs["seed"])) == 20
    assert set(line_fit.seconds) == {"simulator", "engine"}
    closest = line_fit.closest
    assert closest.discrepancy == runs["discrepancy"].min()
    assert closest.signal.shape == (30,)


def test_a_larger_budget_goes_on_where_the_smaller_ended(tmp_path, prior, observed, simulate):
    """Also from within a round, 9 being no multiple of 4, whose points are chosen jointly."""
    calls = []

    def jointly(key, surrogate, n):
        steps = (np.arange(n)[:, None] + 0.5) / n
        return (steps + np.asarray(jax.random.uniform(key, (1, 2)))) % 1.0

    def counted(theta, seeds):
        calls.extend(seeds)
        return simulate(theta, seeds)

    with ThreadPoolExecutor(2) as pool:
        options = {"acquisition": jointly, "confirm": 0, "executor": pool}
        kept = {**options, "bank": tmp_path / "b.sqlite", "identity": "line"}
        small = inference.fit(counted, prior, observed, budget=9, **kept)
        assert len(calls) == 9
        large = inference.fit(counted, prior, observed, budget=12, **kept)
        assert len(calls) == len(set(calls)) == 12
        options["executor"] = None
        at_once = inference.fit(simulate, prior, observed, budget=12, **options)
    np.testing.assert_array_equal(small.history.theta, large.history.theta[:9])
    np.testing.assert_array_equal(large.history.theta, at_once.history.theta)
    np.testing.assert_array_equal(large.history.signals, at_once.history.signals)
    assert large.best == at_once.best


def test_earlier_simulations_count_beside_the_budget(prior, observed, simulate):
    """Ten of one's own make a start design superfluous, and alone are enough."""
    theta = prior.from_unit(np.random.default_rng(3).uniform(size=(10, 2)))
    signals = simulate(theta, range(10))
    fit = inference.fit(simulate, prior, observed, budget=4, earlier=(theta, signals), confirm=0)
    np.testing.assert_array_equal(fit.history.signals[:10], signals)
    np.testing.assert_array_equal(fit.simulations["seed"][:10], np.full(10, -1))
    np.testing.assert_array_equal(fit.simulations["round"], [-1] * 10 + [0] * 4)
    engine = inference.Bolfi(prior, observed)
    engine.tell(theta, signals)
    first = prior.to_array(engine.ask(4))  # the acquisition's, not the design's
    np.testing.assert_array_equal(fit.history.theta[10:], first)


def test_another_simulators_signals_in_a_bank_are_refused(tmp_path, prior, observed, simulate):
    path = tmp_path / "b.sqlite"
    inference.fit(simulate, prior, observed, budget=7, bank=path, identity="line")

    def shorter(theta, seeds):
        return simulate(theta, seeds)[:, :20]

    told = rf"{re.escape(str(path))}.* \(30,\) .*identity='.* \(20,\)"
    with ThreadPoolExecutor(2) as pool:
        options = {"budget": 7, "bank": path, "executor": pool}
        with pytest.raises(ValueError, match=told):
            inference.fit(shorter, prior, observed[:20], identity="line", **options)
        named = inference.fit(shorter, prior, observed[:20], identity="20", **options)
    assert named.failures == {}


def test_an_executor_s_results_are_stored_as_they_come(tmp_path, prior, observed, simulate):
    """The first run of a round waits until the second is in the bank."""
    path = tmp_path / "b.sqlite"
    stored = []

    def slow_first(theta, seeds):
        if not stored and int(seeds[0]) == simulation_seed(0, 0):
            with inference.SimulationBank(path) as other:
                deadline = time.monotonic() + 30.0
                while len(other) < 1 and time.monotonic() < deadline:
                    threading.Event().wait(0.01)
                stored.append(len(other))
        return simulate(theta, seeds)

    with inference.SimulationBank(path) as bank, ThreadPoolExecutor(2) as pool:
        options = {"bank": bank, "identity": "line", "executor": pool}
        inference.fit(slow_first, prior, observed, budget=7, **options)
    assert stored[0] >= 1


def test_a_warning_points_at_who_called_fit(prior, observed):
    def constant(theta, seeds):
        return np.ones((len(seeds), 30))

    with pytest.warns(inference.EmulatorWarning, match="all simulations are equal") as caught:
        inference.fit(constant, prior, np.ones(30), budget=12)
    assert {Path(warning.filename) for warning in caught} == {Path(__file__)}


def test_data_far_from_every_simulation_are_told(prior, observed, simulate):
    with pytest.warns(inference.EmulatorWarning, match="far outside of what was simulated"):
        inference.fit(simulate, prior, observed - 50.0, budget=12)
    fit = inference.fit(simulate, prior, observed, budget=12)
    assert not any("outside" in said for said in fit.warnings)


@pytest.mark.slow
def test_a_fit_on_a_few_of_many_says_so(prior, observed, simulate):
    def fragile(theta, seeds):
        return np.where(theta["slope"][:, None] > 0.3, np.nan, simulate(theta, seeds))

    engine = inference.Bolfi(prior, observed)
    theta = {"slope": np.linspace(-1.0, 1.0, 12)[::-1], "offset": np.arange(12) * 5 % 12 / 12}
    theta = {name: values[:10] for name, values in theta.items()}
    engine.tell(theta, fragile(theta, np.arange(10)))
    assert not any("failed" in said for said in engine.fit(warn=False).warnings)
    fewer = {name: np.concatenate([values[:4]] * 2) for name, values in theta.items()}
    engine.tell(fewer, fragile(fewer, np.arange(8)))
    said = engine.fit(warn=False).warnings
    assert any("12 of 18 simulations failed" in one for one in said)


def shown(fit):
    """The rows of its text, what -> value."""
    title, *rows = repr(fit).splitlines()
    assert title == "Fit"
    return dict(row.strip().split(": ", 1) for row in rows)


def test_a_fit_says_what_it_is_in_a_few_lines(line_fit, prior, observed, simulate):
    rows = ["parameters", "interval ends", "simulations", "discrepancy", "surrogate", "status"]
    assert list(shown(line_fit)) == [*rows, "warnings"]
    assert shown(line_fit)["simulations"].startswith("20,")
    assert "discrepancy" in shown(line_fit)["surrogate"]
    assert all(name in shown(line_fit)["parameters"] for name in prior.names)
    engine = inference.Bolfi(prior, np.ones(30))
    theta = engine.ask(8)
    signals = np.ones((8, 30))
    signals[:2] = np.nan
    engine.tell(theta, signals, errors=["OSError: no licence", *[""] * 7])
    with pytest.warns(inference.EmulatorWarning, match="all simulations are equal"):
        fit = engine.fit()
    told = shown(fit)
    assert told["simulations"].startswith("8,") and fit.failures == {"raised": 1, "not finite": 1}
    assert all(f"{count} {kind}" in told["simulations"] for kind, count in fit.failures.items())
    assert told["warnings"] == "; ".join(fit.warnings)


class Columns:
    """What has names and columns, and is no mapping."""

    def __init__(self, columns):
        self.columns = columns

    def keys(self):
        return self.columns.keys()

    def __getitem__(self, name):
        return self.columns[name]


def test_earlier_simulations_may_come_as_a_table(prior, observed, simulate):
    theta = prior.from_unit(np.random.default_rng(0).random((10, 2)))
    signals, quiet = simulate(theta, np.arange(10)), {"budget": 0, "progress": False, "warn": False}
    labelled = xr.Dataset({name: ("run", column) for name, column in theta.items()})
    for made in (Columns(theta), labelled, pd.DataFrame(theta, index=range(7, 17))):
        fit = inference.fit(None, prior, observed, earlier=(made, signals), **quiet)
        np.testing.assert_array_equal(fit.history.theta, prior.to_array(theta))
        frames = made, pd.DataFrame(signals), pd.Series(np.arange(10), index=range(3, 13))
        again = inference.fit(None, prior, observed, earlier=frames, **quiet)
        np.testing.assert_array_equal(again.log_prob(made), fit.log_prob(theta))


def test_progress_is_told_on_stderr_unless_silenced(prior, observed, simulate, capsys):
    inference.fit(simulate, prior, observed, budget=7, progress=False)
    assert capsys.readouterr() == ("", "")
    inference.fit(simulate, prior, observed, budget=7)
    said = capsys.readouterr()
    assert said.out == "" and "10" in said.err  # three confirm


def single(theta, seed):
    """One straight line; the third of these seeds fails."""
    if seed == simulation_seed(0, 2):
        raise ArithmeticError
    return theta["offset"] + theta["slope"] * np.linspace(-1.0, 1.0, 30)


def test_a_simulator_of_single_runs_is_looped_over(prior, observed, tmp_path):
    """Like its batched twin, and a run that fails costs that run alone and is not repeated."""
    calls = []

    def counted(theta, seed):
        assert isinstance(theta["slope"], float) and isinstance(seed, int)
        calls.append(seed)
        return single(theta, seed)

    def batched(theta, seeds):
        rows = ({name: column[i] for name, column in theta.items()} for i in range(len(seeds)))
        return np.stack([single(row, seed) for row, seed in zip(rows, seeds, strict=True)])

    given = {"budget": 9, "confirm": 0, "warn": False, "progress": False}
    fit = inference.fit(counted, prior, observed, vectorised=False, **given)
    assert calls == [simulation_seed(0, i) for i in range(9)]
    assert fit.failures == {"raised": 1}
    twin = inference.fit(batched, prior, observed, **given)
    xr.testing.assert_equal(fit.simulations.drop_vars("error"), twin.simulations.drop_vars("error"))


def test_a_warning_that_is_an_error_loses_no_simulation(tmp_path, prior, observed):
    """Warnings are errors here, as under `python -W error`."""
    calls = []

    def constant(theta, seeds):
        calls.extend(seeds)
        return np.ones((len(seeds), 30))

    given = {"budget": 12, "confirm": 0, "bank": tmp_path / "b.sqlite", "identity": "ones"}
    with pytest.raises(inference.EmulatorWarning, match="all simulations are equal"):
        inference.fit(constant, prior, observed, **given)
    fit = inference.fit(constant, prior, observed, warn=False, **given)
    assert len(calls) == len(fit.history.theta) == 12


def test_earlier_simulations_alone_are_confirmed_where_there_is_a_simulator(
    prior, observed, simulate
):
    theta = prior.from_unit(np.random.default_rng(3).uniform(size=(10, 2)))
    signals = simulate(theta, range(10))
    seeds, errors = [*range(10)], ["too hot", *[""] * 9]
    signals[0] = np.nan
    told = theta, signals, seeds, errors
    alone, confirmed = (
        inference.fit(of, prior, observed, budget=0, earlier=told, noise=0.05, confirm=4)
        for of in (None, simulate)
    )
    engine = inference.Bolfi(prior, observed, noise=0.05)
    engine.tell(*told)
    assert alone.best == engine.fit(warn=False).best and alone.confirmed is None
    np.testing.assert_array_equal(confirmed.confirming, [10, 11, 12, 13])
    assert confirmed.confirmed
    assert confirmed.history.errors[0] == "too hot"
    with pytest.raises(ValueError, match=r"errors\[1\]"):
        engine.tell(theta, signals, seeds, ["too hot", "cold", *errors[2:]])
    assert len(np.unique(confirmed.history.seeds)) == 14
