"""How much of a liquid stays in a cup that it sticks to, and how that drains."""

import numpy as np

from ...cups import Cups
from ...fluid.liquid import Liquid
from ...pouring import PourAction, pour
from ..case import Case, CaseResult, Curve, Panel, Progress, Row

CUPS = Cups.model_validate(
    {
        "source": {"radius": 0.028, "height": 0.06, "fill": 0.034},
        "receiver": {"radius": 0.035, "height": 0.07},
        "pour": {
            "lip_height": 0.2,
            "final_angle_deg": 135.0,
            "hold": 0.9,
            "angular_velocity_deg_s": (30.0, 180.0),
            "distance": (0.0, 0.07),
        },
    }
)
ACTION = PourAction(angular_velocity=np.pi, distance=0.02)
VISCOSITY = np.array([0.01, 0.1, 1.0])
ADHESION = (0.0, 0.5, 1.0)
HOLDS = (0.9, 2.9, 5.9)  # s
THIN = 0.1  # Pa s; without adhesion nothing of what is thinner stays
FILM = 0.1  # of the liquid at adhesion 1, at least
DENSITY, SEEDS = 1000.0, 2
TOLERANCE = 0.005  # a few particles


def retained(adhesion: float, hold: float, seed: int) -> np.ndarray:
    """Fractions by viscosity, the mean over packings."""
    plan = CUPS.pour.model_copy(update={"hold": hold})
    cups = CUPS.model_copy(update={"pour": plan})
    liquid = Liquid(np.tile(VISCOSITY, SEEDS), 0.0, DENSITY, adhesion=adhesion)
    seeds = np.repeat(seed * SEEDS + np.arange(SEEDS), len(VISCOSITY))
    return pour(liquid, ACTION, cups, seeds).retained.reshape(SEEDS, -1).mean(axis=0)


def run(progress: Progress, seed: int) -> CaseResult:
    """Retained fractions by adhesion, hold and viscosity."""
    left = np.empty((len(ADHESION), len(HOLDS), len(VISCOSITY)))
    for a, adhesion in enumerate(ADHESION):
        for h, hold in enumerate(HOLDS):
            left[a, h] = retained(adhesion, hold, seed)
            progress((a * len(HOLDS) + h + 1) / left[..., 0].size)
    thin = float(left[0, 0, VISCOSITY <= THIN].max())
    film = float(left[-1, 0].min())
    falls = {
        "least film at adhesion 1, short of 0.1": max(FILM - film, 0.0),
        "largest fall with viscosity": _fall(left, axis=2),
        "largest fall with adhesion": _fall(left, axis=0),
        "largest growth while it drains": _fall(-left, axis=1),
    }
    rows = [Row.absolute(f"retained below {THIN:g} Pa s at adhesion 0", 0.0, thin, TOLERANCE)]
    rows += [Row.absolute(name, 0.0, value, TOLERANCE) for name, value in falls.items()]
    panels = tuple(
        Panel(
            "hold [s]",
            f"retained at adhesion {adhesion:g}",
            tuple(
                Curve(f"{v:g} Pa s", HOLDS, left[a, :, k], series=k)
                for k, v in enumerate(VISCOSITY)
            ),
        )
        for a, adhesion in enumerate(ADHESION)
    )
    return CaseResult(tuple(rows), panels, {"retained": left.tolist()})


def _fall(values: np.ndarray, axis: int) -> float:
    return float(np.maximum(-np.diff(values, axis=axis), 0.0).max())


CASE = Case(
    name="adhesion",
    title="Liquid that sticks to its cup",
    truth="a film stays, more of a viscous liquid and of a stickier one, and drains",
    source="Jeffreys 1930 for the order; the amounts are the model's own scale of adhesion",
    unit="fraction",
    tolerance=TOLERANCE,
    settings={"viscosity": VISCOSITY.tolist(), "adhesion": ADHESION, "holds": HOLDS},
    run=run,
)
