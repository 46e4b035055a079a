"""Cells, steps and particles of a pour, by the cup; fixed before inference, kept with every result.

Pours of cells of 1/5.6 to 1/9 of the cup's radius were compared with references, of one cup.
"""

import math
from typing import Any, NamedTuple

import numpy as np

from ..apic.gravity import GRAVITY

CELLS = 7.0  # in the radius of the cup
LAYERS = 4.0  # of cells, at least, in liquid that is shallow
FINEST = 14.0  # cells in the radius, at most, for liquid however shallow
PER_CELL = 4  # particles
COURANT = 0.6  # cells that what falls from the cup's height goes in a step
LEAST_VISCOSITY = 1e-6
"""Kinematic viscosity below which pours look alike [m²/s]: those of 3e-4 and 1e-3 Pa s land within
half a millimetre, as other seeds do."""
FAST_TURN = 0.5  # speed of the floor over that of the fall beyond which steps are halved


class Filled(NamedTuple):
    """A cup and its liquid [m]."""

    radius: float
    height: float
    fill: float

    @property
    def volume(self) -> float:
        """Volume of the liquid [m³]."""
        return math.pi * self.radius**2 * self.fill


def cell_for(cup: Filled, particles: int = 0) -> float:
    """Edge of a cell [m].

    Args:
        cup: It decides, unless `particles` do.
        particles: About as many in the whole cup; 0: cells follow the cup.
    """
    if particles:
        return float((PER_CELL * cup.volume / particles) ** (1.0 / 3.0))
    return max(min(cup.radius / CELLS, cup.fill / LAYERS), cup.radius / FINEST)


def particles_for(cup: Filled, cell: float) -> float:
    """Approximate number of particles that fill cells of an edge [m]."""
    return PER_CELL * cup.volume / cell**3


def steps_for(height: float, cell: float, rate: np.ndarray) -> np.ndarray:
    """Step of each pour [s], in cells [m], from a cup of a height [m]; rates of turn are in rad/s.

    All slow pours share one, and fast ones halve it, since pours that march together share theirs.
    """
    fall = math.sqrt(GRAVITY * height)
    halvings = np.ceil(np.log2((fall + rate * height) / (fall * (1.0 + FAST_TURN))) - 1e-9)
    return COURANT * cell / fall / 2.0 ** np.maximum(halvings, 0.0)


def settings(cup: Filled, particles: int = 0) -> dict[str, Any]:
    """Everything that fixes the discretisation of pours, as plain numbers."""
    return {
        "cell": cell_for(cup, particles),
        "per_cell": PER_CELL,
        "courant": COURANT,
        "fast_turn": FAST_TURN,
    }
