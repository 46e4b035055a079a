"""Every bad recording is refused in one line that names file, field and value."""

import pickle
from dataclasses import replace
from importlib.resources import files
from pathlib import Path

import numpy as np
import pytest
import xarray

import bolfi_liquids as bl
from bolfi_liquids.inputs.bundled import bundled_recording
from bolfi_liquids.inputs.checks import MAX_GRIPPER_GAP, longest_gap
from bolfi_liquids.inputs.open import check_recording, open_recordings
from bolfi_liquids.inputs.recording import Recording, Trajectory, planned_recording


def values(change, *names):
    """With other numbers of some variables."""

    def altered(data):
        for name in names:
            data[name] = ("time", change(data[name].to_numpy().copy()), data[name].attrs)
        return data

    return altered


def blank(start, stop=None):
    def blanked(numbers):
        numbers[start:stop] = np.nan
        return numbers

    return blanked


def units(name, unit):
    def altered(data):
        data[name].attrs["units"] = unit
        return data

    return altered


def attributes(**changed):
    """With other attributes; None leaves one out."""

    def altered(data):
        kept = {name: v for name, v in (data.attrs | changed).items() if v is not None}
        data.attrs = kept
        return data

    return altered


def times(change, unit="s"):
    def altered(data):
        time = change(data["time"].to_numpy().copy())
        attrs = {"units": unit} if time.dtype.kind == "f" else {}
        return data.assign_coords(time=("time", time, attrs))

    return altered


def nanoseconds(time):
    return (1e9 * time).astype("timedelta64[ns]")


XZ, YZ = "inclination_xz", "inclination_yz"
K = np.arange(201)  # samples
BAD = {
    "no fields": (lambda d: d.drop_vars(["x", YZ]), f"x, {YZ}", "missing"),
    "two columns": (
        lambda d: d.assign(x=(("time", "k"), np.ones((201, 2)), {"units": "m"})),
        "x",
        "dimensions ('time', 'k')",
    ),
    "time goes back": (times(lambda t: np.r_[t[:50], t[48], t[51:]]), "time", "1.6 s"),
    "nine samples": (lambda d: d.isel(time=slice(0, 9)), "time", " = 9"),
    "time in ms": (times(lambda t: 1000.0 * t), "time", "33.3333 s"),
    "dates": (
        times(lambda t: np.datetime64("2026-11-29", "ns") + nanoseconds(t)),
        "time",
        "holds dates",
    ),
    "nanoseconds": (times(lambda t: nanoseconds(t).astype(np.int64)), "time", "holds int64"),
    "complex": (values(lambda v: v + 0j, YZ), YZ, "complex128"),
    "gap in x": (values(blank(60, 75), "x"), "x", "0.533333 s from 1.97 s on"),
    "long blind": (values(blank(60, 90), YZ), YZ, "1.03333 s from 1.97 s on"),
    "infinite angle": (values(lambda v: np.where(v == v.max(), np.inf, v), XZ), XZ, "inf rad"),
    "too fast": (values(lambda v: 15 * v, "x", "y"), "time", " m/s"),
    "small degrees": (
        values(lambda v: np.degrees(v) / 5, XZ),
        XZ,
        "the rim stops the stick at 0.46 rad",
    ),
    "radians twice": (values(np.radians, XZ, YZ), YZ, " deg while the gripper moves"),
    "from above": (values(lambda v: np.pi - np.abs(v), YZ), YZ, "3.14115 rad"),
    "no inclination": (values(np.zeros_like, XZ), XZ, "5.3 s at 0 rad from 0.00 s on"),
    "frozen now and then": (
        values(lambda v: np.where(K % 20 > 8, v[K // 20 * 20], v), XZ),
        XZ,
        "share of the time",
    ),
    "random": (
        values(lambda v: np.random.default_rng(0).uniform(-0.25, 0.25, len(v)), XZ),
        XZ,
        " deg",
    ),
    "no stir": (values(np.zeros_like, "x", "y"), "x, y", " = 0 m"),
    "outside": (values(lambda v: v + 0.05, "x"), "x", "0.075 m from the axis"),
    "no attributes": (
        attributes(cup_radius=None, fill=None, stick_density=None),
        "cup_radius, fill, stick_density or stick_mass",
        "missing",
    ),
    "negative radius": (attributes(cup_radius=-0.04), "cup_radius", "-0.04"),
    "radius as text": (attributes(stick_radius="4.5 mm"), "stick_radius", "'4.5 mm'"),
    "tiny cup": (attributes(cup_radius=0.0004), "cup_radius", "0.0004 m"),
    "overfull": (attributes(fill=0.08), "fill", "0.08"),
    "short stick": (attributes(stick_length=0.1), "stick_length", "0.05 m deep"),
    "long stick": (attributes(stick_length=0.3), "stick_length", "-0.065 m"),
    "stick in grams": (attributes(stick_mass=17.0), "stick_mass", "17 kg"),
    "heavy stick": (attributes(stick_mass=1.7), "stick_mass", "1.7 kg"),
    "floating stick": (attributes(stick_density=60.0), "stick_density", "floats up"),
}


@pytest.mark.parametrize(("alter", "field", "value"), BAD.values(), ids=BAD)
def test_bad_recording_is_refused_in_one_line(dataset, tmp_path, alter, field, value):
    path = tmp_path / "bad.nc"
    alter(dataset).to_netcdf(path)
    with pytest.raises(bl.InputError) as refused:
        bl.open_recording(path)
    assert refused.value.where.startswith(str(path)) and refused.value.fix
    assert field in refused.value.where and value in refused.value.what + refused.value.fix
    assert "\n" not in str(refused.value)


def test_planes_that_were_seen_in_turn_are_a_recording(dataset, tmp_path):
    """As two cameras with a clock of their own each: no row holds both."""
    dataset[XZ][2::2] = np.nan
    dataset[YZ][1::2] = np.nan
    dataset.to_netcdf(tmp_path / "stir.nc")
    bl.open_recording(tmp_path / "stir.nc")


def test_what_is_no_recording_is_refused(tmp_path):
    (tmp_path / "stir.nc").write_bytes(b"time,x\n0,0\n")
    for given, said in ((tmp_path / "none.nc", "no such file"), (tmp_path / "stir.nc", "import")):
        with pytest.raises(bl.InputError, match=said):
            bl.open_recording(given)
    with pytest.raises(bl.InputError, match="^held_out: 3 is no recording; give paths of NetCDF"):
        open_recordings([3], "held_out")  # pyright: ignore[reportArgumentType]


def test_a_damaged_recording_is_one_line(tmp_path):
    content = Path(str(files("bolfi_liquids.data") / "glycerin_v10.nc")).read_bytes()
    path, outcomes = tmp_path / "stir.nc", []
    for at in range(0, len(content), len(content) // 11):
        path.write_bytes(content[:at] + bytes([content[at] ^ 0xFF]) + content[at + 1 :])
        try:
            bl.open_recording(path)
        except bl.InputError as err:
            outcomes.append(err)
            assert str(path) in err.where and "\n" not in str(err)
    assert any("damaged" in err.what and "copy it again" in err.fix for err in outcomes)
    path.write_bytes(content[: len(content) // 2])
    with pytest.raises(bl.InputError, match="damaged"):
        bl.open_recording(path)


def test_recording_has_the_files_values(dataset, tmp_path):
    path = tmp_path / "good.nc"
    dataset.attrs["status"] = "aborted"
    dataset[XZ][7:9] = np.nan
    dataset["x"][30:33] = np.nan
    dataset.to_netcdf(path)
    recording = bl.open_recording(path)
    np.testing.assert_array_equal(recording.inclination[:, 0], dataset[XZ])
    np.testing.assert_array_equal(recording.gripper.position[:, 2], dataset["z"])
    np.testing.assert_array_equal(recording.gripper.time, dataset["time"])
    assert recording.number("cup_radius") == 0.04
    assert recording.attrs["status"] == "aborted"
    with pytest.raises(ValueError, match="read-only"):
        recording.inclination[0, 0] = 1.0
    for one in (recording, pickle.loads(pickle.dumps(recording)), recording.first(9)):
        assert one.attrs == recording.attrs and one.hash == recording.hash
        with pytest.raises(TypeError):
            one.attrs["liquid_density"] = 5.0
    (dataset + 1e-9).assign_attrs(dataset.attrs).to_netcdf(path)
    assert bl.open_recording(path).hash != recording.hash


def test_a_recording_without_a_size_is_refused():
    whole = bundled_recording("water")
    attrs = {key: value for key, value in whole.attrs.items() if key != "fill"}
    with pytest.raises(bl.InputError, match="attribute fill: None"):
        check_recording(replace(whole, attrs=attrs))


def test_a_plan_needs_a_path_and_a_density():
    truth = bundled_recording("water")
    plan = planned_recording(*truth.gripper, truth.attrs)
    assert np.isnan(plan.inclination).all() and len(plan.time) == len(truth.time)
    for time, attrs in ((truth.time[::-1], truth.attrs), (truth.time, {"fill": 0.05})):
        with pytest.raises(bl.InputError, match="plan"):
            planned_recording(time, truth.gripper.position, attrs)


def test_what_no_wrong_byte_leads_to_is_no_damage(monkeypatch):
    def load(*_, **__):
        raise ImportError

    monkeypatch.setattr(xarray, "load_dataset", load)
    with pytest.raises(ImportError):
        bundled_recording("water")


def test_gap_counts_to_the_ends():
    time = np.arange(10) * 0.1
    seen = np.ones(10, bool)
    assert longest_gap(time, seen)[0] == pytest.approx(0.1)
    seen[7:] = False
    duration, start = longest_gap(time, seen)
    assert (duration, start) == (pytest.approx(0.3), pytest.approx(0.6))
    assert duration > MAX_GRIPPER_GAP


def test_a_recording_shows_what_it_is_of():
    recording = bundled_recording("glycerin")
    shown = repr(recording)
    parts = [str(recording.path), f"{len(recording.time)} samples", "cup", "stick", "1260 kg/m³"]
    assert all(part in shown for part in parts)
    assert len(shown) < 400 and "array" not in shown
    page = recording._repr_html_()
    assert page.startswith("<table>") and recording.path.name in page
    nothing = np.empty((0, 3))
    path = Trajectory(nothing[:, 0], nothing)
    assert "a.nc" in repr(Recording(path.time, path, nothing[:, :2], {}, Path("a.nc"), ""))
