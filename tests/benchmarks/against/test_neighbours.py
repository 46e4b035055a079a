"""Differences between liquids, in recordings whose differences are known."""

import numpy as np
import pytest
import xarray as xr

from .neighbours import judged_pairs, ratio_row, recorded_difference
from .stir_replay import rms, without_noise
from .stirs import open_reference_stirs


def names(stirs):
    return [tuple(one.name for one in pair) for pair in judged_pairs(stirs)]


def swung(stirs, factor):
    """Signals [deg] of water and oil, `factor` times as far from the gel's as in the recordings."""
    water, oil, gel = (np.degrees(one.recording.inclination) for one in stirs.values())
    return [np.stack([gel + factor * (one - gel) + d for d in (-1.0, 1.0)]) for one in (water, oil)]


def test_pairs_follow_each_other_in_viscosity(stirs):
    assert names(stirs.values()) == [("water_v10", "oil_v10"), ("oil_v10", "gel_v10")]
    water, oil, _ = (np.degrees(stir.recording.inclination) for stir in stirs.values())
    difference = recorded_difference(stirs["water_v10"], stirs["oil_v10"])
    assert difference == pytest.approx(without_noise(rms(water - oil), 2))


@pytest.mark.parametrize("factor", [0.5, 0.9, 1.1, 1.5])
def test_the_ratio_has_a_bar(stirs, factor):
    row = ratio_row(stirs["water_v10"], stirs["oil_v10"], swung(stirs, factor))
    assert row.passed is (0.75 < factor < 1.25)
    assert row.ours == pytest.approx(factor, rel=0.1)  # the noise aside


def test_liquids_that_the_simulator_does_not_tell_apart_fail(stirs):
    water, _ = swung(stirs, 1.0)
    row = ratio_row(stirs["water_v10"], stirs["oil_v10"], [water, water])
    assert row.ours == 0.0 and not row.passed


def test_a_failed_simulation_fails(stirs):
    water, oil = swung(stirs, 1.0)
    water[0] = np.nan
    assert not ratio_row(stirs["water_v10"], stirs["oil_v10"], [water, oil]).passed


def test_what_the_reference_does_not_tell_apart_is_not_judged(grid):
    change(grid / "gel_v10.nc", swing=1.1)  # as in oil
    assert names(open_reference_stirs(grid).stirs) == [("water_v10", "oil_v10")]


@pytest.mark.parametrize("different", ["path", "cup", "length"])
def test_only_stirs_of_one_path_and_rig_are_compared(grid, different):
    change(grid / "oil_v10.nc", different)
    assert names(open_reference_stirs(grid).stirs) == [("water_v10", "gel_v10")]


def change(path, different="", swing=1.0):
    stir = xr.load_dataset(path, decode_times=False)
    for plane in ("inclination_xz", "inclination_yz"):
        stir[plane].values *= swing
    if different == "path":
        stir["x"].values += 1e-3
    elif different == "cup":
        stir.attrs["cup_radius"] = 0.05
    elif different == "length":
        stir = stir.isel(time=slice(0, 50))
    stir.to_netcdf(path)
