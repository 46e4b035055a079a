"""Measurement noise as users give it, against the covariance that it means."""

import tracemalloc

import numpy as np
import pytest
from bolfi_liquids.inference.surrogates import SignalFamily
from bolfi_liquids.inference.surrogates.noise.given import given_noise
from bolfi_liquids.inference.surrogates.output_vectors import MAX_VALUES, describe

RNG = np.random.default_rng(0)


@pytest.fixture
def gappy():
    """Two channels, some samples missing."""
    observed = np.zeros((20, 2))
    observed[[3, 7], 1] = np.nan
    return observed


def test_sds_may_be_shaped_like_the_output_or_follow_its_finite_values(gappy):
    sds = RNG.uniform(1.0, 2.0, gappy.shape)
    there = np.isfinite(gappy)
    output = describe(gappy, None)
    expected = np.concatenate([sds[:, 0], sds[there[:, 1], 1]]) ** 2  # channel after channel
    shaped = np.where(there, sds, np.nan)
    for given in (shaped, sds[there], np.diag(sds[there] ** 2)):
        found = given_noise(given, output)
        np.testing.assert_allclose(found.white, expected)
        assert found.factors.shape == (38, 0)
    np.testing.assert_allclose(given_noise(0.5, output).white, np.full(38, 0.25))


def test_a_covariance_stays_one_in_the_order_of_the_values(gappy):
    root = RNG.normal(size=(38, 38))
    found = given_noise(root @ root.T, describe(gappy, None))
    position = np.full(40, -1)
    position[np.flatnonzero(np.isfinite(gappy).ravel())] = np.arange(38)
    rank = np.concatenate([position[0::2], position[1::2][position[1::2] >= 0]])
    expected = (root @ root.T)[np.ix_(rank, rank)]
    np.testing.assert_allclose(np.diag(found.white) + found.factors @ found.factors.T, expected)
    assert (found.white > 0.0).all()
    drawn = np.cov(found.draw(RNG, 40_000).T)
    error = np.sqrt(np.outer(found.variance, found.variance) + expected**2) / 200.0
    assert (np.abs(drawn - expected) < 5.0 * error).all()


def test_averages_are_less_noisy():
    """Every value the mean of three samples, or of two where one is missing."""
    observed = np.zeros(3 * MAX_VALUES)
    observed[1] = np.nan
    output = describe(observed, None)
    counts = np.r_[2.0, np.full(MAX_VALUES - 1, 3.0)]
    np.testing.assert_allclose(given_noise(0.6, output).white, 0.36 / counts)
    sds = RNG.uniform(1.0, 2.0, len(observed))
    expected = [np.sum(sds[[0, 2]] ** 2) / 4.0, np.sum(sds[3:6] ** 2) / 9.0]
    np.testing.assert_allclose(given_noise(sds, output).white[:2], expected)


def test_a_long_series_needs_no_matrix():
    """20 000 samples: as a covariance 3 GB."""
    tracemalloc.start()
    try:
        scale = SignalFamily(noise=0.1).view(np.zeros(20_000)).scale
        peak = tracemalloc.get_traced_memory()[1]
    finally:
        tracemalloc.stop()
    assert scale.given.white.shape == (MAX_VALUES,) and peak < 50e6


def test_noise_that_reads_two_ways_is_refused():
    observed = np.array([[1.0, np.nan], [np.nan, 2.0]])
    with pytest.raises(ValueError, match=r"give sds as \[\d+\]"):
        SignalFamily(noise=np.full((2, 2), 0.1)).view(observed)
    given = SignalFamily(noise=[0.1, 0.1]).view(observed).scale.given
    np.testing.assert_allclose(given.white, 0.01)
