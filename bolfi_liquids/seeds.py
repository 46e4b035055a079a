"""Seeds of what is random outside of the engine, each from the run's seed and a named phase."""

from enum import Enum

import numpy as np


class Phase(Enum):
    """Purpose of random numbers; its text is part of their seed and must not change."""

    BOOTSTRAP = "bootstrap"
    DRAINING = "pours whose source is held for long"
    GIVEN_POURS = "errors of given pours that outcomes meet"
    MOVING_PICTURES = "moving pictures"
    MAP_DESIGN = "design of the map of landings"
    MAP_MISSES = "misses of the map that draws meet"
    MAP_POURS = "pours of the map of landings"
    ONLINE_SEARCH = "search while the robot stirs"
    ONLINE_STIRS = "stirs while the robot stirs"
    POSTERIOR_DRAWS = "posterior draws"
    REPLICATES = "replicates at the best parameters"
    RUNS_OF_POURS = "packings of a table's pours"
    SBC_DESIGN = "design that calibrations share"
    SBC_SEARCH = "search among shared stirs"
    SBC_STIRS = "stirs that calibrations share"


def generator(seed: int, phase: Enum, *numbers: int) -> np.random.Generator:
    """Random numbers of a phase.

    Args:
        seed: Seed of the run.
        phase: What they are for.
        numbers: Tell apart the steps of one phase.
    """
    return np.random.default_rng(_sequence(seed, phase, numbers))


def simulation_seeds(seed: int, phase: Enum, count: int, *numbers: int) -> list[int]:
    """Seeds of simulations in [0, 2^31), others for every phase; the first do not depend on count.

    Args:
        seed: Seed of the run.
        phase: What the simulations are for.
        count: Number of seeds.
        numbers: Tell apart the steps of one phase.
    """
    words = _sequence(seed, phase, numbers).generate_state(count)
    return [int(word >> 1) for word in words]


def _sequence(seed: int, phase: Enum, numbers: tuple[int, ...]) -> np.random.SeedSequence:
    text = " ".join([phase.value, *map(str, numbers)])
    return np.random.SeedSequence([seed, *text.encode()])
