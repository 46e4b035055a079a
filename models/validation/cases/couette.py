"""Effective viscosity of a flow that a moving plate sets up, and the shear it ends with."""

import numpy as np

from ..analysis.profiles import binned_profile, fit_couette, fit_kinematic_viscosity
from ..case import Case, CaseResult, Curve, Panel, Progress, Row
from ..truths.shear_flows import couette_startup, couette_steady
from . import _channel
from ._channel import APART, CHANNEL, DENSITY, LOOKS, PACKINGS, SPEED, VISCOSITY

# times in gap² / ν: from a layer that particles resolve, until it has reached the plate at rest
BEGIN, END = 0.02, 0.1
LONGEST = 6.0  # s
STEADY = 2.0  # s before the first look at the steady flow
TOLERANCE = 0.1
RATE = CHANNEL.numerics.substep_rate(CHANNEL.spacing)


def startup(z: np.ndarray, time: float, kinematic: float) -> np.ndarray:
    """Velocity [m/s] at heights of any shape, `time` [s] after the plate started."""
    rest = {"gap": CHANNEL.gap, "speed": SPEED, "kinematic": kinematic}
    return couette_startup(np.ravel(z), time, **rest).reshape(np.shape(z))


def grown(viscosity: float, seed: int) -> tuple[float, Curve, Curve]:
    """Viscosity [Pa s] with which the sheared layer grew, and its profiles."""
    kinematic = viscosity / DENSITY
    unit = CHANNEL.gap**2 / kinematic
    begin = BEGIN * unit
    seconds = min(LONGEST, (END - BEGIN) * unit)
    looks = seconds * np.linspace(0.75, 1.0, 4)

    def start(z: np.ndarray) -> np.ndarray:
        return startup(z, begin, kinematic)

    flow = _channel.flow(viscosity, (SPEED, 0.0), start, looks, seed)
    # the time that the start stands for depends on the viscosity: fit what came after it
    z, late = flow.z.reshape(len(looks), -1), flow.velocity.reshape(len(looks), -1)

    def shape(nu: float) -> np.ndarray:
        times = begin * kinematic / nu + np.rint(looks * RATE) / RATE
        return np.stack([startup(row, t, nu) for row, t in zip(z, times, strict=True)])

    fit = fit_kinematic_viscosity(shape, late, 0.2 * kinematic, 5.0 * kinematic)
    profile = binned_profile(z[-1], late[-1], 0.0, CHANNEL.gap, CHANNEL.layers)
    fine = np.linspace(0.0, CHANNEL.gap, 60)
    truth = startup(fine, begin + looks[-1], kinematic)
    return (
        DENSITY * fit.kinematic,
        Curve("", fine / CHANNEL.gap, truth / SPEED, truth=True),
        Curve(f"{viscosity:g} Pa s", profile.at / CHANNEL.gap, profile.mean / SPEED),
    )


def run(progress: Progress, seed: int) -> CaseResult:
    """How a layer grows, then the shear rate of the steady flow."""
    rows, curves = [], []
    for number, viscosity in enumerate(VISCOSITY):
        name = f"{viscosity:g} Pa s"
        ours, truth, seen = grown(viscosity, seed)
        rows.append(
            Row.relative(f"{name} by the layer's growth [Pa s]", viscosity, ours, TOLERANCE)
        )

        def start(z: np.ndarray) -> np.ndarray:
            return couette_steady(z, CHANNEL.gap, SPEED)

        looks = STEADY + APART * np.arange(LOOKS)
        flow = _channel.flow(viscosity, (SPEED, 0.0), start, looks, seed)
        fit = fit_couette(flow.z.ravel(), flow.velocity.ravel(), CHANNEL.gap, SPEED)
        rate = SPEED / CHANNEL.gap
        rows.append(Row.relative(f"shear rate at {name} [1/s]", rate, fit.shear_rate, TOLERANCE))
        curves += [curve._replace(series=number) for curve in (truth, seen)]
        progress((number + 1) / len(VISCOSITY))
    panel = Panel("height / gap", "velocity / plate's, while the layer grows", tuple(curves))
    return CaseResult(tuple(rows), (panel,))


CASE = Case(
    name="couette",
    title="Flow between plates, driven by one of them",
    truth="a layer that grows with the viscosity asked for, and an even shear in the end",
    source="Batchelor 1967, section 4.3; Morris, Fox & Zhu 1997, J. Comput. Phys. 136, 214",
    unit="relative",
    tolerance=TOLERANCE,
    settings={
        "viscosity": VISCOSITY,
        "spacing": CHANNEL.spacing,
        "layers": CHANNEL.layers,
        "speed": SPEED,
        "packings": PACKINGS,
        "span": (BEGIN, END, LONGEST, STEADY),
    },
    run=run,
)
