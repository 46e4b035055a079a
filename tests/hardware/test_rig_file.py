import pickle
from importlib.resources import files

import numpy as np
import pytest
from bolfi_liquids.hardware.errors import RigError
from bolfi_liquids.hardware.rig_file import bundled_rig, open_rig

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
    assert rig.robot.host.startswith("127.")  # nothing but the emulator answers there
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
        ("density = 1000.0 ", "density = 1.0 ", "liquid.density", "greater than or equal to 50"),
        ("fill = 0.05 ", "fill = 0.08 ", "cup", "fill 0.08 m is not below height 0.075 m"),
        ("fill = 0.05 ", "fill = nan ", "cup.fill", "finite"),
        ("points = 9", "points = 9.5", "stirring.points", "9.5"),
        ("points = 9", "points = 8", "stirring.points", "8 is even"),
        ("points = 9", "pionts = 9", "stirring.pionts", "not permitted"),
        ('host = "127.0.0.1" ', "", "robot.host", "required"),
        ("x = [-0.05, 0.05]", "x = [0.05, -0.05]", "limits.stirring", "x must ascend"),
        ("force = 20.0", "force = 0.0", "limits.force", "greater than 0"),
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
