"""Shapes of signals where the user's own discrepancy or summary compares them."""

from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest
from bolfi_liquids.inference.simulations.job import BATCH, simulation_seed

from bolfi_liquids import inference

BUDGET = 9
SMALL = {"budget": BUDGET, "batch": 3, "confirm": 0, "vectorised": False}


def spoilt(simulate, indices, how=lambda signal: signal[:29]):
    """A simulator of single runs; those of these indices return something else."""
    wrong = {simulation_seed(0, index) for index in indices}

    def one(theta, seed):
        signal = simulate({name: np.array([value]) for name, value in theta.items()}, [seed])[0]
        return how(signal) if seed in wrong else signal

    return one


def of_means(observed, simulated):
    """Of any two shapes."""
    return float((observed.mean() - simulated.mean()) ** 2)


def of_samples(observed, simulated):
    return float(np.sum((observed - simulated) ** 2))


@pytest.mark.parametrize(("first", "in_rounds"), [(0, True), (5, False)])
def test_a_signal_of_another_shape_condemns_no_other(prior, observed, simulate, first, in_rounds):
    """Whichever is told first: the discrepancy takes all, and all are learned from."""
    fit = inference.fit(
        spoilt(simulate, [first]),
        prior,
        observed,
        **SMALL,
        warn=False,
        in_rounds=in_rounds,
        discrepancy=of_means,
    )
    assert fit.failures == {} and fit.training_mask.all()
    assert fit.history.signal(first).shape == (29,) and fit.history.signals.shape == (BUDGET, 30)
    others = np.arange(BUDGET) != first
    assert np.isfinite(fit.history.signals[others]).all()
    assert np.isnan(fit.history.signals[first]).all()
    for row in range(BUDGET):
        due = of_means(observed, fit.history.signal(row))
        assert fit.history.discrepancy[row] == due


@pytest.mark.parametrize(
    ("how", "executor", "in_rounds"),
    [
        (lambda signal: signal[:29], False, True),
        # what is returned is then no number
        (lambda signal: signal[:, None] + np.zeros(30), True, True),
        (lambda signal: np.zeros((3, 0)), True, False),
    ],
)
def test_a_run_on_which_the_discrepancy_fails_costs_itself_and_is_named(
    prior, observed, simulate, how, executor, in_rounds
):
    """Also the first run, which all others were compared with before."""
    with ThreadPoolExecutor(2) as pool:
        fit = inference.fit(
            spoilt(simulate, [0], how),
            prior,
            observed,
            **SMALL,
            warn=False,
            in_rounds=in_rounds,
            executor=pool if executor else None,
            discrepancy=lambda a, b: (
                np.sum((a[..., None] - b.T) ** 2, -1)[()] if b.ndim > 1 else of_samples(a, b)
            ),
        )
    assert fit.failures == {"incomparable": 1}
    assert np.flatnonzero(fit.simulations["failed"]).tolist() == [0]
    told = str(fit.simulations["error"][0].item())
    assert str(how(observed).shape) in told and str(simulation_seed(0, 0)) in told
    assert str(float(fit.simulations["slope"][0])) in told


def test_a_discrepancy_that_fails_on_all_of_the_first_runs_ends_the_fit(prior, observed, simulate):
    """It would fail on all others, and each costs a simulation."""
    made, batch = [], 3

    def counted(theta, seed):
        made.append(seed)
        return spoilt(simulate, range(BUDGET))(theta, seed)

    options = {"budget": BUDGET, "batch": batch, "vectorised": False}
    with pytest.raises(ValueError, match=r"discrepancy failed on a signal of shape \(29,\)"):
        inference.fit(counted, prior, observed, discrepancy=of_samples, **options)
    assert len(made) < BATCH + batch
    with pytest.raises(ValueError, match=r"summary failed on a signal of shape \(29,\)"):
        inference.fit(
            spoilt(simulate, range(BUDGET)),
            prior,
            observed,
            summary=lambda signal: signal @ np.ones(30),
            **options,
        )


@pytest.mark.slow
def test_a_summary_may_take_any_shape_and_fail_on_one_run(prior, observed, simulate):
    def summary(signal):
        if len(signal) == 3:
            raise ArithmeticError("too short")
        return np.array([signal.mean(), signal[-1] - signal[0]])

    def uneven(theta, seed):
        cut = {simulation_seed(0, 0): 3, simulation_seed(0, 1): 25}.get(seed, 30)
        return spoilt(simulate, [])(theta, seed)[:cut]

    options = {"budget": BUDGET, "batch": 1, "vectorised": False, "warn": False}
    fit = inference.fit(uneven, prior, observed, summary=summary, **options)
    assert fit.failures == {"incomparable": 1}
    assert not fit.history.succeeded[0] and fit.history.signal(1).shape == (25,)
    assert "too short" in str(fit.simulations["error"][0].item())


@pytest.mark.slow
@pytest.mark.parametrize("order", [1, -1])
def test_what_is_learned_does_not_depend_on_the_order_of_shapes(prior, observed, simulate, order):
    engine = inference.Bolfi(prior, observed, discrepancy=of_means)
    theta = engine.ask(BUDGET)
    signals = [row[: 20 + i] for i, row in enumerate(simulate(theta, range(BUDGET)))][::order]
    engine.tell({name: column[::order] for name, column in theta.items()}, signals)
    assert engine.succeeded == BUDGET and engine.history.failures == {}
    objects = np.empty(BUDGET, object)
    objects[:] = signals
    other = inference.Bolfi(prior, observed, discrepancy=of_means)
    for i in range(BUDGET):  # one by one, and as an array of arrays
        row = {name: column[::order][i : i + 1] for name, column in theta.items()}
        other.tell(row, objects[i : i + 1])
    made = engine.fit(warn=False)
    assert made.best == other.fit(warn=False).best
    for i in range(BUDGET):
        np.testing.assert_array_equal(made.history.signal(i), signals[i])


@pytest.mark.slow
def test_a_user_s_function_may_write_into_what_it_is_given(prior, observed, simulate):
    def greedy(observed, simulated):
        simulated -= observed
        observed *= 0.0
        return float(np.sum(simulated**2))

    def centred(signal):
        signal -= signal.mean()
        return signal[:2]

    for options in ({"discrepancy": greedy}, {"summary": centred}):
        fit = inference.fit(simulate, prior, observed, budget=BUDGET, warn=False, **options)
        theta = prior.to_dict(fit.history.theta)
        np.testing.assert_array_equal(fit.observed, observed)
        np.testing.assert_array_equal(fit.history.signals, simulate(theta, fit.history.seeds))
