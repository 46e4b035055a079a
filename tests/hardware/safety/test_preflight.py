import pytest
from bolfi_liquids.hardware.arm import Payload
from bolfi_liquids.hardware.rig_file import bundled_rig
from bolfi_liquids.hardware.safety.preflight import payload_check

RIG = bundled_rig()
OURS = Payload(RIG.robot.payload, RIG.robot.payload_centre)
NONE = Payload(0.0, (0.0, 0.0, 0.0))


def test_the_payload_of_the_rig_s_file_is_well():
    assert payload_check(OURS, RIG).ok and payload_check(OURS, RIG, ours=True).ok


def test_a_payload_that_nobody_has_set_yet_is_set_by_us_and_must_then_be_there():
    assert payload_check(NONE, RIG).ok
    assert not payload_check(NONE, RIG, ours=True).ok


@pytest.mark.parametrize(
    "other", [OURS._replace(mass=OURS.mass + 0.5), OURS._replace(centre=(0.0, 0.0, 0.5))]
)
def test_another_payload_is_refused_and_named(other):
    check = payload_check(other, RIG)
    assert not check.ok
    assert f"{other.mass:.3f} kg" in check.text and f"{OURS.mass:.3f} kg" in check.text
