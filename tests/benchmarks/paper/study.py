"""Spillage after calibrating in several ways, on truths that are known."""

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np
from bolfi_liquids.inference.simulations import Compute, jobs, run_missing
from numpy.typing import NDArray
from xarray import Dataset

from bolfi_liquids.inputs.prior import default_prior
from bolfi_liquids.pouring.landing_map import LandingMap
from bolfi_liquids.progress import progress_bar

from .calibrations import DRAWS_EACH, PARAMETER_NAMES, Learner
from .decisions import RULES, Action, decide, decide_unknowing, execute, tried
from .study_size import Scale
from .truths import Truths, draw_truths


def spillage_study(
    learners: Mapping[str, Learner], landing_map: LandingMap, scale: Scale, compute: Compute
) -> Dataset:
    """Spilled fractions over (learned_by, rule, truth, budget).

    Beside them `known`, with the liquid known, and `unknown`, without any calibration.

    Args:
        learners: By name, with the same budgets.
        landing_map: By which actions are chosen, and with whose cups they are carried out.
        scale: How many of what.
        compute: Where simulations and calibrations are made and kept.
    """
    truths = draw_truths(scale.repetitions, scale.seed)
    unknowing = decide_unknowing(landing_map, default_prior(), scale.seed)
    concluded = {
        name: conclusions(learner, name, truths, compute) for name, learner in learners.items()
    }
    (budgets,) = {learner.budgets for learner in learners.values()}
    return _judged(truths, landing_map, unknowing, concluded, budgets, compute)


def conclusions(
    learner: Learner, name: str, truths: Truths, compute: Compute
) -> list[NDArray | None]:
    """Of each truth; None where its calibration failed."""
    asked = jobs(truths.theta, truths.seed)
    with progress_bar(f"calibrating ({name})", len(asked), shown=True) as advance:
        one_each = replace(compute, batch=1)
        found = run_missing(
            learner.simulate, asked, one_each, identity=learner.identity, advance=advance
        )
    return [result.signal for result in found]


def _judged(
    truths: Truths,
    landing_map: LandingMap,
    unknowing: Action,
    concluded: Mapping[str, list[NDArray | None]],
    budgets: tuple[int, ...],
    compute: Compute,
) -> Dataset:
    shape = len(concluded), len(RULES), len(truths.seed), len(budgets)
    chosen = [
        (learner, rule, at, n, action)
        for learner, made in enumerate(concluded.values())
        for at, found in enumerate(made)
        if found is not None
        for n in range(len(budgets))
        for rule, action in enumerate(decide(found[n], landing_map).values())
    ]
    actions: list[list[Action]] = []
    for at in range(len(truths.seed)):
        own = {name: values[at : at + 1] for name, values in truths.theta.items()}
        mine = [action for _, _, truth, _, action in chosen if truth == at]
        actions.append([tried(landing_map, own).least("mean"), unknowing, *mine])
    with progress_bar("pouring what was chosen", len(truths.seed), shown=True) as advance:
        spilled = execute(truths, actions, landing_map, compute, advance)
    values, rates, distances = (np.full(shape, np.nan) for _ in range(3))
    for at, outcome in enumerate(spilled):
        mine = [row for row in chosen if row[2] == at]
        for (learner, rule, _, n, action), fraction in zip(mine, outcome[2:], strict=True):
            values[learner, rule, at, n] = fraction
            rates[learner, rule, at, n] = action["angular_velocity"]
            distances[learner, rule, at, n] = action["distance"]
    dims = ("learned_by", "rule", "truth", "budget")
    learned = np.stack([_stacked(made, len(budgets)) for made in concluded.values()])
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
            "learned_by": list(concluded),
            "rule": list(RULES),
            "budget": list(budgets),
            "liquid": ("truth", truths.liquid.astype(str)),
            "repetition": ("truth", truths.repetition),
            "viscosity": ("truth", truths.viscosity, {"units": "Pa s"}),
            "cohesion": ("truth", truths.cohesion),
            "parameter": ["viscosity", "cohesion"],
        },
    )


def _stacked(found: Sequence[NDArray | None], budgets: int) -> NDArray[np.float64]:
    """Conclusions with NaN in the place of failed ones."""
    empty = np.full((budgets, 1 + DRAWS_EACH, len(PARAMETER_NAMES)), np.nan)
    return np.stack([empty if one is None else one for one in found])
