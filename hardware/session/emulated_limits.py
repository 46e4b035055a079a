"""Limits for an emulated arm: a computer that emulates the controller too has stalls of its own."""

from ..rig import Rig

STALL_SECONDS = 1.0  # s, in which neither the arm nor its controller moves on


def patient(rig: Rig) -> Rig:
    """The rig with guards that do not mind a stall of this computer, for rehearsals only.

    A real arm moves on in a stall. These limits are wider than a rig's file may ask for.
    """
    limits = rig.limits.model_copy(
        update={
            "silence": STALL_SECONDS,
            "overrun": STALL_SECONDS,
            "frame_age": STALL_SECONDS,
            # the emulated arm stays behind its set-points by what they move on in a stall
            "tracking_error": rig.limits.tracking_error + STALL_SECONDS * rig.limits.speed,
        }
    )
    return rig.model_copy(update={"limits": limits})
