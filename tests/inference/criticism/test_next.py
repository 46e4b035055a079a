"""The expected signal-to-noise ratio of an experiment that was not made."""

import numpy as np
import pytest
from bolfi_liquids.inference import criticism
from bolfi_liquids.inference.criticism.held_out import RUNS_EACH, separation

SAMPLES, NOISE, REPEATS = 120, 0.1, 200
WAVE = np.sqrt(2.0 / SAMPLES) * np.cos(np.pi * 6 * (np.arange(SAMPLES) + 0.5) / SAMPLES)


def found(ratio, own):
    """Of two explanations that differ by `ratio` times all noise, their runs by `own` of it."""
    measured = NOISE * np.sqrt(1.0 - own**2)
    noise = criticism.KnownNoise(measured)
    proposal = criticism.Proposal(len, noise, (SAMPLES,))

    def repeat(seed):
        rng = np.random.default_rng(seed)
        runs = own * NOISE * rng.normal(size=(2, RUNS_EACH, SAMPLES))
        runs[1] += ratio * NOISE * WAVE
        return separation(proposal, {"one": runs[0], "other": runs[1]}).snr

    return np.array([repeat(seed) for seed in range(REPEATS)])


@pytest.mark.parametrize("own", [pytest.param(0.1, marks=pytest.mark.slow), 0.6])
@pytest.mark.parametrize("ratio", [5.0, pytest.param(10.0, marks=pytest.mark.slow)])
def test_the_ratio_is_found_whatever_part_of_the_noise_the_runs_have(ratio, own):
    """Within a fifth: so few runs hardly know their own noise."""
    assert np.mean(found(ratio, own)) == pytest.approx(ratio, rel=0.2)


def test_explanations_that_are_the_same_are_not_told_apart():
    assert np.median(found(0.0, 0.6)) < 3.0


@pytest.mark.parametrize(
    "wrong",
    [
        lambda: criticism.KnownNoise("x"),
        lambda: criticism.KnownNoise(-0.1),
        lambda: criticism.KnownNoise(np.array([0.1, np.nan])),
        lambda: criticism.Proposal(3, criticism.KnownNoise(0.1), (3,)),
        lambda: criticism.Proposal(len, 3, (3,)),
        lambda: criticism.Proposal(len, criticism.KnownNoise(0.1), 3),
        lambda: criticism.Proposal(len, criticism.KnownNoise(0.1), (0,)),
    ],
)
def test_what_is_no_proposal_is_refused(wrong):
    with pytest.raises(ValueError):
        wrong()
