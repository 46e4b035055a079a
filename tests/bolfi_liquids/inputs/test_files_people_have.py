"""Files as recorders, clocks, scales, spreadsheets and hands leave them: read, or refused."""

from datetime import UTC, datetime, timedelta
from importlib.resources import files

import numpy as np
import pytest
from bolfi_liquids.hardware import open_rig
from bolfi_liquids.hardware.motion import star

from bolfi_liquids.errors import InputError
from bolfi_liquids.inputs.bundled import RECORDED_LIQUIDS, bundled_recording
from bolfi_liquids.inputs.cups import cups_of
from bolfi_liquids.inputs.open import open_recording
from bolfi_liquids.inputs.pour_table import open_pours
from bolfi_liquids.inputs.recording import JUMPS, UNITS, torn_values
from bolfi_liquids.inputs.table_import import import_table, outline

FIELDS = tuple(UNITS)
EPOCH = 1_764_250_000
SIZES = ("cup_radius", "cup_height", "fill", "stick_radius", "stick_length")


@pytest.fixture(scope="module")
def truth():
    return bundled_recording("water")


@pytest.fixture
def made(tmp_path, truth):
    """Imports a table of texts, whose first row is the header."""

    def run(rows, columns="", head="", separator=","):
        sizes = [f'{name} = {{ value = {truth.number(name)!r}, unit = "m" }}' for name in SIZES]
        density = 'liquid_density = { value = 1.0, unit = "g/ml" }'
        stick = truth.number("stick_density")
        sizes += [density, f'stick_density = {{ value = {stick!r}, unit = "kg/m3" }}']
        text = "\n".join([head, "[columns]", columns, "[attributes]", *sizes, ""])
        (tmp_path / "columns.toml").write_text(text)
        lines = [separator.join(row) for row in rows]
        (tmp_path / "stir.csv").write_text("\n".join(lines) + "\n")
        return import_table(tmp_path / "stir.csv", tmp_path / "columns.toml", tmp_path / "s.nc")

    return run


def rows_of(truth, header=FIELDS):
    values = zip(*(truth.values(name) for name in FIELDS), strict=True)
    return [list(header), *([repr(float(value)) for value in row] for row in values)]


def with_time(rows, header, texts):
    """The table with other columns of time in front."""
    return [
        [*header, *rows[0][1:]],
        *([*t, *row[1:]] for t, row in zip(texts, rows[1:], strict=True)),
    ]


def seconds_and_nanoseconds(rows, truth):
    stamps = [divmod(round(1e9 * t) + EPOCH * 10**9, 10**9) for t in truth.time]
    return with_time(rows, ("sec", "nanosec"), [(str(sec), str(rest)) for sec, rest in stamps])


def dates(form):
    def change(rows, truth):
        begin = datetime.fromtimestamp(EPOCH, UTC)
        stamps = (begin + timedelta(seconds=float(t)) for t in truth.time)
        texts = [(one.isoformat() if form is None else one.strftime(form),) for one in stamps]
        return with_time(rows, ("time",), texts)

    return change


def german(rows, truth):
    return [[cell.replace(".", ",") for cell in row] for row in rows]


def two_rows_a_stamp(rows, truth):
    """The arm's row before the cameras', at the same stamp."""
    both = ((row[:4] + ["", ""], row[:1] + [""] * 3 + row[4:]) for row in rows[1:])
    return [rows[0], *(row for pair in both for row in pair)]


ISO = {"columns": 'time = { column = "time", unit = "iso" }'}
READ = {
    "seconds and nanoseconds": (
        seconds_and_nanoseconds,
        {"columns": 'time = [{ column = "sec", unit = "s" }, { column = "nanosec", unit = "ns" }]'},
    ),
    "ISO 8601": (dates(None), ISO),
    "semicolon and decimal comma": (german, {"separator": ";"}),
    "arm and camera share stamps": (two_rows_a_stamp, {}),
    "a rate in place of times": (
        lambda rows, truth: [row[1:] for row in rows],
        {"head": "rate_hz = 30.0"},
    ),
}


@pytest.mark.parametrize(("change", "options"), READ.values(), ids=READ)
def test_what_says_what_it_is_is_read(made, truth, change, options):
    found = made(change(rows_of(truth), truth), **options)
    np.testing.assert_allclose(found.time - found.time[0], truth.time - truth.time[0], atol=1e-6)
    np.testing.assert_allclose(found.gripper.position, truth.gripper.position, atol=1e-12)
    np.testing.assert_allclose(found.inclination, truth.inclination, atol=1e-12)


def few_decimals(rows, truth):
    return with_time(rows, ("time",), [(f"{t / 4:.2f}",) for t in truth.time])


def two_clocks(rows, truth):
    """The arm's log at four times the cameras' rate, and theirs an hour later."""
    arm = [
        [repr(float(row[0]) + 0.008 * k), *row[1:4], "", ""] for row in rows[1:] for k in range(4)
    ]
    camera = [[repr(float(row[0]) + 3600.0), "", "", "", *row[4:]] for row in rows[1:]]
    return [rows[0], *arm, *camera]


def hour_given_back(rows, truth):
    return with_time(rows, ("time",), [(repr(float(t - 3600 * (t > 3))),) for t in truth.time])


def many_torn(rows, truth):
    for row in rows[3::20]:
        row[4] = "1.2"
    return rows


def held(columns, count):
    """Values that are updated in one of so many rows."""

    def change(rows, truth):
        others = [row for at, row in enumerate(rows[1:])]
        kept = [others[at // count * count] for at in range(len(others))]
        return [
            rows[0],
            *(
                [(old if at in columns else new)[at] for at in range(len(new))]
                for new, old in zip(others, kept, strict=True)
            ),
        ]

    return change


REFUSED = {
    "few decimals": (
        few_decimals,
        {},
        ("201 stamps", "168 distinct", "2 decimals", "rate"),
    ),
    "no header": (lambda rows, truth: rows[1:], {}, ("line 1", "time,x,y,z", "names")),
    "dd.mm.yyyy": (dates("%d.%m.%Y %H:%M:%S.%f"), {}, ("line 2", "27.11.2025", "2026-", "iso")),
    "time of day": (dates("%H:%M:%S.%f"), {}, ("line 2", "13:26:40", "iso")),
    "two clocks": (two_clocks, {}, ("clocks", "3600 s", "shift")),
    "a stamp left out": (
        lambda rows, truth: [*rows[:81], ["", *rows[81][1:]], *rows[82:]],
        {},
        ("time", "missing stamps = 1", "sample 80"),
    ),
    "a jump of two rows": (
        lambda rows, truth: [
            [row[0], "0.3", *row[2:]] if at in (81, 82) else row for at, row in enumerate(rows)
        ],
        {},
        ("x, y, z", "jump", "after sample 79"),
    ),
    "an hour given back": (hour_given_back, {}, ("time", "-3599.97 s", "set back")),
    "many torn": (many_torn, {}, ("10 of 201", "sample 2", "record again")),
    "poses held": (held((1, 2, 3), 6), {}, ("x, y, z", "stairs = 0.2 s", "5 Hz", "NaN")),
    "doubled angles": (held((4, 5), 2), {}, ("inclination_xz", "stairs", "15 Hz", "NaN")),
    "thousands": (
        lambda rows, truth: [*rows[:5], [*rows[5][:1], "1 234.5", *rows[5][2:]], *rows[6:]],
        {},
        ("line 6", "column x", "1 234.5", "thousands"),
    ),
    "two tables": (
        lambda rows, truth: [["cup", "0.04"], *rows],
        {},
        ("line 2", "6 cells", "one table"),
    ),
}


@pytest.mark.parametrize(("change", "options", "said"), REFUSED.values(), ids=REFUSED)
def test_what_is_ambiguous_is_refused_with_its_place_and_cure(
    made, truth, tmp_path, change, options, said
):
    with pytest.raises(InputError) as refused:
        made(change(rows_of(truth), truth), **options)
    for part in ("stir.csv", *said):
        assert part in str(refused.value)
    assert "remove the line" not in str(refused.value)
    assert not (tmp_path / "s.nc").exists()


def test_what_a_plane_or_the_stamps_suffered_is_warned_of(made, truth):
    """`test_frame` holds all of these faults."""
    rows = rows_of(truth)
    late = np.interp(truth.time - 0.2, truth.time, truth.inclination[:, 1])
    for row, angle in zip(rows[1:], late, strict=True):
        row[5] = repr(float(angle))
    assert "warning: inclination_yz comes 0.2 s later" in outline(made(rows))


@pytest.mark.parametrize(
    ("field", "value", "sample"),
    [("x", "-4.7e226", 80), ("z", "3e-246", 80), ("inclination_xz", "1.05", 80), ("y", "0.1", 0)],
)
def test_one_torn_value_is_named_and_missing(made, truth, tmp_path, field, value, sample):
    rows = rows_of(truth)
    rows[sample + 1][FIELDS.index(field)] = value
    made(rows)
    found = open_recording(tmp_path / "s.nc")
    (told,) = found.torn
    assert told.startswith(f"{field}: ") and f"sample {sample} " in told
    for name in FIELDS:
        expected = truth.values(name).copy()
        expected[sample] = np.nan if name == field else expected[sample]
        np.testing.assert_allclose(found.values(name), expected, atol=1e-12)


@pytest.mark.parametrize("rate", [10.0, 125.0])  # Hz
def test_neither_a_stir_nor_the_corners_of_a_fast_path_are_torn(rate):
    assert not any(bundled_recording(liquid).torn for liquid in RECORDED_LIQUIDS)
    assert not torn_values(0.06 * np.arange(9.0), JUMPS["x"]).any()  # each far from both
    for speed in (0.1, 1.0):  # m/s
        path = star(speed=speed, height=0.2, radius=0.1)
        time = np.arange(path.time[0], path.time[-1], 1.0 / rate)
        for axis, jump in zip(path.position.T, JUMPS.values(), strict=False):
            assert not torn_values(np.interp(time, path.time, axis), jump).any()


@pytest.mark.parametrize("shown", ["-0.3", "-0.6"])
def test_a_scale_s_drift_is_0_within_its_error_and_refused_beyond(tmp_path, shown):
    rows = ["45,1,100,4,0", f"90,1,104,0,{shown}", "120,1,90,7,7"]
    header = "angular_velocity_deg_s,distance_cm,received,retained,spilled"
    (tmp_path / "pours.csv").write_text("\n".join([header, *rows, ""]))
    if shown == "-0.3":
        np.testing.assert_allclose(open_pours(tmp_path / "pours.csv").fractions[1], [0, 1, 0])
        return
    with pytest.raises(InputError, match="line 3, column spilled: .*drift"):
        open_pours(tmp_path / "pours.csv")


CUPS, RIG = ("bolfi_liquids.data", "cups.toml"), ("bolfi_liquids.hardware.data", "rig.toml")
WRITTEN = {
    "radius in cm": (CUPS, "radius = 0.028", "radius = 2.8", ("source.radius", "0.005 to 0.25 m")),
    "contact angle in rad": (CUPS, "60.0 ", "1.05 ", ("contact_angle_deg", "radians")),
    "final angle in rad": (CUPS, "135.0", "2.36", ("final_angle_deg", "5 to 180 deg")),
    "rounds a second": (
        CUPS,
        "[30.0, 180.0]",
        "[0.1, 0.5]",
        ("velocity_deg_s.0", "0.573"),
    ),
    "hold in ms": (CUPS, "hold = 0.9", "hold = 900.0", ("pour.hold", "0 to 60 s")),
    "low angle": (CUPS, "135.0", "13.5", ("final_angle_deg", "43 deg")),
    "unknown key": (CUPS, "lip_height", "lip_hight", ("pour.lip_hight", "lip_height?")),
    "a key like none": (CUPS, "radius = 0.028", "diameter = 0.056", ("source.diameter", "radius")),
    "joints in deg": (RIG, "start = [1.76", "start = [101.0", ("robot.start.0", "6.28319 rad")),
    "unknown key of a rig": (RIG, "yaw_deg", "yaw_dg", ("cup.yaw_dg", "yaw_deg?")),
    "not TOML": (CUPS, "[source]", "[source", ("line 2",)),
}


@pytest.mark.parametrize(("file", "old", "new", "said"), WRITTEN.values(), ids=WRITTEN)
def test_a_slip_in_cups_or_rig_is_named_with_both_ends(tmp_path, file, old, new, said):
    package, name = file
    text = (files(package) / name).read_text(encoding="utf-8")
    assert old in text
    (tmp_path / name).write_text(text.replace(old, new, 1), encoding="utf-8")
    with pytest.raises(ValueError) as refused:
        (cups_of if file == CUPS else open_rig)(tmp_path / name)
    for part in (name, *said):
        assert part in str(refused.value)


@pytest.mark.parametrize("file", [CUPS, RIG])
def test_all_missing_fields_are_named_at_once(tmp_path, file):
    package, name = file
    lines = (files(package) / name).read_text(encoding="utf-8").splitlines()
    kept = [line for line in lines if not line.startswith(("radius", "height", "lip_height"))]
    (tmp_path / name).write_text("\n".join(kept), encoding="utf-8")
    with pytest.raises(ValueError) as refused:
        (cups_of if file == CUPS else open_rig)(tmp_path / name)
    missing = ("source.radius", "receiver.height", "pour.lip_height")
    if file == RIG:
        missing = ("cup.radius", "stick.radius", "stirring.height")
    assert all(one in str(refused.value) for one in missing)
