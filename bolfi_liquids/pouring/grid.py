"""Profiles of pours for any liquid of the prior, interpolated between those of a grid.

Studies that choose thousands of pours cannot simulate each: a grid of liquids is poured once, at
every angular velocity, and what lies between is interpolated, linearly in the logarithm of the
viscosity and in the cohesion.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..seeds import Phase, simulation_seeds
from .spillage import (
    Outcomes,
    Profiles,
    Surface,
    pour_all,
    surface,
)

if TYPE_CHECKING:
    from scipy.interpolate import RegularGridInterpolator

    from ..inference import Prior
    from ..inference.simulations import Keep
    from ..models import Cups
    from ..progress import Advance


class GridSize(NamedTuple):
    """How fine a grid of pours is; cohesion acts slowly."""

    viscosities: int = 24
    cohesions: int = 3
    rates: int = 12


FINE_GRID = GridSize()


@dataclass(frozen=True, eq=False)
class PourGrid:
    """See the module.

    Attributes:
        cups: Of the pours.
        log_viscosity: Of the grid, shape (V,).
        cohesion: Shape (C,).
        profiles: Of V * C liquids, cohesion first, in the place of draws.
    """

    cups: "Cups"
    log_viscosity: NDArray[np.float64]
    cohesion: NDArray[np.float64]
    profiles: Profiles

    @cached_property
    def _between(self) -> "RegularGridInterpolator":
        """Fractions (points, rates, D, 3) at points of log viscosity and cohesion."""
        from scipy.interpolate import RegularGridInterpolator

        by_liquid = np.moveaxis(self.profiles.fractions, 1, 0)
        nodes = len(self.log_viscosity), len(self.cohesion)
        axes = self.log_viscosity, self.cohesion
        return RegularGridInterpolator(axes, by_liquid.reshape(*nodes, *by_liquid.shape[1:]))

    def surface(self, liquids: Mapping[str, NDArray]) -> Surface:
        """What all actions spill of each liquid, `viscosity` [Pa s] and `cohesion`, (draws,)."""
        at = np.column_stack([np.log(liquids["viscosity"]), liquids["cohesion"]])
        axes = self.log_viscosity, self.cohesion
        inside = np.clip(at, [axis[0] for axis in axes], [axis[-1] for axis in axes])
        fractions = np.moveaxis(self._between(inside), 0, 1)
        return surface(self.profiles._replace(fractions=fractions), self.cups)


def make_grid(
    cups: "Cups",
    density: float,
    prior: "Prior",
    keep: "Keep",
    advance: "Advance",
    *,
    size: GridSize = FINE_GRID,
) -> PourGrid:
    """Pour the grid's liquids, one call of the simulator for each angular velocity.

    Args:
        cups: Of the pours.
        density: Of every liquid [kg/m3].
        prior: Its bounds are the grid's.
        keep: Where the pours are made and kept.
        advance: Called after each angular velocity.
        size: Two of each at least.
    """
    ends = prior.from_unit(np.array([[0.0, 0.0], [1.0, 1.0]]))
    low, high = ({name: float(values[end]) for name, values in ends.items()} for end in (0, 1))
    viscosity = np.geomspace(low["viscosity"], high["viscosity"], size.viscosities)
    cohesion = np.linspace(low["cohesion"], high["cohesion"], size.cohesions)
    mesh = np.meshgrid(viscosity, cohesion, indexing="ij")
    theta = {"viscosity": mesh[0].ravel(), "cohesion": mesh[1].ravel()}
    seeds = np.array(simulation_seeds(0, Phase.GRID_POURS, mesh[0].size), np.int64)
    rates = np.geomspace(*cups.angular_velocity_range, size.rates)
    made = pour_all(Outcomes(theta, density, cups, seeds), rates, keep, advance)
    return PourGrid(cups, np.log(viscosity), cohesion, made)
