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


@pytest.fixture(scope="module")
def signal_fit(simulate, prior, observed):
    engine = inference.Bolfi(prior, observed)
    theta = engine.ask(10)
    engine.tell(theta, simulate(theta, range(10)))
    return engine.fit()


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


@pytest.mark.parametrize("workers", [0, 2])
def test_a_larger_budget_goes_on_where_the_smaller_ended(
    tmp_path, prior, observed, simulate, workers
):
    """Also from within a round, 9 being no multiple of 4, whose points are chosen jointly."""
    calls = []

    def jointly(key, surrogate, n):
        steps = (np.arange(n)[:, None] + 0.5) / n
        return (steps + np.asarray(jax.random.uniform(key, (1, 2)))) % 1.0

    def counted(theta, seeds):
        calls.extend(seeds)
        return simulate(theta, seeds)

    with ThreadPoolExecutor(2) as pool:
        options = {"acquisition": jointly, "confirm": 0, "executor": pool if workers else None}
        kept = {**options, "bank": tmp_path / "b.sqlite"}
        small = inference.fit(counted, prior, observed, budget=9, **kept)
        assert len(calls) == 9
        large = inference.fit(counted, prior, observed, budget=12, **kept)
        assert len(calls) == len(set(calls)) == 12
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


def test_a_bank_s_simulations_serve_as_earlier_ones(prior, observed, simulate):
    with inference.SimulationBank() as bank:
        first = inference.fit(simulate, prior, observed, budget=8, bank=bank, identity="line")
        kept = bank.simulations("line")
    again = inference.fit(None, prior, observed, budget=0, earlier=kept)
    order = np.argsort(first.history.seeds), np.argsort(again.history.seeds)
    for name in ("theta", "signals", "seeds"):
        both = (getattr(fit.history, name) for fit in (first, again))
        left, right = (rows[rank] for rows, rank in zip(both, order, strict=True))
        np.testing.assert_array_equal(left, right)


def test_a_shared_bank_serves_a_second_observation(tmp_path, prior, observed, simulate):
    calls = []

    def counted(theta, seeds):
        calls.extend(seeds)
        return simulate(theta, seeds)

    with inference.SimulationBank(tmp_path / "b.sqlite") as bank:
        options = {"budget": 7, "confirm": 0, "bank": bank}
        inference.fit(counted, prior, observed, identity="line", **options)
        inference.fit(counted, prior, observed + 0.1, identity="line", **options)
        assert len(calls) == len(bank) == 7  # the start designs coincide
        inference.fit(counted, prior, observed, identity="other line", **options)
        assert len(calls) == 14


@pytest.mark.parametrize("workers", [0, 2])
def test_another_simulators_signals_in_a_bank_are_refused(
    tmp_path, prior, observed, simulate, workers
):
    path = tmp_path / "b.sqlite"
    inference.fit(simulate, prior, observed, budget=7, bank=path)

    def shorter(theta, seeds):
        return simulate(theta, seeds)[:, :20]

    message = (
        rf"{re.escape(str(path))} holds a signal of shape \(30,\) under identity='', where "
        r"\(20,\) is expected"
    )
    with ThreadPoolExecutor(2) as pool:
        options = {"bank": path, "executor": pool if workers else None}
        with pytest.raises(ValueError, match=message):
            inference.fit(shorter, prior, observed[:20], budget=7, **options)
        named = inference.fit(shorter, prior, observed[:20], budget=7, identity="20", **options)
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
        inference.fit(slow_first, prior, observed, budget=7, bank=bank, executor=pool)
    assert stored[0] >= 1


def test_a_larger_run_asks_what_a_smaller_one_did(tmp_path, prior, observed, simulate):
    """It finds all simulations of the smaller in the bank."""
    calls = []

    def counted(theta, seeds):
        calls.extend(seeds)
        return simulate(theta, seeds)

    bank = tmp_path / "b.sqlite"
    for budget in (30, 66):
        inference.fit(counted, prior, observed, budget=budget, batch=6, confirm=0, bank=bank)
    assert len(calls) == 66


def test_a_warning_points_at_who_called_fit(prior, observed):
    def constant(theta, seeds):
        return np.ones((len(seeds), 30))

    with pytest.warns(inference.EmulatorWarning, match="all simulations are equal") as caught:
        inference.fit(constant, prior, observed, budget=12)
    assert {Path(warning.filename) for warning in caught} == {Path(__file__)}


@pytest.mark.parametrize("shift", [1e4, -50.0])
def test_data_far_from_every_simulation_are_told(prior, observed, simulate, shift):
    with pytest.warns(inference.EmulatorWarning, match="far outside of what was simulated"):
        inference.fit(simulate, prior, observed + shift, budget=12)
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


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"budget": 5, "initial": 6}, "budget=5 is smaller than the start design of initial=6"),
        ({"budget": 2}, "budget must be an integer from 3"),
        ({"batch": 0}, "batch must be an integer"),
        ({"budget": 0, "earlier": ({"slope": [0], "offset": [0]}, np.zeros((1, 30)))}, "budget=0"),
    ],
)
def test_bad_budgets_are_refused(prior, observed, simulate, options, message):
    with pytest.raises(ValueError, match=message):
        inference.fit(simulate, prior, observed, **options)


def shown(fit):
    """The rows of its text, what -> value."""
    title, *rows = repr(fit).splitlines()
    assert title == "Fit"
    return dict(row.strip().split(": ", 1) for row in rows)


def test_a_fit_says_what_it_is_in_a_few_lines(line_fit, prior, observed, simulate):
    rows = ["parameters", "simulations", "discrepancy", "surrogate", "status", "warnings"]
    assert list(shown(line_fit)) == rows
    assert shown(line_fit)["simulations"].startswith("20,")
    assert "discrepancy" in shown(line_fit)["surrogate"]
    assert all(name in shown(line_fit)["parameters"] for name in prior.names)
    engine = inference.Bolfi(prior, observed)
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


@pytest.mark.parametrize(
    "earlier", [5, "runs.npz", {"theta": {}, "signals": []}, (np.zeros((4, 2)), np.zeros((4, 30)))]
)
def test_earlier_simulations_of_another_form_are_refused(prior, observed, simulate, earlier):
    with pytest.raises(ValueError, match=r"earlier must be \(theta, signals\), .*, got "):
        inference.fit(simulate, prior, observed, earlier=earlier)
    with pytest.raises(ValueError, match="signals"):
        inference.fit(simulate, prior, observed, earlier=({"slope": [0], "offset": [0]}, "loud"))


class Columns:
    """What has names and columns, and is no mapping."""

    def __init__(self, columns):
        self.columns = columns

    def keys(self):
        return self.columns.keys()

    def __getitem__(self, name):
        return self.columns[name]


@pytest.mark.parametrize(
    "table", [Columns, xr.Dataset, lambda columns: pd.DataFrame(columns, index=range(7, 17))]
)
def test_earlier_simulations_may_come_as_a_table(prior, observed, simulate, table):
    theta = prior.from_unit(np.random.default_rng(0).random((10, 2)))
    signals, quiet = simulate(theta, np.arange(10)), {"budget": 0, "progress": False, "warn": False}
    given = {name: ("run", column) for name, column in theta.items()}
    made = table(given if table is xr.Dataset else theta)
    fit = inference.fit(None, prior, observed, earlier=(made, signals), **quiet)
    np.testing.assert_array_equal(fit.history.theta, prior.to_array(theta))
    frames = made, pd.DataFrame(signals), pd.Series(np.arange(10), index=range(3, 13))
    again = inference.fit(None, prior, observed, earlier=frames, **quiet)
    np.testing.assert_array_equal(again.log_prob(made), fit.log_prob(theta))
    with pytest.raises(ValueError, match=r"must map .* got \('slope',\)$"):
        fit.log_prob(Columns({"slope": [0.1]}))


def test_a_table_that_is_not_finite_names_its_row(prior, observed):
    frame = pd.DataFrame({"slope": [0.1, np.nan, 0.3], "offset": [0.5, 0.5, np.inf]})
    with pytest.raises(
        ValueError, match=r"finite, got {'slope': nan, .*} in row 1, the first of 2"
    ):
        inference.fit(None, prior, observed, earlier=(frame, np.zeros((3, 30))), budget=0)


@pytest.mark.parametrize("fixture", ["line_fit", "signal_fit"])
def test_predictions_at_points_of_another_shape_are_refused(fixture, request, prior):
    fit = request.getfixturevalue(fixture)
    for theta in (0.5, {"slope": 0.5}, {"slope": np.zeros((2, 2)), "offset": np.zeros((2, 2))}):
        for use in (fit.surrogate.predict, fit.log_prob):
            with pytest.raises(ValueError, match="theta must"):
                use(theta)
    assert np.shape(fit.surrogate.predict({"slope": 0.5, "offset": 0.5})[0]) in ((), (30,))


def test_progress_is_told_on_stderr_unless_silenced(prior, observed, simulate, capsys):
    inference.fit(simulate, prior, observed, budget=7, progress=False)
    assert capsys.readouterr() == ("", "")
    inference.fit(simulate, prior, observed, budget=7)
    said = capsys.readouterr()
    assert said.out == "" and "10" in said.err  # three confirm


@pytest.mark.parametrize("progress", [None, 1, "bar"])
def test_progress_of_another_kind_is_refused_before_anything_is_simulated(
    prior, observed, progress
):
    calls = []
    with pytest.raises(ValueError, match="progress must be"):
        inference.fit(lambda *given: calls.append(given), prior, observed, progress=progress)
    with pytest.raises(ValueError, match="progress must be"):
        inference.replicates(
            lambda *given: calls.append(given), calls.append, prior, 2, progress=progress
        )
    assert calls == []


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


def test_a_simulator_of_single_runs_is_recognised_by_its_shape(prior, observed):
    def one(theta, seeds):
        return np.zeros(observed.shape)

    with pytest.raises(ValueError, match="vectorised=False"):
        inference.fit(one, prior, observed, budget=9, progress=False)


def test_a_warning_that_is_an_error_loses_no_simulation(tmp_path, prior, observed):
    """Warnings are errors here, as under `python -W error`."""
    calls = []

    def constant(theta, seeds):
        calls.extend(seeds)
        return np.ones((len(seeds), 30))

    given = {"budget": 12, "confirm": 0, "bank": tmp_path / "b.sqlite", "progress": False}
    with pytest.raises(inference.EmulatorWarning, match="all simulations are equal"):
        inference.fit(constant, prior, observed, **given)
    fit = inference.fit(constant, prior, observed, warn=False, **given)
    assert len(calls) == len(fit.history.theta) == 12


def test_complaints_are_kept_without_a_warning(prior, observed):
    """Warnings are errors here, so that one would fail the test."""
    fit = inference.fit(
        lambda theta, seeds: np.ones((len(seeds), 30)), prior, observed, budget=12, warn=False
    )
    assert fit.warnings
