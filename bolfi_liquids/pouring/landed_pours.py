"""The pours of a map: made where the bank lacks them, and kept under what they depend on."""

import json
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from itertools import combinations
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..inputs.prior import split_parameters
from ..progress import Advance, silent
from ..run.fluid_simulator import FluidSimulator
from .design import RATE, Box
from .parcels import PARCELS, parcels_of

if TYPE_CHECKING:
    from ..inference import SimulationBank
    from ..inference.simulations import Keep
    from ..models import Cups

AT_ONCE = 8  # pours in one call: four march together on each of two processors


class Poured(NamedTuple):
    """Finished pours.

    Attributes:
        theta: Parameters of liquid and effects, and the angular velocity: name -> (n,).
        rows: See `parcels`, shape (n, ROW).
    """

    theta: dict[str, NDArray[np.float64]]
    rows: NDArray[np.float64]


@dataclass(frozen=True)
class LandedPours(FluidSimulator):
    """A simulator of pours whose effects may have any coefficient.

    Attributes:
        cups: Source and receiver, and how the source is turned.
        density: Of the liquid [kg/m3].
        effects: Names of those whose coefficients are parameters.
    """

    cups: "Cups"
    density: float
    effects: tuple[str, ...] = ()

    def simulate(self, theta: Mapping[str, NDArray], seeds: NDArray) -> NDArray[np.float64]:
        """Rows (B, ROW) of pours at theta, name -> (B,)."""
        from .. import models

        rest = {name: values for name, values in theta.items() if name != RATE}
        liquid, effects = split_parameters(rest)
        given = models.Liquid(**liquid, density=self.density)
        return parcels_of(
            models.landings(given, theta[RATE], self.cups, seeds, effects=effects or None)
        )

    @property
    def identity(self) -> str:
        """A text that two equal simulators share."""
        made_of = [self.cups.settings(), self.density, list(self.effects), PARCELS]
        return json.dumps(["landed pours", *made_of], sort_keys=True)


def pours_in(
    box: Box, pours: LandedPours, count: int, keep: "Keep", advance: Advance = silent
) -> Poured:
    """All pours in a box that the bank holds, once it holds the first `count` of the sequence.

    Those made without an effect are pours with its neutral coefficient.

    Args:
        box: Where they are wanted.
        pours: The simulator, with the effects of the box.
        count: How many of the sequence; never are more than these made.
        keep: Where pours are made and kept; its identity and batch are not used.
        advance: Called with 1 for each pour of the sequence.

    Raises:
        RuntimeError: All of the sequence failed.
    """
    from ..run.simulations import simulate_kept

    asked = box.jobs(count)
    theta = {name: np.array([job.theta[name] for job in asked]) for name in box.prior.names}
    keep = keep._replace(identity=pours.identity, batch=AT_ONCE)
    simulate_kept(pours.simulate, theta, [job.seed for job in asked], keep, advance=advance)
    found = [one for one in _in_bank(box, pours, keep.bank)]
    return Poured(
        {name: np.concatenate([one.theta[name] for one in found]) for name in box.prior.names},
        np.concatenate([one.rows for one in found]),
    )


def _in_bank(box: Box, pours: LandedPours, bank: "SimulationBank") -> Iterator[Poured]:
    """What the bank holds inside of the box, by the effects with which it was poured."""
    from ..models import EFFECTS

    for size in range(len(pours.effects) + 1):
        for effects in combinations(pours.effects, size):
            identity = LandedPours(pours.cups, pours.density, effects).identity
            if not bank.holds(identity):
                continue
            made = bank.simulations(identity)
            without = {
                name: np.full(len(made.seeds), float(EFFECTS[name].neutral))
                for name in pours.effects
                if name not in effects
            }
            theta = {**made.theta, **without}
            good = np.isfinite(made.signals).all(axis=1) & box.holds(box.prior.to_unit(theta))
            yield Poured({name: values[good] for name, values in theta.items()}, made.signals[good])
