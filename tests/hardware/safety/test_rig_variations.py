"""No number of a rig.toml, however wrong, makes an arm leave the box or go too fast.

Every number of the bundled one is made wrong, and is refused or harmless: all motions planned with
it stay, sample by sample, within the unchanged file's boxes and rates.
"""

import pickle
import tomllib
from collections.abc import Iterator
from functools import cache
from hashlib import sha256
from importlib.resources import files
from pathlib import Path

import numpy as np
import pytest
import tomli_w
from bolfi_liquids.hardware.errors import MotionRejected, RigError
from bolfi_liquids.hardware.motion.poses import cup_frame
from bolfi_liquids.hardware.motion.pour_paths import (
    approach_pour,
    pour_path,
    ready_to_pour,
    upright_again,
)
from bolfi_liquids.hardware.motion.stir_paths import (
    PosePath,
    above_cup,
    approach,
    insert,
    placed,
    retract,
    strokes,
)
from bolfi_liquids.hardware.rig import Rig
from bolfi_liquids.hardware.rig_file import bundled_rig, open_rig
from bolfi_liquids.hardware.robot.orders import Checked, Done, Follow, Leave
from bolfi_liquids.hardware.safety.limits import MAX_TILT, Tool, check_path, workspace
from scipy.spatial.transform import Rotation

Field = tuple[str | int, ...]

TEMPLATE = bundled_rig()
WRITTEN = tomllib.loads(
    (files("bolfi_liquids.hardware.data") / "rig.toml").read_text(encoding="utf-8")
)
FACTORS = {"0": 0, "its negative": -1, "a tenth": 0.1, "ten times": 10, "a hundred times": 100}
INSTEAD_OF_ZERO = 1  # what is multiplied where the file has 0
POURS = [  # as the bundled cups allow: slowest and fastest, nearest and farthest
    {"angular_velocity": np.radians(rate), "distance": distance}
    for rate, distance in ((30.0, 0.0), (180.0, 0.07))
]
TURN = {"final_angle": np.radians(135.0), "hold": 0.9}
LIP_HEIGHT = 0.2  # m
SHOWN_CYCLES = 2  # further ones repeat the second
ROUNDING = 1e-6
_ASKED: dict[str, bool] = {}


def numbers(written: object = WRITTEN, field: Field = ()) -> Iterator[tuple[Field, float]]:
    """Each number of the file, with the way to it."""
    if isinstance(written, dict | list):
        items = written.items() if isinstance(written, dict) else enumerate(written)
        for key, value in items:
            yield from numbers(value, (*field, key))
    elif isinstance(written, int | float) and not isinstance(written, bool):
        yield field, written


def name_of(field: Field) -> str:
    return ".".join(map(str, field))


def changed(field: Field, value: float, written: object = WRITTEN) -> object:
    """The file with one number replaced."""
    if not field:
        return value
    first, rest = field[0], field[1:]
    if isinstance(written, dict):
        return {k: changed(rest, value, v) if k == first else v for k, v in written.items()}
    assert isinstance(written, list)
    return [changed(rest, value, v) if k == first else v for k, v in enumerate(written)]


def outcome(field: Field, value: float, factor: str, directory: Path) -> str:
    """What becomes of the file with a number times a factor: how it is refused, or "harmless".

    Raises:
        AssertionError: A motion can be planned that leaves the template's boxes or rates.
    """
    path = directory / "rig.toml"
    wrong = FACTORS[factor] * (value or INSTEAD_OF_ZERO)
    path.write_text(tomli_w.dumps(changed(field, wrong)), encoding="utf-8")  # pyright: ignore
    try:
        rig = open_rig(path)
    except RigError as err:
        assert err.where.startswith(str(path)) and err.fix and "\n" not in str(err)
        return "refused"
    return planned(rig.model_copy(update={"cameras": TEMPLATE.cameras}))


@cache
def planned(rig: Rig) -> str:
    """What becomes of the motions of a rig, as `outcome` says it."""
    refused = [name for name, motions in (("stir", stirs), ("pour", pours)) if _no(motions, rig)]
    return f"refused to {' or '.join(refused)}" if refused else "harmless"


def _no(motions, rig: Rig) -> bool:
    """Whether one is refused; those before it are harmless."""
    try:
        for tool, path in motions(rig):
            if not _allowed(path, rig, tool):
                return True
            judge(path, rig, tool)
    except RigError:
        return True
    return False


def _allowed(path: PosePath, rig: Rig, tool: Tool) -> bool:
    """Whether `check_path` lets it pass, which is asked once for all rigs that it does not tell."""
    parts = (tool, *path, *workspace(rig, tool), rig.robot.rate, rig.limits, rig.cup, rig.stick)
    told = sha256(pickle.dumps(parts)).hexdigest()
    if told not in _ASKED:
        try:
            check_path(path, rig, tool)
        except MotionRejected:
            _ASKED[told] = False
        else:
            _ASKED[told] = True
    return _ASKED[told]


def stirs(rig: Rig) -> Iterator[tuple[Tool, PosePath]]:
    """The way to the cup from a place near its box's corner, the stir, and out again."""
    beside = above_cup(TEMPLATE) + [0.02, 0.02, -0.02, 0.0, 0.0, 0.0]
    yield "stirring", approach(rig, placed(above_cup(rig), x=beside[0], y=beside[1], z=beside[2]))
    yield "stirring", insert(rig)
    stir = strokes(rig, min(rig.stirring.cycles, SHOWN_CYCLES))
    for stroke in stir:
        yield "stirring", stroke
    yield "stirring", retract(rig, stir[-1].pose[-1, :3])


def pours(rig: Rig) -> Iterator[tuple[Tool, PosePath]]:
    """The way to the receiver, pours as the bundled cups allow, and one that is given up."""
    for action in POURS:
        place = {"distance": action["distance"], "lip_height": LIP_HEIGHT}
        beside = ready_to_pour(rig, **place) + [-0.05, 0.05, -0.05, 0.0, 0.0, 0.0]
        yield "pouring", approach_pour(rig, beside, **place)
        path = pour_path(rig, lip_height=LIP_HEIGHT, **action, **TURN)
        yield "pouring", path
        yield "pouring", upright_again(rig, path, 0.5 * path.duration)


def judge(path: PosePath, rig: Rig, tool: Tool) -> None:
    """A planned path against the template's limits, without the code that plans or checks."""
    dt = np.diff(path.time)
    assert (dt > 0.0).all()
    limits, box = TEMPLATE.limits, getattr(TEMPLATE.limits, tool)
    in_base = cup_frame(rig.cup).to_base(path.pose)
    for pose in (path.pose, cup_frame(TEMPLATE.cup).from_base(in_base)):
        position = pose[:, :3]
        assert (position >= box.low - ROUNDING).all() and (position <= box.high + ROUNDING).all()
    step = np.linalg.norm(np.diff(path.pose[:, :3], axis=0), axis=1)
    assert (step / dt).max() <= limits.speed * (1.0 + ROUNDING)
    turns = Rotation.from_rotvec(path.pose[:, 3:])
    rate = (turns[:-1].inv() * turns[1:]).magnitude() / dt
    assert rate.max() <= np.radians(limits.tilt_rate_deg_s) * (1.0 + ROUNDING)
    if tool == "stirring":
        down = -turns.as_matrix()[:, 2, 2]
        assert (down >= np.cos(MAX_TILT["stirring"])).all()


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
