"""Simulations that fail: what a loop makes of them."""

import re

import numpy as np
import pytest

from bolfi_liquids import inference


def test_an_exception_costs_one_run(tmp_path, prior, observed, simulate):
    def fragile(theta, seeds):
        if (theta["slope"] > 0.5).any():
            raise FloatingPointError("blew up")
        return simulate(theta, seeds)

    with inference.SimulationBank(tmp_path / "b.sqlite") as bank:
        fit = inference.fit(fragile, prior, observed, budget=12, bank=bank)
        failed = fit.simulations["slope"] > 0.5
        np.testing.assert_array_equal(fit.simulations["failed"], failed)
        assert failed.any() and not failed.all()
        row = fit.simulations.isel(simulation=int(np.argmax(failed.to_numpy())))
        theta = {name: float(row[name]) for name in prior.names}
        stored = bank.get("", theta, int(row["seed"]))
    assert stored is not None and stored.error is not None
    assert re.fullmatch(
        r"FloatingPointError: blew up \(test_failures\.py, line \d+\)", stored.error
    )


def test_what_raised_is_tried_again_by_the_next_call(tmp_path, prior, observed, simulate):
    broken = [True]

    def licensed(theta, seeds):
        if broken[0]:
            raise OSError("no licence")
        return simulate(theta, seeds)

    with inference.SimulationBank(tmp_path / "b.sqlite") as bank:
        with pytest.raises(RuntimeError, match="no licence"):
            inference.fit(licensed, prior, observed, budget=9, bank=bank)
        broken[0] = False
        mended = inference.fit(licensed, prior, observed, budget=9, bank=bank)
    plain = inference.fit(simulate, prior, observed, budget=9)
    np.testing.assert_array_equal(mended.history.signals, plain.history.signals)


def test_total_failure_is_an_error_with_its_cause(prior, observed):
    def broken(theta, seeds):
        raise OSError("no licence")

    with pytest.raises(RuntimeError, match="all 12 simulations .* OSError: no licence"):
        inference.fit(broken, prior, observed)


@pytest.mark.parametrize("successes", [1, 2])
def test_too_few_successes_are_an_error_that_loses_nothing(
    tmp_path, prior, observed, simulate, successes
):
    calls = []

    def fragile(theta, seeds):
        calls.extend(seeds)
        if len(calls) > successes:
            raise OSError("no licence")
        return simulate(theta, seeds)

    path = tmp_path / "b.sqlite"
    with pytest.raises(RuntimeError, match=f"^{successes} of 7 .*no licence") as caught:
        inference.fit(fragile, prior, observed, budget=7, batch=1, bank=path)
    assert str(path) in str(caught.value)
    with inference.SimulationBank(path) as bank:
        assert len(bank.simulations("").seeds) == successes
    calls.clear()
    with pytest.raises(RuntimeError, match=f"^{successes} of 7 ") as caught:
        inference.fit(fragile, prior, observed, budget=7, batch=1)
    assert str(path) not in str(caught.value) and ":memory:" not in str(caught.value)


def test_the_user_s_own_line_is_named_where_the_engine_refuses_his_call(prior, observed):
    def wrong(theta, seeds):
        return prior.to_array({"slope": theta["slope"]})

    line = wrong.__code__.co_firstlineno + 1
    with pytest.raises(RuntimeError, match=rf"\(test_failures\.py, line {line}\)"):
        inference.fit(wrong, prior, observed)


def test_copies_among_earlier_simulations_are_too_few(prior, observed):
    earlier = {"slope": [0.5] * 3, "offset": [0.5] * 3}, np.zeros((3, 30)), [0, 0, 0]
    with pytest.raises(RuntimeError, match=r"^1 of 3 "):
        inference.fit(None, prior, observed, budget=0, initial=3, earlier=earlier)


@pytest.mark.parametrize("shape", [(29,), (1, 30), ()])
def test_a_single_run_s_signal_of_wrong_shape_is_told_as_the_user_made_it(prior, observed, shape):
    with pytest.raises(ValueError, match=re.escape(f"(30,), got {shape}")):
        inference.fit(lambda theta, seed: np.zeros(shape), prior, observed, vectorised=False)


@pytest.mark.parametrize("shape", [(4, 29), (3, 30), (30,), ()])
def test_signals_of_wrong_shape_are_refused_and_not_stored(prior, observed, simulate, shape):
    message = re.escape(f"shape (4, 30), one row per theta, got {shape}")
    with inference.SimulationBank() as bank:
        with pytest.raises(ValueError, match=message):
            inference.fit(lambda theta, seeds: np.zeros(shape), prior, observed, bank=bank)
        assert len(bank) == 0
        # and nothing is claimed any more, for which this call would wait
        assert inference.fit(simulate, prior, observed, budget=7, bank=bank).failures == {}
