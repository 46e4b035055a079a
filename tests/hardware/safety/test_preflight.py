from bolfi_liquids.hardware.arm import Payload
from bolfi_liquids.hardware.rig_file import bundled_rig
from bolfi_liquids.hardware.safety.preflight import payload_check

RIG = bundled_rig()


def test_the_payload_is_the_rig_s_or_none_that_anybody_has_set_yet():
    """We set it; it must then be there."""
    ours = Payload(RIG.robot.payload, RIG.robot.payload_centre)
    for payload, before, after in (
        (ours, True, True),
        (Payload(0.0, (0.0, 0.0, 0.0)), True, False),
        (ours._replace(mass=ours.mass + 0.5), False, False),
        (ours._replace(centre=(0.0, 0.0, 0.5)), False, False),
    ):
        assert payload_check(payload, RIG).ok == before
        assert payload_check(payload, RIG, ours=True).ok == after
