"""What decides an online calibration besides plan, cups and data."""

from dataclasses import dataclass

from ..errors import InputError
from ..inputs.settings import (
    MIN_PARTICLES,
    MIN_SIMULATIONS,
    SURROGATES,
    at_least,
    one_of,
)
from ..pouring.map import LEAST_POURS, POURS

STOPS = ("bound", "mean")


@dataclass(frozen=True)
class OnlineSettings:
    """What decides an online calibration besides plan, cups and data.

    Attributes:
        target: Spilled fraction under which stirring may end.
        stop: What must be under it: "bound", the spilled fraction that one pour in twenty exceeds,
            or "mean", the expected one.
        least_strokes: That must be finished before stirring may end. After the first ones the
            posterior is often wide, and sometimes wrong: nine see the cup from all sides.
        design: Simulations all over the prior, made before the robot moves.
        budget: Simulations in all.
        batch: Simulations side by side while the robot stirs, each on a core of its own.
        surrogate: "discrepancy", the paper's, or "signal", which emulates the inclination itself.
        particles: Of the simulated liquid.
        pours: Of the spillage map.
        seed: Of everything random.
    """

    target: float = 0.05
    stop: str = "bound"
    least_strokes: int = 9
    design: int = 16
    budget: int = 48
    batch: int = 1
    surrogate: str = "discrepancy"
    particles: int = 1000
    pours: int = POURS
    seed: int = 0

    def __post_init__(self):
        if not (isinstance(self.target, int | float) and 0.0 < self.target < 1.0):
            raise InputError(
                f"{self.target!r}",
                where=_where("target"),
                fix="give a spilled fraction between 0 and 1",
            )
        for name, choices in {"stop": STOPS, "surrogate": SURROGATES}.items():
            one_of(choices, _where(name), getattr(self, name))
        least = {
            "least_strokes": 1,
            "design": MIN_SIMULATIONS,
            "budget": self.design,
            "batch": 1,
            "particles": MIN_PARTICLES,
            "pours": LEAST_POURS,
            "seed": 0,
        }
        for name, lowest in least.items():
            at_least(lowest, _where(name), getattr(self, name))


def _where(name: str) -> str:
    return f"online setting {name}"
