"""The pours that a decision simulates: those of a map of landings, and a few that are held longer.

One sequence of points fills all liquids, effects and angular velocities that are thought possible.
A decision takes its first points inside a box around the posterior. The sequence depends on no
posterior, so another posterior finds the pours of the first one wherever the boxes overlap; and the
box ends on a lattice, so a posterior that has hardly moved has the same box.
"""

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, replace
from itertools import combinations
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..inputs.prior import PARAMETERS
from ..progress import Advance, progress_bar, silent
from ..run.results import Number
from ..seeds import Phase, generator, simulation_seeds
from ..simulators import RATE, BatchOf, PourSimulator

if TYPE_CHECKING:
    from numpy.typing import ArrayLike

    from ..inference import Prior, SimulationBank
    from ..inference.simulations import Compute, Job
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
AT_ONCE = 8  # pours in one call: four march together on each of two processors
TENTH = 0.1  # share of the liquid that may stay in the source
HELD_S = np.arange(0.0, 10.01, 0.1)  # that a pour is simulated for
LONGEST_HOLD_S = 60.0  # that cups may ask for
LIQUIDS = 4  # that one pair of lanes pours at once


def joint_prior(liquid: "Prior", names: Iterable[str], cups: "Cups") -> "Prior":
    """Prior of viscosity, cohesion, coefficients of effects, and the angular velocity.

    Args:
        liquid: Of viscosity and cohesion at least.
        names: Of parameters; those count that are effects which change a pour.
        cups: Whose range of angular velocities is taken.
    """
    import numpyro.distributions as dist

    from ..inference import Prior
    from ..models import EFFECTS

    effects = sorted(set(names) & {name for name, one in EFFECTS.items() if "pour" in one.scenes})
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
        """The sequence's first pours inside, ordered so that like viscosities and durations come
        together; fewer than `count` where the sequence ends."""
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
        """Points (n, d) and their numbers in the sequence, shape (n,)."""
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
    """Around a posterior, over all angular velocities, large enough to hold many points.

    Args:
        prior: See `joint_prior`.
        draws: Posterior draws of its liquids, name -> (n,), and of other parameters.
        best: Parameters that must lie inside, likewise.
    """
    from ..inference import Prior
    from ..models import EFFECTS

    *names, rate = prior.names
    assert rate == RATE
    liquid = Prior({name: prior.distributions[name] for name in names})

    def quantiles(of: "Mapping[str, ArrayLike]") -> NDArray[np.float64]:
        return liquid.to_unit({name: np.atleast_1d(of[name]) for name in names})

    low, high = np.quantile(quantiles(draws), [TAIL, 1.0 - TAIL], axis=0)
    margin = MARGIN * (high - low)
    # pours without an effect are pours with its neutral coefficient
    neutral = {name: EFFECTS[name].neutral for name in names if name in EFFECTS}
    inside = quantiles(best), quantiles({**best, **neutral})
    points = np.concatenate([[low - margin], [high + margin], *inside])
    # the least box of whole cells that holds all of them, within all quantiles
    first = np.clip(np.floor(points.min(axis=0) * CELLS), 0, CELLS - 1)
    last = np.clip(np.ceil(points.max(axis=0) * CELLS), first + 1, CELLS)
    low, high = np.append(first / CELLS, 0.0), np.append(last / CELLS, 1.0)
    while np.prod(high - low) < MIN_VOLUME:
        narrow = np.argmin(high - low)
        low[narrow] = max(0.0, low[narrow] - 1.0 / CELLS)
        high[narrow] = min(1.0, high[narrow] + 1.0 / CELLS)
    return Box(prior, low, high)


class Poured(NamedTuple):
    """Finished pours.

    Attributes:
        theta: Parameters of liquid and effects, and the angular velocity: name -> (n,).
        rows: See `parcels`, shape (n, ROW).
    """

    theta: dict[str, NDArray[np.float64]]
    rows: NDArray[np.float64]


def pours_in(
    box: Box, pours: PourSimulator, count: int, compute: "Compute", advance: Advance = silent
) -> Poured:
    """All pours in a box that the bank holds, once it holds the first `count` of the sequence.

    Args:
        box: Where they are wanted.
        pours: The simulator of `Parcels`, with the effects of the box.
        count: How many of the sequence; never are more than these made.
        compute: Where pours are made and kept, in its bank; its batch is not used.
        advance: Called with 1 for each pour of the sequence.

    Raises:
        RuntimeError: All of the sequence failed.
    """
    from ..inference.simulations import columns
    from ..run.simulations import simulate_kept

    assert compute.bank is not None
    theta, seeds = columns(box.jobs(count))
    simulate_kept(pours, theta, seeds.tolist(), replace(compute, batch=AT_ONCE), advance=advance)
    found = list(_in_bank(box, pours, compute.bank))
    return Poured(
        {name: np.concatenate([one.theta[name] for one in found]) for name in box.prior.names},
        np.concatenate([one.rows for one in found]),
    )


def pours_of_all(
    liquid: "Prior", pours: PourSimulator, count: int, compute: "Compute", *, progress: bool
) -> tuple[Box, Poured]:
    """Pours of all liquids of a prior, without effects, and whether a bar shows; see `pours_in`."""
    box = whole(joint_prior(liquid, (), pours.cups))
    with progress_bar("pouring", count, shown=progress) as advance:
        return box, pours_in(box, pours, count, compute, advance)


def _in_bank(box: Box, pours: PourSimulator, bank: "SimulationBank") -> Iterator[Poured]:
    """Pours of the bank inside of the box, by the effects with which they were poured; a pour
    made without an effect has its neutral coefficient."""
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


@dataclass(frozen=True)
class Hold:
    """Emptying of the source; see `hold_of`.

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
    """Learn how a source empties that is turned at a rate [rad/s].

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
