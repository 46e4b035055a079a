"""What a fit says of what it was given: of data cut off, losses, seeds and failures."""

import numpy as np
import numpyro.distributions as dist
import pytest
from bolfi_liquids.inference.surrogates.warnings import censored_warnings, unreached_warnings

from bolfi_liquids import inference

TIME = np.linspace(0.0, 8.0, 24)
DECAY = 5.0 * np.exp(-0.6 * TIME)
SEEN = DECAY + 0.02 * np.random.default_rng(4).normal(size=24)
LIMIT = 0.8


@pytest.mark.parametrize(
    ("observed", "value"),
    [
        (np.maximum(SEEN, LIMIT), "0.8"),
        (np.minimum(SEEN, LIMIT), "0.8"),
    ],
)
def test_data_cut_off_at_a_limit_are_told(observed, value):
    (said,) = censored_warnings(observed, DECAY)
    assert f" of 24 observed values are {value}, " in said
    both = np.stack([SEEN, observed], axis=1)  # of two channels
    assert censored_warnings(both, np.stack([DECAY, DECAY], axis=1)) == [said]


@pytest.mark.parametrize(
    ("observed", "simulated"),
    [
        (np.maximum(SEEN, LIMIT), np.maximum(DECAY, LIMIT)),  # the simulator cuts off, too
        (np.where(SEEN < LIMIT, np.nan, SEEN), DECAY),
        (np.round(SEEN, 1), DECAY + 0.04),
        (np.random.default_rng(0).poisson(DECAY).astype(float), DECAY),
        (np.array(3.0), np.array(3.1)),
    ],
)
def test_data_that_repeat_for_another_reason_are_not(observed, simulated):
    assert censored_warnings(observed, simulated) == []


@pytest.mark.parametrize(("sign", "side"), [(1.0, "below"), (-1.0, "above")])
def test_losses_that_all_lie_beyond_what_was_observed_are_told(sign, side):
    losses = sign * (1.3 + np.linspace(0.0, 2.0, 30) ** 2)[:, None]
    (said,) = unreached_warnings(np.zeros(1), losses, 0.0)
    assert f"{side} all 30 simulated ones, 1.3 from the nearest" in said
    assert unreached_warnings(np.zeros(1), losses, 0.5) == []  # noise reaches as far
    assert unreached_warnings(np.zeros(2), np.column_stack([losses, losses]), 0.0) == []
    runs = np.linspace(0.0, 10.0, 40)[:, None]
    for seen in (-0.2, 0.5, 10.0):  # within what was simulated, or near it
        assert unreached_warnings(np.array([sign * seen]), sign * runs, 0.0) == []


PRIOR = inference.Prior({"level": dist.Uniform(1.0, 3.0)})
RUNS = PRIOR.from_unit((np.arange(30)[:, None] + 0.5) / 30)


def fitted(observed, signals, **options):
    engine = inference.Bolfi(PRIOR, observed, **options)
    engine.tell(RUNS, signals)
    return engine.fit(warn=False).warnings


def test_a_fit_says_so_where_the_output_itself_is_compared():
    losses = 1.3 + (RUNS["level"][:, None] - 2.0) ** 2
    assert any("losses" in said for said in fitted([0.0], losses))
    assert not any("losses" in said for said in fitted([1.5], losses, noise=0.1))
    found = fitted([0.0], losses, discrepancy=lambda observed, simulated: float(simulated[0]))
    assert not any("simulated ones" in said for said in found)
    decays = RUNS["level"][:, None] * DECAY
    limited, half = np.maximum(2.0 * SEEN, LIMIT), np.minimum(decays, 1e3)
    assert any("cut off" in said for said in fitted(limited, decays, noise=0.02))
    cut = {"summary": lambda signal: np.maximum(signal, LIMIT), "noise": 0.02}
    assert not any("cut off" in said for said in fitted(limited, half, **cut))


def test_unlike_signals_of_one_seed_are_runs_of_their_own(prior, observed, simulate):
    engine = inference.Bolfi(prior, observed)
    theta = engine.ask(8)
    same = np.zeros(8, int)
    for noise in (range(8), range(8, 16), range(8)):
        engine.tell(theta, simulate(theta, noise), same)
    assert (engine.told, engine.succeeded) == (24, 16)  # the last are copies
    fit = engine.fit(warn=False)
    np.testing.assert_array_equal(fit.training_mask, np.arange(24) < 16)
    (said,) = [said for said in fit.warnings if "seed" in said]
    assert said.startswith("8 of 24 simulations have theta and seed of an earlier one")


def quiet_log(signal):
    with np.errstate(divide="ignore"):
        return np.log(signal)


def test_a_summary_of_zeros_is_named_with_its_value(prior, observed, simulate):
    """Of the simulations: failed runs, whose cause the fit names; of the data: refused."""

    def dry(theta, seeds):
        signal = 2.0 + simulate(theta, seeds)
        return np.where((np.arange(30) < 3) & (theta["slope"][:, None] > -0.4), 0.0, signal)

    fit = inference.fit(dry, prior, 2.0 + observed, budget=14, summary=quiet_log, warn=False)
    failed = fit.history.errors[~fit.history.succeeded]
    assert len(failed) > 7
    assert all(why.startswith("not finite: summary returns -inf in 3 of 30 ") for why in failed)
    (said,) = [said for said in fit.warnings if "simulations failed" in said]
    assert said.endswith(failed[-1])
    with pytest.raises(ValueError, match="^summary must .* -inf in 3 of 30 "):
        inference.Bolfi(prior, np.where(np.arange(30) < 3, 0.0, observed), summary=quiet_log)
    inference.Bolfi(prior, np.where(np.arange(30) < 3, np.nan, observed), summary=quiet_log)


@pytest.mark.parametrize(
    ("observed", "summary", "told"),
    [
        (np.where(TIME > 7.0, np.nan, SEEN), lambda y: [y.mean()], "^the summary of observed must"),
        (SEEN, lambda y: y[:, 1:], r"^the summary failed on .*IndexError.* not with a batch"),
    ],
)
def test_a_summary_of_the_data_that_is_lost_or_fails_is_refused(prior, observed, summary, told):
    with pytest.raises(ValueError, match=told):
        inference.Bolfi(prior, observed, summary=summary)


def test_data_that_are_their_summary_already_are_told(prior, observed, simulate):
    def ends(signal):
        return signal[[0, -1]]

    options = {"summary": ends, "noise": 0, "budget": 10, "confirm": 0, "warn": False}
    told = [
        [
            said
            for said in inference.fit(simulate, prior, data, **options).warnings
            if "(30,)" in said
        ]
        for data in (observed, ends(observed))
    ]
    assert not told[0] and "observed has the shape (2,)" in told[1][0]
    shorter = inference.fit(simulate, prior, observed[:20], **options)
    assert not any("(20,)" in said for said in shorter.warnings)


def test_what_of_a_summary_is_missing_is_printed(prior, observed, simulate):
    def thirds(signal):
        return signal.reshape(3, 10).mean(1)

    gap = np.where(np.arange(30) < 3, np.nan, observed)
    how = {"summary": thirds, "noise": 0.05, "budget": 10, "confirm": 0, "warn": False}
    fit = inference.fit(simulate, prior, gap, **how)
    assert "1 values of the summary of observed missing" in repr(fit)


@pytest.mark.parametrize("unit", [1e-6, 1e6])
@pytest.mark.parametrize("noise", [0.0, 0.2])
@pytest.mark.parametrize(("slope", "status"), [(2.0, "not fitted"), (0.0, "fitted")])
def test_a_constant_is_judged_by_what_it_misses(prior, unit, noise, slope, status):
    constant = unit * (slope * np.linspace(0.0, 1.0, 30) - 3.0)
    data = unit * (noise * np.random.default_rng(0).normal(size=30) - 3.0)
    options = {"noise": noise * unit, "budget": 8, "warn": False}
    fit = inference.fit(lambda _, seeds: np.tile(constant, (len(seeds), 1)), prior, data, **options)
    assert fit.status == status
    assert fit.warnings[0].startswith("all simulations are equal")
