"""From a posterior to the pour that is expected to spill least."""

import json
from collections.abc import Mapping
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..calibration.bad_fit import refuse_bad_fit
from ..calibration.posterior_file import write_tree
from ..calibration.result import Calibration
from ..calibration.summary import FitStatus
from ..criticism.result import latest_calibration
from ..errors import InputError
from ..inputs.cups import cups_of
from ..inputs.settings import PourSettings
from ..progress import Advance, progress_bar
from ..run.directory import POUR, Run, open_bank, run_path
from ..run.entering import working_in_run
from ..run.execution import Execution
from ..run.workers import open_workers
from ..seeds import Phase, simulation_seeds
from .pour_file import pour_tree
from .result import Judged, Pour, PourSummary
from .spillage import (
    MAX_LANDING_SDS,
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
    from ..inference.simulations import Keep, Workers
    from ..models import Cups

PLUG_IN_SEEDS = 4
"""Seeds that each action of the plug-in is tried with; the paper tries one."""

N_FINALISTS = 3
"""Angular velocities that are tried on as many draws again, beside that of the plug-in."""

JUDGE_DRAWS_FACTOR = 2
"""How many times as many draws judge the two actions as each try takes."""

LANDINGS_PER_POUR = 5
"""Equally probable places where the liquid of each judging pour may land."""

SEARCH_STRATUM, AGAIN_STRATUM = 1, 2
"""Strata of the posterior draws that choose; all others judge."""


def choose_pour(  # noqa: PLR0913  the one call that most users make
    calibration: Run,
    cups: "Cups | str | Path | None" = None,
    *,
    iterations: int = 15,
    draws: int = 16,
    risk: str = "mean",
    seed: int = 0,
    force: bool = False,
    executor: "Workers | None" = None,
    timeout: float | None = None,
    progress: bool = True,
) -> Pour:
    """Choose angular velocity and distance so that little is spilled whatever the liquid is.

    Every angular velocity of a grid is poured with a fixed set of posterior draws and simulator
    seeds, each pour for all distances at once. The most promising ones, and the one that would be
    best at theta*, are poured with as many draws again: with few draws, good actions differ mainly
    by chance. Of these the action is taken whose risk is least, averaged over where the liquid may
    land, and judged on draws and seeds it was not chosen by, so that the figure is not flattered
    by the choice. Finished simulations are kept in the run.

    Args:
        calibration: A calibration; a criticism, or a RUN directory, whose latest posterior is
            poured.
        cups: Source, receiver and ranges of the action, or a TOML file of them; None takes the
            bundled ones.
        iterations: Angular velocities tried, as many again for the plug-in.
        draws: Posterior draws that each action is tried on, and again those that promise most.
        risk: "mean", or "cvar": the mean over the worst tenth of the draws.
        seed: Seed of all random draws.
        force: Whether to choose even though the fit is bad, see `calibration.bad_fit`.
        executor: Where pours are simulated, see `calibrate`; the result has the same bits.
        timeout: Seconds that one pour may take; None sets no limit.
        progress: Whether to show a bar on stderr.

    Raises:
        InputError: A setting, `timeout` or the file of the cups cannot be used; the fit is bad; or
            another command works in the run.
        ValueError, ImportError, ConnectionError: `executor` cannot be used.
        RuntimeError: Pours failed at every angular velocity, or at all of the promising ones.
    """
    settings = PourSettings(iterations=iterations, draws=draws, risk=risk, seed=seed)
    with working_in_run(run_path(calibration)):
        latest = latest_calibration(calibration)
        if not force:
            refuse_bad_fit(latest.summary, latest.path)
        drawn = strata(latest, settings.draws, settings.seed)
        cups = cups_of(cups)
        with open_workers(executor, timeout) as workers:
            execution = Execution(workers, timeout, progress)
            return _chosen(latest, cups, settings, drawn, execution)


def _chosen(
    calibration: Calibration,
    cups: "Cups",
    settings: PourSettings,
    drawn: "Drawn",
    execution: Execution,
) -> Pour:
    """Search, judge, and write what was found into the run."""
    actions = 2 * settings.iterations + N_FINALISTS + 3
    with (
        open_bank(calibration.path) as bank,
        progress_bar("trying actions", actions, shown=execution.progress) as advance,
    ):
        keep = execution.keep(bank)
        pours = _Pours(cups, calibration.liquid_density, settings, keep, advance)
        choice = _search(pours, drawn, calibration.best)
        pour = _judge(pours, choice, drawn.judge, calibration.path)
    _keep(pour, choice, drawn, pours, calibration.summary.fit_status)
    return pour


class Drawn(NamedTuple):
    """Posterior draws, name -> (draws,), no two groups of which share one.

    Attributes:
        search: On which every action is tried.
        again: On which the most promising actions are tried too.
        judge: On which the chosen action and the plug-in are judged.
    """

    search: dict[str, NDArray]
    again: dict[str, NDArray]
    judge: dict[str, NDArray]


def strata(calibration: Calibration, draws: int, seed: int) -> Drawn:
    """Distinct strata of the posterior, so that the draws that judge have chosen nothing.

    Raises:
        InputError: The posterior has too few draws.
    """
    groups = 2 + JUDGE_DRAWS_FACTOR
    needed, there = groups * draws, next(iter(calibration.posterior.values())).size
    if needed > there:
        raise InputError(
            f"{draws!r} needs {needed} posterior draws, the run has {there}",
            where="draws",
            fix=f"give {there // groups} at most, or calibrate with more draws",
        )
    drawn = calibration.draws(needed, seed)
    stratum = np.arange(needed) % groups
    search, again = stratum == SEARCH_STRATUM, stratum == AGAIN_STRATUM

    def of(chosen: NDArray[np.bool_]) -> dict[str, NDArray]:
        return {name: values[chosen] for name, values in drawn.items()}

    return Drawn(of(search), of(again), of(~(search | again)))


class _Choice(NamedTuple):
    """What was tried, and the two actions that it led to."""

    over_posterior: Surface
    at_best: Surface
    finalists: Surface
    chosen: dict[str, float]
    plug_in: dict[str, float]

    @property
    def n_pours(self) -> int:
        """Pours of one liquid that were made."""
        tried = sum(one.spilled[..., 0].size for one in (self.over_posterior, self.at_best))
        draws_again = len(self.finalists.spilled) - len(self.over_posterior.spilled)
        return tried + draws_again * len(self.finalists.angular_velocity)


def _search(pours: "_Pours", drawn: Drawn, best: Mapping[str, float]) -> _Choice:
    """Try all actions over the posterior and at theta* (`best`), the most promising ones again."""
    risk = pours.settings.risk
    at_theta = {name: np.full(PLUG_IN_SEEDS, value) for name, value in best.items()}
    over_posterior, at_best = pours.try_all(drawn.search), pours.try_all(at_theta)
    plug_in = at_best.least(risk)
    finalists = pours.try_again(over_posterior, plug_in["angular_velocity"], drawn.again)
    chosen = finalists.least(risk, neighbours=False)
    return _Choice(over_posterior, at_best, finalists, chosen, plug_in)


def _judge(pours: "_Pours", choice: _Choice, liquids: Mapping[str, NDArray], path: Path) -> Pour:
    chosen, plug_in = (pours.judge(action, liquids) for action in (choice.chosen, choice.plug_in))
    return Pour(path, chosen, plug_in)


def _keep(
    pour: Pour, choice: _Choice, drawn: Drawn, pours: "_Pours", fit_status: FitStatus
) -> None:
    """Write pour.nc and the section "pour" of summary.json."""
    cups, settings = pours.cups, pours.settings
    tried = {
        "actions": choice.over_posterior,
        "actions_plug_in": choice.at_best,
        "finalists": choice.finalists,
    }
    liquids = {"liquids": drawn.search, "liquids_again": drawn.again}
    least = cups.least_viscosity(pours.density)
    tree = pour_tree(pour, tried, liquids, settings.risk)
    tree.attrs.update(
        asdict(settings),
        cups=json.dumps(cups.settings()),
        least_viscosity=least,
        landing_sd=landing_sd(cups),
        fit_status=str(fit_status),  # a bad fit was poured by force
    )
    write_tree(tree, pour.path / POUR)
    judged = 2 * JUDGE_DRAWS_FACTOR * settings.draws
    PourSummary.from_pour(
        pour,
        settings,
        n_simulations=choice.n_pours + judged,
        least_viscosity=least,
        fit_status=fit_status,
    ).write(pour.path)


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
        return surface(self._profiles(rates, liquids, Phase.SEARCHED_POURS), self.cups)

    def try_again(self, first: Surface, plug_in: float, liquids: Mapping[str, NDArray]) -> Surface:
        """Pour these liquids too where least was spilled, and at the angular velocity `plug_in`."""
        by_promise = np.argsort(first.risk(self.settings.risk).min(axis=1), kind="stable")
        named = [*first.angular_velocity[by_promise[:N_FINALISTS]], plug_in]
        rates = np.intersect1d(named, first.angular_velocity)
        return first.with_draws(
            surface(self._profiles(rates, liquids, Phase.SEARCHED_AGAIN), self.cups)
        )

    def judge(self, action: Mapping[str, float], liquids: Mapping[str, NDArray]) -> Judged:
        """Pour every liquid, with seeds of their own."""
        rate, distance = action["angular_velocity"], action["distance"]
        profiles = self._profiles(np.array([rate]), liquids, Phase.JUDGED_POURS)
        spread = MAX_LANDING_SDS * landing_sd(self.cups)
        off = np.clip(landing_sd(self.cups) * normal_scores(LANDINGS_PER_POUR), -spread, spread)
        return Judged(
            rate, distance, landed(profiles.fractions[0], profiles.distance, distance, off)
        )

    def _profiles(self, rates: NDArray, liquids: Mapping[str, NDArray], purpose: Phase) -> Profiles:
        count = len(next(iter(liquids.values())))
        seeds = np.array(simulation_seeds(self.settings.seed, purpose, count), np.int64)
        outcomes = Outcomes(liquids, self.density, self.cups, seeds)
        return pour_all(outcomes, rates, self.keep, self.advance)
