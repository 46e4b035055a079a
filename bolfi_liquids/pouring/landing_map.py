"""Where the liquid of any pour lands, learned from a few dozen pours.

The parcels of a pour (see `parcels`) are smooth functions of the liquid and of the angular
velocity, which an emulator learns. Each pour is also predicted from all others. What that misses is
the error of the map, chance between pours included; it is added to what the map predicts, so that
figures that rest on the map count it.
"""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from ..inputs.pour_table import PourTable
from ..inputs.settings import MIN_MAP_POURS
from ..seeds import Phase, generator
from ..simulators import RATE
from .given import GivenPours, learn_given
from .parcels import fractions_of, scale
from .pours import Box, Poured
from .spillage import (
    MAX_LANDING_SDS,
    Judged,
    Profiles,
    Surface,
    landed,
    landing_sd,
    normal_scores,
    reachable_distances,
    surface,
)

if TYPE_CHECKING:
    from ..inference import Emulation
    from ..models import Cups

RATES = 31  # angular velocities that are tried
MIN_OUTCOMES = 64  # of an action, however few the draws
BEST_DRAWS = 384  # posterior draws at most that choose and judge the best action
LANDINGS_PER_DRAW = 5
"""Equally probable places where the liquid of each judging draw may land."""


@dataclass(frozen=True, eq=False)
class LandingMap:
    """Predicted landings of the pours in a box; see `learn_map`.

    Attributes:
        box: Of the liquids; those beyond are taken at its edge.
        cups: From and into which is poured.
        poured: What was learned from.
        emulation: Of the parcels, over quantiles within the box.
        given: Pours that were made of the liquid, which correct what `surface` and `judge` say;
            None where there are none.
    """

    box: Box
    cups: "Cups"
    poured: Poured
    emulation: "Emulation"
    given: GivenPours | None = None

    @property
    def pours(self) -> int:
        """Number of pours that were learned from."""
        return len(self.poured.rows)

    def profiles(self, rates: NDArray, liquids: Mapping[str, NDArray], misses: NDArray) -> Profiles:
        """Spillage of liquids at angular velocities [rad/s], (W,), with receivers at any distance.

        Args:
            rates: Within the range of the cups.
            liquids: Parameters and coefficients, name -> (draws,); others are ignored.
            misses: Which left-out pour each draw is as far from its prediction as, shape (draws,).
        """
        names = [name for name in self.box.prior.names if name != RATE]
        theta = {name: np.tile(liquids[name], len(rates)) for name in names}
        theta[RATE] = np.repeat(rates, len(misses))
        predicted = self.emulation.predict(_inputs(self.box, theta))
        rows = predicted + np.tile(self.emulation.missed[misses], (len(rates), 1))
        distance = reachable_distances(self.cups)
        fractions = fractions_of(rows, distance, self.cups.receiver.radius)
        return Profiles(rates, distance, fractions.reshape(len(rates), len(misses), -1, 3))

    def surface(
        self, liquids: Mapping[str, NDArray], *, rates: int = RATES, seed: int = 0
    ) -> Surface:
        """Expected spillage of every action over liquids that might be in the cup.

        Each draw meets one of the map's errors, the same for all actions, which then differ by what
        they are and not by luck. Few draws are repeated, so that they meet errors of all kinds.

        Args:
            liquids: As for `profiles`.
            rates: How many angular velocities are tried.
            seed: Of which error each draw meets.
        """
        outcomes, misses = self._outcomes(liquids, seed)
        tried = np.geomspace(*self.cups.angular_velocity_range, rates)
        found = surface(self.profiles(tried, outcomes, misses), self.cups)
        if self.given is None:
            return found
        here = self._spilled(self.given.table, outcomes, misses)
        return self.given.surface(found, here)

    def judge(
        self, action: Mapping[str, float], liquids: Mapping[str, NDArray], *, seed: int = 0
    ) -> Judged:
        """Spillage of an action over liquids, each landing at `LANDINGS_PER_DRAW` places.

        Args:
            action: `angular_velocity` [rad/s] and `distance` [m].
            liquids, seed: As for `surface`.
        """
        rate, distance = action["angular_velocity"], action["distance"]
        outcomes, misses = self._outcomes(liquids, seed)
        fractions = self._landed(np.array([rate]), np.array([distance]), outcomes, misses)[0]
        found = Judged(rate, distance, fractions)
        if self.given is None:
            return found
        table = self.given.table
        here = self._landed(table.angular_velocity, table.distance, outcomes, misses)
        return self.given.outcomes(found, np.moveaxis(here[..., [0, 2]], 0, 1), seed)

    def best(self, liquids: Mapping[str, NDArray]) -> Judged:
        """The action that is expected to spill least, judged on draws that did not choose it.

        Args:
            liquids: Posterior draws in no order, name -> (draws,).
        """
        choosing, judging = _halves(liquids)
        return self.judge(self.surface(choosing).least("mean"), judging)

    def regret(self, liquids: Mapping[str, NDArray]) -> NDArray[np.float64]:
        """Spillage of the action of `best` less that of the action that is best for the liquid at
        hand, of each draw that did not choose the former, shape (draws,).

        Both are averaged over where the liquid may land, and meet the same error of the map.

        Args:
            liquids: As for `best`.
        """
        choosing, judging = _halves(liquids)
        best = self.surface(choosing).risk("mean").argmin()
        spilled = self.surface(judging).spilled
        of_actions = spilled.reshape(len(spilled), -1)
        return of_actions[:, best] - of_actions.min(axis=1)

    @cached_property
    def error(self) -> NDArray[np.float64]:
        """Spilled fraction of each pour less that predicted from the others, shape (pours, D),
        over the distances of the decision, averaged over where the liquid may land."""
        at = np.zeros(1)
        distance = reachable_distances(self.cups)
        radius = self.cups.receiver.radius
        pairs = (self.poured.rows, self.emulation.left_out)
        known, expected = (
            surface(Profiles(at, distance, fractions_of(rows, distance, radius)[None]), self.cups)
            for rows in pairs
        )
        return (known.spilled - expected.spilled)[:, 0]

    @property
    def rms_error(self) -> float:
        """RMS error of the spilled fraction, over pours that were left out and all distances."""
        return float(np.sqrt(np.mean(self.error**2)))

    def corrected(
        self, table: PourTable, liquids: Mapping[str, NDArray], *, seed: int = 0
    ) -> "LandingMap":
        """Map that given pours of the liquid correct.

        Args:
            table: The pours, within the range of the cups.
            liquids, seed: As for `surface`.
        """
        outcomes, misses = self._outcomes(liquids, seed)
        spilled = self._spilled(table, outcomes, misses)
        landed = self._landed(table.angular_velocity, table.distance, outcomes, misses)
        retained = landed[:, ::LANDINGS_PER_DRAW, 2].T  # the same wherever the liquid lands
        return replace(self, given=learn_given(table, (spilled, retained)))

    def _outcomes(
        self, liquids: Mapping[str, NDArray], seed: int
    ) -> tuple[dict[str, NDArray], NDArray[np.int64]]:
        """Draws, each so often that there are `MIN_OUTCOMES`, and the left-out pour whose error
        each meets, all pours about as often."""
        there = len(next(iter(liquids.values())))
        times = -(-MIN_OUTCOMES // there)
        outcomes = {name: np.repeat(values, times) for name, values in liquids.items()}
        rng = generator(seed, Phase.MAP_MISSES)
        return outcomes, rng.permutation(np.arange(there * times) % self.pours)

    def _spilled(
        self, table: PourTable, liquids: Mapping[str, NDArray], misses: NDArray
    ) -> NDArray[np.float64]:
        """Spilled fractions (draws, A) of a table's pours, averaged over where they may land."""
        from scipy.interpolate import make_interp_spline

        rates, row = np.unique(table.angular_velocity, return_inverse=True)
        found = surface(self.profiles(rates, liquids, misses), self.cups)
        along = make_interp_spline(found.distance, found.spilled, k=1, axis=2)(table.distance)
        return along[:, row, np.arange(len(row))]

    def _landed(
        self, rate: NDArray, distance: NDArray, liquids: Mapping[str, NDArray], misses: NDArray
    ) -> NDArray[np.float64]:
        """Fractions (A, draws * LANDINGS_PER_DRAW, 3) of A actions, at each place of landing."""
        rates, row = np.unique(rate, return_inverse=True)
        profiles = self.profiles(rates, liquids, misses)
        scores = np.clip(normal_scores(LANDINGS_PER_DRAW), -MAX_LANDING_SDS, MAX_LANDING_SDS)
        off = landing_sd(self.cups) * scores
        pairs = zip(row, distance, strict=True)
        return np.stack(
            [landed(profiles.fractions[k], profiles.distance, at, off) for k, at in pairs]
        )


def learn_map(box: Box, cups: "Cups", poured: Poured) -> LandingMap:
    """Learn from the pours in a box.

    Raises:
        RuntimeError: They are too few.
    """
    import numpyro.distributions as dist

    from ..inference import Prior, emulate

    if len(poured.rows) < MIN_MAP_POURS:
        raise RuntimeError(
            f"{len(poured.rows)} pours succeeded, and a map needs {MIN_MAP_POURS}; allow more "
            "time, or more pours, and repeat the call: nothing that has finished is lost"
        )
    sides = zip(box.prior.names, box.low, box.high, strict=True)
    within = Prior({name: dist.Uniform(low, high) for name, low, high in sides})
    learned = emulate(within, _inputs(box, poured.theta), poured.rows, scale())
    return LandingMap(box, cups, poured, learned)


def _halves(liquids: Mapping[str, NDArray]) -> tuple[dict[str, NDArray], dict[str, NDArray]]:
    """Draws that choose an action, and others that judge it; a single draw does both."""
    several = len(next(iter(liquids.values()))) > 1
    choosing, judging = (
        {name: values[part] for name, values in liquids.items()}
        for part in (slice(0, BEST_DRAWS, 2), slice(int(several), BEST_DRAWS, 2))
    )
    return choosing, judging


def _inputs(box: Box, theta: Mapping[str, NDArray]) -> dict[str, NDArray[np.float64]]:
    """Quantiles of the box's prior, those beyond the box at its edge, name -> (n,)."""
    return box.prior.to_dict(np.clip(box.prior.to_unit(theta), box.low, box.high))
