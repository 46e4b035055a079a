"""A vector learned from runs that were made before."""

import numpy as np
import numpyro.distributions as dist
import pytest

from bolfi_liquids import inference

PRIOR = inference.Prior({"a": dist.Uniform(0.0, 2.0), "b": dist.LogUniform(0.1, 10.0)})
PLACES = np.linspace(0.0, 1.0, 30)


def theta_of(n, seed=0):
    return PRIOR.from_unit(np.random.default_rng(seed).random((n, 2)))


def curve(theta):
    """[n, 30], smooth in both parameters."""
    slope, shift = theta["a"][:, None], np.log(theta["b"])[:, None]
    return slope * PLACES + 0.3 * np.sin(shift + PLACES)


THETA, FRESH = theta_of(50), theta_of(40, 1)
ONE = np.ones(len(PLACES))


def test_new_runs_are_predicted():
    learned = inference.emulate(PRIOR, THETA, curve(THETA), ONE)
    np.testing.assert_allclose(learned.predict(FRESH), curve(FRESH), atol=0.02)


def test_what_is_missed_of_runs_left_out_is_what_is_missed_of_new_ones():
    rng, noise = np.random.default_rng(3), 0.05
    shift = noise * rng.standard_normal((50, 1))
    learned = inference.emulate(PRIOR, THETA, curve(THETA) + shift, ONE)
    left_out = np.sqrt(np.mean(learned.missed**2))
    fresh = curve(FRESH) + noise * rng.standard_normal((40, 1)) - learned.predict(FRESH)
    # two RMS of 50 and 40 shifts differ by 0.15 of themselves (sd)
    assert left_out == pytest.approx(np.sqrt(np.mean(fresh**2)), rel=0.5)
    np.testing.assert_allclose(learned.left_out + learned.missed, curve(THETA) + shift)


def test_a_run_does_not_foretell_itself():
    outputs = curve(THETA)
    outputs[9] += 0.5
    learned = inference.emulate(PRIOR, THETA, outputs, ONE)
    assert abs(learned.missed[9].mean()) > 0.4


def test_a_run_that_is_not_finite_is_left_out():
    outputs = curve(THETA)
    outputs[9, 3] = np.nan
    learned = inference.emulate(PRIOR, THETA, outputs, ONE)
    np.testing.assert_allclose(learned.predict(FRESH), curve(FRESH), atol=0.02)
    others = np.arange(50) != 9  # each of which keeps its row
    np.testing.assert_allclose(learned.left_out[others], curve(THETA)[others], atol=0.1)
    assert np.isnan(learned.left_out[9]).all() and np.isnan(learned.missed[9]).all()


@pytest.mark.parametrize("wrong", [0.0, -1.0, np.inf, np.nan])
def test_a_scale_that_is_none_is_refused(wrong):
    with pytest.raises(ValueError, match="scale must hold 30 positive and finite numbers"):
        inference.emulate(PRIOR, THETA, curve(THETA), np.append(ONE[1:], wrong))
