"""The last third of the runs, predicted from the first two thirds."""

import numpy as np
import pytest
from bolfi_liquids.inference.gp.process import JITTER, predict, predict_joint
from bolfi_liquids.inference.sobol import sobol
from bolfi_liquids.inference.surrogates.emulator import Limits, emulate, innovations
from bolfi_liquids.inference.surrogates.held_back import MIN_FIRST_RUNS, held_back
from bolfi_liquids.inference.surrogates.warnings import held_back_warnings
from scipy.stats import binom

pytestmark = pytest.mark.slow

TIME = np.linspace(0.0, 2.0, 40)
NOISE = 0.03
COMPONENTS = 8


def scale(outputs):
    return np.full(outputs.shape[1], outputs.std())


def decays(u, rng):
    """Of size u_0 and rate u_1, with white run-to-run noise."""
    signal = (0.5 + u[:, :1]) * np.exp(-(0.2 + u[:, 1:]) * TIME)
    return signal + NOISE * rng.normal(size=signal.shape)


def gathered(seed, n=20):
    """A design whose last third lies together, as an engine's does; and where."""
    rng, first = np.random.default_rng(seed), round(2 * n / 3)
    centre = rng.uniform(0.15, 0.85, 2)
    last = np.clip(centre + 0.05 * rng.normal(size=(n - first, 2)), 0.02, 0.98)
    return np.concatenate([sobol(seed, 0, first, 2), last]), centre


def errors(u, outputs, predicted=0.3):
    return held_back(emulate(u, outputs, scale, Limits(COMPONENTS, predicted)), scale)


def test_a_smooth_simulator_hardly_ever_surprises():
    """A rate of 5 % is refuted at 5 %: no more than one alarm of 100 fits. At the nominal 1 % there
    would be more one time in four."""
    alarms = 0
    for seed in range(100):
        u, _ = gathered(seed)
        alarms += bool(held_back_warnings(errors(u, decays(u, np.random.default_rng(seed)))))
    assert binom.cdf(alarms, 100, 0.05) < 0.05


def test_innovations_are_errors_of_one_run_after_another():
    """Conditioning on each new run in turn, by the plain formulae."""
    u, _ = gathered(0)
    outputs = decays(u, np.random.default_rng(0))
    early, new = emulate(u[:13], outputs[:13], scale, Limits(COMPONENTS)), u[13:]
    found = innovations(early, new, outputs[13:])
    joint = predict_joint(early.gp, new, new)
    error = early.basis.scores(outputs[13:]).T - predict(early.gp, new)[0]
    white = early.remainder.white / np.sum(early.basis.vectors**2, 0)[: early.basis.used]
    for j in range(early.basis.used):
        total = joint[j] + (early.noise[j, j] + white[j] + JITTER) * np.eye(7)
        for i in range(7):
            gain = np.linalg.solve(total[:i, :i], total[:i, i])
            sd = np.sqrt(total[i, i] - gain @ total[:i, i])
            expected = (error[j, i] - gain @ error[j, :i]) / sd
            np.testing.assert_allclose(found[i, j], expected, rtol=1e-6)


def test_a_peak_between_the_first_runs_is_a_surprise():
    """The last third lies where the output does what the first two never showed."""
    first, last = sobol(0, 0, 20, 2), 0.5 + 0.1 * (sobol(1, 0, 10, 2) - 0.5)
    first = first[np.linalg.norm(first - 0.5, axis=1) > 0.15]
    u = np.concatenate([first, last])
    outputs = decays(u, np.random.default_rng(0))
    assert not held_back_warnings(errors(u, outputs))
    near = np.exp(-0.5 * np.sum((u - 0.5) ** 2, 1, keepdims=True) / 0.05**2)
    assert "simulate more" in held_back_warnings(errors(u, outputs + near * np.sin(3.0 * TIME)))[0]


def late(u, centre, outputs):
    """Oscillation of ten noise sds of the last runs alone, orthogonal to all that the first
    ones' components can be."""
    first = round(2 * len(u) / 3)
    shown = np.linalg.svd(outputs[:first] - outputs[:first].mean(0), full_matrices=False)[2]
    shape = np.sin(9.0 * TIME)
    shape -= shown[:COMPONENTS].T @ (shown[:COMPONENTS] @ shape)
    near = np.exp(-0.5 * np.sum((u - centre) ** 2, 1, keepdims=True) / 0.1**2)
    near[:first] = 0.0
    return 10.0 * NOISE * near * shape / shape.std()


def test_what_no_component_shows_is_a_surprise():
    u, centre = gathered(1)
    outputs = decays(u, np.random.default_rng(1))
    plain, found = (errors(u, made) for made in (outputs, outputs + late(u, centre, outputs)))
    np.testing.assert_allclose(found.errors[:, :-1], plain.errors[:, :-1], atol=1e-6)
    assert not held_back_warnings(plain)
    assert held_back_warnings(found)


def test_where_no_component_is_in_use_the_last_runs_may_still_surprise():
    u, centre = gathered(2)
    outputs = NOISE * np.random.default_rng(2).normal(size=(20, len(TIME)))
    both = outputs, outputs + late(u, centre, outputs)
    plain, found = (errors(u, made, predicted=0.9) for made in both)
    assert np.isnan(plain.errors[:, :-1]).all()
    assert not held_back_warnings(plain)
    assert held_back_warnings(found)


@pytest.mark.parametrize(
    "u",
    [
        np.linspace(0.0, 1.0, 30)[:, None] * np.ones(2),  # the last ones lie beyond the first
        sobol(0, 0, MIN_FIRST_RUNS, 2),
    ],
)
def test_nothing_is_said_where_nothing_can_be_foretold(u):
    found = errors(u, decays(u, np.random.default_rng(0)))
    assert np.isnan(found.errors).all()
    assert held_back_warnings(found) == []
