"""The probability of success against a known border."""

import numpy as np
import numpyro.distributions as dist
from bolfi_liquids.inference.sobol import sobol
from bolfi_liquids.inference.surrogates.base import RunOutcomes
from bolfi_liquids.inference.surrogates.processes import learn_success, log_success

from bolfi_liquids import inference


def test_a_border_is_found():
    u = sobol(0, 0, 40, 2)
    border = learn_success(RunOutcomes(u, u.sum(1) < 1.0), None)
    points = sobol(1, 0, 512, 2)
    clear = np.abs(points.sum(1) - 1.0) > 0.15
    probable = np.exp(log_success(border, points[clear]))
    assert np.mean((probable > 0.5) == (points[clear].sum(1) < 1.0)) > 0.97
    assert probable[points[clear].sum(1) > 1.3].max() < 0.1


def test_failures_by_chance_leave_every_place_possible():
    u = sobol(0, 0, 60, 2)
    chance = learn_success(RunOutcomes(u, np.random.default_rng(0).random(60) < 0.8), None)
    probable = np.exp(log_success(chance, sobol(1, 0, 512, 2)))
    assert abs(probable.mean() - 0.8) < 0.1 and probable.min() > 0.3


def test_no_mass_lies_where_runs_fail():
    """Data near a + b = 1, beyond which every run raises: with both surrogates."""

    def simulate(theta, seed):
        if theta["a"] + theta["b"] > 1.0:
            raise RuntimeError("no solution")
        return np.array([theta["a"], theta["b"]])

    prior = inference.Prior({name: dist.Uniform(0, 1) for name in "ab"})
    observed = np.array([0.47, 0.5])
    for options in ({"noise": 0.1}, {"surrogate": "discrepancy"}):
        how = {"budget": 24, "confirm": 0, "vectorised": False, "progress": False, "warn": False}
        fit = inference.fit(simulate, prior, observed, **how, **options)
        drawn = fit.sample("quadrature", warn=False)["posterior"]
        # 0.18 of the mass would lie there if runs did not fail
        assert (drawn["a"] + drawn["b"] > 1.1).mean() < 0.05
