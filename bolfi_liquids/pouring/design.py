"""Which pours a map of landings is learned from.

One sequence of points fills all liquids, effects and angular velocities that are thought possible.
A decision takes its first points inside a box around the posterior. The sequence depends on no
posterior, so another posterior finds the pours of the first one wherever the boxes overlap; and the
box ends on a lattice, so a posterior that has hardly moved has the same box.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from ..inputs.prior import PARAMETERS
from ..seeds import Phase, generator, simulation_seeds
from ..simulators import RATE

if TYPE_CHECKING:
    from numpy.typing import ArrayLike

    from ..inference import Prior
    from ..inference.simulations import Job
    from ..models import Cups

CELLS = 32  # of the lattice, along each side
TAIL = 0.005  # of a parameter's draws, at either end, that may lie outside
MARGIN = 0.1  # by which the box is wider at either end, in units of the draws' range
MIN_VOLUME = 2.0**-13
"""Of a box, which then has 128 of the sequence's points on average; no decision asks for more than
100. Of 120 boxes of this size, the poorest had 128 with six inputs, and 104 with eight."""
SEQUENCE, BLOCK = 2**20, 2**14  # points that are looked at, and at a time
PACKINGS = 64  # initial packings of the pours
WIDE = 0.1  # share of the prior's viscosities that are poured alike


def acting_in_pours(names: "tuple[str, ...] | list[str]") -> tuple[str, ...]:
    """Those of the effects `names` that change a pour."""
    from ..models import EFFECTS

    return tuple(sorted(name for name in names if "pour" in EFFECTS[name].scenes))


def joint_prior(liquid: "Prior", effects: tuple[str, ...], cups: "Cups") -> "Prior":
    """Of viscosity, cohesion, the coefficients of `effects`, and the angular velocity."""
    import numpyro.distributions as dist

    from ..inference import Prior
    from ..models import EFFECTS

    return Prior(
        {
            **{name: liquid.distributions[name] for name in PARAMETERS},
            **{name: EFFECTS[name].prior for name in effects},
            RATE: dist.LogUniform(*cups.angular_velocity_range),
        }
    )


@dataclass(frozen=True, eq=False)
class Box:
    """A part of all pours that are thought possible.

    Attributes:
        prior: Of viscosity, cohesion, coefficients and angular velocity, see `joint_prior`.
        low, high: Ends of the box in quantiles of the prior, shape (d,).
    """

    prior: "Prior"
    low: NDArray[np.float64]
    high: NDArray[np.float64]

    @property
    def effects(self) -> tuple[str, ...]:
        """Whose coefficients are among the inputs."""
        return tuple(name for name in self.prior.names if name not in (*PARAMETERS, RATE))

    def holds(self, u: NDArray) -> NDArray[np.bool_]:
        """Which quantiles (n, d) lie inside, shape (n,)."""
        return np.all((u >= self.low) & (u <= self.high), axis=1)

    def jobs(self, count: int) -> "list[Job]":
        """The sequence's first pours inside, in an order in which pours of like viscosity and
        duration come together."""
        from ..inference.simulations import jobs

        u, place = self._first(count)
        theta = self.prior.from_unit(u)
        seeds = simulation_seeds(0, Phase.MAP_POURS, PACKINGS)
        made = jobs(theta, [seeds[at % PACKINGS] for at in place])
        viscosity = self.prior.names.index("viscosity")
        alike = max(1, round(float(self.high[viscosity] - self.low[viscosity]) / WIDE))
        group = np.argsort(np.argsort(u[:, viscosity], kind="stable")) * alike // max(len(u), 1)
        return [made[at] for at in np.lexsort((theta[RATE], group))]

    def _first(self, count: int) -> tuple[NDArray[np.float64], NDArray[np.int64]]:
        """Points (n, d) and their numbers in the sequence; n < count where it ends."""
        from scipy.stats import qmc

        sequence = qmc.Sobol(len(self.prior), rng=generator(0, Phase.MAP_DESIGN))
        points, places, found = [], [], 0
        for start in range(0, SEQUENCE, BLOCK):
            u = sequence.random(BLOCK)
            inside = np.flatnonzero(self.holds(u))
            points.append(u[inside])
            places.append(start + inside)
            if (found := found + len(inside)) >= count:
                break
        return np.concatenate(points)[:count], np.concatenate(places)[:count]


def whole(prior: "Prior") -> Box:
    """All that the prior holds."""
    return Box(prior, np.zeros(len(prior)), np.ones(len(prior)))


def box_around(prior: "Prior", draws: Mapping[str, NDArray], best: Mapping[str, float]) -> Box:
    """Around a posterior, over all angular velocities.

    Args:
        prior: See `joint_prior`.
        draws: Posterior draws of its liquids, name -> (n,), and of other parameters.
        best: Parameters that must lie inside, likewise.
    """
    drawn = _quantiles(prior, draws)
    low, high = np.quantile(drawn, [TAIL, 1.0 - TAIL], axis=0)
    margin = MARGIN * (high - low)
    # pours without an effect are pours with its neutral coefficient
    inside = _quantiles(prior, best), _quantiles(prior, {**best, **_neutral(prior)})
    points = np.concatenate([[low - margin], [high + margin], *inside])
    low, high = _on_lattice(points.min(axis=0), points.max(axis=0))
    rate = prior.names.index(RATE)
    low[rate], high[rate] = 0.0, 1.0
    return _large_enough(Box(prior, low, high))


def _quantiles(prior: "Prior", liquids: "Mapping[str, ArrayLike]") -> NDArray[np.float64]:
    """Of liquids (n, d), at the middle angular velocity."""
    middle = float(prior.from_unit(np.full(len(prior), 0.5))[RATE])
    named = {name: np.atleast_1d(liquids[name]) for name in prior.names if name != RATE}
    count = len(named["viscosity"])
    return prior.to_unit({**named, RATE: np.full(count, middle)})


def _neutral(prior: "Prior") -> dict[str, float]:
    """Coefficients of a prior's effects where these do nothing."""
    from ..models import EFFECTS

    return {name: EFFECTS[name].neutral for name in prior.names if name in EFFECTS}


def _on_lattice(low: NDArray, high: NDArray) -> tuple[NDArray, NDArray]:
    """The least box of whole cells that holds all between, within all quantiles."""
    first = np.clip(np.floor(low * CELLS), 0, CELLS - 1)
    last = np.clip(np.ceil(high * CELLS), first + 1, CELLS)
    return first / CELLS, last / CELLS


def _large_enough(box: Box) -> Box:
    """The box, widened along its narrowest sides until the sequence has many points in it."""
    low, high = box.low.copy(), box.high.copy()
    while np.prod(high - low) < MIN_VOLUME:
        narrow = np.argmin(high - low)
        low[narrow] = max(0.0, low[narrow] - 1.0 / CELLS)
        high[narrow] = min(1.0, high[narrow] + 1.0 / CELLS)
    return Box(box.prior, low, high)
