"""Simulations that fail: what a loop makes of them."""

import re
from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest

from bolfi_liquids import inference


def test_what_raised_is_tried_again_by_the_next_call(tmp_path, prior, observed, simulate):
    broken = [True]

    def licensed(theta, seeds):
        if broken[0]:
            raise OSError("no licence")
        return simulate(theta, seeds)

    with inference.SimulationBank(tmp_path / "b.sqlite") as bank:
        with pytest.raises(RuntimeError, match="no licence"):
            inference.fit(licensed, prior, observed, budget=9, bank=bank, identity="line")
        broken[0] = False
        mended = inference.fit(licensed, prior, observed, budget=9, bank=bank, identity="line")
    plain = inference.fit(simulate, prior, observed, budget=9)
    np.testing.assert_array_equal(mended.history.signals, plain.history.signals)


def test_total_failure_is_an_error_with_its_cause(prior, observed):
    def broken(theta, seeds):
        raise OSError("no licence")

    with pytest.raises(RuntimeError, match="all 12 simulations .* OSError: no licence"):
        inference.fit(broken, prior, observed)


def test_too_few_successes_are_an_error_that_loses_nothing(tmp_path, prior, observed, simulate):
    calls, successes = [], 2

    def fragile(theta, seeds):
        calls.extend(seeds)
        if len(calls) > successes:
            raise OSError("no licence")
        return simulate(theta, seeds)

    path = tmp_path / "b.sqlite"
    with pytest.raises(RuntimeError, match=f"^{successes} of 7 .*no licence") as caught:
        inference.fit(fragile, prior, observed, budget=7, batch=1, bank=path, identity="line")
    assert str(path) in str(caught.value)
    with inference.SimulationBank(path) as bank:
        assert len(bank.simulations("line").seeds) == successes
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


def test_a_single_run_s_signal_of_wrong_shape_is_told_as_the_user_made_it(prior, observed):
    with pytest.raises(
        ValueError, match="^with vectorised=False simulate .* " + re.escape("(30,), got (1, 30)")
    ):
        inference.fit(lambda theta, seed: np.zeros((1, 30)), prior, observed, vectorised=False)


@pytest.mark.parametrize("shape", [(4, 29), (3, 30), (30,)])
def test_signals_of_wrong_shape_are_refused_and_not_stored(prior, observed, simulate, shape):
    message = re.escape(f"shape (4, 30), one row per theta, got {shape}")
    with inference.SimulationBank() as bank:
        kept = {"bank": bank, "identity": "line"}
        with pytest.raises(ValueError, match=message) as refused:
            inference.fit(lambda theta, seeds: np.zeros(shape), prior, observed, **kept)
        assert ("vectorised=False" in str(refused.value)) == (shape == (30,))
        assert len(bank) == 0
        # and nothing is claimed any more, for which this call would wait
        assert inference.fit(simulate, prior, observed, budget=7, **kept).failures == {}


@pytest.mark.slow
def test_a_fit_of_fewer_runs_than_the_surrogate_needs_warns(prior, observed, simulate):
    """Two parameters need 2 d + 2 = 6: level, slopes, curvatures, and one that could contradict."""
    engine = inference.Bolfi(prior, observed)
    theta = engine.ask(9)
    signals = simulate(theta, range(9))
    for failed, warned in ((4, True), (3, False)):
        signals = simulate(theta, range(9))
        signals[:failed] = np.nan
        engine = inference.Bolfi(prior, observed)
        engine.tell(theta, signals)
        fit = engine.fit(warn=False)
        assert any("learned from 5 simulations" in said for said in fit.warnings) is warned


def test_an_executor_that_was_shut_down_is_named(prior, observed, simulate):
    with ThreadPoolExecutor(1) as pool:
        pass
    with pytest.raises(RuntimeError, match="the executor is shut down .*shutdown"):
        inference.fit(simulate, prior, observed, budget=9, executor=pool)


def test_a_simulator_may_write_into_what_it_is_given(prior, observed, simulate):
    """Neither the next run nor what is kept of this one changes."""

    def greedy(theta, seeds):
        signals = simulate(theta, seeds)
        for column in (*theta.values(), seeds):
            column[:] = 0
        return signals

    def alone(theta, seed):
        signal = simulate({name: np.array([value]) for name, value in theta.items()}, [seed])[0]
        theta.clear()
        return signal

    plain = inference.fit(simulate, prior, observed, budget=9)
    for fit in (
        inference.fit(greedy, prior, observed, budget=9),
        inference.fit(alone, prior, observed, budget=9, vectorised=False),
    ):
        np.testing.assert_array_equal(fit.history.theta, plain.history.theta)
        np.testing.assert_array_equal(fit.history.seeds, plain.history.seeds)
        np.testing.assert_array_equal(fit.history.signals, plain.history.signals)

    def draws(observed, seed):
        return {name: np.random.default_rng(seed).random(15) for name in prior.names}

    options = {"draws": 7, "independent": True, "progress": False}
    made = inference.replicates(draws, greedy, prior, 4, **options)
    np.testing.assert_array_equal(
        made.truth, inference.replicates(draws, simulate, prior, 4, **options).truth
    )


def test_what_an_acquisition_returns_is_checked(prior, observed, simulate):
    returned = [np.full((1, 3), 0.5), np.full((1, 2), np.nan), np.full((1, 2), 1.5), None]
    engine = inference.Bolfi(
        prior, observed, initial=4, acquisition=lambda key, surrogate, n: returned[-1]
    )
    theta = engine.ask(4)
    engine.tell(theta, simulate(theta, range(4)))
    while returned:
        with pytest.raises(ValueError, match="acquisition"):
            engine.ask(2)
        returned.pop()


@pytest.mark.slow
@pytest.mark.parametrize("scale", [1e-300, 1e150, 1e160])
@pytest.mark.parametrize("surrogate", ["signal", "discrepancy"])
def test_outputs_of_any_size_are_learned_from_or_told(prior, observed, simulate, surrogate, scale):
    """Also where the user has made NumPy raise."""
    engine = inference.Bolfi(prior, scale * observed, surrogate=surrogate)
    theta = engine.ask(10)
    with np.errstate(all="raise"):
        engine.tell(theta, scale * simulate(theta, range(10)))
        assert engine.told == 10
        if engine.succeeded < 3:
            with pytest.raises(ValueError, match="not finite"):
                engine.fit()
        else:
            fit = engine.fit(warn=False)
            assert np.isfinite(fit.log_prob({"slope": 0.3, "offset": 0.6}))


@pytest.mark.parametrize(
    ("simulate", "vectorised", "told"),
    [
        (lambda theta, seeds: float(theta["slope"]) * np.ones(30), True, "vectorised=False"),
        (lambda theta, seed: theta["slope"][:, None] * np.ones(30), False, "theta, name -> float"),
    ],
)
def test_a_simulator_that_misreads_its_call_is_told_the_call(
    prior, observed, simulate, vectorised, told
):
    with pytest.raises(RuntimeError, match=f"TypeError.* simulate is called with .*{told}"):
        inference.fit(simulate, prior, observed, vectorised=vectorised)


@pytest.mark.parametrize("vectorised", [True, False])
def test_a_simulator_of_theta_alone_is_refused_before_a_run(prior, observed, vectorised):
    with pytest.raises(ValueError, match=r"^simulate must be called with \(theta, seed"):
        inference.fit(lambda theta: 1 / 0, prior, observed, vectorised=vectorised)


def test_a_discrepancy_of_missing_samples_is_told_their_number(prior, observed, simulate):
    gappy = np.where(np.arange(30) < 2, np.nan, observed)
    with pytest.raises(RuntimeError, match="observed holds 2 NaN"):
        inference.fit(simulate, prior, gappy, discrepancy=lambda a, b: np.sum((a - b) ** 2))
