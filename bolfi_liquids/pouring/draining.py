"""How long the source must be held until nearly all of the liquid has left it."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from ..progress import Advance, silent
from ..run.results import Number
from ..seeds import Phase, simulation_seeds
from ..simulators import RATE, BatchOf, PourSimulator

if TYPE_CHECKING:
    from ..inference.simulations import Compute

TENTH = 0.1  # share of the liquid that may stay in the source
HELD_S = np.arange(0.0, 10.01, 0.1)  # that a pour is simulated for
LONGEST_HOLD_S = 60.0  # that cups may ask for
LIQUIDS = 4  # that one pair of lanes pours at once


@dataclass(frozen=True)
class Hold:
    """How the source empties; see `hold_of`.

    Attributes:
        until_tenth_s: Time after which a tenth of the liquid stays, in the mean over the posterior
            [s]; beyond `simulated_s` by the power law of the last half of it; NaN beyond
            `LONGEST_HOLD_S`.
        simulated_s: Time that was simulated [s].
        retained_then: Share that stays after it.
    """

    until_tenth_s: Number
    simulated_s: Number
    retained_then: Number


@dataclass(frozen=True)
class Draining:
    """Shares (B, T) that are left in sources that are held for as long as `HELD_S` says."""

    def __call__(
        self, batch: BatchOf, theta: Mapping[str, NDArray], seeds: NDArray
    ) -> NDArray[np.float64]:
        from .. import models

        pours = batch(theta, seeds)
        plan = pours.cups.pour.model_copy(update={"hold": float(HELD_S[-1])})
        held = pours._replace(cups=pours.cups.model_copy(update={"pour": plan}))
        return models.draining(held, HELD_S)

    @property
    def settings(self) -> list[Any]:
        """The times."""
        return ["draining", HELD_S.tolist()]


def hold_of(
    draining: PourSimulator,
    rate: float,
    liquids: Mapping[str, NDArray],
    compute: "Compute",
    advance: Advance = silent,
) -> Hold:
    """How a source that is turned at a rate [rad/s] empties.

    Args:
        draining: The simulator of `Draining`.
        rate: At which the source turns.
        liquids: Posterior draws, name -> (draws,); a few of them are poured, thin to thick.
        compute: Where pours are made and kept; its batch is not used, and its timeout is that of a
            pour that is held as the cups say.
        advance: Called with 1 for each of these pours.

    Raises:
        RuntimeError: All pours failed.
    """
    from ..run.simulations import simulate_kept

    thick = np.argsort(liquids["viscosity"], kind="stable")
    some = thick[(2 * np.arange(LIQUIDS) + 1) * len(thick) // (2 * LIQUIDS)]
    names = ("viscosity", "cohesion", *draining.effects)
    theta = {name: liquids[name][some] for name in names} | {RATE: np.full(LIQUIDS, rate)}
    seeds = simulation_seeds(0, Phase.DRAINING, LIQUIDS)
    plan = draining.cups.pour
    longer = (plan.final_angle / rate + HELD_S[-1]) / (plan.final_angle / rate + plan.hold)
    timeout = None if compute.timeout is None else longer * compute.timeout
    compute = replace(compute, batch=LIQUIDS, timeout=timeout)
    made = simulate_kept(draining, theta, seeds, compute, advance=advance)
    left = made.signals.mean(axis=0)
    return Hold(_until_tenth(left), float(HELD_S[-1]), float(left[-1]))


def _until_tenth(left: NDArray) -> float:
    """See `Hold`; `left` are shares at `HELD_S`, shape (T,)."""
    if (enough := np.flatnonzero(left <= TENTH)).size:
        return float(HELD_S[enough[0]])
    # a film thins as a power of time: Jeffreys, Proc. Camb. Phil. Soc. 26, 204 (1930)
    half = len(left) // 2
    power = np.log(left[half] / left[-1]) / np.log(HELD_S[-1] / HELD_S[half])
    until = HELD_S[-1] * (left[-1] / TENTH) ** (1.0 / max(power, 1e-2))
    return float(until) if until <= LONGEST_HOLD_S else np.nan
