"""An emulator alone, for any client of a real controller."""

import time
from collections.abc import Iterator
from typing import TYPE_CHECKING

from .hidden_stir import with_stir
from .stir import plan_stir

if TYPE_CHECKING:
    from ..hardware import Rig


def emulator_until_interrupted(
    rig: "Rig", address: str | None = None, viscosity: float = 1.0
) -> Iterator[str]:
    """Run an emulator of a rig's controller; yields what to tell, ends at Ctrl-C.

    Its stick hangs in the liquid as the stir of the rig's file has it, whenever a client stirs so.

    Raises:
        InputError, ValueError: The viscosity, or the rig's stir, cannot be simulated.
        RigError: It cannot start.
        MotionRejected: The rig's stir breaks one of its limits.
    """
    from ..hardware import HiddenLiquid, emulated
    from ..hardware.emulator import check_address
    from ..hardware.motion import above_cup

    if address is not None:
        check_address(address)  # before the stir is simulated
    liquid = with_stir(rig, plan_stir(rig), HiddenLiquid(viscosity=viscosity))
    with emulated(rig, above_cup(rig), address=address, liquid=liquid) as running:
        at = running.emulator.address
        yield f"emulator of a {rig.robot.controller} controller on {at}; end it with Ctrl-C"
        yield f'to use it, set host = "{at}" under [robot] in rig.toml'
        try:
            while running.emulator.alive:
                time.sleep(0.2)
        except KeyboardInterrupt:
            return
        raise RuntimeError(f"the emulator ended by itself; it said: {running.emulator.notes()}")
