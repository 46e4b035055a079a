"""rig.toml: what can be used, and what is refused with the field that is wrong."""

import json
import pickle
from importlib.resources import files

import numpy as np
import pytest
from bolfi_liquids.hardware.errors import RigError
from bolfi_liquids.hardware.motion.kinematics import inverse
from bolfi_liquids.hardware.motion.poses import cup_frame
from bolfi_liquids.hardware.motion.stir_paths import (
    above_cup,
    approach,
    insert,
    placed,
    retract,
    stir,
)
from bolfi_liquids.hardware.rig import Rig
from bolfi_liquids.hardware.rig_file import (
    MAX_START_AWAY,
    bundled_rig,
    checked_rig,
    clearance,
    open_rig,
    receiver_fault,
)
from bolfi_liquids.hardware.safety.limits import workspace
from pydantic import ValidationError
from rig_ends import numbers

TEXT = (files("bolfi_liquids.hardware.data") / "rig.toml").read_text(encoding="utf-8")
BUNDLED = bundled_rig()
CONTROLLERS = ("cb3", "e-series")


def changed(rig: Rig, **sections) -> Rig:
    parts = {name: getattr(rig, name).model_copy(update=of) for name, of in sections.items()}
    return rig.model_copy(update=parts)


def first_camera(**fields) -> Rig:
    first, second = BUNDLED.cameras
    return BUNDLED.model_copy(update={"cameras": (first.model_copy(update=fields), second)})


@pytest.fixture
def written(tmp_path):
    """Writes the bundled rig with one line replaced."""

    def write(old, new):
        assert TEXT.count(old) >= 1
        path = tmp_path / "rig.toml"
        path.write_text(TEXT.replace(old, new, 1))
        return path

    return write


def test_the_bundled_rig_can_be_used():
    rig = BUNDLED
    assert (rig.camera("xz").view, rig.camera("yz").view) == ("xz", "yz")
    assert rig.robot.host.startswith("127.")  # no robot answers there
    volume = np.pi * rig.stick.radius**2 * rig.stick.length
    assert rig.stick.density == pytest.approx(rig.stick.mass / volume)
    assert (rig.limits.stirring.low < rig.limits.stirring.high).all()
    assert pickle.loads(pickle.dumps(rig)) == rig  # it is sent to spawned processes


@pytest.mark.parametrize(
    ("old", "new", "field"),
    [
        ("radius = 0.04 ", "radius = 40 ", "cup.radius"),
        ("fill = 0.05 ", "fill = nan ", "cup.fill"),
        ("fill = 0.05 ", "fill = 0.08 ", "cup"),
        ("points = 9", "points = 9.5", "stirring.points"),
        ("points = 9", "points = 8", "stirring.points"),
        ("points = 9", "points = 1", "stirring.points"),
        ("points = 9", "pionts = 9", "stirring.pionts"),
        ("[robot]", "zzz = 1\n[robot]", "zzz"),
        ('view = "xz"', 'view = "xz"\nrates = 30.0', "cameras.0.rates"),
        ('host = "127.0.0.1" ', "", "robot.host"),
        ("x = [-0.05, 0.05]", "x = [0.05, -0.05]", "limits.stirring"),
        ("x = [-0.05, 0.05]", "x = [-0.05, 0.21]", "limits.stirring.x.1"),
        ("focal_length = 800.0 ", "", "cameras.0"),
        ('view = "yz"', 'view = "xz"', ""),
        ("speed = 0.1\n", "speed = 0.16\n", "stirring.speed"),
        ("radius = 0.025", "radius = 0.038", "stirring.radius"),
        ("height = 0.235 ", "height = 0.28 ", "stirring.height"),
        ("clear_height = 0.32 ", "clear_height = 0.25 ", "stirring.clear_height"),
        ("source = 1", "source = 0", "cameras"),
        ("frame_age = 0.15", "frame_age = 0.03", "limits.frame_age"),
        ("density = 1000.0 ", "density = 13600.0 ", "stick.mass"),  # it would swim
        ("rate = 125.0 ", "rate = 120.0 ", "robot"),
    ],
)
def test_a_wrong_line_is_named_with_its_field(written, old, new, field):
    path = written(old, new)
    with pytest.raises(RigError) as caught:
        open_rig(path)
    assert caught.value.where == (f"{path}: {field}" if field else str(path))
    assert "\n" not in str(caught.value)
    assert ("give an odd number" in str(caught.value)) == (new == "points = 8")
    assert str(pickle.loads(pickle.dumps(caught.value))) == str(caught.value)


def test_names_of_the_section_itself_are_proposed(written):
    for old, new, proposed in (
        ("points = 9", "pionts = 9", "did you mean points?"),
        ("[stick]", "length = 1.0\n[stick]", "known: position, yaw_deg, radius,"),
    ):
        with pytest.raises(RigError) as caught:
            open_rig(written(old, new))
        assert proposed in str(caught.value)


def test_what_is_no_rig_file_is_refused(tmp_path, written):
    (tmp_path / "picture.toml").write_bytes(b"\x89PNG\xff\xfe")
    broken = written("[robot]", "[robot")
    for path in (tmp_path / "none.toml", tmp_path, tmp_path / "picture.toml", broken):
        with pytest.raises(RigError) as caught:
            open_rig(path)
        assert caught.value.where == str(path)


def test_two_cameras_differ_in_driver_or_source(written):
    path = written("source = 0 ", 'driver = "a.py:A"\n')
    text = path.read_text().replace("source = 1", "")
    for second, fine in (("b.py:B", True), ("a.py:B", True), ("a.py:A", False)):
        path.write_text(text.replace('view = "yz"', f'view = "yz"\ndriver = "{second}"'))
        if fine:
            assert all(camera.is_device for camera in open_rig(path).cameras)
        else:
            with pytest.raises(RigError, match="both have the source 0"):
                open_rig(path)


def test_a_camera_is_a_device_a_driver_or_files():
    for source, driver, device in (
        (1, None, True),
        ("/dev/video2", None, True),
        ("pictures", None, False),
        ("serial 7", "mine.py:Mine", True),
    ):
        (camera, _) = first_camera(source=source, driver=driver).cameras
        assert camera.is_device == device


def test_paths_count_from_the_file_s_own_directory(written):
    path = written("source = 0 ", 'intrinsics = "xz.json"\nsource = "pictures" ')
    camera = open_rig(path).camera("xz")
    assert camera.source == str(path.parent / "pictures")
    assert camera.intrinsics == str(path.parent / "xz.json")
    assert open_rig(path).camera("yz").source == 1
    path = written("source = 0 ", 'driver = "mine.py:Mine"\nsource = "serial 7" ')
    camera = open_rig(path).camera("xz")
    assert (camera.source, camera.driver) == ("serial 7", str(path.parent / "mine.py:Mine"))


def test_a_receiver_does_not_overlap_the_stirred_cup(written):
    """The file does not say how wide the receiver is; the cups of a pour do."""
    rig = open_rig(written("receiver = [0.05, ", "receiver = [0.225, "))  # 7.5 cm between axes
    assert receiver_fault(rig, 0.034) == ""
    assert "pouring.receiver" in receiver_fault(rig, 0.036)
    with pytest.raises(RigError, match="receiver"):
        open_rig(written("receiver = [0.05, ", "receiver = [0.255, "))  # no cup is as small


def test_all_faults_that_do_not_follow_from_each_other_are_named_at_once(written):
    path = written('host = "127.0.0.1" ', 'hots = "127.0.0.1" ')
    text = path.read_text().replace("payload = 0.9 ", "").replace("force = 20.0", "force = 51.0")
    path.write_text(text.replace("rate = 125.0 ", "rate = 900 "))
    with pytest.raises(RigError) as caught:
        open_rig(path)
    for field in ("robot.hots", "robot.host", "robot.payload", "robot.rate", "limits.force"):
        assert field in str(caught.value)


def test_each_number_has_ends_and_both_are_allowed():
    """A number without ends could let an arm do harm."""
    found = list(numbers(BUNDLED))
    sections = {name.split(".")[0] for name, *_ in found}
    assert len(found) > 70 and sections == set(Rig.model_fields)
    for name, value, ends in found:
        assert ends is not None and ends.low <= value <= ends.high and ends.why, name


def test_a_limit_beyond_its_end_is_refused_of_copies_too():
    for name in ("force", "speed", "frame_age", "silence", "overrun", "latency"):
        ends = next(of for field, _, of in numbers(BUNDLED) if field == f"limits.{name}")
        for beyond in (0.999 * ends.low, 1.001 * ends.high):
            with pytest.raises(RigError) as caught:
                checked_rig(changed(BUNDLED, limits={name: beyond}))
            assert caught.value.where == f"rig: limits.{name}"


def test_the_rig_of_a_recording_is_read_whatever_ends_there_are_now():
    rig = json.loads(json.dumps(BUNDLED.model_dump(mode="json")))
    rig["limits"] |= {"force": 100.0, "frame_age": 1.0, "speed": 0.4}
    rig["stirring"] |= {"radius": 0.2, "points": 4, "cycles": 1000}
    rig["pouring"]["receiver"] = rig["cup"]["position"]
    rig["robot"]["stirring_tcp"][2] = -5.0
    rig["robot"]["brand"] = "of another version"
    read = Rig.model_validate(rig)
    with pytest.raises(RigError):
        checked_rig(read)
    assert (read.limits.force, read.stirring.cycles) == (100.0, 1000)
    for damaged in ({"limits": {}}, {"cup": {"radius": "wide"}}, {"cameras": [{}, {}]}):
        with pytest.raises(ValidationError):
            Rig.model_validate(rig | damaged)


# -- joints and numbers that disagree about the cup's place by more than is safe


SIDES = np.array([[1, 0, 0], [0, -1, 0], [-0.6, 0.8, 0], [0, 0, 1], [0, 0, -1]], float)


def started(rig: Rig, shift=(0.0, 0.0, 0.0)) -> Rig:
    """The rig with `start` read off where the pivot is, by `shift` [m], not above the cup."""
    space, place = workspace(rig, "stirring"), above_cup(rig)
    place[:3] += shift
    found = inverse(space.arm, cup_frame(rig.cup).to_base(place), space.start, tcp=space.tcp)
    assert found is not None
    return changed(rig, robot={"start": tuple(np.round(found, 5).tolist())})


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


def refused(rig: Rig, field: str = "robot.start") -> bool:
    try:
        checked_rig(rig)
    except RigError as err:
        assert err.where == f"rig: {field}"
        return True
    return False


@pytest.mark.parametrize("controller", CONTROLLERS)
def test_no_start_that_is_accepted_lets_the_stick_meet_the_cup(controller):
    rig = started(changed(BUNDLED, robot={"controller": controller}))
    accepted = harmful = 0
    for side in SIDES:
        for size in (0.0, 0.003, 0.009, 0.0115, 0.0145, 0.016, 0.026, 0.039):
            shift = size * side
            touches = met(rig, shift)
            harmful += touches
            if not refused(started(rig, shift)):
                accepted += 1
                assert not touches, shift
        # it is accepted up to the rig's own clearance
        most = clearance(rig).along if side[2] else clearance(rig).aside
        assert not refused(started(rig, 0.95 * most * side))
        assert refused(started(rig, 1.05 * most * side))
    assert accepted > 10 and harmful > 10


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


def test_tracking_is_guarded_within_the_clearance():
    """Before an arm that is held, or lags, lets the stick meet the cup, it must stop."""
    for part, wrong in ((0.95, False), (1.05, True)):
        rig = changed(BUNDLED, limits={"tracking_error": part * clearance(BUNDLED).aside})
        assert refused(rig, "limits.tracking_error") == wrong


@pytest.mark.parametrize(
    ("field", "value"),
    [
        ("target", (0.0, 0.0, 1.6)),
        ("marker", (0.0, -2.0, 0.025)),
        ("position", (0.0, -0.035, 0.1)),
    ],
)
def test_a_camera_that_cannot_see_the_stick_is_refused(field, value):
    assert refused(first_camera(**{field: value}), f"cameras.0.{field}")


def test_a_camera_that_sees_the_stick_is_accepted():
    # on the bench, below a cup that stands higher; a wide lens, measured
    checked_rig(first_camera(position=(0.0, -0.5, -0.03)))
    checked_rig(first_camera(target=(0.0, -0.25, 0.33), intrinsics="lens.json"))
