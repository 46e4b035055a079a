"""Sessions with an emulated controller: a computer that runs it, too, has stalls of its own."""

from functools import cached_property

from bolfi_liquids.hardware.emulated.rig import STALL_SECONDS
from bolfi_liquids.hardware.emulated.rig import patient as emulated_patient
from bolfi_liquids.hardware.rig import Rig
from bolfi_liquids.hardware.session.setup import SessionSetup


def patient(rig: Rig) -> Rig:
    """As for the arm in our process, whose controller cannot fall silent."""
    # the arm stays behind its set-points by what they move on in a stall
    error = rig.limits.tracking_error + STALL_SECONDS * rig.limits.speed
    wider = {"silence": STALL_SECONDS, "tracking_error": error}
    limits = emulated_patient(rig).limits.model_copy(update=wider)
    return rig.model_copy(update={"limits": limits})


class PatientSetup(SessionSetup):
    """A session by the real client, whose guards bear stalls."""

    @cached_property
    def guarded_rig(self) -> Rig:
        return patient(super().guarded_rig)
