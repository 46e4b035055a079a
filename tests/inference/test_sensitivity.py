"""Sobol indices against closed forms."""

import numpy as np
import numpyro.distributions as dist
import pytest

from bolfi_liquids import inference

A, B = 7.0, 0.1  # of Ishigami's function


def ishigami(theta, seeds):
    x, y, z = theta.values()
    return (np.sin(x) + A * np.sin(y) ** 2 + B * z**4 * np.sin(x))[:, None]


def ishigami_indices():
    """Ishigami and Homma (1990): first and total."""
    of_x = 0.5 * (1.0 + B * np.pi**4 / 5.0) ** 2
    of_y, of_both = A**2 / 8.0, B**2 * np.pi**8 * (1.0 / 18.0 - 1.0 / 50.0)
    whole = of_x + of_y + of_both
    return np.array([of_x, of_y, 0.0]) / whole, np.array([of_x + of_both, of_y, of_both]) / whole


def fitted(simulate, prior, n, **options):
    """Of n points that fill the prior."""
    how = {"budget": n, "initial": n, "confirm": 0, "progress": False, "warn": False}
    observed = simulate(prior.from_unit(np.full((1, len(prior)), 0.4)), [0])[0]
    return inference.fit(simulate, prior, observed, **{**how, **options})


def test_indices_of_a_linear_output_are_shares_of_its_variance():
    weights = np.array([[1.0, 2.0, 0.5], [3.0, 0.0, 1.0]])
    prior = inference.Prior(
        {name: dist.Normal(0.0, sd) for name, sd in zip("abc", (1, 2, 3), strict=True)}
    )

    def linear(theta, seeds):
        return np.stack(list(theta.values()), axis=-1) @ weights.T

    found = fitted(linear, prior, 30).sobol()
    variances = (weights * [1.0, 2.0, 3.0]) ** 2
    expected = variances / variances.sum(1, keepdims=True)
    assert found["first"].dims == ("parameter", "signal_dim_0")
    for name in ("first", "total"):
        np.testing.assert_allclose(found[name].sel(parameter=list("abc")).T, expected, atol=0.02)
        of_all = variances.sum(0) / variances.sum()
        np.testing.assert_allclose(found[f"{name}_of_all"], of_all, atol=0.02)


@pytest.mark.slow
def test_ishigami_s_indices():
    bounds = dist.Uniform(-np.pi, np.pi)
    prior = inference.Prior({"x": bounds, "y": bounds, "z": bounds})
    found = fitted(ishigami, prior, 160, noise=0.1).sobol()
    for name, expected in zip(("first", "total"), ishigami_indices(), strict=True):
        np.testing.assert_allclose(found[f"{name}_of_all"], expected, atol=0.05)
        np.testing.assert_array_equal(found[f"{name}_of_all"], found[name][:, 0])


def test_what_does_not_vary_has_no_index_and_a_discrepancy_has_one():
    prior = inference.Prior({"a": dist.Uniform(0.0, 1.0), "b": dist.Uniform(0.0, 1.0)})

    def half(theta, seeds):
        return np.stack([theta["a"], np.ones(len(theta["a"]))], axis=1)

    found = fitted(half, prior, 12, noise=0.1).sobol(256)
    assert np.isnan(found["total"][:, 1]).all()
    np.testing.assert_allclose(found["total_of_all"], [1.0, 0.0], atol=0.01)
    scalar = fitted(half, prior, 12, surrogate="discrepancy").sobol(256)
    assert scalar["first"].dims[0] == "parameter"
    assert scalar["total"].squeeze()[0] > 0.9


def test_an_offset_changes_no_index():
    """Of an air pressure [Pa] that sound changes by 1e-7 of itself."""
    prior = inference.Prior({"a": dist.Uniform(0.0, 1.0), "b": dist.Uniform(0.0, 1.0)})

    def pressure(theta, seeds):
        return 101325.0 + 0.01 * np.stack([theta["a"], theta["a"] + 2.0 * theta["b"]], axis=1)

    found = fitted(pressure, prior, 12, noise=1e-3).sobol(256)
    np.testing.assert_allclose(found["first"].T, [[1.0, 0.0], [0.2, 0.8]], atol=0.02)


def test_where_nothing_varies_there_are_no_indices():
    prior = inference.Prior({"a": dist.Uniform(0.0, 1.0)})
    with pytest.raises(ValueError, match="varies"):
        fitted(lambda theta, _: np.ones((len(theta["a"]), 3)), prior, 8).sobol()
