"""Tables as recorders, clocks and spreadsheets leave them: read as what they are, or refused."""

from datetime import UTC, datetime, timedelta

import numpy as np
import pytest
from bolfi_liquids.hardware.motion import star

from bolfi_liquids.errors import InputError
from bolfi_liquids.inputs.bundled import RECORDED_LIQUIDS, bundled_recording
from bolfi_liquids.inputs.open import open_recording
from bolfi_liquids.inputs.recording import JUMPS, torn_values
from bolfi_liquids.inputs.table_import import import_table

FIELDS = ("time", "x", "y", "z", "inclination_xz", "inclination_yz")
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
    columns = [truth.time, *truth.gripper.position.T, *truth.inclination.T]
    values = zip(*columns, strict=True)
    return [list(header), *([repr(float(value)) for value in row] for row in values)]


def with_time(rows, header, texts):
    """The table with other columns of time in front."""
    return [
        [*header, *rows[0][1:]],
        *([*t, *row[1:]] for t, row in zip(texts, rows[1:], strict=True)),
    ]


def seconds_and_nanoseconds(rows, truth):
    stamps = [divmod(round(1e9 * t) + EPOCH * 10**9, 10**9) for t in truth.time]
    texts = [(str(sec), str(nanosec)) for sec, nanosec in stamps]
    return with_time(rows, ("sec", "nanosec"), texts)


def iso(rows, truth):
    begin = datetime.fromtimestamp(EPOCH, UTC)
    texts = [((begin + timedelta(seconds=float(t))).isoformat(),) for t in truth.time]
    return with_time(rows, ("time",), texts)


def german(rows, truth):
    return [[cell.replace(".", ",") for cell in row] for row in rows]


def two_rows_a_stamp(rows, truth):
    """The arm's row before the cameras', at the same stamp."""
    both = ((row[:4] + ["", ""], row[:1] + [""] * 3 + row[4:]) for row in rows[1:])
    return [rows[0], *(row for pair in both for row in pair)]


def without_time(rows, truth):
    return [row[1:] for row in rows]


READ = {
    "SI names": (lambda rows, truth: rows, {}),
    "seconds and nanoseconds": (
        seconds_and_nanoseconds,
        {"columns": 'time = [{ column = "sec", unit = "s" }, { column = "nanosec", unit = "ns" }]'},
    ),
    "ISO 8601": (iso, {"columns": 'time = { column = "time", unit = "iso" }'}),
    "semicolon and decimal comma": (german, {"separator": ";"}),
    "semicolon and decimal point": (lambda rows, truth: rows, {"separator": ";"}),
    "tabs": (lambda rows, truth: rows, {"separator": "\t"}),
    "tabs and decimal comma": (german, {"separator": "\t", "head": 'decimal = ","'}),
    "arm and camera share stamps": (two_rows_a_stamp, {}),
    "a rate in place of times": (without_time, {"head": "rate_hz = 30.0"}),
}


@pytest.mark.parametrize(("change", "options"), READ.values(), ids=READ)
def test_what_says_what_it_is_is_read(made, truth, change, options):
    found = made(change(rows_of(truth), truth), **options)
    np.testing.assert_allclose(found.time - found.time[0], truth.time - truth.time[0], atol=1e-6)
    np.testing.assert_allclose(found.gripper.position, truth.gripper.position, atol=1e-12)
    np.testing.assert_allclose(found.inclination, truth.inclination, atol=1e-12)


def few_decimals(rows, truth):
    return with_time(rows, ("time",), [(f"{t / 4:.2f}",) for t in truth.time])


def dates(form):
    def change(rows, truth):
        begin = datetime.fromtimestamp(EPOCH, UTC)
        texts = [((begin + timedelta(seconds=float(t))).strftime(form),) for t in truth.time]
        return with_time(rows, ("time",), texts)

    return change


def two_clocks(rows, truth):
    arm = [row[:4] + ["", ""] for row in rows[1:]]
    camera = [[repr(float(row[0]) + 3600.0), "", "", "", *row[4:]] for row in rows[1:]]
    return [rows[0], *arm, *camera]


def two_clocks_and_a_fast_arm(rows, truth):
    header, *others = two_clocks(rows, truth)
    arm, camera = others[: len(others) // 2], others[len(others) // 2 :]
    fast = [[repr(float(row[0]) + 0.008 * k), *row[1:]] for row in arm for k in range(4)]
    return [header, *fast, *camera]


def many_torn(rows, truth):
    for row in rows[3::20]:
        row[4] = "1.2"
    return rows


REFUSED = {
    "few decimals": (
        few_decimals,
        {},
        ("time", "201 stamps", "168 distinct", "2 decimals", "rate"),
    ),
    "no header": (lambda rows, truth: rows[1:], {}, ("line 1", "time,x,y,z", "names")),
    "dd.mm.yyyy": (dates("%d.%m.%Y %H:%M:%S.%f"), {}, ("line 2", "27.11.2025", "2026-", "iso")),
    "dd.mm.yyyy as ISO": (
        dates("%d.%m.%Y %H:%M:%S.%f"),
        {"columns": 'time = { column = "time", unit = "iso" }'},
        ("line 2", "27.11.2025", "ISO 8601"),
    ),
    "time of day": (dates("%H:%M:%S.%f"), {}, ("line 2", "13:26:40", "iso")),
    "two clocks": (two_clocks, {}, ("clocks", "3600 s", "shift")),
    "two clocks, a fast arm": (two_clocks_and_a_fast_arm, {}, ("clocks", "3600 s", "shift")),
    "many torn": (many_torn, {}, ("10 of 201", "sample 2", "record again")),
    "thousands": (
        lambda rows, truth: [*rows[:5], [*rows[5][:1], "1 234.5", *rows[5][2:]], *rows[6:]],
        {},
        ("line 6", "column x", "1 234.5"),
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
    assert not (tmp_path / "s.nc").exists()


@pytest.mark.parametrize(
    ("field", "value"),
    [("x", "-4.7e226"), ("z", "3e-246"), ("y", "0.1"), ("inclination_xz", "1.05")],
)
def test_one_torn_value_is_named_and_missing(made, truth, tmp_path, field, value):
    rows = rows_of(truth)
    rows[81][FIELDS.index(field)] = value  # sample 80
    made(rows)
    found = open_recording(tmp_path / "s.nc")
    (told,) = found.torn
    assert told.startswith(f"{field}: ") and "sample 80" in told
    columns = np.column_stack([found.gripper.position, found.inclination])
    expected = np.column_stack([truth.gripper.position, truth.inclination])
    expected[80, FIELDS.index(field) - 1] = np.nan
    np.testing.assert_allclose(columns, expected, atol=1e-12)


@pytest.mark.parametrize("speed", [0.1, 1.0])  # m/s
@pytest.mark.parametrize("rate", [10.0, 30.0, 125.0])  # Hz
def test_corners_of_a_path_are_not_torn(speed, rate):
    path = star(speed=speed, height=0.2, radius=0.1)
    time = np.arange(path.time[0], path.time[-1], 1.0 / rate)
    for axis, jump in zip(path.position.T, JUMPS.values(), strict=False):
        assert not torn_values(np.interp(time, path.time, axis), jump).any()


@pytest.mark.parametrize("liquid", RECORDED_LIQUIDS)
def test_nothing_of_a_stir_is_torn(liquid):
    assert bundled_recording(liquid).torn == ()
