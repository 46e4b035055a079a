"""What is measured of a repeated stir, where it is known."""

import numpy as np
import pytest

from . import stir_replay
from .stir_replay import (
    SEEDS,
    repeat_stir,
    rms,
    simulate_stir,
    spread,
    stir_rows,
)


def judged(stir, simulate):
    return stir_rows(stir, repeat_stir(stir, simulate).signals)


def test_noise_is_taken_out_in_quadrature_and_seeds_are_told_apart(stirs, shifted):
    """Offset and sign of the seeds add in quadrature; the variance of -1, 1, ... is n / (n - 1)."""
    far, apart = judged(stirs["oil_v10"], shifted(offset=0.3, spread=0.03))
    assert far.ours == pytest.approx(np.sqrt(0.3**2 + 0.03**2 - 0.1**2)) and far.passed
    assert apart.ours == pytest.approx(0.03 * np.sqrt(SEEDS / (SEEDS - 1))) and apart.passed


@pytest.mark.parametrize(
    ("offset", "spread", "name", "passes"),
    [
        (0.09, 0.0, "gel_v10", True),  # less than the noise
        (0.15, 0.0, "gel_v10", False),
        (0.15, 0.0, "oil_v10", True),
        (0.4, 0.0, "oil_v10", False),
        (0.4, 0.0, "water_v10", True),
        (0.7, 0.0, "water_v10", False),
        (0.0, 0.05, "water_v10", False),  # no two seeds agree
    ],
)
def test_each_bar_is_that_of_the_liquid(stirs, shifted, offset, spread, name, passes):
    rows = judged(stirs[name], shifted(offset, spread))
    assert all(row.passed for row in rows) is passes


def test_a_failed_simulation_fails(stirs, shifted):
    def simulate(stir, seeds):
        signals = shifted()(stir, seeds)
        signals[1] = np.nan
        return signals

    far, apart = judged(stirs["oil_v10"], simulate)
    assert np.isnan(far.ours) and not far.passed and not apart.passed


def test_missed_samples_are_left_out():
    values = np.full((3, 5, 2), 2.0)
    values[:, 1, 0] = np.nan
    assert rms(values) == 2.0
    values[0, 2, 0] = np.nan  # of one trial alone
    assert np.isnan(rms(values))
    assert np.isnan(rms(np.full((5, 2), np.nan)))


def test_the_true_liquid_is_stirred_in_the_true_depth(stirs, monkeypatch):
    given = {}

    def stir(liquid, gripper, setup, seeds, effects):
        given.update(liquid=liquid, setup=setup, effects=effects)
        return np.zeros((len(seeds), len(gripper.time), 2))

    monkeypatch.setattr(stir_replay, "stir", stir)
    oil = stirs["oil_v10"]
    simulate_stir(oil, np.arange(4))
    density = oil.recording.number("liquid_density")
    assert (given["liquid"].viscosity, given["liquid"].density) == (0.1, density)
    assert given["setup"].cup.fill == 0.05
    assert given["effects"] == {"fill_level": pytest.approx(3e-4)}


@pytest.mark.slow
def test_the_fluid_repeats_a_short_stir(stirs):
    signals = simulate_stir(stirs["gel_v10"], np.arange(4))
    assert signals.shape == (4, 60, 2) and np.isfinite(signals).all()
    assert spread(signals) > 0.0
