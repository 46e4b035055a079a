"""The harness of the study of criticism: it goes on where it stopped, and repeats nothing."""

import numpy as np
import pytest
from misfit import study

# The data sets.


@pytest.mark.parametrize(("effect", "strength"), [("tilt", 2.5), ("friction", 6.0), ("swirl", 2.5)])
def test_an_effect_changes_the_inclination_as_much_as_asked(effect, strength):
    base = {"drag": 2.0, "eddy": 0.3}
    coefficient = study._coefficient(base, effect, strength, np.random.default_rng(0))
    assert study._change(base, effect, coefficient) == pytest.approx(strength, rel=0.01)
    assert study._change(base, effect, 0.0) == 0.0


def test_the_base_parameters_absorb_part_of_an_effect():
    """A tilt is none of theirs; what is left is no more than what it changes."""
    base = {"drag": 2.0, "eddy": 0.3}
    exact = study._exact
    coefficient = study._coefficient(base, "fill", 2.5, np.random.default_rng(0))
    left = study._snr(base, "fill", coefficient)
    root = np.linalg.inv(np.linalg.cholesky(study.stand_in.covariance()))
    changed = exact(study.FIRST, {**base, "fill": coefficient}) - exact(study.FIRST, base)
    assert 0.0 < left < 0.7 * np.linalg.norm(root @ changed)


def test_data_hold_the_noise_that_is_said():
    """Variance at the slowest frequencies of many observations, against `covariance`."""
    stir, base = study.FIRST, {"drag": 2.0, "eddy": 0.3}
    clean = study._exact(stir, base)
    moving = slice(90, 240)  # the liquid's own error has its full size
    noise = np.stack([(stir.observe(base, seed) - clean)[moving] for seed in range(200)])
    expected = study.stand_in.covariance()[moving, moving]
    modes = np.cos(np.pi * np.arange(1, 9) * (np.arange(150)[:, None] + 0.5) / 150.0)
    seen = np.mean(np.einsum("stc,tk->sck", noise, modes) ** 2, (0, 1))
    ratio = seen / np.sum(modes * (expected @ modes), 0)
    assert np.abs(ratio - 1.0).max() < 4.5 * np.sqrt(2.0 / 400)
