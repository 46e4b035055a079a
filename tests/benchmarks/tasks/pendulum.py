"""pend2: drag of a driven pendulum with process noise, both of whose states are observed.

theta'' = -k sin(theta) - c1 theta' - c2 |theta'| theta' + 3 cos(3 t), from theta = 1.2 at rest,
by explicit Euler steps.
"""

from __future__ import annotations

import numpy as np

from .base import Task, Theta, normals

START = 1.2  # rad
STIFFNESS = 20.0  # 1/s^2
TRUTH = {"c1": np.array([0.25]), "c2": np.array([0.15])}
RANGES = {"c1": (0.0, 1.0), "c2": (0.0, 0.5)}

STEPS = 300
STEP = 0.02  # s
NOISE = 0.25  # rad/s per sqrt(s), on the rate
RUNS = 4  # of one simulation, over which the discrepancy is averaged


def conservative(time: float, angle: np.ndarray, stiffness: np.ndarray | float) -> np.ndarray:
    """Acceleration without drag [rad/s^2]."""
    return -stiffness * np.sin(angle) + 3.0 * np.cos(3.0 * time)


def trajectories(theta: Theta, noise: np.ndarray) -> np.ndarray:
    """Angle and rate after each step, [b, runs, steps, 2].

    Args:
        theta: c1, c2, each [b].
        noise: Standard normal numbers [b, runs, steps].
    """
    c1, c2 = theta["c1"][:, None], theta["c2"][:, None]
    states = np.empty((*noise.shape, 2))
    angle, rate = np.full(noise.shape[:2], START), np.zeros(noise.shape[:2])
    kicks = NOISE * np.sqrt(STEP) * noise
    for i in range(noise.shape[-1]):
        drag = (c1 + c2 * np.abs(rate)) * rate
        acceleration = conservative(i * STEP, angle, STIFFNESS) - drag
        angle, rate = angle + STEP * rate, rate + STEP * acceleration + kicks[..., i]
        states[..., i, 0], states[..., i, 1] = angle, rate
    return states


def simulate(theta: Theta, seeds: np.ndarray) -> np.ndarray:
    """Four runs, [b, 4, 300, 2]: angle [rad] and rate [rad/s]."""
    return trajectories(theta, normals(seeds, RUNS, STEPS))


def observe(seed: int) -> np.ndarray:
    """One run, [1, 300, 2]."""
    return trajectories(TRUTH, normals(np.array([seed]), 1, STEPS))[0]


def discrepancy(observed: np.ndarray, simulated: np.ndarray) -> float:
    """Mean over the runs of the integral of (angle difference)^2 + (rate difference)^2 / 20."""
    squares = (simulated - observed) ** 2  # [runs, 300, 2]
    return float(((squares[..., 0] + squares[..., 1] / STIFFNESS).sum(axis=-1) * STEP).mean())


def log_likelihood(observed: np.ndarray, theta: Theta) -> np.ndarray:
    """From the rate's steps, which are normal given the state before; the angle's are certain.

    The acceleration is linear in c1 and c2, so that the sum over steps is a quadratic form.
    """
    angle = np.append(START, observed[0, :-1, 0])
    rate = np.append(0.0, observed[0, :-1, 1])
    acceleration = np.diff(observed[0, :, 1], prepend=0.0) / STEP
    drag = conservative(np.arange(len(rate)) * STEP, angle, STIFFNESS) - acceleration
    design = np.stack([rate, np.abs(rate) * rate, -drag])  # [3, steps]
    coefficients = np.stack([theta["c1"], theta["c2"], np.ones_like(theta["c1"])])  # [3, n]
    squares = np.einsum("in,ij,jn->n", coefficients, design @ design.T, coefficients)
    return -0.5 * squares * STEP / NOISE**2


def first_run(signals: np.ndarray) -> np.ndarray:
    """[b, runs, 300, 2] -> [b, 300, 2]: as noisy as the observed run, unlike the mean of four."""
    return signals[:, 0]


PEND2 = Task(
    name="pend2",
    ranges=RANGES,
    simulate=simulate,
    observe=observe,
    discrepancy=discrepancy,
    log_likelihood=log_likelihood,
    view=first_run,
)
