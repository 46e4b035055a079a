"""A table in other columns, units and signs becomes the recording that it was made from."""

import re
from importlib.resources import files

import numpy as np
import pytest

import bolfi_liquids as bl
from bolfi_liquids.inputs.bundled import RECORDED_LIQUIDS, bundled_recording, write_template
from bolfi_liquids.inputs.frame import recording_warnings
from bolfi_liquids.inputs.table_import import (
    at_camera_times,
    import_table,
    open_table_map,
    outline,
)

TRUTH = files("bolfi_liquids.data") / "water_v10.nc"
OFFSET = 120.0  # mm, of the robot's z above the cup's floor

MAP = """
delimiter = ";"
decimal = ","
skip = 2
source = "a robot in the cellar"

[columns]
time = { column = "t (ms)", unit = "ms" }
x = { column = "X", unit = "mm" }
y = { column = "Y", unit = "mm", flip = true }
z = { column = "Z", unit = "mm", offset = -120.0 }
inclination_xz = { column = "A", unit = "deg" }
inclination_yz = { column = "B", unit = "mrad", flip = true }

[attributes]
"""


@pytest.fixture(scope="module")
def truth():
    return bl.open_recording(TRUTH)


@pytest.fixture
def written(tmp_path, truth):
    """The table and its map."""
    (tmp_path / "columns.toml").write_text(MAP + attributes(truth))
    return table_of(tmp_path / "stir.csv", truth), tmp_path / "columns.toml"


def attributes(truth):
    mm = ("cup_radius", "cup_height", "fill", "stick_radius", "stick_length")
    lines = [f'{name} = {{ value = {1000 * truth.attrs[name]!r}, unit = "mm" }}' for name in mm]
    density = truth.attrs["liquid_density"] / 1000
    lines.append(f'liquid_density = {{ value = {density!r}, unit = "g/cm3" }}')
    lines.append(f'stick_density = {{ value = {truth.attrs["stick_density"]!r}, unit = "kg/m3" }}')
    return "\n".join(lines) + "\n"


def table_of(path, truth, change=lambda rows: None):
    x, y, z = truth.gripper.position.T
    xz, yz = truth.inclination.T
    columns = (1e3 * truth.time, 1e3 * x, -1e3 * y, 1e3 * z + OFFSET, np.degrees(xz), -1e3 * yz)
    rows = [["t (ms)", "X", "Y", "Z", "A", "B", "note"]]
    rows += [
        [f"{value:.9g}".replace(".", ",") for value in row] + ["ok"]
        for row in zip(*columns, strict=True)
    ]
    change(rows)
    lines = ["made by hand", "", *(";".join(row) for row in rows)]
    path.write_text("\n".join(lines) + "\n\n", encoding="utf-8-sig")
    return path


def test_the_recording_is_what_the_table_was_made_from(written, truth, tmp_path):
    found = import_table(*written, tmp_path / "stir.nc")
    np.testing.assert_allclose(found.time, truth.time, atol=1e-8)
    np.testing.assert_allclose(found.gripper.position, truth.gripper.position, atol=1e-8)
    np.testing.assert_allclose(found.inclination, truth.inclination, atol=1e-8)
    for name in ("cup_radius", "fill", "stick_density", "liquid_density"):
        assert found.number(name) == pytest.approx(truth.number(name))
    assert found.attrs["source"] == "a robot in the cellar"
    assert found.attrs["imported_from"] == "stir.csv"
    # whoever has the file alone can repeat it
    assert '"offset":-120.0' in found.attrs["imported_with"]


def test_cells_without_a_number_are_missing_samples(tmp_path, written, truth):
    def blind(rows):
        for at, cell in ((40, ""), (41, "NaN"), (42, "n/a")):
            rows[at][4] = cell
        rows[50][5] = ""

    table = table_of(tmp_path / "blind.csv", truth, blind)
    found = import_table(table, written[1], tmp_path / "blind.nc")
    missing = [list(np.flatnonzero(np.isnan(angle))) for angle in found.inclination.T]
    assert missing == [[39, 40, 41], [49]]
    assert "seen in" in outline(found)


def merged(truth, *, robot, share=1.0, blind=slice(0, 0)):
    """Changes a table into a robot's log and a camera's, merged by their times."""

    def change(rows):
        camera = [row[:1] + ["", "", ""] + row[4:] for row in rows[1:]]
        for row in camera[blind]:
            row[4:6] = ["", ""]
        times = np.arange(truth.time[0], share * truth.time[-1], 1.0 / robot)
        way = [np.interp(times, truth.time, axis) for axis in truth.gripper.position.T]
        columns = (1e3 * times, 1e3 * way[0], -1e3 * way[1], 1e3 * way[2] + OFFSET)
        of_robot = [
            [f"{value:.9g}".replace(".", ",") for value in row] + ["", "", ""]
            for row in zip(*columns, strict=True)
        ]
        taken = {row[0] for row in of_robot}
        both = of_robot + [row for row in camera if row[0] not in taken]
        seen = {row[0]: row for row in camera}
        for row in of_robot:
            row[4:] = seen.get(row[0], row)[4:]
        rows[1:] = sorted(both, key=lambda row: float(row[0].replace(",", ".")))

    return change


@pytest.mark.parametrize("robot", [125.0, 500.0])
def test_a_robot_s_fast_log_is_interpolated_to_the_cameras_and_named(
    tmp_path, written, truth, caplog, robot
):
    caplog.set_level("INFO")
    table = table_of(tmp_path / "merged.csv", truth, merged(truth, robot=robot))
    found = import_table(table, written[1], tmp_path / "merged.nc")
    count = len(found.time)  # the robot's log ends a little before the cameras'
    assert len(truth.time) - 2 <= count <= len(truth.time)
    np.testing.assert_allclose(found.time, truth.time[:count], atol=1e-8)
    np.testing.assert_allclose(found.inclination, truth.inclination[:count], atol=1e-8)
    seen = np.isfinite(found.gripper.position).all(axis=1)
    assert seen[:-3].all()
    apart = found.gripper.position[seen] - truth.gripper.position[:count][seen]
    assert np.abs(apart).max() < 5e-4  # 0.1 m/s for 4 ms
    for said in (caplog.text, found.attrs["history"]):
        assert "x, y, z were interpolated" in said and "inclination_xz" in said


def test_a_stick_that_is_out_of_sight_is_not_taken_for_a_slow_camera(tmp_path, written, truth):
    def blind(rows):
        for row in rows[len(rows) // 3 :]:
            row[4] = row[5] = ""

    table = table_of(tmp_path / "blind.csv", truth, blind)
    with pytest.raises(ValueError, match="inclination_xz: .*135 of 201"):
        import_table(table, written[1], tmp_path / "blind.nc")
    values = {"time": np.arange(90) / 30.0} | {name: np.zeros(90) for name in "xyz"}
    angle = np.full(90, np.nan)
    angle[np.r_[0:10, 40:50, 80:90]] = 0.1
    same, told = at_camera_times(values | {"inclination_xz": angle, "inclination_yz": angle})
    assert told == "" and len(same["time"]) == 90


def test_the_robot_s_own_gap_is_not_filled():
    time = np.arange(0.0, 6.0, 0.008)
    seen = np.arange(len(time)) % 4 == 2
    known = ~seen & ~((time > 2.0) & (time < 3.0))
    angle, place = np.where(seen, 0.1, np.nan), np.where(known, time, np.nan)
    values = {"time": time, "inclination_xz": angle, "inclination_yz": angle}
    made, told = at_camera_times(values | dict.fromkeys("xyz", place))
    inside = (made["time"] > 2.01) & (made["time"] < 2.99)
    outside = (made["time"] < 1.98) | (made["time"] > 3.02)
    assert told and np.isnan(made["x"][inside]).all()
    np.testing.assert_allclose(made["x"][outside][:-1], made["time"][outside][:-1])


@pytest.mark.parametrize(
    ("change", "says"),
    [
        (lambda rows: rows[7].__setitem__(1, "1.5.2"), r"line 10, column X: '1.5.2' is no number"),
        (lambda rows: rows[0].__setitem__(4, "Angle"), "no column 'A' among"),
        (lambda rows: rows[0].__setitem__(6, "X"), "2 columns are named 'X'"),
        (lambda rows: rows.insert(20, rows[21]), "repeated stamps = 1"),
        (lambda rows: rows.clear(), "no column"),
        (
            lambda rows: rows[7].__delitem__(slice(3, None)),
            "line 10: 3 cells, where the header has 7",
        ),
        (lambda rows: rows.__delitem__(slice(5, None)), "number of samples = 4"),
    ],
)
def test_what_cannot_be_used_is_named(tmp_path, written, truth, change, says):
    table = table_of(tmp_path / "bad.csv", truth, change)
    with pytest.raises(ValueError, match=says):
        import_table(table, written[1], tmp_path / "bad.nc")
    assert not (tmp_path / "bad.nc").exists()


@pytest.mark.parametrize(
    ("old", "new", "says"),
    [
        ('unit = "deg"', 'unit = "rad"', "inclination_xz: .*7.79.* rad.*in the map"),
        ('"Z", unit = "mm", offset = -120.0', '"Z", unit = "mm"', "z, .*above the"),
        ('unit = "ms"', 'unit = "hours"', "columns.time.0.unit: .*'s', 'ms'.*'hours'"),
        ("time = {", "tine = {", "columns.tine: .*did you mean time"),
        (
            'inclination_yz = { column = "B", unit = "mrad", flip = true }',
            "",
            "no column 'inclination_yz'",
        ),
        ("skip = 2", 'skip = "2"', "skip"),
        ("skip = 2", "skip 2", "not TOML"),
        (
            "liquid_density = { value",
            "liquid_densty = { value",
            "liquid_densty: .*did you mean liquid_density",
        ),
        ('"X", unit = "mm"', '"Y", unit = "mm"', "columns: y and x are both 'Y'"),
        ('"X", unit = "mm"', '"X", units = "mm"', "columns.x.units: is no field that is known"),
        ('"X", unit = "mm"', '"X"', "columns.x.unit: is missing"),
        (
            "[attributes]",
            '[attributes]\nstick_mass = { value = 9.0, unit = "g" }',
            "both are given",
        ),
    ],
)
def test_a_map_that_cannot_be_right_is_named(tmp_path, written, old, new, says):
    table, columns = written
    text = columns.read_text()
    assert old in text
    columns.write_text(text.replace(old, new))
    with pytest.raises(ValueError, match=says):
        import_table(table, columns, tmp_path / "stir.nc")
    assert not (tmp_path / "stir.nc").exists()


@pytest.mark.parametrize("liquid", RECORDED_LIQUIDS)
def test_what_a_stick_does_is_not_warned_of(liquid):
    assert "warning" not in outline(bundled_recording(liquid))


@pytest.mark.parametrize(
    ("old", "new", "says"),
    [
        ('"B", unit = "mrad", flip = true', '"B", unit = "mrad"', "_yz, or of y, is wrong"),
        ('"X", unit = "mm" }', '"X", unit = "mm", flip = true }', "_xz, or of x, is wrong"),
        ("inclination_xz = {", "swap", "exchanged"),
    ],
)
def test_a_stick_that_cannot_lean_so_is_warned_of(tmp_path, written, old, new, says):
    table, columns = written
    text = columns.read_text()
    if new == "swap":
        rest = text.replace("inclination_xz =", "X =").replace(
            "inclination_yz =", "inclination_xz ="
        )
        columns.write_text(rest.replace("X =", "inclination_yz ="))
    else:
        columns.write_text(text.replace(old, new))
    told = outline(import_table(table, columns, tmp_path / "stir.nc"))
    assert re.search(f"warning: .*{says}", told)


def test_sizes_are_told_as_a_person_measures_them(truth):
    assert "cup: radius 4 cm" in outline(truth) and "liquid: 1000 kg/m" in outline(truth)


@pytest.mark.parametrize("name", ["stir.csv", "columns.toml", "other.nc"])
def test_nothing_but_an_import_is_written_over(tmp_path, written, name):
    (tmp_path / "other.nc").write_text("mine")
    before = (tmp_path / name).read_bytes()
    with pytest.raises(ValueError, match="ends in|exists already, and is no import"):
        import_table(*written, tmp_path / name)
    assert (tmp_path / name).read_bytes() == before


def test_columns_that_the_map_leaves_out_are_told(tmp_path, written, caplog):
    caplog.set_level("INFO")
    import_table(*written, tmp_path / "stir.nc")
    (told,) = caplog.records
    assert "stir.csv: columns not used: note" in told.getMessage()


def test_a_stir_from_the_middle_is_imported_and_warned_of(tmp_path, written, truth):
    table = table_of(tmp_path / "late.csv", truth, lambda rows: rows.__delitem__(slice(1, 60)))
    found = import_table(table, written[1], tmp_path / "late.nc")
    (warned,) = [line for line in outline(found).splitlines() if line.startswith("warning")]
    assert "late.nc" in warned and "starts in motion" in warned


def test_an_import_may_be_made_again(tmp_path, written):
    again = [import_table(*written, tmp_path / "stir.nc").hash for _ in range(2)]
    assert len(set(again)) == 1


def test_the_template_is_a_map_and_overwrites_nothing(tmp_path):
    path = write_template("columns.toml", tmp_path / "columns.toml")
    assert open_table_map(path).columns.time[0].unit == "ms"
    with pytest.raises(ValueError, match="exists already"):
        write_template("columns.toml", path)


def test_a_turned_cup_frame_is_warned_of_and_yaw_turns_it_back(tmp_path, written, truth):
    def turn(rows):
        """As a robot writes it whose x axis points 30 degrees clockwise of the cameras'."""
        for row in rows[1:]:
            x, y = (float(row[k].replace(",", ".")) for k in (1, 2))
            way = np.exp(-1j * np.radians(30.0)) * (x - 1j * y)  # the table's y is flipped
            row[1:3] = [f"{value:.9g}".replace(".", ",") for value in (way.real, -way.imag)]

    table, columns = table_of(tmp_path / "turned.csv", truth, turn), written[1]
    found = import_table(table, columns, tmp_path / "turned.nc")
    (warning,) = [line for line in outline(found).splitlines() if line.startswith("warning")]
    (yaw,) = re.findall(r"add (-?\d+) to `yaw_deg`", warning)
    assert int(yaw) == pytest.approx(30, abs=6)  # water turns the stick by some degrees itself
    text = columns.read_text()
    columns.write_text("yaw_deg = -90\n" + text)  # the advice counts from what the map says
    (warning,) = recording_warnings([import_table(table, columns, tmp_path / "worse.nc")])
    (more,) = re.findall(r"add (-?\d+) to `yaw_deg`", warning)
    assert int(more) - 90 == pytest.approx(30, abs=6)
    columns.write_text("yaw_deg = 30\n" + text)
    mended = import_table(table, columns, tmp_path / "mended.nc")
    np.testing.assert_allclose(mended.gripper.position, truth.gripper.position, atol=1e-8)
    assert "warning" not in outline(mended)


def test_a_yaw_that_is_no_angle_is_refused(tmp_path, written):
    table, columns = written
    columns.write_text("yaw_deg = 4500\n" + columns.read_text())
    with pytest.raises(ValueError, match="yaw_deg"):
        import_table(table, columns, tmp_path / "stir.nc")
