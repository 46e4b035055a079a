"""Pours chosen from posteriors, and what they spill when they are carried out."""

from collections.abc import Iterable, Mapping, Sequence

import numpy as np
from bolfi_liquids.inference import Prior
from bolfi_liquids.inference.simulations import Compute
from bolfi_liquids.models import Cups
from numpy.typing import NDArray

from bolfi_liquids.inputs.cups import bundled_cups
from bolfi_liquids.inputs.prior import default_prior
from bolfi_liquids.pouring.landing_map import LandingMap, learn_map
from bolfi_liquids.pouring.parcels import Parcels
from bolfi_liquids.pouring.pours import joint_prior, pours_in, whole
from bolfi_liquids.pouring.spillage import (
    DISTANCE_STEP,
    Profiles,
    Surface,
)
from bolfi_liquids.progress import Advance, silent
from bolfi_liquids.seeds import generator, simulation_seeds
from bolfi_liquids.simulators import PourSimulator

from .calibrations import PARAMETER_NAMES
from .outcomes import Outcomes, pour_all
from .phases import Phase
from .truths import DENSITY, Truths

RULES = ("plug_in", "mean", "cvar")
"""The best pour at theta*, as in the paper; least expected spillage over the posterior; least mean
spillage over the worst tenth of its draws."""

RATES = 12  # angular velocities; each that is chosen is poured for every truth
PRIOR_DRAWS = 64  # draws of the prior over which a pour is chosen without any calibration
EXECUTION_SEEDS = 4  # seeds with which a chosen pour is carried out

Action = Mapping[str, float]


def map_of_all_liquids(count: int, compute: Compute, advance: Advance = silent) -> LandingMap:
    """The map of the default prior and the bundled cups, learned from `count` pours."""
    cups = bundled_cups()
    box = whole(joint_prior(default_prior(), (), cups))
    pours = PourSimulator(cups, DENSITY, Parcels())
    return learn_map(box, cups, pours_in(box, pours, count, compute, advance))


def decide(concluded: NDArray, landing_map: LandingMap) -> dict[str, Action]:
    """The action of each rule, from theta* and draws, shape (1 + draws, 2)."""
    liquids = dict(zip(PARAMETER_NAMES, concluded.T, strict=True))
    best = {name: values[:1] for name, values in liquids.items()}
    over = tried(landing_map, {name: values[1:] for name, values in liquids.items()})
    return {
        "plug_in": tried(landing_map, best).least("mean"),
        "mean": over.least("mean"),
        "cvar": over.least("cvar"),
    }


def decide_unknowing(landing_map: LandingMap, prior: Prior, seed: int) -> dict[str, float]:
    """The action that spills least in expectation over the prior."""
    drawn = prior.from_unit(
        generator(seed, Phase.UNKNOWING).uniform(size=(PRIOR_DRAWS, len(prior)))
    )
    return tried(landing_map, drawn).least("mean")


def tried(landing_map: LandingMap, liquids: Mapping[str, NDArray]) -> Surface:
    """What the actions spill that a study chooses among."""
    return landing_map.surface(liquids, rates=RATES)


def execute(
    truths: Truths,
    actions: Iterable[Iterable[Action]],
    landing_map: LandingMap,
    compute: Compute,
    advance: Advance,
) -> list[NDArray[np.float64]]:
    """Spilled fraction of each action, the mean over seeds that nothing else uses.

    Args:
        truths: n liquids.
        actions: Those of each.
        landing_map: Its cups are poured.
        compute: Where pours are made and kept.
        advance: Called after each truth.
    """
    spilled = []
    for at, chosen in enumerate(actions):
        theta = {name: float(values[at]) for name, values in truths.theta.items()}
        outcomes = executions(theta, DENSITY, landing_map.cups, int(truths.seed[at]))
        spilled.append(spilled_by(outcomes, list(chosen), compute))
        advance(1)
    return spilled


def executions(
    theta: Mapping[str, float],
    density: float,
    cups: Cups,
    seed: int,
    purpose: Phase = Phase.EXECUTION,
) -> Outcomes:
    """Pours of one liquid, with seeds that nothing else uses.

    Args:
        theta: Its parameters, and coefficients of effects.
        density: [kg/m3].
        cups: From and into which is poured.
        seed: Of the truth.
        purpose: Another one lets an action be chosen by other pours.
    """
    seeds = np.array(simulation_seeds(seed, purpose, EXECUTION_SEEDS), np.int64)
    tiled = {name: np.full(EXECUTION_SEEDS, value) for name, value in theta.items()}
    return Outcomes(tiled, density, cups, seeds)


def spilled_by(
    outcomes: Outcomes, actions: Sequence[Action], compute: Compute
) -> NDArray[np.float64]:
    """Spilled fraction of each action, the mean over the outcomes' seeds."""
    rates = np.unique([action["angular_velocity"] for action in actions])
    made = pour_all(outcomes, rates, compute, silent)
    return np.array([_spilled(made, action) for action in actions])


def _spilled(made: Profiles, action: Action) -> float:
    row = np.flatnonzero(np.isclose(made.angular_velocity, action["angular_velocity"]))
    column = int(np.argmin(np.abs(made.distance - action["distance"])))
    if len(row) == 0 or abs(made.distance[column] - action["distance"]) > DISTANCE_STEP:
        return float("nan")  # its pours failed
    return float(made.fractions[row[0], :, column, 0].mean())
