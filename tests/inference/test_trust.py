"""Fits that cannot be trusted say so; the same without the cause do not."""

import numpy as np
import numpyro.distributions as dist
import pytest
from bolfi_liquids.inference.surrogates.warnings import (
    DOUBTED,
    FEW_NUMBERS,
    GENEROUS,
    GUESSED,
    LOW_THRESHOLD,
    MISFIT,
    OUTSIDE,
    TOO_SMOOTH,
    UNCONFIRMED,
    UNEVEN,
    distance_warnings,
)

from bolfi_liquids import inference

TIME = np.linspace(0.0, 5.0, 30)
DATA = 3.0 * np.exp(-0.8 * TIME) + 0.1 * np.random.default_rng(0).normal(size=30)
PRIOR = inference.Prior({"height": dist.Uniform(1, 6), "rate": dist.Uniform(0.1, 3)})


def decay(theta, seeds):
    return theta["height"][:, None] * np.exp(-theta["rate"][:, None] * TIME)


def warnings_of(simulate, observed, prior=PRIOR, budget=20, **options):
    fit = inference.fit(
        simulate, prior, observed, budget=budget, progress=False, warn=False, **options
    )
    return fit.warnings


@pytest.mark.parametrize(("noise", "said"), [(0.1, False), (0.01, True)])
def test_noise_that_is_too_small_is_said(noise, said):
    assert (MISFIT in warnings_of(decay, DATA, noise=noise)) == said


@pytest.mark.parametrize(("numbers", "said"), [(3, True), (30, False)])
def test_too_few_numbers_to_tell_the_noise(numbers, said):
    def first(theta, seeds):
        return decay(theta, seeds)[:, :numbers]

    assert (FEW_NUMBERS in warnings_of(first, DATA[:numbers])) == said
    assert FEW_NUMBERS not in warnings_of(first, DATA[:numbers], noise=0.1)


def test_a_threshold_below_all_runs():
    def tall(theta, seeds):
        return decay({"height": np.full(len(seeds), 3.0), **theta}, seeds)

    rate = inference.Prior({"rate": dist.Uniform(0.05, 3)})
    for threshold, said in ((1e-9, True), (None, False)):
        found = warnings_of(tall, DATA, rate, surrogate="discrepancy", threshold=threshold)
        assert (LOW_THRESHOLD in found) == said


def circle(a):
    return np.stack([np.sin(6.0 * a), np.cos(6.0 * a)], -1)


@pytest.mark.parametrize(("end", "said"), [(0.3, True), (1.0, False)])
def test_a_posterior_where_nothing_was_simulated(end, said):
    """Data of beyond the prior's first third, and runs of that alone, or of all."""
    prior = inference.Prior({"a": dist.Uniform(0, 1)})
    a = np.linspace(0.0, end, round(20 * end))
    data = circle(np.array(0.4)) + [0.02, -0.03]
    options = {"noise": 0.05, "earlier": ({"a": a}, circle(a)), "progress": False, "warn": False}
    fit = inference.fit(None, prior, data, budget=0, **options)
    assert (fit.doubt > 1.5) == (DOUBTED in fit.warnings) == said
    assert fit.status == "not confirmed"  # nothing was run at draws of the posterior


def narrow(theta, seeds):
    """A line but for a bump, of which a few runs show nothing."""
    a = theta["a"][:, None]
    return np.concatenate([a, 3.0 * np.exp(-0.5 * ((a - 0.62) / 0.06) ** 2)], 1)


@pytest.mark.slow
@pytest.mark.parametrize(("family", "budget"), [("signal", 20), ("discrepancy", 40)])
def test_a_fault_in_a_quarter_of_the_posterior_is_found(family, budget):
    """There the output is that of a rate two sds off. Of 12 draws none may lie there, once in 30
    times; without a fault the posterior moves too far once in 20."""
    prior = inference.Prior({"height": dist.Uniform(1, 6), "rate": dist.Uniform(0.2, 3)})
    options = {"noise": 0.2} if family == "signal" else {"surrogate": family}
    truth, found = {"height": np.array([3.0]), "rate": np.array([0.8])}, {0.0: 0, 2.0: 0}
    for seed in range(6):
        noise = 0.2 * np.random.default_rng(seed).normal(size=len(TIME))
        data = decay(truth, [0])[0] + noise
        quiet = {"progress": False, "warn": False, "confirm": 0}
        made = inference.fit(
            decay, prior, data, seed=seed, budget=budget, **options, **quiet
        ).history
        for shift in found:
            engine = inference.Bolfi(prior, data, seed=seed, **options)
            engine.tell(prior.to_dict(made.theta), made.signals)
            before = engine.fit(warn=False)
            rate = before.sample(warn=False)["posterior"]["rate"].to_numpy()
            drawn = engine.confirm(before, 12)
            there = drawn["rate"] > np.quantile(rate, 0.75)
            faulty = drawn | {"rate": drawn["rate"] + shift * rate.std() * there}
            engine.tell(drawn, decay(faulty, [0]))
            found[shift] += not engine.fit(warn=False).confirmed
    assert found[0.0] <= 1 and found[2.0] >= 5


def test_runs_at_draws_of_the_posterior_confirm_it_or_move_it():
    prior = inference.Prior({"a": dist.Uniform(0, 1)})
    options = {"noise": 0.1, "progress": False, "warn": False}
    plain = inference.fit(lambda theta, seeds: circle(theta["a"]), prior, circle(0.4), **options)
    assert plain.confirmed and plain.status == "fitted" and len(plain.history.theta) == 23
    engine = inference.Bolfi(prior, circle(0.4), noise=0.1)
    a = np.linspace(0.0, 0.3, 6)
    engine.tell({"a": a}, circle(a))
    before = engine.fit(warn=False)
    assert before.confirmed is None
    drawn = engine.confirm(before, 4)
    assert len(np.unique(drawn["a"])) == 4
    with pytest.raises(ValueError, match="fit must be what"):
        engine.confirm(plain)
    engine.tell(drawn, circle(drawn["a"]))
    moved = engine.fit(warn=False)
    assert moved.confirmed is False and UNCONFIRMED in moved.warnings
    with pytest.raises(ValueError, match="fit must be what"):
        engine.confirm(before)


def test_a_budget_is_exceeded_by_two_rounds_or_by_half_at_most():
    """By as many runs at draws as it takes; none if that is asked for."""
    prior = inference.Prior({"a": dist.Uniform(0, 1)})
    data = narrow({"a": np.array([0.62])}, None)[0]
    options = {"noise": 0.02, "budget": 8, "progress": False, "warn": False}
    for confirm, most in ((0, 8), (2, 12), (3, 14)):
        made = inference.fit(narrow, prior, data, confirm=confirm, **options)
        assert 8 + confirm <= len(made.history.theta) <= most


PAPER = {"surrogate": "discrepancy"}


def test_a_sum_of_squares_gives_the_exact_posterior():
    """Against a grid: independent noise whose size nothing tells but the residual."""
    fit = inference.fit(decay, PRIOR, DATA, budget=30, progress=False, warn=False, **PAPER)
    drawn = fit.sample("quadrature", warn=False)["posterior"]
    axes = np.meshgrid(np.linspace(2.5, 3.5, 201), np.linspace(0.6, 1.1, 201), indexing="ij")
    height, rate = (axis.ravel() for axis in axes)
    misfit = np.sum((decay({"height": height, "rate": rate}, None) - DATA) ** 2, 1)
    weights = np.exp(-15.0 * np.log(misfit / misfit.min()))
    for name, grid in (("height", height), ("rate", rate)):
        mean = np.average(grid, weights=weights)
        sd = np.sqrt(np.average((grid - mean) ** 2, weights=weights))
        assert abs(float(drawn[name].mean()) - mean) < sd
        assert 0.5 < float(drawn[name].std()) / sd < 3.0


def test_data_far_outside_are_said_by_the_discrepancy_too():
    assert any("far outside" in said for said in warnings_of(decay, DATA + 50.0, **PAPER))
    assert not any("far outside" in said for said in warnings_of(decay, DATA, **PAPER))


def test_a_discrepancy_of_one_number_leaves_the_width_to_guess():
    def loss(theta, seeds):
        return np.sum((decay(theta, seeds) - DATA) ** 2, 1)[:, None]

    own = {"discrepancy": lambda observed, simulated: float(simulated[0])}
    assert GUESSED in warnings_of(loss, [0.0], **own)
    assert GUESSED not in warnings_of(loss, [0.0], **own, threshold=0.4)


def test_what_a_sum_of_squares_cannot_see_is_said():
    noise = np.random.default_rng(0).normal(size=(4, 40))
    run, even = np.linspace(0.0, 9.0, 40), np.ones(3)
    few, rough = 10.0 ** -np.linspace(0, 6, 40), np.array([0.05, 1.0, 2.0])
    for size, sizes, said in ((few, even, UNEVEN), (1.0, rough, TOO_SMOOTH), (1.0, even, None)):
        outputs = run * np.array([1.0, 1.5, 2.0])[:, None] + size * sizes[:, None] * noise[:3]
        found = distance_warnings(run + size * noise[3], outputs)
        assert [text for text in (UNEVEN, TOO_SMOOTH) if text in found] == ([said] if said else [])


def test_noise_that_repeated_runs_do_not_show_is_doubt():
    """A wave of many cycles, of which four components make a part: no run has any noise."""
    time = np.linspace(0.0, 20.0, 80)
    prior = inference.Prior({"w": dist.Uniform(0.5, 5.0)})
    observed = np.sin(2.3 * time) + 0.3 * np.random.default_rng(0).normal(size=80)

    def simulate(theta, seeds):
        return np.sin(theta["w"][:, None] * time)

    options = {"budget": 16, "noise": 0.3, "warn": False, "progress": False}
    fit = inference.fit(simulate, prior, observed, components=4, **options)
    latent = fit.learned.log_likelihood._replace(doubt=np.zeros(()))
    gap = [
        np.ptp(likelihood(prior.to_unit({"w": np.array([2.3, 3.0])})))
        for likelihood in (latent, fit.learned.sure)
    ]
    assert gap[1] > 2.0 * gap[0]
    assert fit.status == "not confirmed"


def test_noise_given_far_too_large_is_said():
    for noise, said in ((1.0, True), (0.1, False)):
        assert (GENEROUS in warnings_of(decay, DATA, noise=noise)) is said


def test_a_narrow_posterior_of_many_parameters_has_its_moments():
    """A linear model of six parameters and known noise, against the closed form."""
    rng = np.random.default_rng(0)
    design, sd = rng.normal(size=(30, 6)), 0.02
    prior = inference.Prior({f"t{i}": dist.Normal(0.0, 1.0) for i in range(6)})

    def simulate(theta, seeds):
        return np.stack(list(theta.values()), 1) @ design.T

    observed = design @ rng.normal(size=6) + sd * rng.normal(size=30)
    options = {"budget": 60, "noise": sd, "progress": False, "warn": False}
    fit = inference.fit(simulate, prior, observed, **options)
    covariance = np.linalg.inv(np.eye(6) + design.T @ design / sd**2)
    exact = covariance @ design.T @ observed / sd**2, np.sqrt(np.diag(covariance))
    mean, found = fit.population.moments
    assert (np.abs(mean - exact[0]) < 0.3 * exact[1]).all()
    assert (np.abs(np.log(found / exact[1])) < 0.3).all()
    assert fit.status == "fitted" and not fit.warnings


def test_nothing_is_confirmed_before_a_run_is_told():
    engine = inference.Bolfi(PRIOR, DATA, noise=0.1)
    theta = engine.ask(20)
    engine.tell(theta, decay(theta, None))
    engine.confirm(engine.fit(warn=False))
    assert engine.fit(warn=False).confirmed is None


@pytest.mark.parametrize("noise", [0.3, None])
def test_noise_larger_than_what_runs_differ_by_is_no_misfit(noise):
    time, prior = np.linspace(0.0, 5.0, 50), inference.Prior({"tau": dist.Uniform(0.8, 2.1)})

    def simulate(theta, seeds):
        return np.exp(-time / theta["tau"][:, None])

    data = np.exp(-time / 1.3) + np.random.default_rng(0).normal(0.0, 0.3, 50)
    for offset, status in ((0.0, "fitted"), (3.0, "not fitted")):
        fit = inference.fit(
            simulate, prior, data + offset, noise=noise, budget=20, progress=False, warn=False
        )
        assert fit.status == status
        assert (OUTSIDE in fit.warnings) is (offset > 0.0)
