"""The stir of a hidden liquid: simulated before the session, replayed by the emulated arm."""

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from ..errors import InputError
from ..inputs.described_liquid import COHESION
from ..inputs.recording import planned_recording
from ..simulation.simulate import described_liquids, simulated
from ..simulators import stir_simulator
from .stir import StirPlan

if TYPE_CHECKING:
    from ..hardware import HiddenLiquid, Rig


def with_stir(rig: "Rig", plan: StirPlan, liquid: "HiddenLiquid") -> "HiddenLiquid":
    """The liquid, and how the stick hangs that stirs it along a plan.

    The path is that of the emulated arm, which lags its plan and rounds corners off.

    Args:
        rig: What is there.
        plan: That will be followed.
        liquid: Of which a viscosity is known; one that has a stir keeps it.

    Raises:
        InputError: The liquid cannot be simulated, or its stir goes wrong.
        ValueError: The rig cannot be simulated.
    """
    from ..hardware import StickMotion, servoed
    from ..hardware.motion import joined
    from ..hardware.recorder.finalise import rig_attributes
    from ..inference.simulations import Compute

    if liquid.stir is not None:
        return liquid
    path = servoed(joined(list(plan.strokes)))
    expected = planned_recording(path.time, path.position, rig_attributes(rig))
    of = {"viscosity": liquid.viscosity, "cohesion": COHESION, "seed": liquid.seed}
    try:
        liquids = described_liquids(of, density=rig.liquid.density)
        (inclination,) = simulated(stir_simulator([expected], 0), liquids, Compute())
        if not np.isfinite(inclination).all():
            raise RuntimeError("its result is not finite")
    except InputError as err:
        raise InputError(err.what, where=f"emulated {err.where}", fix=err.fix) from err
    except RuntimeError as err:
        raise InputError(
            f"{liquid.viscosity:g} Pa s cannot be stirred along the rig's path: {err}",
            where="emulated viscosity",
            fix="give another viscosity, or another path under [stirring] of rig.toml",
        ) from err
    return replace(liquid, stir=StickMotion(path.time, path.position, inclination))
