import json
import pickle
from importlib.resources import files
from typing import Annotated, get_args

import numpy as np
import pytest
from bolfi_liquids.hardware.errors import RigError
from bolfi_liquids.hardware.rig import Rig, check_receiver
from bolfi_liquids.hardware.rig_file import bundled_rig, open_rig
from bolfi_liquids.hardware.rig_numbers import RECORDED, RigSection
from pydantic import Field, ValidationError, create_model

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
        ("radius = 0.04 ", "radius = 40 ", "cup.radius", "millimetres.*40"),
        ("mass = 0.0168", "mass = 168", "stick.mass", "168 kg looks like grams"),
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
        ("points = 9", "pionts = 9", "stirring.pionts", "not permitted"),
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
    check_receiver(rig, 0.034)
    with pytest.raises(ValueError, match="stands in the stirred cup"):
        check_receiver(rig, 0.036)
    with pytest.raises(RigError, match="stands in the stirred cup"):
        open_rig(changed("receiver = [0.05, ", "receiver = [0.255, "))  # no cup is as small


def ends(kind, way=""):
    """Each number of a rig's section whose type says more than one end, by its name."""
    for name, field in kind.model_fields.items():
        for inner in (field.annotation, *get_args(field.annotation)):
            if isinstance(inner, type) and issubclass(inner, RigSection):
                yield from ends(inner, f"{way}{name}.")
        texts = repr(field.metadata) + repr(field.annotation)
        if any(one in texts for one in ("Ge(", "Gt(", "Le(", "Lt(")):
            yield f"{way}{name}"


def test_each_end_of_a_number_stands_once():
    """An end in pydantic's own words stands beside one with a reason, or holds for recordings."""
    assert list(ends(Rig)) == []
    twice = create_model("Twice", __base__=RigSection, one=(Annotated[float, Field(gt=0)], 1.0))
    assert list(ends(twice)) == ["one"]


def test_the_rig_of_a_recording_is_read_whatever_ends_there_are_now():
    written = json.loads(json.dumps(bundled_rig().model_dump(mode="json")))
    written["limits"] |= {"force": 100.0, "frame_age": 1.0, "speed": 0.4}
    written["stirring"] |= {"radius": 0.2, "points": 4, "cycles": 1000}
    written["pouring"]["receiver"] = written["cup"]["position"]
    written["robot"]["stirring_tcp"][2] = -5.0
    written["stick"]["mass"] = 31.0
    written["robot"]["brand"] = "of another version"
    with pytest.raises(ValidationError):
        Rig.model_validate(written)
    rig = Rig.model_validate(written, context=RECORDED)
    assert (rig.limits.force, rig.stirring.cycles, rig.stick.mass) == (100.0, 1000, 31.0)
    for damaged in ({"limits": {}}, {"cup": {"radius": "wide"}}, {"cameras": [{}, {}]}):
        with pytest.raises(ValidationError):
            Rig.model_validate(written | damaged, context=RECORDED)
