"""Spillage after calibrating by stirring and by pouring, on truths that are known."""

from collections.abc import Sequence
from concurrent.futures import Executor
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from ..bundled import bundled_recording
from ..prior import default_prior
from ..progress import progress_bar
from ..stirring import stirring_of
from ..worker_processes import processes, processors
from .calibrations import ByPouring, ByStirring
from .decisions import RULES, Action, decide, decide_unknowing, execute
from .truths import Truths, draw_truths

if TYPE_CHECKING:
    from xarray import Dataset

    from ..inference import Prior, SimulationBank
    from ..pour_grid import PourGrid
    from .scale import Scale

METHODS = ("signal", "discrepancy", "pour")
"""Stirring with either surrogate, and pouring as the paper's reference does."""

PARTICLES = 1000


@dataclass(frozen=True, eq=False)
class Tasks:
    """What all methods share.

    Attributes:
        truths: The liquids.
        grid: Of pours, by which actions are chosen.
        bank: Where all simulations are kept.
    """

    truths: Truths
    grid: "PourGrid"
    bank: "SimulationBank"


def spillage_study(
    bank: "SimulationBank", grid: "PourGrid", scale: "Scale", *, progress: bool = True
) -> "Dataset":
    """Spilled fractions over (learned_by, rule, truth, budget).

    Beside them `known`, with the liquid known, and `unknown`, without any calibration.

    Args:
        bank: Where all simulations and calibrations are kept.
        grid: Of pours, by which actions are chosen, and with whose cups they are carried out.
        scale: How many of what.
        progress: Show bars on stderr.
    """
    prior = default_prior()
    truths = draw_truths(scale.repetitions, scale.seed)
    cups = grid.cups
    tasks = Tasks(truths, grid, bank)
    stirring = stirring_of([bundled_recording("water")], PARTICLES)
    middle = np.sqrt(np.prod(cups.angular_velocity_range)), np.mean(cups.distance_range)
    learners = {
        "signal": ByStirring(stirring, prior, "signal", scale.budgets),
        "discrepancy": ByStirring(stirring, prior, "discrepancy", scale.budgets),
        "pour": ByPouring(cups, prior, float(middle[0]), float(middle[1]), scale.budgets),
    }
    with processes() as pool:
        concluded = {
            name: conclusions(learner, name, tasks, pool, progress=progress)
            for name, learner in learners.items()
        }
    return _judged(tasks, prior, concluded, scale, progress)


def conclusions(
    learner: ByStirring | ByPouring,
    name: str,
    tasks: Tasks,
    pool: Executor | None,
    *,
    progress: bool,
) -> list[NDArray | None]:
    """Of each truth; None where its calibration failed."""
    from ..inference import Job, run_missing

    truths = tasks.truths
    jobs = [
        Job({key: float(values[at]) for key, values in truths.theta.items()}, int(seed))
        for at, seed in enumerate(truths.seed)
    ]
    found, at_once = [], 2 * processors()
    with progress_bar(f"calibrating ({name})", len(jobs), shown=progress) as advance:
        for start in range(0, len(jobs), at_once):
            part = jobs[start : start + at_once]
            found += run_missing(learner.simulate, part, None, tasks.bank, learner.identity, pool)
            advance(len(part))
    return [result.signal for result in found]


def _judged(
    tasks: Tasks,
    prior: "Prior",
    concluded: dict[str, list[NDArray | None]],
    scale: "Scale",
    progress: bool,
) -> "Dataset":
    from xarray import Dataset

    truths, grid = tasks.truths, tasks.grid
    shape = len(METHODS), len(RULES), len(truths.seed), len(scale.budgets)
    chosen = [
        (method, rule, at, n, action)
        for method, name in enumerate(METHODS)
        for at, found in enumerate(concluded[name])
        if found is not None
        for n in range(len(scale.budgets))
        for rule, action in enumerate(decide(found[n], grid).values())
    ]
    unknowing = decide_unknowing(grid, prior, scale.seed)
    actions: list[list[Action]] = []
    for at in range(len(truths.seed)):
        own = {name: values[at : at + 1] for name, values in truths.theta.items()}
        mine = [action for _, _, truth, _, action in chosen if truth == at]
        actions.append([grid.surface(own).least("mean"), unknowing, *mine])
    with progress_bar("pouring what was chosen", len(truths.seed), shown=progress) as advance:
        spilled = execute(truths, actions, grid, tasks.bank, advance)
    values, rates, distances = (np.full(shape, np.nan) for _ in range(3))
    for at, outcome in enumerate(spilled):
        mine = [row for row in chosen if row[2] == at]
        for (method, rule, _, n, action), fraction in zip(mine, outcome[2:], strict=True):
            values[method, rule, at, n] = fraction
            rates[method, rule, at, n] = action["angular_velocity"]
            distances[method, rule, at, n] = action["distance"]
    dims = ("learned_by", "rule", "truth", "budget")
    learned = np.stack([_stacked(concluded[name], shape[3]) for name in METHODS])
    return Dataset(
        {
            "spilled": (dims, values),
            "angular_velocity": (dims, rates, {"units": "rad s-1"}),
            "distance": (dims, distances, {"units": "m"}),
            "known": ("truth", np.array([outcome[0] for outcome in spilled])),
            "unknown": ("truth", np.array([outcome[1] for outcome in spilled])),
            "concluded": (("learned_by", "truth", "budget", "draw", "parameter"), learned),
        },
        coords={
            "learned_by": list(METHODS),
            "rule": list(RULES),
            "budget": list(scale.budgets),
            "liquid": ("truth", truths.liquid.astype(str)),
            "repetition": ("truth", truths.repetition),
            "viscosity": ("truth", truths.viscosity, {"units": "Pa s"}),
            "cohesion": ("truth", truths.cohesion),
            "parameter": ["viscosity", "cohesion"],
        },
    )


def _stacked(found: Sequence[NDArray | None], budgets: int) -> NDArray[np.float64]:
    """Conclusions with NaN in the place of failed ones."""
    from .calibrations import DRAWS, NAMES

    empty = np.full((budgets, 1 + DRAWS, len(NAMES)), np.nan)
    return np.stack([empty if one is None else one for one in found])
