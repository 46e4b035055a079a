"""Sessions with an emulated controller: a computer that runs it, too, has stalls of its own."""

from functools import cached_property

from bolfi_liquids.hardware.rig import Rig
from bolfi_liquids.hardware.session.setup import SessionSetup

STALL_SECONDS = 1.0  # s, in which neither the arm nor its controller moves on


def patient(rig: Rig) -> Rig:
    """The rig with guards that do not mind a stall; wider than a rig's file may ask for."""
    limits = rig.limits.model_copy(
        update={
            "silence": STALL_SECONDS,
            "overrun": STALL_SECONDS,
            "frame_age": STALL_SECONDS,
            # the arm stays behind its set-points by what they move on in a stall
            "tracking_error": rig.limits.tracking_error + STALL_SECONDS * rig.limits.speed,
        }
    )
    return rig.model_copy(update={"limits": limits})


class PatientSetup(SessionSetup):
    """A session by the real client, whose guards bear stalls."""

    @cached_property
    def guarded_rig(self) -> Rig:
        return patient(super().guarded_rig)
