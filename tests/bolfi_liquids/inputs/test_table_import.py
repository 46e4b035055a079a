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


def merged(truth):
    """Changes a table into a robot's log at 125 Hz and a camera's, merged by their times."""

    def change(rows):
        camera = [row[:1] + ["", "", ""] + row[4:] for row in rows[1:]]
        times = np.arange(truth.time[0], truth.time[-1], 0.008)
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


def test_a_robot_s_fast_log_is_interpolated_to_the_cameras_and_named(
    tmp_path, written, truth, caplog
):
    caplog.set_level("INFO")
    table = table_of(tmp_path / "merged.csv", truth, merged(truth))
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


MAP_SLIPS = {
    "another unit": ('unit = "deg"', 'unit = "rad"', ("inclination_xz", "7.79", "in the map")),
    "no offset": ('"mm", offset = -120.0', '"mm"', ("z, ", "above the")),
    "unknown unit": ('unit = "ms"', 'unit = "hours"', ("columns.time.0.unit", "'ms'", "'hours'")),
    "unknown column": ("time = {", "tine = {", ("columns.tine", "did you mean time")),
    "no column": ('inclination_yz = { column = "B"', "#", ("'inclination_yz'",)),
    "a turn": ("skip = 2", "skip = 2\nyaw_deg = 4500", ("yaw_deg",)),
    "one column twice": ('"X", unit = "mm"', '"Y", unit = "mm"', ("columns: y and x",)),
    "no unit": ('"X", unit = "mm"', '"X"', ("columns.x.unit",)),
    "two weights": (
        "[attributes]",
        '[attributes]\nstick_mass = { value = 9.0, unit = "g" }',
        ("both are given",),
    ),
}


@pytest.mark.parametrize(("old", "new", "says"), MAP_SLIPS.values(), ids=MAP_SLIPS)
def test_a_map_that_cannot_be_right_is_named(tmp_path, written, old, new, says):
    table, columns = written
    text = columns.read_text()
    assert old in text
    columns.write_text(text.replace(old, new))
    with pytest.raises(ValueError) as refused:
        import_table(table, columns, tmp_path / "stir.nc")
    assert all(part in str(refused.value) for part in says), refused.value
    assert not (tmp_path / "stir.nc").exists()


@pytest.mark.parametrize("name", ["stir.csv", "other.nc"])
def test_nothing_but_an_import_is_written_over(tmp_path, written, name):
    (tmp_path / "other.nc").write_text("mine")
    before = (tmp_path / name).read_bytes()
    with pytest.raises(ValueError, match=name):
        import_table(*written, tmp_path / name)
    assert (tmp_path / name).read_bytes() == before


def test_an_import_may_be_made_again_and_tells_what_it_leaves_out(tmp_path, written, caplog):
    caplog.set_level("INFO")
    again = [import_table(*written, tmp_path / "stir.nc").hash for _ in range(2)]
    assert len(set(again)) == 1
    assert "stir.csv: columns not used: note" in caplog.records[0].getMessage()


def test_what_was_read_is_outlined_and_a_stir_from_the_middle_warned_of(tmp_path, written, truth):
    assert "cup: radius 4 cm" in outline(truth) and "liquid: 1000 kg/m" in outline(truth)
    assert not any("warning" in outline(bundled_recording(liquid)) for liquid in RECORDED_LIQUIDS)
    table = table_of(tmp_path / "late.csv", truth, lambda rows: rows.__delitem__(slice(1, 60)))
    found = import_table(table, written[1], tmp_path / "late.nc")
    (warned,) = [line for line in outline(found).splitlines() if line.startswith("warning")]
    assert "late.nc" in warned and "starts in motion" in warned


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
    text = columns.read_text()
    for yaw in (0, -90):  # the advice counts from what the map says
        columns.write_text(f"yaw_deg = {yaw}\n" + text)
        (warning,) = recording_warnings([import_table(table, columns, tmp_path / "turned.nc")])
        (more,) = re.findall(r"add (-?\d+) to `yaw_deg`", warning)
        assert int(more) + yaw == pytest.approx(30, abs=6)  # water turns the stick by some degrees
    columns.write_text("yaw_deg = 30\n" + text)
    mended = import_table(table, columns, tmp_path / "mended.nc")
    np.testing.assert_allclose(mended.gripper.position, truth.gripper.position, atol=1e-8)
    assert "warning" not in outline(mended)
