import json
import pickle
from importlib.resources import files

import numpy as np
import pytest
from bolfi_liquids.hardware.errors import RigError
from bolfi_liquids.hardware.rig import Rig
from bolfi_liquids.hardware.rig_checks import receiver_fault
from bolfi_liquids.hardware.rig_file import bundled_rig, checked_rig, open_rig
from pydantic import ValidationError
from rig_ends import numbers

TEXT = (files("bolfi_liquids.hardware.data") / "rig.toml").read_text(encoding="utf-8")


@pytest.fixture
def changed(tmp_path):
    """Writes the bundled rig with one line replaced."""

    def write(old, new):
        assert TEXT.count(old) >= 1
        path = tmp_path / "rig.toml"
        path.write_text(TEXT.replace(old, new, 1))
        return path

    return write


def test_the_bundled_rig_can_be_used():
    rig = bundled_rig()
    assert (rig.camera("xz").view, rig.camera("yz").view) == ("xz", "yz")
    assert rig.robot.host.startswith("127.")  # no robot answers there
    volume = np.pi * rig.stick.radius**2 * rig.stick.length
    assert rig.stick.density == pytest.approx(rig.stick.mass / volume)
    assert (rig.limits.stirring.low < rig.limits.stirring.high).all()
    assert rig.stirring.speed <= rig.limits.speed
    assert pickle.loads(pickle.dumps(rig)) == rig  # it is sent to spawned processes


@pytest.mark.parametrize(
    ("old", "new", "field", "message"),
    [
        ("radius = 0.04 ", "radius = 40 ", "cup.radius", "40 m is not within 0.01 to 0.2 m"),
        ("mass = 0.0168", "mass = 168", "stick.mass", "168 kg is not within .* grams"),
        ("height = 0.235 ", "height = 235.0 ", "stirring.height", "millimetres"),
        (
            "density = 1000.0 ",
            "density = 1.0 ",
            "liquid.density",
            "1 kg/m3 is not within 50 to 20000",
        ),
        ("fill = 0.05 ", "fill = 0.08 ", "cup", "fill 0.08 m is not below height 0.075 m"),
        ("fill = 0.05 ", "fill = nan ", "cup.fill", "finite"),
        ("points = 9", "points = 9.5", "stirring.points", "9.5"),
        ("points = 9", "points = 8", "stirring.points", "8 is even"),
        ("points = 9", "pionts = 9", "stirring.pionts", "points"),
        # only names of the section itself are proposed
        ("[stick]", "length = 1.0\n[stick]", "cup.length", "known: position, yaw_deg, radius,"),
        ("[cup]", 'driver = "ur"\n[cup]', "robot.driver", "known: host, controller, rate"),
        ("[cup]", "zzz = 1\n[cup]", "robot.zzz", "known: host, controller, rate"),
        ("[robot]", "zzz = 1\n[robot]", "zzz", "known: robot, cup, stick"),
        ('view = "xz"', 'view = "xz"\nrates = 30.0', "cameras.0.rates", "mean rate\\?"),
        ('host = "127.0.0.1" ', "", "robot.host", "required"),
        ("x = [-0.05, 0.05]", "x = [0.05, -0.05]", "limits.stirring", "x must ascend"),
        ("force = 20.0", "force = 0.0", "limits.force", "0 N is not within 1 to"),
        ("force = 20.0", "force = 51.0", "limits.force", "51 N is not within 1 to 50 N.*face"),
        ("frame_age = 0.15", "frame_age = 0.001", "limits.frame_age", "0.001 s is not within"),
        ("frame_age = 0.15", "frame_age = 0.16", "limits.frame_age", "0.16 s is not within"),
        ("speed = 0.15", "speed = nan", "limits.speed", "finite"),
        ('view = "yz"', 'view = "xz"', "", "one must see xz and one yz, got xz and xz"),
        ("focal_length = 800.0 ", "", "cameras.0", "neither intrinsics nor focal_length"),
        ("radius = 0.025", "radius = 0.038", "", "brings the stick to the cup's wall"),
        ("height = 0.235 ", "height = 0.28 ", "", "outside the liquid"),
        ("clear_height = 0.32 ", "clear_height = 0.25 ", "", "leaves the stick in the cup"),
    ],
)
def test_a_wrong_number_is_named_with_its_field(changed, old, new, field, message):
    path = changed(old, new)
    with pytest.raises(RigError, match=message) as caught:
        open_rig(path)
    assert caught.value.where == (f"{path}: {field}" if field else str(path))
    assert "\n" not in str(caught.value)
    assert str(pickle.loads(pickle.dumps(caught.value))) == str(caught.value)


def test_what_is_no_rig_file_is_refused(tmp_path, changed):
    with pytest.raises(RigError, match="No such file.*give the path of a rig.toml"):
        open_rig(tmp_path / "none.toml")
    with pytest.raises(RigError, match="directory"):
        open_rig(tmp_path)
    (tmp_path / "picture.toml").write_bytes(b"\x89PNG\xff\xfe")
    with pytest.raises(RigError, match="not a text file"):
        open_rig(tmp_path / "picture.toml")
    with pytest.raises(RigError, match="not TOML.*line"):
        open_rig(changed("[robot]", "[robot"))


def test_paths_count_from_the_file_s_own_directory(changed):
    path = changed("source = 0 ", 'intrinsics = "xz.json"\nsource = "pictures" ')
    camera = open_rig(path).camera("xz")
    assert camera.source == str(path.parent / "pictures")
    assert camera.intrinsics == str(path.parent / "xz.json")
    assert open_rig(path).camera("yz").source == 1


def test_a_receiver_does_not_overlap_the_stirred_cup(changed):
    """The file does not say how wide the receiver is; the cups of a pour do."""
    rig = open_rig(changed("receiver = [0.05, ", "receiver = [0.225, "))  # 7.5 cm between axes
    assert receiver_fault(rig, 0.034) == ""
    assert "stands in the stirred cup" in receiver_fault(rig, 0.036)
    with pytest.raises(RigError, match="stands in the stirred cup"):
        open_rig(changed("receiver = [0.05, ", "receiver = [0.255, "))  # no cup is as small


def test_all_faults_that_do_not_follow_from_each_other_are_named_at_once(changed):
    path = changed('host = "127.0.0.1" ', 'hots = "127.0.0.1" ')
    text = path.read_text()
    for old, new in (("payload = 0.9 ", ""), ("radius = 0.04 ", ""), ("width", "")):
        text = text.replace(old, new, 1)
    path.write_text(text)
    with pytest.raises(RigError) as caught:
        open_rig(path)
    told = str(caught.value)
    for field in ("robot.hots", "did you mean host?", "robot.host", "robot.payload", "cup.radius"):
        assert field in told
    text = TEXT.replace("force = 20.0", "force = 51.0").replace("rate = 125.0 ", "rate = 900 ")
    path.write_text(text)
    with pytest.raises(
        RigError, match=r"robot\.rate: .* 50 to 500 Hz.*limits\.force: .* 1 to 50 N"
    ):
        open_rig(path)


def test_each_number_has_ends_and_both_are_allowed():
    """A number without ends could let an arm do harm; `changed` keeps all others as they are."""
    rig = bundled_rig()
    found = list(numbers(rig))
    assert len(found) > 70 and {name.split(".")[0] for name, *_ in found} == set(Rig.model_fields)
    for name, value, ends in found:
        assert ends is not None, name
        assert ends.low <= value <= ends.high and ends.why, name


@pytest.mark.parametrize("end", ["low", "high"])
@pytest.mark.parametrize("name", ["force", "speed", "frame_age", "silence", "overrun", "latency"])
def test_a_limit_beyond_its_end_is_refused(name, end):
    """Copies of a rig are checked, too."""
    rig = bundled_rig()
    ends = next(of for field, _, of in numbers(rig) if field == f"limits.{name}")
    assert ends is not None
    beyond = getattr(ends, end) * (0.999 if end == "low" else 1.001)
    limits = rig.limits.model_copy(update={name: beyond})
    with pytest.raises(RigError) as caught:
        checked_rig(rig.model_copy(update={"limits": limits}))
    assert caught.value.where == f"rig: limits.{name}"


def test_the_rig_of_a_recording_is_read_whatever_ends_there_are_now():
    written = json.loads(json.dumps(bundled_rig().model_dump(mode="json")))
    written["limits"] |= {"force": 100.0, "frame_age": 1.0, "speed": 0.4}
    written["stirring"] |= {"radius": 0.2, "points": 4, "cycles": 1000}
    written["pouring"]["receiver"] = written["cup"]["position"]
    written["robot"]["stirring_tcp"][2] = -5.0
    written["stick"]["mass"] = 31.0
    written["robot"]["brand"] = "of another version"
    rig = Rig.model_validate(written)
    with pytest.raises(RigError):
        checked_rig(rig)
    assert (rig.limits.force, rig.stirring.cycles, rig.stick.mass) == (100.0, 1000, 31.0)
    for damaged in ({"limits": {}}, {"cup": {"radius": "wide"}}, {"cameras": [{}, {}]}):
        with pytest.raises(ValidationError):
            Rig.model_validate(written | damaged)
