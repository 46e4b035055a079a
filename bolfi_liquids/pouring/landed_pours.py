"""The pours of a map: made where the bank lacks them, and kept under what they depend on."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from itertools import combinations
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..progress import Advance, silent
from ..simulators import BatchOf, PourSimulator
from .design import Box
from .parcels import PARCELS, parcels_of

if TYPE_CHECKING:
    from ..inference import SimulationBank
    from ..inference.simulations import Compute

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
class Parcels:
    """Where the liquid lands, as rows (B, ROW) of `parcels`."""

    def __call__(
        self, batch: BatchOf, theta: Mapping[str, NDArray], seeds: NDArray
    ) -> NDArray[np.float64]:
        from .. import models

        return parcels_of(models.landings(*batch(theta, seeds)))

    @property
    def settings(self) -> list[Any]:
        """The number of parcels."""
        return ["landed pours", PARCELS]


def pours_in(
    box: Box, pours: PourSimulator, count: int, compute: "Compute", advance: Advance = silent
) -> Poured:
    """All pours in a box that the bank holds, once it holds the first `count` of the sequence.

    Those made without an effect are pours with its neutral coefficient.

    Args:
        box: Where they are wanted.
        pours: The simulator of `Parcels`, with the effects of the box.
        count: How many of the sequence; never are more than these made.
        compute: Where pours are made and kept; its batch is not used.
        advance: Called with 1 for each pour of the sequence.

    Raises:
        ValueError: There is no bank.
        RuntimeError: All of the sequence failed.
    """
    from ..run.simulations import simulate_kept

    asked = box.jobs(count)
    theta = {name: np.array([job.theta[name] for job in asked]) for name in box.prior.names}
    if (bank := compute.bank) is None:
        raise ValueError("compute needs a bank: the map learns from all pours that it holds")
    compute = replace(compute, batch=AT_ONCE)
    simulate_kept(pours, theta, [job.seed for job in asked], compute, advance=advance)
    found = list(_in_bank(box, pours, bank))
    return Poured(
        {name: np.concatenate([one.theta[name] for one in found]) for name in box.prior.names},
        np.concatenate([one.rows for one in found]),
    )


def _in_bank(box: Box, pours: PourSimulator, bank: "SimulationBank") -> Iterator[Poured]:
    """What the bank holds inside of the box, by the effects with which it was poured."""
    from ..models import EFFECTS

    for size in range(len(pours.effects) + 1):
        for effects in combinations(pours.effects, size):
            identity = replace(pours, effects=effects).identity
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
