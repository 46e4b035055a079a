"""A pour in a few numbers says what its particles say."""

import numpy as np
import pytest

from bolfi_liquids import models
from bolfi_liquids.pouring.parcels import PARCELS, ROW, fractions_of, parcels_of

DISTANCE = np.arange(-0.02, 0.09, 1e-3)
RADIUS = 0.035


@pytest.fixture
def landings(rng):
    """Two streams of 3000 particles, one of which splits, as wide as a cup."""
    ahead = np.concatenate([rng.normal(0.03, 0.01, 2000), rng.normal(-0.02, 0.002, 1000)])
    position = np.stack([ahead, rng.normal(0.0, 0.008, 3000)], axis=-1)
    other = position + [0.02, 0.0]
    other[2400:] = np.nan
    return models.Landings(np.stack([position, other]).astype(np.float32), np.array([0.0, 0.2]))


def test_fractions_are_those_of_the_particles(landings):
    found = fractions_of(parcels_of(landings), DISTANCE, RADIUS)
    known = landings.into(DISTANCE[:, None], RADIUS)
    for column, name in enumerate(("spilled", "received", "retained")):
        missed = found[..., column].T - getattr(known, name)
        assert np.sqrt(np.mean(missed**2)) < 0.005, name
    np.testing.assert_allclose(found.sum(axis=-1), 1.0)
    assert found.min() >= 0.0


def test_parcels_hold_equal_shares_in_order(landings):
    rows = parcels_of(landings)
    assert rows.shape == (2, ROW)
    ahead = rows[:, 1 : 1 + PARCELS]
    assert (np.diff(ahead, axis=1) >= 0.0).all()
    means = np.nanmean(landings.position[..., 0], axis=1)
    np.testing.assert_allclose(ahead.mean(axis=1), means, atol=1e-6)


def test_more_parcels_than_particles_share_them():
    position = np.full((1, 10, 2), np.nan, np.float32)
    position[0, :3] = [[0.01, 0.0], [0.02, 0.0], [0.06, 0.0]]
    rows = parcels_of(models.Landings(position, np.array([0.7])))
    spilled = fractions_of(rows, np.array([0.015, 0.06]), 0.02)[0, :, 0]
    assert spilled == pytest.approx([0.1, 0.2], abs=0.002)


def test_what_stays_in_the_source_is_not_spilled_and_a_diverged_pour_is_no_row():
    nothing = np.full((2, 10, 2), np.nan, np.float32)
    stays, diverged = parcels_of(models.Landings(nothing, np.array([1.0, np.nan])))
    assert fractions_of(stays[None], DISTANCE, RADIUS)[0, :, 2] == pytest.approx(1.0)
    assert np.isnan(diverged).all()
