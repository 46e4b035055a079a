"""Of the last simulations, what those before them had led to expect."""

import numpy as np
import pytest
from bolfi_liquids.inference.design import sobol
from bolfi_liquids.inference.emulator import emulate
from bolfi_liquids.inference.emulator_checks import SURPRISED, surprised
from bolfi_liquids.inference.foretold import FEWEST, foretold_errors
from scipy.stats import binom

TIME = np.linspace(0.0, 2.0, 40)
NOISE = 0.03


def scale(outputs):
    return np.full(outputs.shape[1], outputs.std())


def decays(u, rng):
    """Of size u_0 and rate u_1, with white run-to-run noise."""
    signal = (0.5 + u[:, :1]) * np.exp(-(0.2 + u[:, 1:]) * TIME)
    return signal + NOISE * rng.normal(size=signal.shape)


def errors(u, outputs):
    found = foretold_errors(emulate(u, outputs, scale, 8, 64), scale, 0.3)
    return found[np.isfinite(found)]


def test_of_a_smooth_simulator_errors_are_as_large_as_believed():
    made = []
    for seed in range(30):
        u = sobol(seed, 0, 30, 2)
        made.append(errors(u, decays(u, np.random.default_rng(seed))))
    assert 0.8 < np.median([np.mean(z**2) for z in made]) < 1.3
    alarms = sum(bool(surprised(z)) for z in made)
    assert alarms <= binom.isf(1e-3, len(made), 0.02)


def test_a_peak_between_the_first_runs_is_a_surprise():
    """The last third lies where the output does what the first two never showed."""
    first, last = sobol(0, 0, 20, 2), 0.5 + 0.1 * (sobol(1, 0, 10, 2) - 0.5)
    first = first[np.linalg.norm(first - 0.5, axis=1) > 0.15]
    u = np.concatenate([first, last])
    outputs = decays(u, np.random.default_rng(0))
    assert not surprised(errors(u, outputs))
    near = np.exp(-0.5 * np.sum((u - 0.5) ** 2, 1, keepdims=True) / 0.05**2)
    found = errors(u, outputs + near * np.sin(3.0 * TIME))
    assert np.mean(found**2) > SURPRISED
    assert "simulate more" in surprised(found)[0]


@pytest.mark.parametrize(
    "u",
    [
        np.linspace(0.0, 1.0, 30)[:, None] * np.ones(2),  # the last ones lie beyond the first
        sobol(0, 0, FEWEST, 2),
    ],
)
def test_nothing_is_said_where_nothing_can_be_foretold(u):
    assert errors(u, decays(u, np.random.default_rng(0))).size == 0
    assert surprised(np.full((len(u), 3), np.nan)) == []
