"""Hardware of each simulated stir, which an effect in the rig may change."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

MAX_PIVOT_DISTANCE = 10.0  # m; float32 locates a pivot to 1e-6 m there


class Rig(NamedTuple):
    """Stick, pivot, filling and path of B stirs, float64.

    Attributes:
        stick_mass: Mass of the uniform stick [kg], shape [B].
        pivot_friction: Dry friction torque of the pivot [N m], shape [B].
        fill: Depth of the liquid with the stick in it [m], shape [B].
        path: Pivot at the start and at the end of each step [m], shape [B, steps + 1, 3].
    """

    stick_mass: np.ndarray
    pivot_friction: np.ndarray
    fill: np.ndarray
    path: np.ndarray

    def rows(self, part: slice | np.ndarray) -> "Rig":
        """The stirs that `part` picks."""
        return Rig(*(field[part] for field in self))


def check_rig(rig: Rig, deepest: float, effects: Sequence[str]) -> None:
    """Refuse a rig that no stir can have.

    Args:
        rig: Rig to check.
        deepest: Largest depth of liquid that the simulation has room for [m].
        effects: Names of the effects that made it so, for the message.

    Raises:
        ValueError: a value is not finite or out of its range.
    """
    ranges = {
        "stick_mass": (rig.stick_mass > 0, "must be positive [kg]"),
        "pivot_friction": (rig.pivot_friction >= 0, "must not be negative [N m]"),
        "fill": ((rig.fill >= 0) & (rig.fill <= deepest), f"must be 0 to {deepest:.4g} m"),
        "path": (
            np.abs(rig.path) < MAX_PIVOT_DISTANCE,
            f"must be finite and within {MAX_PIVOT_DISTANCE:g} m",
        ),
    }
    for name, (inside, rule) in ranges.items():
        values = getattr(rig, name)
        wrong = values[~(inside & np.isfinite(values))]
        if wrong.size:
            after = f" after the effects {', '.join(effects)}; change their coefficients"
            raise ValueError(
                f"the rig's {name} {rule}, got {wrong[0]:.4g}{after if effects else ''}"
            )
