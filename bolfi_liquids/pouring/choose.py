"""From a posterior to the pour that is expected to spill least."""

import json
from collections.abc import Mapping
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from ..calibration.result import Calibration
from ..criticism.result import latest_calibration
from ..errors import InputError
from ..inputs.cups import bundled_cups, open_cups
from ..inputs.settings import PourSettings
from ..progress import Advance, progress_bar
from ..run.directory import POUR, open_bank
from ..run.summary import write_section
from .spillage import (
    ACTION,
    FARTHEST,
    Outcomes,
    Profiles,
    Surface,
    landed,
    landing_sd,
    normal_scores,
    pour_all,
    surface,
)

if TYPE_CHECKING:
    from ..inference.simulations.executors import Workers
    from ..inference.simulations.runner import Keep
    from ..models import Cups

PLUG_IN_SEEDS = 4  # that each action of the plug-in is tried with; the paper tries one
FINALISTS = 3  # angular velocities that are tried on as many draws again, and the plug-in's
JUDGE_DRAWS = 2  # times as many draws judge the two actions as each try takes
LANDINGS = 5  # equally probable ones of each pour that judges
_SEARCH, _JUDGE, _AGAIN = 11, 12, 13  # purposes of seeds


@dataclass(frozen=True, eq=False)
class Judged:
    """An action and what it spills, on draws and seeds that did not choose it.

    Attributes:
        angular_velocity: Of the source about its lip [rad/s].
        distance: Horizontally from the lip to the receiver's axis [m].
        fractions: Spilled, received and retained, shape (outcomes, 3); rows sum to 1. Each draw
            has several outcomes, as the liquid may land elsewhere than simulated.
    """

    angular_velocity: float
    distance: float
    fractions: NDArray[np.float64]

    @property
    def action(self) -> dict[str, float]:
        """`angular_velocity` and `distance`."""
        return dict(zip(ACTION, (self.angular_velocity, self.distance), strict=True))

    @property
    def expected_spillage(self) -> float:
        """Mean spilled fraction."""
        return float(self.fractions[:, 0].mean())

    @property
    def spillage_q95(self) -> float:
        """Spilled fraction that one outcome in twenty exceeds."""
        return float(np.quantile(self.fractions[:, 0], 0.95))


@dataclass(frozen=True, eq=False)
class Pour:
    """The chosen pour, and beside it the plug-in: the best one if theta* were the truth.

    Attributes:
        path: The RUN directory.
        chosen: Found over the posterior draws.
        plug_in: Found at theta* alone, judged over the same draws as `chosen`.
    """

    path: Path
    chosen: Judged
    plug_in: Judged


def choose_pour(  # noqa: PLR0913  the one call that most users make
    calibration: Calibration | str | Path,
    cups: "Cups | str | Path | None" = None,
    *,
    iterations: int = 15,
    draws: int = 16,
    risk: str = "mean",
    seed: int = 0,
    executor: "Workers | None" = None,
    timeout: float | None = None,
    progress: bool = True,
) -> Pour:
    """Choose angular velocity and distance so that little is spilled whatever the liquid is.

    Every angular velocity of a grid is poured with a fixed set of posterior draws and simulator
    seeds, each pour for all distances at once. The most promising ones, and the one that would be
    best at theta*, are poured with as many draws again: few draws tell good actions apart by
    chance. Of these the action is taken whose risk is least, averaged over where the liquid may
    land, and judged on draws and seeds it was not chosen by, so that the figure is not flattered
    by the choice. Finished simulations are kept in the run.

    Args:
        calibration: Whose posterior is poured; or a RUN directory, whose latest is.
        cups: Source, receiver and ranges of the action, or a TOML file of them; None are the
            bundled ones.
        iterations: Angular velocities tried, as many again for the plug-in.
        draws: Posterior draws that each action is tried on, and again those that promise most.
        risk: "mean", or "cvar": the mean over the worst tenth of the draws.
        seed: Seed of all random draws.
        executor: Where pours are simulated, see `calibrate`; the result has the same bits.
        timeout: Seconds that one pour may take; None sets no limit.
        progress: Whether to show a bar on stderr.

    Raises:
        InputError: A setting or the file of the cups cannot be used.
        RuntimeError: Pours failed at every angular velocity, or at all of the promising ones.
    """
    from ..calibration.tree import write_tree
    from ..inference.simulations.executors import open_executor
    from ..inference.simulations.runner import Keep
    from .tree import pour_section, pour_tree

    if not isinstance(calibration, Calibration):
        calibration = latest_calibration(calibration)
    settings = PourSettings(iterations=iterations, draws=draws, risk=risk, seed=seed)
    if cups is None or isinstance(cups, str | Path):
        cups = bundled_cups() if cups is None else open_cups(cups)
    # distinct strata: none of the draws that judge has chosen
    needed = (2 + JUDGE_DRAWS) * draws
    if needed > (there := next(iter(calibration.posterior.values())).size):
        raise InputError(
            f"{draws!r} needs {needed} posterior draws, the run has {there}",
            where="draws",
            fix=f"give {there // (2 + JUDGE_DRAWS)} at most, or calibrate with more draws",
        )
    drawn = calibration.draws(needed, seed)
    stratum = np.arange(len(next(iter(drawn.values())))) % (2 + JUDGE_DRAWS)
    search, again, others = (
        {name: values[np.isin(stratum, chosen)] for name, values in drawn.items()}
        for chosen in (1, 2, (0, 3))
    )
    best = {name: np.full(PLUG_IN_SEEDS, value) for name, value in calibration.best.items()}
    with (
        open_bank(calibration.path) as bank,
        open_executor(executor) as workers,
        progress_bar("trying actions", 2 * iterations + FINALISTS + 3, shown=progress) as advance,
    ):
        keep = Keep(bank, executor=workers, timeout=timeout)
        pours = _Pours(cups, calibration.liquid_density, settings, keep, advance)
        over_posterior, at_best = pours.try_all(search), pours.try_all(best)
        if_true = at_best.least(risk)
        finalists = pours.try_again(over_posterior, if_true["angular_velocity"], again)
        chosen = pours.judge(finalists.least(risk, neighbours=False), others)
        plug_in = pours.judge(if_true, others)
    pour = Pour(calibration.path, chosen, plug_in)
    tried = {"actions": over_posterior, "actions_plug_in": at_best, "finalists": finalists}
    tree = pour_tree(pour, tried, {"liquids": search, "liquids_again": again}, risk)
    floor = cups.least_viscosity(calibration.liquid_density, chosen.angular_velocity)
    tree.attrs.update(
        asdict(settings),
        cups=json.dumps(cups.settings()),
        least_viscosity=floor,
        landing_sd=landing_sd(cups),
    )
    write_tree(tree, calibration.path / POUR)
    made = sum(surface.spilled[..., 0].size for surface in (over_posterior, at_best))
    made += draws * len(finalists.angular_velocity)
    judged = 2 * JUDGE_DRAWS * draws
    section = pour_section(pour, settings, n_simulations=made + judged, least_viscosity=floor)
    write_section(calibration.path, "pour", section)
    return pour


@dataclass(frozen=True)
class _Pours:
    """What trying and judging, over the posterior and at theta*, share."""

    cups: "Cups"
    density: float
    settings: PourSettings
    keep: "Keep"
    advance: Advance

    def try_all(self, liquids: Mapping[str, NDArray]) -> Surface:
        """Pour these liquids at every angular velocity of the grid."""
        low, high = self.cups.angular_velocity_range
        rates = np.geomspace(low, high, self.settings.iterations)
        return surface(self._profiles(rates, liquids, _SEARCH), self.cups)

    def try_again(self, first: Surface, plug_in: float, liquids: Mapping[str, NDArray]) -> Surface:
        """Pour these liquids too where least was spilled, and at the angular velocity `plug_in`."""
        by_promise = np.argsort(first.risk(self.settings.risk).min(axis=1), kind="stable")
        named = [*first.angular_velocity[by_promise[:FINALISTS]], plug_in]
        rates = np.intersect1d(named, first.angular_velocity)
        return first.with_draws(surface(self._profiles(rates, liquids, _AGAIN), self.cups))

    def judge(self, action: Mapping[str, float], liquids: Mapping[str, NDArray]) -> Judged:
        """Pour every liquid, with seeds of their own."""
        rate, distance = action["angular_velocity"], action["distance"]
        profiles = self._profiles(np.array([rate]), liquids, _JUDGE)
        spread = FARTHEST * landing_sd(self.cups)
        off = np.clip(landing_sd(self.cups) * normal_scores(LANDINGS), -spread, spread)
        return Judged(
            rate, distance, landed(profiles.fractions[0], profiles.distance, distance, off)
        )

    def _profiles(self, rates: NDArray, liquids: Mapping[str, NDArray], purpose: int) -> Profiles:
        from ..run.simulations import fresh_seeds

        count = len(next(iter(liquids.values())))
        seeds = np.array(fresh_seeds(self.settings.seed, purpose, count), np.int64)
        outcomes = Outcomes(liquids, self.density, self.cups, seeds)
        return pour_all(outcomes, rates, self.keep, self.advance)
