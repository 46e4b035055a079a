"""Surface tension: a weightless drop becomes round, and swings as Rayleigh 1879 says."""

import numpy as np
import pytest

from bolfi_liquids import models

SPACING = 0.006
DENSITY = 900.0
SIDES = (6, 8, 6, 8)  # particles along the edges of the cubes that the drops are made from
TENSIONS = np.array([0.02, 0.02, 0.08, 0.08])
SAMPLES = 120


@pytest.fixture(scope="module")
def swinging_drops(weightless):
    return frequencies(weightless, SIDES, TENSIONS, DENSITY, SPACING)


def frequencies(weightless, sides, tensions, density, spacing):
    """Drops for each of `sides` and `tensions`: they become round, are pulled and then let go.

    Returns:
        Ratio of least to greatest moment of inertia before the pull, and angular frequencies
        [1/s], measured and Rayleigh's.
    """
    slots, counts = len(sides), np.array(sides) ** 3
    extent = [(-10.0 * spacing,) * 3, (10.0 * spacing,) * 3]
    tension = (models.EFFECTS["surface_tension"],)
    drops = weightless(slots, counts.max(), spacing, extent, tension)
    radius = spacing * (0.75 * counts / np.pi) ** (1 / 3)
    rayleigh = np.sqrt(8.0 * tensions / (density * radius**3))
    drops.place([cube(side, spacing) for side in sides])
    drops.pour_in(models.Liquid(0.05, 0.0, density).batch(slots), tensions[None])
    drops.step(slots, round(np.pi / rayleigh.min() * drops.rate))

    points = drops.position.to_numpy()
    roundness = np.array([least_over_most(x[:n]) for x, n in zip(points, counts, strict=True)])
    velocity = points * np.float32([-0.5, -0.5, 1.0]) * 0.15 * rayleigh[:, None, None]
    drops.velocity.from_numpy(velocity.astype(np.float32))
    drops.pour_in(models.Liquid(0.003, 0.0, density).batch(slots), tensions[None])
    steps = round(4.0 * np.pi / rayleigh.min() * drops.rate / SAMPLES)
    stretch = np.empty((slots, SAMPLES))
    for k in range(SAMPLES):
        drops.step(slots, steps)
        for b, points in enumerate(drops.position.to_numpy()):
            spread = points[: counts[b]].var(axis=0)
            stretch[b, k] = spread[2] / spread.sum() - 1.0 / 3.0
    measured = np.array([frequency(s, steps / drops.rate) for s in stretch])
    return roundness, measured, rayleigh


def cube(side, spacing):
    axis = spacing * (np.arange(side) - (side - 1) / 2)
    points = np.stack(np.meshgrid(axis, axis, axis, indexing="ij"), -1).reshape(-1, 3)
    return points + np.random.default_rng(side).normal(0.0, 0.05 * spacing, points.shape)


def least_over_most(points):
    """Of the principal moments of inertia."""
    second = np.linalg.eigvalsh(np.cov(points.T))
    return (second[0] + second[1]) / (second[1] + second[2])


def frequency(swing, interval):
    """From the first period between zeros; halves differ, as long drops swing back later."""
    before = np.nonzero(swing[1:] * swing[:-1] < 0)[0][:3]
    zeros = before - swing[before] / (swing[before + 1] - swing[before])
    return 2.0 * np.pi / (interval * (zeros[2] - zeros[0]))


@pytest.mark.minutes
def test_cubes_become_balls(swinging_drops):
    roundness, _, _ = swinging_drops
    assert roundness.min() > 0.95


@pytest.mark.slow
def test_drops_swing_at_rayleighs_frequency(swinging_drops):
    """Of any size and tension, though the radius is only four to five particles."""
    _, measured, rayleigh = swinging_drops
    np.testing.assert_allclose(measured / rayleigh, 1.0, atol=0.1)


@pytest.mark.slow
def test_frequency_rises_as_the_root_of_the_tension(swinging_drops):
    _, measured, _ = swinging_drops
    np.testing.assert_allclose(measured[2:] / measured[:2], 2.0, rtol=0.1)
