"""Pours of given liquids by given actions, simulated one by one and not read from a map."""

import json
from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np
from bolfi_liquids.inference.simulations import Compute
from bolfi_liquids.models import Cups
from numpy.typing import NDArray

from bolfi_liquids import models
from bolfi_liquids.inputs.prior import split_parameters
from bolfi_liquids.pouring.spillage import FRACTIONS, Profiles, reachable_distances
from bolfi_liquids.progress import Advance
from bolfi_liquids.run.simulations import simulate_kept
from bolfi_liquids.simulators import FluidSimulator


@dataclass(frozen=True)
class Outcomes(FluidSimulator):
    """The liquids and seeds that every action is tried on.

    Actions that meet the same liquids and the same seeds (common random numbers) differ by
    what they are and not by luck.

    Attributes:
        theta: Parameter of the liquid, or coefficient of an effect -> values, shape (draws,).
        density: Of the liquid [kg/m3].
        cups: Source, receiver and how the source is turned.
        seeds: One for each draw, shape (draws,).
    """

    theta: Mapping[str, NDArray]
    density: float
    cups: Cups
    seeds: NDArray[np.int64]

    @property
    def distances(self) -> NDArray[np.float64]:
        """See `reachable_distances`."""
        return reachable_distances(self.cups)

    def simulate(self, action: Mapping[str, NDArray], seeds: NDArray) -> NDArray[np.float64]:
        """Fractions (actions, draws, D, 3) spilled, received and retained.

        Args:
            action: `angular_velocity` [rad/s], shape (actions,).
            seeds: The engine's, not used: see the class.
        """
        draws, actions = len(self.seeds), len(seeds)
        tiled = {name: np.tile(values, actions) for name, values in self.theta.items()}
        liquid, effects = split_parameters(tiled)
        landings = models.landings(
            models.Liquid(**liquid, density=self.density),
            np.repeat(action["angular_velocity"], draws),
            self.cups,
            np.tile(self.seeds, actions),
            effects=effects,
        )
        result = landings.into(self.distances[:, None], self.cups.receiver.radius)
        fractions = np.stack([getattr(result, name) for name in FRACTIONS], axis=-1)
        return np.moveaxis(fractions, 0, 1).reshape(actions, draws, -1, len(FRACTIONS))

    @property
    def identity(self) -> str:
        """A text that two equal experiments share."""
        liquids = {name: np.asarray(values).tolist() for name, values in self.theta.items()}
        seeds = np.asarray(self.seeds).tolist()
        made_of = [self.cups.settings(), self.density, liquids, seeds, self.distances.tolist()]
        return json.dumps(["profiles", *made_of], sort_keys=True)


def pour_all(outcomes: Outcomes, rates: NDArray, compute: Compute, advance: Advance) -> Profiles:
    """Pour every liquid at every angular velocity [rad/s]; what the bank holds is not repeated.

    Those at which a pour failed are left out.

    Args:
        outcomes: The liquids and seeds.
        rates: Angular velocities [rad/s], shape (W,).
        compute: Where pours are made and kept; its batch is not used.
        advance: Called with 1 for each angular velocity.

    Raises:
        RuntimeError: Pours failed at all of them.
    """
    compute = replace(compute, batch=1)
    theta = {"angular_velocity": rates}
    made = simulate_kept(outcomes, theta, [0] * len(rates), compute, advance=advance)
    return Profiles(rates[made.places], outcomes.distances, made.signals)
