"""Differences between liquids, in recordings whose differences are known."""

import numpy as np
import pytest
import xarray as xr

from bolfi_liquids.checks.neighbours import neighbours
from bolfi_liquids.checks.reference import open_reference
from bolfi_liquids.checks.replay import rms, without_noise


def records(stirs, factor):
    """As kept: each stick swings `factor` times as far from the gel's as in the recordings."""
    gel = stirs[-1].recording.inclination
    return {stir.name: record(gel + factor * (stir.recording.inclination - gel)) for stir in stirs}


def record(signal):
    planes = [
        {"curves": [{"truth": True, "y": [9.0]}, *({"truth": False, "y": y + d} for d in (-1, 1))]}
        for y in np.degrees(signal).T
    ]
    return {"panels": planes}


def test_pairs_follow_each_other_in_viscosity(reference):
    stirs = reference.stirs
    pairs = neighbours(stirs, records(stirs, 1.0))
    assert [(pair.thinner, pair.thicker) for pair in pairs] == [
        ("water_v10", "oil_v10"),
        ("oil_v10", "gel_v10"),
    ]
    water, oil, _ = (np.degrees(stir.recording.inclination) for stir in stirs)
    assert pairs[0].reference == pytest.approx(without_noise(rms(water - oil), 2))
    assert pairs[0].simulated == pytest.approx(rms(water - oil))


@pytest.mark.parametrize("factor", [0.5, 0.9, 1.1, 1.5])
def test_the_ratio_has_a_bar(reference, factor):
    stirs = reference.stirs
    pair = neighbours(stirs, records(stirs, factor))[0]
    assert pair.judged and pair.passed is (0.75 < factor < 1.25)
    assert pair.ratio == pytest.approx(factor, rel=0.1)  # the noise aside


def test_what_the_reference_does_not_tell_apart_is_not_judged(grid):
    swing(grid / "gel_v10.nc", 1.1)  # as in oil
    stirs = open_reference(grid).stirs
    pair = neighbours(stirs, records(stirs, 5.0))[1]
    assert not pair.judged and pair.ratio is None and pair.passed
    assert pair.to_json()["ratio"] is None


def test_a_failed_simulation_fails(reference):
    stirs = reference.stirs
    kept = records(stirs, 1.0)
    kept["water_v10"] = record(np.full((60, 2), np.nan))
    pair = neighbours(stirs, kept)[0]
    assert pair.judged and not pair.passed
    assert pair.to_json()["simulated"] is None


def test_a_pair_needs_both_records(reference):
    """Water and gel are no neighbours because oil was not simulated."""
    stirs = reference.stirs
    kept = records(stirs, 1.0)
    assert neighbours(stirs, {name: kept[name] for name in ("water_v10", "gel_v10")}) == ()
    assert len(neighbours(stirs, kept | {"water_v10": {"panels": []}})) == 1


@pytest.mark.parametrize("change", ["path", "cup", "length"])
def test_only_stirs_of_one_path_and_rig_are_compared(grid, change):
    path = grid / "oil_v10.nc"
    stir = xr.load_dataset(path, decode_times=False)
    if change == "path":
        stir["x"].values += 1e-3
    elif change == "cup":
        stir.attrs["cup_radius"] = 0.05
    else:
        stir = stir.isel(time=slice(0, 50))
    stir.to_netcdf(path)
    stirs = open_reference(grid).stirs
    signals = {one.name: record(one.recording.inclination) for one in stirs}
    (pair,) = neighbours(stirs, signals)
    assert (pair.thinner, pair.thicker) == ("water_v10", "gel_v10")


def swing(path, factor):
    stir = xr.load_dataset(path, decode_times=False)
    for plane in ("inclination_xz", "inclination_yz"):
        stir[plane].values *= factor
    stir.to_netcdf(path)
