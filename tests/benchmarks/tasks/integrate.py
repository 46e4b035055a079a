"""Ordinary differential equations of many parameters at once."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np


def runge_kutta(
    rate: Callable[[np.ndarray], np.ndarray], state: np.ndarray, times: np.ndarray, step: float
) -> np.ndarray:
    """States [len(times), *state.shape] from `state` at time 0, by the classical fourth order.

    Args:
        rate: State -> its derivative; depends on no time.
        state: At time 0.
        times: Ascending, from 0 on.
        step: The longest.
    """
    states, now = [], 0.0
    for time in times:
        steps = int(np.ceil((time - now) / step - 1e-9))
        h = (time - now) / max(steps, 1)
        for _ in range(steps):
            k1 = rate(state)
            k2 = rate(state + 0.5 * h * k1)
            k3 = rate(state + 0.5 * h * k2)
            state = state + h * (k1 + 2.0 * (k2 + k3) + rate(state + h * k3)) / 6.0
        states.append(state)
        now = time
    return np.stack(states)
