"""From a posterior to the pour that is expected to spill least."""

import json
import logging
from dataclasses import asdict, replace
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from ..calibration.result import Calibration
from ..calibration.summary import refuse_bad_fit
from ..criticism.result import Criticism, calibration_to_pour
from ..errors import Argument, InputError
from ..inputs.cups import cups_of
from ..inputs.pour_table import Pours, PourTable, check_scene, table_of
from ..inputs.settings import PourSettings, Risk
from ..progress import progress_bar
from ..run.compute import open_compute
from ..run.given_pours import GIVEN_POURS, digest_of_pours, keep_pours, kept_pours
from ..run.run import Run, RunOrPath
from ..simulators import PourSimulator
from .landing_map import LandingMap, learn_map
from .parcels import Parcels
from .pours import LIQUIDS, TENTH, Draining, box_around, hold_of, joint_prior, pours_in
from .result import ActionSummary, GivenSummary, Pour, PourSummary, pour_tree
from .spillage import Judged, Surface, landing_sd

if TYPE_CHECKING:
    from ..inference.simulations import Compute, Workers
    from ..models import Cups

logger = logging.getLogger(__name__)

Draws = dict[str, NDArray[np.float64]]
"""Posterior draws of liquids, name -> (draws,)."""

JUDGE_DRAWS_FACTOR = 2
"""How many times as many draws judge the two actions as search for them."""

SEARCH_STRATUM = 1
"""Stratum of the posterior draws that choose; all others judge."""


def choose_pour(  # noqa: PLR0913  the one call that most users make
    calibration: RunOrPath,
    cups: "Cups | str | Path | None" = None,
    *,
    given: Pours | None = None,
    budget: int = PourSettings.budget,
    iterations: int = PourSettings.iterations,
    draws: int = PourSettings.draws,
    risk: Risk = "mean",
    seed: int = 0,
    force: bool = False,
    executor: "Workers | None" = None,
    timeout: float | None = None,
    progress: bool = True,
) -> Pour:
    """Choose angular velocity and distance so that little is spilled whatever the liquid is.

    A few dozen pours of liquids all over the posterior, at all angular velocities, teach a map of
    where the liquid lands (see `landing_map`). On the map every action is tried over posterior
    draws; the one whose risk is least is chosen, averaged over where the liquid may land, and
    judged on draws that it was not chosen by. How far the map is from pours that were left out
    counts in both. Pours that were made of the liquid correct the map in both (see `given`).
    Finished pours are kept in the run, and another posterior of it uses them again.

    Args:
        calibration: A calibration; a criticism, or a RUN directory, whose latest posterior is
            poured.
        cups: Source, receiver and ranges of the action, or a TOML file of them; None takes the
            bundled ones.
        given: A table of pours of the liquid that were made with these cups, or its path. The run
            keeps it; None takes the one that was given last, here or to `calibrate` or `criticise`.
        budget: Pours that are simulated at most, 24 to 100; those that the run holds already count.
        iterations: Angular velocities tried on the map, which costs next to nothing.
        draws: Posterior draws that each action is tried on; twice as many judge.
        risk: "mean", or "cvar": the mean over the worst tenth of the draws.
        seed: Seed of all random draws; the pours do not depend on it.
        force: Whether to choose even though the fit is bad, see `calibration.summary.bad_fit`.
        executor, timeout, progress: See `calibrate`.

    Raises:
        InputError: A setting, `timeout` or the file of the cups cannot be used; the fit is bad; the
            run is of another model; or another command works in it.
        ValueError, ImportError, ConnectionError: `executor` cannot be used.
        RuntimeError: Too few pours succeeded.
    """
    settings = PourSettings(budget=budget, iterations=iterations, draws=draws, risk=risk, seed=seed)
    cups = cups_of(cups)
    table = table_of(given, Argument("given"))
    if table is not None:
        check_scene(table, cups)
    with Run.entered(calibration) as run:
        latest, own = calibration_to_pour(run), calibration
        if isinstance(own, Criticism):
            own = own.calibration
        if isinstance(own, Calibration) and own.key != latest.key:
            raise InputError(
                "holds another posterior: a criticism has added to it, or draws were changed",
                where=str(run.path),
                fix="give the RUN directory",
            )
        if not force:
            refuse_bad_fit(latest.summary, run.path)
        counted = _counted(run.path, cups, table)
        with open_compute(executor, timeout) as compute:
            if table is not None:
                keep_pours(run.path, table, cups)
            pour = decided(latest, cups, settings, compute, counted, progress=progress)
        made_from = {
            "after": latest.key,
            "given": digest_of_pours(run.path),
            "effects": run.own_effects(),
            "settings": asdict(settings),
            "cups": cups.settings(),
            "forced": force,
        }
        run.keep("pour", pour.tree, made_from, pour.summary.to_json())
        return pour


def _counted(run: Path, cups: "Cups", given: PourTable | None) -> PourTable | None:
    """The given pours that count with these cups, or those that the run keeps; logs the others."""
    if (table := given or kept_pours(run, cups)) is None:
        if (run / GIVEN_POURS).is_file():
            logger.warning("%s: its pours were made with other cups; not used", run / GIVEN_POURS)
        return None
    inside, there = table.within(cups), len(table.lines)
    if not len(inside.lines):
        raise InputError(
            f"none of its {there} pours is in the range of actions that the cups allow",
            where=str(table.path),
            fix="widen the range in the cups file, or give other pours",
        )
    if outside := there - len(inside.lines):
        what = "%s: %d of %d pours are outside of the actions that the cups allow; not used"
        logger.warning(what, table.path, outside, there)
    return inside


def decided(
    calibration: Calibration,
    cups: "Cups",
    settings: PourSettings,
    compute: "Compute",
    given: PourTable | None = None,
    *,
    progress: bool = False,
) -> Pour:
    """The pour of a posterior; pours are kept in the run's bank, and nothing else is written.

    Args:
        calibration, cups, settings, compute: See `choose_pour`.
        given: Pours of the liquid that were made, all of them within the range of the cups.
        progress: Whether to show bars on stderr.

    Raises:
        InputError, RuntimeError: See `choose_pour`.
    """
    search, judge = strata(calibration, settings.draws, settings.seed)
    seed, density = settings.seed, calibration.liquid_density
    with calibration.run.bank() as bank:
        own = replace(compute, bank=bank)
        simulated = learned = _learned(calibration, cups, settings, own, progress)
        if given is not None:
            learned = simulated.corrected(given, search, seed=seed)
        at_best = {name: np.array([value]) for name, value in calibration.best.items()}

        def surface(on: LandingMap, liquids: Draws) -> Surface:
            return on.surface(liquids, rates=settings.iterations, seed=seed)

        def least(tried: Surface) -> Judged:
            return learned.judge(tried.least(settings.risk), judge, seed=seed)

        tried = {"actions": surface(learned, search), "actions_plug_in": surface(learned, at_best)}
        chosen, plug_in = (least(one) for one in tried.values())
        hold = None
        if chosen.fractions[:, 2].mean() > TENTH:
            draining = PourSimulator(cups, density, Draining(), learned.box.effects)
            with progress_bar("holding the source", LIQUIDS, shown=progress) as advance:
                hold = hold_of(draining, chosen.angular_velocity, search, own, advance)
    corrected = None
    if learned.given is not None:
        without = least(surface(simulated, search))
        corrected = GivenSummary.of(learned.given, chosen, without)
    summary = PourSummary.of(
        chosen,
        plug_in=ActionSummary.of(plug_in),
        risk=settings.risk,
        seed=seed,
        n_simulations=learned.pours,
        map_error=learned.rms_error,
        least_viscosity=cups.least_viscosity(density),
        fit_status=calibration.summary.fit_status,  # a bad fit was poured by force
        given=corrected,
        hold=hold,
    )
    tree = pour_tree({"chosen": chosen, "plug_in": plug_in}, tried, search, learned, settings.risk)
    tree.attrs.update(
        asdict(settings),
        cups=json.dumps(cups.settings()),
        least_viscosity=summary.least_viscosity,
        landing_sd=landing_sd(cups),
        map_error=summary.map_error,
        fit_status=str(summary.fit_status),
    )
    return Pour(calibration.run, chosen, plug_in, tree, summary)


def _learned(
    calibration: Calibration,
    cups: "Cups",
    settings: PourSettings,
    compute: "Compute",
    progress: bool,
) -> LandingMap:
    """The map of landings around a posterior; what the run's bank holds is not poured again."""
    draws = {str(name): v.to_numpy().ravel() for name, v in calibration.posterior.items()}
    box = box_around(joint_prior(calibration.prior, draws, cups), draws, calibration.best)
    pours = PourSimulator(cups, calibration.liquid_density, Parcels(), box.effects)
    with progress_bar("pouring", settings.budget, shown=progress) as advance:
        poured = pours_in(box, pours, settings.budget, compute, advance)
    return learn_map(box, cups, poured)


def strata(calibration: Calibration, draws: int, seed: int) -> tuple[Draws, Draws]:
    """Draws to search with and draws to judge by; they share none, so the judge chose nothing.

    Raises:
        InputError: The posterior has too few draws.
    """
    groups = 1 + JUDGE_DRAWS_FACTOR
    needed, there = groups * draws, next(iter(calibration.posterior.values())).size
    if needed > there:
        raise InputError(
            f"{draws!r} needs {needed} posterior draws, the run has {there}",
            where="draws",
            fix=f"give {there // groups} at most, or calibrate with more draws",
        )
    drawn = calibration.draws(needed, seed)
    searches = np.arange(needed) % groups == SEARCH_STRATUM
    search, judge = (
        {name: values[chosen] for name, values in drawn.items()} for chosen in (searches, ~searches)
    )
    return search, judge
