"""How long the source must be held until nearly all of the liquid has left it."""

import json
from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from ..inputs.prior import split_parameters
from ..progress import Advance, silent
from ..run.fluid_simulator import FluidSimulator
from ..run.summary import Number
from ..seeds import Phase, simulation_seeds
from .design import RATE

if TYPE_CHECKING:
    from ..inference.simulations import Keep
    from ..models import Cups

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
class Draining(FluidSimulator):
    """Pours whose source is held for as long as `HELD_S` says.

    Attributes:
        cups: Source and receiver, and how the source is turned.
        density: Of the liquid [kg/m3].
        effects: Names of those whose coefficients are parameters.
    """

    cups: "Cups"
    density: float
    effects: tuple[str, ...] = ()

    def simulate(self, theta: Mapping[str, NDArray], seeds: NDArray) -> NDArray[np.float64]:
        """Shares (B, T) left in the source, at theta, name -> (B,)."""
        from .. import models

        rest = {name: values for name, values in theta.items() if name != RATE}
        liquid, effects = split_parameters(rest)
        given = models.Liquid(**liquid, density=self.density)
        plan = self.cups.pour.model_copy(update={"hold": float(HELD_S[-1])})
        cups = self.cups.model_copy(update={"pour": plan})
        return models.draining(given, theta[RATE], cups, seeds, HELD_S, effects=effects or None)

    @property
    def identity(self) -> str:
        """A text that two equal simulators share."""
        made_of = [self.cups.settings(), self.density, list(self.effects), HELD_S.tolist()]
        return json.dumps(["draining", *made_of], sort_keys=True)


def hold_of(
    draining: Draining,
    rate: float,
    liquids: Mapping[str, NDArray],
    keep: "Keep",
    advance: Advance = silent,
) -> Hold:
    """How a source that is turned at a rate [rad/s] empties.

    Args:
        draining: The simulator.
        rate: At which the source turns.
        liquids: Posterior draws, name -> (draws,); a few of them are poured, thin to thick.
        keep: Where pours are made and kept; its identity and batch are not used, and its timeout
            is that of a pour that is held as the cups say.
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
    timeout = None if keep.timeout is None else longer * keep.timeout
    keep = keep._replace(identity=draining.identity, batch=LIQUIDS, timeout=timeout)
    made = simulate_kept(draining.simulate, theta, seeds, keep, advance=advance)
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
