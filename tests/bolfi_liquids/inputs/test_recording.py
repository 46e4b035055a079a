"""Every bad recording is refused in one line that names file, field and value."""

import pickle
from dataclasses import replace
from importlib.resources import files
from pathlib import Path

import numpy as np
import pytest
import xarray
from typer.testing import CliRunner

import bolfi_liquids as bl
from bolfi_liquids.cli.app import app
from bolfi_liquids.inputs.bundled import bundled_recording
from bolfi_liquids.inputs.checks import MAX_GRIPPER_GAP, longest_gap
from bolfi_liquids.inputs.open import check_recording
from bolfi_liquids.inputs.recording import Recording, Trajectory

GAP = slice(60, 75)  # half a second


def backwards(data):
    time = data["time"].to_numpy().copy()
    time[50] = time[48]
    return data.assign_coords(time=("time", time, data["time"].attrs))


def with_values(name, change):
    def altered(data):
        return data.assign({name: ("time", change(data[name].to_numpy().copy()), data[name].attrs)})

    return altered


def blank(part):
    def blanked(values):
        values[part] = np.nan
        return values

    return blanked


def with_units(name, units):
    def altered(data):
        data[name].attrs["units"] = units
        return data

    return altered


def with_attribute(name, value):
    return lambda data: data.assign_attrs({name: value})


def without_attribute(*names):
    def altered(data):
        for name in names:
            del data.attrs[name]
        return data

    return altered


def in_milliseconds(data):
    return data.assign_coords(time=("time", 1000.0 * data["time"].to_numpy(), {"units": "s"}))


def _nanoseconds(data):
    return (1e9 * data["time"].to_numpy()).astype("timedelta64[ns]")


BAD = {
    "no time": (lambda d: d.drop_vars("time"), "time", "missing"),
    "no x": (lambda d: d.drop_vars("x"), "x", "missing"),
    "no inclination": (lambda d: d.drop_vars("inclination_yz"), "inclination_yz", "missing"),
    "time goes back": (backwards, "time", "1.6 s"),
    "empty": (lambda d: d.isel(time=slice(0, 0)), "time", " = 0"),
    "nine samples": (lambda d: d.isel(time=slice(0, 9)), "time", " = 9"),
    "time in ms": (in_milliseconds, "time", "33.3333 s"),
    "ms by units": (with_units("time", "ms"), "time", "'ms'"),
    "gap in x": (with_values("x", blank(GAP)), "x", "0.533333 s from 1.97 s on"),
    "gap at the start": (with_values("z", blank(slice(0, 9))), "z", "0.3 s from 0.00 s on"),
    "never seen": (
        with_values("inclination_xz", blank(slice(None))),
        "inclination_xz",
        "NaN in 201 of 201",
    ),
    "long blind": (
        with_values("inclination_yz", blank(slice(60, 90))),
        "inclination_yz",
        "1.03333 s from 1.97 s on",
    ),
    "infinite angle": (
        with_values("inclination_xz", lambda v: np.where(v == v.max(), np.inf, v)),
        "inclination_xz",
        "inf rad",
    ),
    "floating stick": (with_attribute("stick_density", 60.0), "stick_density", "floats up"),
    "stick in grams": (with_attribute("stick_mass", 17.0), "stick_mass", "17 kg"),
    "no stir": (
        lambda d: with_values("x", np.zeros_like)(with_values("y", np.zeros_like)(d)),
        "x, y",
        " = 0 m",
    ),
    "degrees": (with_values("inclination_xz", np.degrees), "inclination_xz", "7.30548 rad"),
    "radians twice": (
        lambda d: with_values("inclination_xz", np.radians)(
            with_values("inclination_yz", np.radians)(d)
        ),
        "inclination_yz",
        " deg while the gripper moves",
    ),
    "degrees by units": (with_units("inclination_yz", "degree"), "inclination_yz", "'degree'"),
    "gripper in mm": (with_values("y", lambda v: 1000 * v), "y", "24.548 m"),
    "mm by units": (with_units("z", "mm"), "z", "'mm'"),
    "infinite": (with_values("x", lambda v: np.where(v == v.max(), np.inf, v)), "x", "inf"),
    "no cup": (without_attribute("cup_radius"), "cup_radius", "missing"),
    "no weight": (without_attribute("stick_density"), "stick_density or stick_mass", "missing"),
    "negative radius": (with_attribute("cup_radius", -0.04), "cup_radius", "-0.04"),
    "radius as text": (
        with_attribute("stick_radius", "4.5 mm"),
        "stick_radius",
        ": '4.5 mm'; give one",
    ),
    "no mass": (with_attribute("stick_mass", 0.0), "stick_mass", "0 kg, above 0 to 2 kg allowed"),
    "light stick": (with_attribute("stick_mass", 5e-7), "or stick_mass", "0.0005 g floats up"),
    "cup in mm": (with_attribute("cup_height", 75.0), "cup_height", "75 m"),
    "g/cm3": (with_attribute("liquid_density", 1.26), "liquid_density", "1.26"),
    "overfull": (with_attribute("fill", 0.08), "fill", "0.08"),
    "thick stick": (with_attribute("stick_radius", 0.05), "stick_radius", "0.05"),
    "short stick": (with_attribute("stick_length", 0.1), "stick_length", "0.05 m deep"),
    "long stick": (with_attribute("stick_length", 0.3), "stick_length", "-0.065 m"),
    "complex": (with_values("inclination_yz", lambda v: v + 0j), "inclination_yz", "complex128"),
    "whole numbers": (
        with_values("x", lambda v: np.rint(1000 * v).astype(int)),
        "x",
        "int64",
    ),
    "dates": (
        lambda d: d.assign_coords(time=np.datetime64("2026-11-29", "ns") + _nanoseconds(d)),
        "time",
        "holds dates",
    ),
    "nanoseconds": (
        lambda d: d.assign_coords(time=_nanoseconds(d).astype(np.int64)),
        "time",
        "holds int64",
    ),
    "cup of 1 m": (with_attribute("cup_radius", 1.0), "cup_radius", "1 m"),
    "tiny cup": (with_attribute("cup_radius", 0.0004), "cup_radius", "0.0004 m"),
    "heavy stick": (with_attribute("stick_mass", 1.7), "stick_mass", "1.7 kg"),
    "several sizes": (with_attribute("cup_radius", [0.04, 0.05]), "cup_radius", "array"),
    "no inclination at all": (
        with_values("inclination_xz", np.zeros_like),
        "inclination_xz",
        "5.3 s at 0 rad from 0.00 s on",
    ),
    "one inclination": (
        with_values("inclination_yz", lambda v: np.full_like(v, 0.02)),
        "inclination_yz",
        "0.02 rad",
    ),
    "frozen from 2.5 s on": (
        with_values("inclination_xz", lambda v: np.where(np.arange(len(v)) > 75, v[75], v)),
        "inclination_xz",
        "from 2.50 s on",
    ),
    "frozen again and again": (
        with_values("inclination_xz", lambda v: v[np.arange(len(v)) // 12 * 12]),
        "inclination_xz",
        "from 5.60 s on",
    ),
    "random": (
        with_values(
            "inclination_xz", lambda v: 1.5 * np.random.default_rng(0).uniform(-1, 1, len(v))
        ),
        "inclination_xz",
        " of 201",
    ),
    "small degrees": (
        with_values("inclination_xz", lambda v: np.degrees(v) / 5),
        "inclination_xz",
        "the rim stops the stick at 0.46 rad",
    ),
    "from above": (
        with_values("inclination_yz", lambda v: np.pi - np.abs(v)),
        "inclination_yz",
        "3.14115 rad",
    ),
    "outside": (with_values("x", lambda v: v + 0.05), "x", "0.075 m from the axis"),
}


@pytest.mark.parametrize(("alter", "field", "value"), BAD.values(), ids=BAD)
def test_bad_recording_is_refused_in_one_line(dataset, tmp_path, alter, field, value):
    path = tmp_path / "bad.nc"
    alter(dataset).to_netcdf(path)
    result = CliRunner().invoke(app, ["calibrate", str(path), "--out", str(tmp_path / "run")])
    assert result.exit_code == 2
    lines = result.stderr.strip().splitlines()
    assert len(lines) == 1, lines
    assert lines[0].startswith(f"error: {path}")
    assert field in lines[0].removeprefix(f"error: {path}")
    assert value in lines[0]
    assert not (tmp_path / "run").exists()


def test_planes_that_were_seen_in_turn_are_a_recording(dataset, tmp_path):
    """As two cameras with a clock of their own each: no row holds both."""
    seen = dataset.copy(deep=True)
    seen["inclination_xz"][2::2] = np.nan
    seen["inclination_yz"][1::2] = np.nan
    seen.to_netcdf(tmp_path / "stir.nc")
    bl.open_recording(tmp_path / "stir.nc")


@pytest.mark.parametrize("content", [None, b"", b"time,x\n0,0\n"], ids=["none", "empty", "csv"])
def test_what_is_no_recording_is_refused(tmp_path, content):
    path = tmp_path / "stir.nc"
    if content is not None:
        path.write_bytes(content)
    with pytest.raises(ValueError, match="no such file" if content is None else "not a NetCDF"):
        bl.open_recording(path)


def test_a_damaged_recording_is_one_line(dataset, tmp_path):
    whole = Path(str(files("bolfi_liquids.data"))) / "glycerin_v10.nc"
    content, path = whole.read_bytes(), tmp_path / "stir.nc"
    outcomes = []
    for at in range(0, len(content), len(content) // 29):
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
    dataset["inclination_xz"][7:9] = np.nan
    dataset["x"][30:33] = np.nan
    dataset.to_netcdf(path)
    recording = bl.open_recording(path)
    np.testing.assert_array_equal(recording.inclination[:, 0], dataset["inclination_xz"])
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


@pytest.mark.parametrize("name", ["fill", "liquid_density"])
def test_a_recording_without_a_size_is_refused(name):
    whole = bundled_recording("water")
    attrs = {key: value for key, value in whole.attrs.items() if key != name}
    with pytest.raises(bl.InputError, match=f"attribute {name}: None"):
        check_recording(replace(whole, attrs=attrs))


@pytest.mark.parametrize("error", [ImportError, NameError])
def test_what_no_wrong_byte_leads_to_is_no_damage(monkeypatch, error):
    def load(*_, **__):
        raise error

    monkeypatch.setattr(xarray, "load_dataset", load)
    with pytest.raises(error):
        bundled_recording("water")


def test_hash_follows_the_bytes(dataset, tmp_path):
    hashes = set()
    for name, shift in (("a", 0.0), ("b", 0.0), ("c", 1e-9)):
        path = tmp_path / f"{name}.nc"
        (dataset + shift).assign_attrs(dataset.attrs).to_netcdf(path)
        hashes.add(bl.open_recording(path).hash)
    assert len(hashes) == 2


def test_gap_counts_to_the_ends():
    time = np.arange(10) * 0.1
    seen = np.ones(10, bool)
    assert longest_gap(time, seen)[0] == pytest.approx(0.1)
    seen[7:] = False
    duration, start = longest_gap(time, seen)
    assert (duration, start) == (pytest.approx(0.3), pytest.approx(0.6))
    assert duration > MAX_GRIPPER_GAP


def test_a_recording_shows_what_it_is_of():
    recording = bl.open_recording(str(files("bolfi_liquids.data") / "glycerin_v10.nc"))
    shown = repr(recording)
    parts = [str(recording.path), f"{len(recording.time)} samples", "cup", "stick", "1260 kg/m³"]
    assert all(part in shown for part in parts)
    assert len(shown) < 400 and "array" not in shown
    page = recording._repr_html_()
    assert page.startswith("<table>") and recording.path.name in page


def test_a_recording_that_has_neither_samples_nor_attributes_is_shown():
    nothing = np.empty((0, 3))
    empty = Recording(
        nothing[:, 0],
        Trajectory(nothing[:, 0], nothing),
        nothing[:, :2],
        {},
        Path("a.nc"),
        "",
    )
    assert "a.nc" in repr(empty)
