"""No number of a rig.toml, however wrong, makes an arm leave the box or go too fast."""

import sys
from pathlib import Path

import numpy as np
import pytest
from bolfi_liquids.hardware.motion.poses import cup_frame
from bolfi_liquids.hardware.motion.stir_paths import insert
from bolfi_liquids.hardware.rig_file import open_rig
from bolfi_liquids.hardware.robot.orders import Checked, Done, Follow, Leave

sys.path.insert(0, str(Path(__file__).parent))
from rig_variations import (  # noqa: E402
    FACTORS,
    TEMPLATE,
    changed,
    judge,
    name_of,
    numbers,
    outcome,
    planned,
    stirs,
    tomli_w,
)

NUMBERS = dict(numbers())
SECTIONS = {"robot", "cup", "stick", "liquid", "stirring", "limits", "cameras", "pouring"}


def test_the_walk_finds_the_numbers_of_all_sections():
    assert {str(field[0]) for field in NUMBERS} == SECTIONS
    assert ("limits", "stirring", "x", 1) in NUMBERS and ("robot", "start", 5) in NUMBERS


@pytest.mark.slow
@pytest.mark.parametrize("field", NUMBERS, ids=name_of)
def test_a_wrong_number_is_refused_or_harmless(field, tmp_path):
    for factor in FACTORS:
        outcome(field, NUMBERS[field], factor, tmp_path)


def test_the_template_itself_is_not_refused():
    """Without this the test above could not fail."""
    assert planned(TEMPLATE) == "harmless"


def test_a_harmful_path_is_found():
    spoiled = (
        lambda path: path._replace(time=path.time / 4.0),  # faster
        lambda path: path._replace(pose=path.pose + [0.05, 0.0, 0.0, 0.0, 0.0, 0.0]),  # aside
        lambda path: path._replace(pose=path.pose * [1, 1, 1, 0, 0, 0]),  # upside down
    )
    strokes = [path for _, path in stirs(TEMPLATE)]
    for spoil in spoiled:
        with pytest.raises(AssertionError):
            for path in strokes:
                judge(spoil(path), TEMPLATE, "stirring")


DANGEROUS = [  # seen at the first full state
    ("robot.stirring_orientation", "stirring_orientation", [0.0, 0.0, 0.0]),
    ("robot.stirring_tcp", "stirring_tcp", [0.0, 0.0, -0.14, 0.0, 0.0, 0.0]),
    ("robot.payload", "payload", 0.0009),
    ("robot.pouring_tcp", "pouring_tcp", [-0.028, 0.03, 0.19, 0.0, 0.0, 0.0]),
    ("robot.pouring_tcp", "pouring_orientation", [-1.57079633, 0.0, 0.0]),
    ("stirring.radius", "radius", 0.000025),
    ("stick", "mass", 0.00002),
    ("cup.position", "position", [1.2, -1.2, 0.05]),
    ("limits.tracking_error", "tracking_error", 1.0),
    ("limits", "stirring", {"x": [-0.5, 0.05], "y": [-0.05, 0.05], "z": [0.221, 0.36]}),
]


@pytest.mark.parametrize(("where", "name", "value"), DANGEROUS, ids=[d[1] for d in DANGEROUS])
def test_what_cannot_be_is_refused_with_its_field(where, name, value, tmp_path):
    section = where.split(".")[0]
    path = tmp_path / "rig.toml"
    path.write_text(tomli_w.dumps(changed((section, name), value)))
    with pytest.raises(ValueError) as caught:
        open_rig(path)
    said = str(caught.value)
    assert f"{path}: {where}" in said and "\n" not in said


def test_a_cup_that_turns_away_from_the_receiver_is_refused(tmp_path):
    path = tmp_path / "rig.toml"
    for heading in (-160.0, -90.0, 90.0, 170.0):
        path.write_text(tomli_w.dumps(changed(("pouring", "heading_deg"), heading)))
        with pytest.raises(ValueError, match="receiver"):
            open_rig(path)


def test_nan_is_no_number(tmp_path):
    path = tmp_path / "rig.toml"
    for field in (("liquid", "density"), ("cup", "yaw_deg"), ("robot", "start", 0)):
        path.write_text(tomli_w.dumps(changed(field, float("nan"))))
        with pytest.raises(ValueError, match=field[1]):
            open_rig(path)


MOVED = [("stirring", "approach_speed"), ("stirring", "acceleration"), ("robot", "start", 5)]


@pytest.mark.slow
@pytest.mark.parametrize("field", MOVED, ids=name_of)
def test_what_is_harmless_is_so_on_the_emulated_arm(field, stepped, tmp_path):
    path = tmp_path / "changed.toml"
    path.write_text(tomli_w.dumps(changed(field, 0.1 * NUMBERS[field])))
    rig = open_rig(path)
    down = insert(rig)
    one = stepped(rig, "stirring", down.pose[0])
    one.when(Checked, lambda: one.orders.put(Follow(down)))
    one.when(Done, lambda: one.orders.put(Leave()))
    assert one.run() == 0
    box, period = TEMPLATE.limits.stirring, 1.0 / TEMPLATE.robot.rate
    place = np.array([[row.x, row.y, row.z] for row in one.rows])
    assert (place >= box.low).all() and (place <= box.high).all()
    assert np.ptp(place[:, 2]) == pytest.approx(np.ptp(down.pose[:, 2]), abs=2e-3)
    time = np.array([row.time for row in one.rows])
    speed = np.linalg.norm(np.diff(place, axis=0), axis=1) / np.maximum(np.diff(time), period)
    assert speed.max() <= TEMPLATE.limits.speed
    assert cup_frame(rig.cup).origin == pytest.approx(cup_frame(TEMPLATE.cup).origin)
