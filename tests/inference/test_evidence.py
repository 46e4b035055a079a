"""Log evidences against closed forms, and whether their errors cover."""

import functools

import numpy as np
import numpyro.distributions as dist
import pytest
from scipy.special import logsumexp
from scipy.stats import multivariate_normal, norm

from bolfi_liquids import inference

pytestmark = pytest.mark.slow

TIME = np.linspace(-1.0, 1.0, 24)
SD = {"polynomial": 0.3, "decay": 0.1}
REPETITIONS = 5
TASKS = ["1", "2", "3", "5", "decay"]


def polynomial(d, seed):
    """Simulator, prior, data and log evidence of d normal coefficients and normal noise."""
    design, names = np.stack([TIME**i for i in range(d)], 1), "abcde"[:d]
    prior = inference.Prior({name: dist.Normal(0.0, 1.0) for name in names})
    rng, sd = np.random.default_rng(seed), SD["polynomial"]
    data = design @ rng.normal(size=d) + sd * rng.normal(size=TIME.size)
    covariance = sd**2 * np.eye(TIME.size) + design @ design.T
    exact = multivariate_normal.logpdf(data, np.zeros(TIME.size), covariance)
    return lambda theta, _: np.stack([theta[n] for n in names], -1) @ design.T, prior, data, exact


def decay(theta, seeds):
    return theta["amplitude"][:, None] * np.exp(-theta["rate"][:, None] * (TIME + 1.0) / 2.0)


def decay_task(seed):
    """The same of a curve that is not linear, its evidence by quadrature."""
    prior = inference.Prior(
        {"amplitude": dist.LogUniform(0.5, 2.0), "rate": dist.LogUniform(0.2, 10.0)}
    )
    rng, sd, cells = np.random.default_rng(seed), SD["decay"], 300
    data = decay(prior.from_unit(rng.random((1, 2))), None)[0] + sd * rng.normal(size=TIME.size)
    axis = (np.arange(cells) + 0.5) / cells
    u = np.stack(np.meshgrid(axis, axis), -1).reshape(-1, 2)
    densities = norm.logpdf(data, decay(prior.from_unit(u), None), sd).sum(1)
    return decay, prior, data, logsumexp(densities) - 2.0 * np.log(cells)


@functools.cache
def found(task):
    """Errors, and what they are said to be, of all repetitions."""
    rows = []
    for seed in range(REPETITIONS):
        made = decay_task(seed) if task == "decay" else polynomial(int(task), seed)
        simulate, prior, data, exact = made
        options = {"noise": SD.get(task, SD["polynomial"]), "confirm": 0}
        fit = inference.fit(
            simulate, prior, data, budget=40, seed=seed, progress=False, warn=False, **options
        )
        rows.append((fit.evidence.log - exact, fit.evidence.error))
    return np.array(rows).T


@pytest.mark.parametrize("task", TASKS)
def test_log_evidence_is_near_the_exact_one(task):
    errors, said = found(task)
    assert np.abs(errors).max() < 0.15
    assert said.max() < (0.5 if task == "decay" else 0.03)  # an error bar that says something


def test_errors_cover_in_nine_of_ten_cases():
    covered = np.concatenate([np.abs(e) < norm.isf(0.05) * said for e, said in map(found, TASKS)])
    assert covered.mean() >= 0.9


def test_the_evidence_is_that_of_the_stated_noise_also_where_a_misfit_explains_the_data():
    simulate, prior, data, _ = polynomial(2, 0)
    sd = SD["polynomial"] / 4.0
    how = {"noise": sd, "budget": 40, "confirm": 0, "progress": False, "warn": False}
    fit = inference.fit(simulate, prior, data, **how)
    assert fit.learned.misfit_probability > 0.95
    design = np.stack([np.ones_like(TIME), TIME], 1)
    covariance = sd**2 * np.eye(TIME.size) + design @ design.T
    exact = multivariate_normal.logpdf(data, np.zeros(TIME.size), covariance)
    assert fit.evidence.log == pytest.approx(exact, abs=0.15)


def test_equal_outputs_have_no_evidence():
    prior = inference.Prior({"a": dist.Normal(0.0, 1.0)})
    fit = inference.fit(
        lambda theta, _: np.ones((len(theta["a"]), TIME.size)),
        *(prior, np.ones(TIME.size)),
        **{"noise": 0.1, "budget": 10, "confirm": 0, "progress": False, "warn": False},
    )
    assert np.isnan(fit.evidence.log)


def test_an_emulator_of_few_runs_says_that_it_knows_less():
    simulate, prior, data, _ = decay_task(0)
    few, many = (
        inference.fit(
            simulate, prior, data, budget=n, noise=0.1, confirm=0, progress=False, warn=False
        ).evidence.error
        for n in (8, 40)
    )
    assert few > 2.0 * many


@pytest.mark.parametrize("law", ["poisson", lambda mean: 0.1 + 0.2 * np.abs(mean)])
def test_noise_by_the_mean_has_the_density_of_its_law(law):
    """Of one level, seen ten times: its evidence by quadrature."""
    prior = inference.Prior({"level": dist.Uniform(5.0, 50.0)})
    data = np.random.default_rng(2).poisson(20.0, 10).astype(float)
    levels = np.linspace(5.0, 50.0, 4001)[:, None]
    if law == "poisson":
        from scipy.stats import poisson

        densities = poisson.logpmf(data, levels).sum(1)
    else:
        densities = norm.logpdf(data, levels, law(levels)).sum(1)
    exact = np.log(np.mean(np.exp(densities - densities.max()))) + densities.max()
    fit = inference.fit(
        lambda theta, _: np.repeat(theta["level"][:, None], 10, 1),
        prior,
        data,
        **{"budget": 20, "confirm": 0, "noise": law},
        progress=False,
        warn=False,
    )
    assert fit.evidence.log == pytest.approx(exact, abs=0.15)
