"""Gels and shear-thinning liquids pushed through a channel, against their profiles."""

from typing import NamedTuple

import numpy as np

from ...effects.shear_thinning import ONSET_TIME
from ...fluid.liquid import Liquid
from ..analysis.profiles import binned_profile
from ..case import Case, CaseResult, Curve, Panel, Progress, Row
from ..scenes.channel import Channel, Drive, channel_flow
from ..truths.generalised_flows import generalised_channel, herschel_bulkley_channel


class Flow(NamedTuple):
    """Viscosity at rest [Pa s], yield stress [Pa], 1 - n, and force per mass [m/s²]."""

    viscosity: float
    yield_stress: float
    thinning: float
    push: float


DENSITY = 1000.0
GELS = (Flow(2.0, 10.0, 0.0, 1.0), Flow(2.0, 20.0, 0.0, 1.0))
THINNING = (Flow(3.0, 0.0, 0.3, 1.0), Flow(10.0, 0.0, 0.5, 1.0), Flow(5.0, 0.0, 0.5, 0.5))
CHANNEL = Channel(layers=12)
TIMES = np.linspace(4.0, 6.0, 5)  # s; a channel's time of diffusion is below 0.4 s
PACKINGS = 4  # of each flow; from one to the next the speed in the middle differs by 5 %
TOLERANCE = 0.1  # of the speed in the middle


def truth(flow: Flow, z: np.ndarray) -> np.ndarray:
    """Velocity [m/s] at z."""
    gap, gradient = CHANNEL.gap, DENSITY * flow.push
    if flow.yield_stress:
        return herschel_bulkley_channel(
            z,
            gap=gap,
            gradient=gradient,
            consistency=flow.viscosity,
            yield_stress=flow.yield_stress,
        )

    def carreau(rate: float) -> float:
        return flow.viscosity * (1.0 + (ONSET_TIME * rate) ** 2) ** (-0.5 * flow.thinning)

    return generalised_channel(z, gap=gap, gradient=gradient, viscosity=carreau)


def simulated(flows: tuple[Flow, ...], effect: str, coefficient: list[float], seed: int):
    """Heights and velocities, of shape [B, particles of all packings and times] each."""
    push = np.repeat([flow.push for flow in flows], PACKINGS)
    profiles = channel_flow(
        CHANNEL,
        Liquid(np.repeat([flow.viscosity for flow in flows], PACKINGS), 0.0, DENSITY),
        Drive(np.zeros_like(push), push, np.zeros_like),
        TIMES,
        effects={effect: np.repeat(coefficient, PACKINGS)},
        seed=seed,
    )
    return (np.moveaxis(a, 1, 0).reshape(len(flows), -1) for a in profiles)


def run(progress: Progress, seed: int) -> CaseResult:
    """Profiles; the layer of particles at each wall, half of it inside its friction, is left
    out of the largest error, as one bin cannot follow the slope there."""
    groups = (
        (GELS, "yield_stress", [flow.yield_stress for flow in GELS]),
        (THINNING, "shear_thinning", [flow.thinning for flow in THINNING]),
    )
    rows, panels = [], []
    for number, (flows, effect, coefficient) in enumerate(groups):
        z, u = simulated(flows, effect, coefficient, seed)
        curves = []
        for k, flow in enumerate(flows):
            profile = binned_profile(z[k], u[k], 0.0, CHANNEL.gap, CHANNEL.layers)
            expected = truth(flow, profile.at)
            middle = float(truth(flow, np.array([CHANNEL.gap / 2]))[0])
            off = (profile.mean - expected)[1:-1] / middle
            name = f"{effect} {coefficient[k]:g}, {flow.viscosity:g} Pa s"
            worst = float(np.abs(off).max())
            rows += [
                Row.relative(
                    f"speed in the middle, {name} [m/s]",
                    middle,
                    float(profile.mean.max()),
                    TOLERANCE,
                ),
                Row(f"largest error of the profile, {name}", 0.0, worst, worst, TOLERANCE),
            ]
            fine = np.linspace(0.0, CHANNEL.gap, 200)
            curves += [
                Curve(name, 100.0 * fine, truth(flow, fine), truth=True, series=k),
                Curve("", 100.0 * profile.at, profile.mean, series=k),
            ]
        panels.append(Panel("height [cm]", "velocity [m/s]", tuple(curves)))
        progress((number + 1) / len(groups))
    return CaseResult(tuple(rows), tuple(panels))


CASE = Case(
    name="herschel_bulkley",
    title="Gels and shear-thinning liquids in a channel",
    truth="the profile that carries a stress linear across the gap",
    source="Bird, Dai & Yarusso 1983, Rev. Chem. Eng. 1, 1; Carreau 1972",
    unit="relative",
    tolerance=TOLERANCE,
    settings={
        "gels": GELS,
        "thinning": THINNING,
        "layers": CHANNEL.layers,
        "packings": PACKINGS,
    },
    run=run,
)
