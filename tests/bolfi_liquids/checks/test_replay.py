"""What is measured of a repeated stir, where it is known."""

import pickle

import numpy as np
import pytest

from bolfi_liquids.checks import replay
from bolfi_liquids.checks.replay import replay_case, rms, rms_bar, spread, without_noise


def judged(reference, simulate, name="oil_v10", seed=0):
    (stir,) = reference.chosen([name])
    result = replay_case(stir, simulate).run(lambda fraction: None, seed)
    return result, {row.quantity: row for row in result.rows}


def test_noise_is_taken_out_in_quadrature_and_seeds_are_told_apart(reference, shifted):
    """Offset and sign of the seeds add in quadrature; the variance of -1, 1, ... is n / (n - 1)."""
    result, rows = judged(reference, shifted(offset=0.3, spread=0.03))
    assert result.notes["rms_with_noise_deg"] == pytest.approx(np.hypot(0.3, 0.03))
    expected = np.sqrt(0.3**2 + 0.03**2 - 0.1**2)
    assert rows[replay.RMS].ours == pytest.approx(expected)
    variance = replay.SEEDS / (replay.SEEDS - 1)
    assert rows[replay.SPREAD].ours == pytest.approx(0.03 * np.sqrt(variance))
    assert result.passed


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
def test_each_bar_is_that_of_the_liquid(reference, shifted, offset, spread, name, passes):
    result, _ = judged(reference, shifted(offset, spread), name)
    assert result.passed is passes


def test_bars_by_viscosity():
    viscosities = (0.001, 0.0299, 0.03, 0.05, 0.08, 0.1, 0.2, 1.0, 12.0)
    bars = [rms_bar(viscosity) for viscosity in viscosities]
    assert bars == [0.6, 0.6, 0.55, 0.55, 0.36, 0.36, 0.1, 0.1, 0.1]


def test_a_failed_simulation_fails(reference, shifted):
    def simulate(stir, seeds):
        signals = shifted()(stir, seeds)
        signals[1] = np.nan
        return signals

    result, rows = judged(reference, simulate, seed=2)
    assert not result.passed and np.isnan(rows[replay.RMS].ours)
    assert result.notes["failed_seeds"].tolist() == [2 * replay.SEEDS + 1]


def test_missed_samples_are_left_out():
    values = np.full((3, 5, 2), 2.0)
    values[:, 1, 0] = np.nan
    assert rms(values) == 2.0
    values[0, 2, 0] = np.nan  # of one trial alone
    assert np.isnan(rms(values))
    assert np.isnan(rms(np.full((5, 2), np.nan)))


def test_what_is_less_than_the_noise_is_nothing():
    assert without_noise(0.05) == 0.0
    assert without_noise(np.sqrt(0.02), recordings=2) == pytest.approx(0.0, abs=1e-8)
    assert np.isnan(without_noise(np.nan))
    assert spread(np.zeros((4, 5, 2))) == 0.0


def test_the_timed_stir_is_the_whole_one_after_a_short_one_with_other_seeds(reference, shifted):
    calls = []

    def simulate(stir, seeds):
        calls.append((len(stir.recording.time), list(seeds)))
        return shifted()(stir, seeds)

    judged(reference, simulate, seed=1)
    first = [replay.SEEDS + k for k in range(replay.SEEDS)]
    assert calls == [(10, [seed + replay.SEEDS for seed in first]), (60, first)]


def test_the_true_liquid_is_stirred_in_the_true_depth(reference, monkeypatch):
    given = {}

    def stir(liquid, gripper, setup, seeds, effects):
        given.update(liquid=liquid, setup=setup, effects=effects)
        return np.zeros((len(seeds), len(gripper.time), 2))

    monkeypatch.setattr(replay, "stir", stir)
    (oil,) = reference.chosen(["oil_v10"])
    replay.repeated(oil, np.arange(4))
    density = oil.recording.number("liquid_density")
    assert (given["liquid"].viscosity, given["liquid"].density) == (0.1, density)
    assert given["setup"].cup.fill == 0.05
    assert given["effects"] == {"fill_level": pytest.approx(3e-4)}


@pytest.mark.slow
def test_the_fluid_repeats_a_short_stir(reference):
    signals = replay.repeated(reference.stirs[-1], np.arange(4))
    assert signals.shape == (4, 60, 2) and np.isfinite(signals).all()
    assert spread(signals) > 0.0


def test_a_case_reaches_another_process(reference):
    case = replay_case(reference.stirs[0])
    again = pickle.loads(pickle.dumps(case))
    assert again.settings == case.settings and again.run.reference.name == "water_v10"
