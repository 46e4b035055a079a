"""The stir of a hidden liquid: simulated before the session, replayed by the emulated arm."""

import warnings
from collections.abc import Mapping
from dataclasses import replace
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from ..errors import InputError
from ..inputs.described_liquid import COHESION
from .stir import StirPlan

if TYPE_CHECKING:
    from ..hardware import HiddenLiquid, Rig
    from ..hardware.motion import Trajectory


class _Expected(NamedTuple):
    """A stir that was not made yet, as the simulator reads a recording."""

    attrs: Mapping[str, float]
    gripper: "Trajectory"


def with_stir(rig: "Rig", plan: StirPlan, liquid: "HiddenLiquid") -> "HiddenLiquid":
    """The liquid, and how the stick hangs that stirs it along a plan.

    The path is that of the emulated arm, which lags its plan and rounds corners off.

    Args:
        rig: What is there.
        plan: That will be followed.
        liquid: Of which a viscosity is known.

    Raises:
        InputError: The simulation of the stir goes wrong.
        ValueError: The rig cannot be simulated.
    """
    from .. import models
    from ..hardware import StickMotion, servoed
    from ..hardware.motion import joined
    from ..hardware.recorder.finalise import rig_attributes

    path = servoed(joined(list(plan.strokes)))
    setup = models.StirSetup.from_recording(_Expected(rig_attributes(rig), path))
    hidden = models.Liquid(liquid.viscosity, COHESION, rig.liquid.density)
    with warnings.catch_warnings(record=True) as told:
        warnings.simplefilter("always")
        (inclination,) = models.stir(hidden, path, setup, [liquid.seed])
    if not np.isfinite(inclination).all():
        why = "; ".join(str(one.message) for one in told)
        raise InputError(
            f"{liquid.viscosity:g} Pa s cannot be stirred along the rig's path: {why}",
            where="emulated viscosity",
            fix="give another viscosity, or another path under [stirring] of rig.toml",
        )
    return replace(liquid, stir=StickMotion(path.time, path.position, inclination))
