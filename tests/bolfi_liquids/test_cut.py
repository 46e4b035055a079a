"""Cutting recordings."""

import re

import numpy as np
import pytest
import xarray as xr
from typer.testing import CliRunner

import bolfi_liquids as bl
from bolfi_liquids.cli.app import app

WAIT = 45  # samples of a way down before the recording


@pytest.fixture
def lowering(dataset, tmp_path):
    """A file that begins with the stick's way down, and ends unseen."""
    before = dataset.isel(time=np.zeros(WAIT, int))
    step = float(dataset["time"][1] - dataset["time"][0])
    begin = float(dataset["time"][0]) - step * np.arange(WAIT, 0, -1)
    before = before.assign_coords(time=("time", begin, dataset["time"].attrs))
    rng = np.random.default_rng(0)
    for name in ("inclination_xz", "inclination_yz"):
        before[name] = before[name] + np.radians(0.1) * rng.normal(size=WAIT)
    before["z"] = before["z"] + np.linspace(0.1, 0.0, WAIT)
    whole = xr.concat([before, dataset], "time").assign_attrs(dataset.attrs, history="recorded")
    for name in dataset.variables:
        whole[name].attrs = dataset[name].attrs
    whole["doubts"] = ("time", np.arange(whole.sizes["time"], dtype=np.int32))
    for name in ("inclination_xz", "inclination_yz"):
        whole[name][-20:] = np.nan
    path = tmp_path / "whole.nc"
    whole.to_netcdf(path)
    return path


def test_what_stays_is_what_was_there(lowering, tmp_path):
    whole = xr.load_dataset(lowering, decode_times=False)
    made = bl.trim(lowering, start=0.1, stop=4.0, out=tmp_path / "cut.nc")
    cut = xr.load_dataset(tmp_path / "cut.nc", decode_times=False)
    xr.testing.assert_equal(cut, whole.sel(time=slice(0.1, 4.0)))
    np.testing.assert_array_equal(made.time, cut["time"])
    told = cut.attrs.pop("history")
    assert cut.attrs == {key: v for key, v in whole.attrs.items() if key != "history"}
    first, second = told.splitlines()
    assert first == "recorded"
    assert "whole.nc" in second and "0.1 to 4 s" in second and "trim" not in made.path.name


def test_without_times_it_starts_at_rest_and_ends_where_the_stick_was_seen(lowering, tmp_path):
    whole = xr.load_dataset(lowering, decode_times=False)
    with pytest.raises(bl.InputError, match="in the air|without an inclination"):
        bl.open_recording(lowering)
    made = bl.trim(lowering, out=tmp_path / "cut.nc")
    assert -0.1 < made.time[0] <= 0.1
    assert made.time[-1] == whole["time"][-21]
    assert np.isfinite(made.inclination[-1]).all()


def test_the_command_tells_first_and_cuts_then(lowering, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    told = CliRunner().invoke(app, ["trim", "whole.nc"])
    assert told.exit_code == 0 and list(tmp_path.iterdir()) == [lowering]
    (proposed,) = [line for line in told.stdout.splitlines() if line.startswith("next: ")]
    words = proposed.removeprefix("next: bolfi-liquids ").replace("FILE.nc", "cut.nc").split()
    done = CliRunner().invoke(app, words)
    assert done.exit_code == 0, done.stderr
    by_hand = bl.open_recording("cut.nc")
    by_default = bl.trim("whole.nc", out="again.nc")
    np.testing.assert_array_equal(by_hand.time, by_default.time)


@pytest.mark.parametrize(
    ("options", "said"),
    [
        (["--out", "other.nc"], "other.nc: exists already"),
        (["--out", "cut.csv"], "ends in"),
        (["--start", "99", "--out", "cut.nc"], "nothing lies from 99"),
        (["--start", "3", "--stop", "2", "--out", "cut.nc"], "nothing lies from 3 to 2 s"),
        (["--start", "nan", "--out", "cut.nc"], "--start: nan"),
        (["--start", "2", "--out", "cut.nc"], "whole.nc: .*starts in motion"),
    ],
)
def test_what_cannot_be_cut_is_refused_and_nothing_written(
    lowering, tmp_path, monkeypatch, options, said
):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "other.nc").write_text("mine")
    before = {path.name: path.read_bytes() for path in tmp_path.iterdir()}
    result = CliRunner().invoke(app, ["trim", "whole.nc", *options])
    assert result.exit_code == 2
    (line,) = result.stderr.strip().splitlines()
    assert re.search(said, line)
    assert {path.name: path.read_bytes() for path in tmp_path.iterdir()} == before


def test_a_stir_without_a_rest_offers_none(dataset, tmp_path):
    path = tmp_path / "middle.nc"
    dataset.isel(time=slice(40, 140)).to_netcdf(path)
    with pytest.raises(bl.InputError, match="no time at which gripper and stick rest"):
        bl.trim(path, out=tmp_path / "cut.nc")
