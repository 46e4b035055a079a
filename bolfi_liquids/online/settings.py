"""Settings of an online calibration, beside plan, cups and data."""

from typing import Annotated

from pydantic import Field

from ..errors import InputError
from ..inputs.settings import (
    MAX_COUNT,
    MIN_MAP_POURS,
    PRIOR_POURS,
    Count,
    Integer,
    Particles,
    Seed,
    Simulations,
    checked,
)

WHERE = "online setting {}"


@checked(WHERE)
class OnlineSettings:
    """Settings of an online calibration, beside plan, cups and data.

    Attributes:
        target: Stirring may end where only one pour in twenty spills more than this fraction.
        least_strokes: Strokes that must be finished before stirring may end. After the first ones
            the posterior is often wide, and sometimes wrong: nine see the cup from all sides.
        design: Simulations all over the prior, made before the robot moves.
        budget: Simulations in all.
        in_flight: Simulations made together while the robot stirs; each occupies a core.
        particles: Number of particles of the simulated liquid; 0: cells follow the stick.
        pours: Number of pours from which a map of landings is learned, of all liquids of the prior.
        seed: Seed of all random draws.
    """

    target: Annotated[float, Field(gt=0.0, lt=1.0)] = 0.05
    least_strokes: Count = 9
    design: Simulations = 16
    budget: Simulations = 48
    in_flight: Count = 1
    particles: Particles = 0
    pours: Annotated[Integer, Field(ge=MIN_MAP_POURS, le=MAX_COUNT)] = PRIOR_POURS
    seed: Seed = 0

    def __post_init__(self):
        if self.budget < self.design:
            raise InputError(
                f"{self.budget} simulations in all, fewer than the {self.design} of the design",
                where=WHERE.format("budget"),
                fix="give a larger budget or a smaller design",
            )
