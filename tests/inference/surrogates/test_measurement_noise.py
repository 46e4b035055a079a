"""The noise model against dense algebra and sampling."""

import numpy as np
import pytest
from bolfi_liquids.inference.surrogates.measurement_noise import (
    CORRELATIONS,
    STEP,
    Layout,
    Nodes,
    candidates,
    correlated,
    misfit_beside,
    reduce,
    residual_size,
    shrunk_covariance,
)
from scipy.stats import multivariate_normal, norm

ALPHA = 1e-4  # false alarms


def dense(layout, sigma, rho):
    """sigma^2 rho^|gap| within a channel, by definition."""
    gap = np.abs(layout.sample[:, None] - layout.sample)
    return sigma**2 * np.where(layout.channel[:, None] == layout.channel, rho**gap, 0.0)


@pytest.fixture
def gappy():
    """Two channels, one with missing samples."""
    return Layout(np.repeat([0, 1], [9, 6]), np.append(np.arange(9), [0, 1, 4, 5, 6, 11]))


def test_reduction_agrees_with_dense_least_squares(gappy):
    """The likelihood of any scores, up to one factor for all nodes and scores."""
    rng = np.random.default_rng(0)
    m, k = 15, 3
    vectors, observed = rng.normal(size=(m, k)), rng.normal(size=m)
    factors, white = 0.4 * rng.normal(size=(m, 4)), rng.uniform(0.1, 0.3, m)
    nodes = Nodes(np.array([0.5, 1.0, 0.3, 0.0]), np.array([0.0, 0.6, 0.95, 0.0]))
    padded = np.column_stack([vectors, np.zeros((m, 2))])  # components that are empty
    found = reduce((padded, observed, factors), white, gappy, nodes)
    scores = rng.normal(size=(5, k))
    for g in range(4):
        covariance = factors @ factors.T + np.diag(white)
        covariance = covariance + dense(gappy, nodes.sigma[g], nodes.rho[g])
        full = [multivariate_normal(vectors @ z, covariance).logpdf(observed) for z in scores]
        short = multivariate_normal(found.estimate[g], found.covariance[g]).logpdf(scores)
        expected = np.array(full) + 0.5 * (m - k) * np.log(2.0 * np.pi)
        np.testing.assert_allclose(found.log_weight[g] + short, expected, rtol=1e-9)


def test_simulated_noise_has_the_covariance_of_the_model(gappy):
    n = 20_000
    white = np.random.default_rng(0).normal(size=(n, 15))
    drawn = correlated(white, gappy, Nodes(np.full(n, 0.7), np.full(n, 0.8)))
    expected = dense(gappy, 0.7, 0.8)
    error = np.sqrt((np.outer(np.diag(expected), np.diag(expected)) + expected**2) / n)
    z = (np.cov(drawn.T) - expected) / error
    assert np.abs(z).max() < norm.isf(ALPHA / 2 / z.size)


def test_evidence_finds_size_and_correlation_of_the_noise():
    """Over 200 samples the posterior of the nodes is within 25 % and 0.2 of the truth."""
    m = 200
    layout = Layout(np.zeros(m, int), np.arange(m))
    vectors = np.stack([np.ones(m), np.linspace(-1.0, 1.0, m)], axis=1)
    truth = Nodes(np.array([0.3]), np.array([0.6]))
    noise = correlated(np.random.default_rng(1).normal(size=(1, m)), layout, truth)[0]
    observed = vectors @ [1.0, 2.0] + noise
    size = residual_size(observed, vectors)
    nodes = candidates(size / 8.0, 2.5 * size, CORRELATIONS)
    found = reduce((vectors, observed, np.zeros((m, 1))), np.zeros(m), layout, nodes)
    evidence = found.log_weight + 0.5 * np.linalg.slogdet(found.covariance)[1]
    weight = np.exp(evidence - evidence.max())
    weight /= weight.sum()
    assert abs(np.log(weight @ nodes.sigma / 0.3)) < 0.25
    assert abs(weight @ nodes.rho - 0.6) < 0.2


def test_a_misfit_is_as_probable_as_said_and_most_of_all_as_large_as_the_given_noise():
    nodes, log_weight = misfit_beside(0.3, 0.1, 2.0, False)
    weight = np.exp(log_weight)
    assert nodes.sigma[0] == 0.0 and weight[0] == pytest.approx(0.9)
    assert weight.sum() == pytest.approx(1.0)
    assert abs(np.log(nodes.sigma[1:][np.argmax(weight[1:])] / 0.3)) < np.log(STEP)


def test_white_residuals_stay_white_and_smooth_ones_keep_their_shape():
    rng = np.random.default_rng(0)
    n, m = 30, 60
    white = shrunk_covariance(rng.normal(size=(n, m)), 0)
    total = np.sum(white.factors**2) / m + white.white
    assert abs(total - 1.0) < 4.0 * np.sqrt(2.0 / n / m)
    assert white.white > 0.8
    shape = np.sin(np.linspace(0.0, 3.0, m))
    smooth = shrunk_covariance(rng.normal(size=(n, 1)) * shape, 0)
    leading = np.linalg.svd(smooth.factors)[0][:, 0]
    assert abs(leading @ shape) / np.linalg.norm(shape) > 0.999
    assert smooth.white < 0.15 * np.mean(shape**2)


def test_no_freedom_or_no_residual_is_no_noise():
    for residuals, lost in (
        (np.random.default_rng(0).normal(size=(3, 5)), 4),
        (np.zeros((6, 5)), 3),
    ):
        found = shrunk_covariance(residuals, lost)
        assert not found.factors.any() and found.white == 0.0
