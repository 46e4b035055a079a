"""A rig whose joints and numbers disagree about the cup's place by more than is safe is refused."""

import numpy as np
import pytest
from bolfi_liquids.hardware.errors import RigError
from bolfi_liquids.hardware.motion.cup_frame import cup_frame
from bolfi_liquids.hardware.motion.kinematics import inverse
from bolfi_liquids.hardware.motion.stir_paths import (
    above_cup,
    approach,
    insert,
    placed,
    retract,
    stir,
)
from bolfi_liquids.hardware.rig import Rig
from bolfi_liquids.hardware.rig_checks import MAX_START_AWAY, clearance
from bolfi_liquids.hardware.rig_file import bundled_rig, checked_rig
from bolfi_liquids.hardware.safety.limits import workspace

BUNDLED = bundled_rig()
CONTROLLERS = ("cb3", "e-series")
SIDES = np.array([[1, 0, 0], [0, -1, 0], [-0.6, 0.8, 0], [0, 0, 1], [0, 0, -1]], float)


def changed(rig: Rig, **sections) -> Rig:
    parts = {name: getattr(rig, name).model_copy(update=of) for name, of in sections.items()}
    return rig.model_copy(update=parts)


def started(rig: Rig, shift=(0.0, 0.0, 0.0)) -> Rig:
    """The rig with `start` read off where the pivot is, by `shift` [m], not above the cup."""
    space, place = workspace(rig, "stirring"), above_cup(rig)
    place[:3] += shift
    found = inverse(space.arm, cup_frame(rig.cup).to_base(place), space.start, tcp=space.tcp)
    assert found is not None
    return changed(rig, robot={"start": tuple(np.round(found, 5).tolist())})


def rig_of(controller: str) -> Rig:
    return started(changed(BUNDLED, robot={"controller": controller}))


def met(rig: Rig, shift) -> bool:
    """Whether the stick of the planned motions meets a cup that stands where `start` says."""
    beside = placed(above_cup(rig), x=0.05, y=0.05)
    for path in (approach(rig, beside), insert(rig), stir(rig), retract(rig)):
        x, y, z = (path.pose[:, :3] - shift).T
        tip, away = z - rig.stick.length, np.hypot(x, y)
        wall = (tip <= rig.cup.height) & (away + rig.stick.radius >= rig.cup.radius)
        if wall.any() or (tip <= 0.0).any():
            return True
    return False


def refused(rig: Rig) -> bool:
    try:
        checked_rig(rig)
    except RigError as err:
        assert err.where == "rig: robot.start"
        return True
    return False


@pytest.mark.parametrize("controller", CONTROLLERS)
def test_no_start_that_is_accepted_lets_the_stick_meet_the_cup(controller):
    rig, accepted, harmful = rig_of(controller), 0, 0
    for side in SIDES:
        for size in (0.0, 0.003, 0.009, 0.0115, 0.0145, 0.016, 0.026, 0.039):
            shift = size * side
            touches = met(rig, shift)
            harmful += touches
            if not refused(started(rig, shift)):
                accepted += 1
                assert not touches, shift
    assert accepted > 10 and harmful > 10


@pytest.mark.parametrize("controller", CONTROLLERS)
@pytest.mark.parametrize("side", SIDES)
def test_a_start_is_accepted_up_to_the_rig_s_own_clearance(controller, side):
    rig = rig_of(controller)
    most = clearance(rig).along if side[2] else clearance(rig).aside
    assert not refused(started(rig, 0.95 * most * side))
    assert refused(started(rig, 1.05 * most * side))


def test_a_narrow_rig_needs_a_nearer_start_and_a_wide_one_none_further_than_a_cup():
    close = changed(BUNDLED, stirring={"radius": 0.034}, limits={"tracking_error": 0.001})
    narrow = started(close, (0.003, 0.0, 0.0))
    assert clearance(narrow).aside == pytest.approx(0.0015)
    assert refused(narrow) and not refused(started(narrow))
    wide = changed(BUNDLED, cup={"radius": 0.12})
    assert clearance(wide).aside > MAX_START_AWAY
    assert not refused(started(wide, (0.035, 0.0, 0.0)))
    assert refused(started(wide, (0.045, 0.0, 0.0)))


def test_the_bundled_start_is_that_of_its_controller():
    assert not refused(BUNDLED)
    assert refused(changed(BUNDLED, robot={"controller": "e-series"}))


@pytest.mark.parametrize("part", [0.95, 1.05])
def test_tracking_is_guarded_within_the_clearance(part):
    """Before an arm that is held, or lags, lets the stick meet the cup, it must stop."""
    limit = part * clearance(BUNDLED).aside
    rig = changed(BUNDLED, limits={"tracking_error": limit})
    if part < 1.0:
        assert checked_rig(rig).limits.tracking_error == limit
    else:
        with pytest.raises(RigError) as told:
            checked_rig(rig)
        assert told.value.where == "rig: limits.tracking_error"


@pytest.mark.parametrize(
    ("field", "value"),
    [
        ("target", (0.0, 0.0, 1.6)),
        ("marker", (0.0, -2.0, 0.025)),
        ("position", (0.0, -0.035, 0.1)),
    ],
)
def test_a_camera_that_cannot_see_the_stick_is_refused(field, value):
    first, second = BUNDLED.cameras
    wrong = first.model_copy(update={field: value})
    with pytest.raises(RigError) as told:
        checked_rig(BUNDLED.model_copy(update={"cameras": (wrong, second)}))
    assert told.value.where == f"rig: cameras.0.{field}"


@pytest.mark.parametrize(
    "fields",
    [
        {"position": (0.0, -0.5, -0.03)},  # on the bench, below a cup that stands higher
        {"target": (0.0, -0.25, 0.33), "intrinsics": "lens.json"},  # a wide lens, measured
    ],
)
def test_a_camera_that_sees_the_stick_is_accepted(fields):
    first, second = BUNDLED.cameras
    rig = changed(BUNDLED, robot={})
    rig = rig.model_copy(update={"cameras": (first.model_copy(update=fields), second)})
    assert checked_rig(rig).cameras[0].position == rig.cameras[0].position


def test_two_cameras_are_two_devices():
    first, second = BUNDLED.cameras
    same = second.model_copy(update={"source": first.source})
    with pytest.raises(RigError, match="source"):
        checked_rig(BUNDLED.model_copy(update={"cameras": (first, same)}))
