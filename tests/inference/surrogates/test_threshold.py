"""The log-space likelihood, far beyond where Phi underflows."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from bolfi_liquids.inference.gp.namespaces import log_ndtr
from bolfi_liquids.inference.sobol import sobol
from bolfi_liquids.inference.surrogates.discrepancy import learn, with_threshold
from bolfi_liquids.inference.surrogates.threshold import (
    Matched,
    Predicted,
    Transform,
    log_both_below,
    matched,
)
from scipy.special import erfcx
from scipy.stats import norm

from bolfi_liquids import inference

U = sobol(0, 0, 12, 2)
DELTA = 1.0 + ((U - 0.4) ** 2).sum(-1)


def test_finite_and_monotone_with_finite_gradients_over_a_hundred_decades():
    fitted = with_threshold(learn(U, DELTA, "identity"), Predicted(0.2))
    with jax.enable_x64(True):
        u = jnp.array([0.8, 0.3])
        thresholds = -jnp.logspace(-50.0, 50.0, 201)
        values, gradients = jax.jit(
            jax.vmap(
                lambda eps: jax.value_and_grad(
                    lambda u: fitted.log_likelihood._replace(threshold=eps)(u[None])[0]
                )(u)
            )
        )(thresholds)
    values = np.asarray(values)
    assert np.isfinite(values).all()
    assert np.isfinite(gradients).all()
    assert (np.diff(values) <= 0).all()
    assert values[-1] < -1e90


def test_log_ndtr_by_jax_is_that_of_scipy_and_its_slope_the_mills_ratio():
    z = np.concatenate([-np.logspace(8.0, -3.0, 60), [0.0, 1.0, 8.0]])
    with jax.enable_x64(True):
        values, slopes = jax.jit(jax.vmap(jax.value_and_grad(log_ndtr)))(jnp.asarray(z))
    np.testing.assert_allclose(values, norm.logcdf(z), rtol=1e-9, atol=1e-15)
    expected = np.sqrt(2.0 / np.pi) / erfcx(-z / np.sqrt(2.0))
    np.testing.assert_allclose(slopes, expected, rtol=1e-8)


@pytest.mark.parametrize("r", [1e-6, 0.5, 0.999])
def test_the_chance_that_both_pass_is_right_in_the_tail_too(r):
    """Against a dense sum over what the two have in common, about the integrand's peak."""
    for z in (2.0, -1.0, -4.0, -8.0, -30.0):
        peak = 2.0 * np.sqrt(r) / (1.0 + r) * max(-z, 0.0)
        w = np.linspace(peak - 12.0, peak + 12.0, 400_001)
        logs = 2.0 * norm.logcdf((z + np.sqrt(r) * w) / np.sqrt(1.0 - r)) + norm.logpdf(w)
        expected = np.logaddexp.reduce(logs) + np.log(w[1] - w[0])
        found = log_both_below(np.array([z]), np.array([r]))[0]
        assert found == pytest.approx(expected, abs=0.01)


def test_threshold_rules():
    for rule, expected in {
        "min_observed": np.sqrt(DELTA.min()),
        inference.surrogates.Quantile(0.25): np.sqrt(np.quantile(DELTA, 0.25)),
        1.44: 1.2,
    }.items():
        found = with_threshold(learn(U, DELTA, "sqrt"), rule).threshold
        np.testing.assert_allclose(found, expected)


def test_a_threshold_that_the_transform_cannot_take_is_refused():
    with pytest.raises(ValueError, match="threshold .* must be positive"):
        with_threshold(learn(U, DELTA, "log"), -1.0)


@pytest.mark.parametrize(("name", "dimension"), [("identity", 1), ("sqrt", 2), ("log", 4)])
def test_a_matched_threshold_gives_the_width_of_independent_errors(name, dimension):
    """Draws along the radius of a quadratic discrepancy, weighted by Phi: d s^2 is expected."""
    numbers, least, transform = 30, 6.0, Transform(name, 0.0)
    mean, sd = float(transform(np.asarray(least))), 1e-3
    eps, width = matched(Matched(numbers), mean, sd, transform, dimension)
    r = np.linspace(0.0, 20.0, 200_001)[1:]
    weights = r ** (dimension - 1) * norm.cdf((eps - transform(least + r**2)) / np.hypot(sd, width))
    expected = dimension * least / (numbers - dimension)
    assert weights @ r**2 / weights.sum() == pytest.approx(expected, rel=0.02)
    assert width > sd


def test_noise_that_is_too_large_for_it_is_known():
    eps, width = matched(Matched(1000), 6.0, 3.0, Transform("identity", 0.0), 1)
    assert width == 0.0 and eps == pytest.approx(6.0 + 3.0 * norm.ppf(0.02))


def test_doubt_is_no_agreement_to_a_cautious_surrogate_and_what_is_learned_stays():
    at = U[U[:, 0] < 0.6]
    fitted = with_threshold(learn(at, 1.0 + 9.0 * ((at - 0.3) ** 2).sum(-1), "identity"), 1.2)
    near, far = np.array([[0.3, 0.3]]), np.array([[1.0, 0.0]])
    open_, cautious = fitted.log_likelihood, fitted.cautious.log_likelihood
    np.testing.assert_allclose(cautious(near), open_(near), atol=0.05)
    assert cautious(far) < open_(far)
