import shutil
from importlib.resources import files
from pathlib import Path
from typing import NamedTuple

import numpy as np
import pytest
import xarray as xr

from . import strip_pours
from .pours import open_poured_liquids
from .stirs import open_reference_stirs

SAMPLES = 60  # 2 s: the pause and the first strokes
HEADER = "file,liquid,viscosity_Pa_s,true_fill_m,hidden,size"


class Liquid(NamedTuple):
    """A row of truths.csv, and how far the stick swings in its recording."""

    viscosity: str
    swing: float
    hidden: str = ""


LIQUIDS = {
    "water_v10": Liquid("0.001", 1.3),
    "oil_v10": Liquid("0.1", 1.1),
    "gel_v10": Liquid("12", 1.0),
    "hidden_oil_bubbles_v10": Liquid("0.1", 1.1, "bubbles"),
}


@pytest.fixture(scope="session")
def made_grid(tmp_path_factory):
    """A reference's directory: stirs on one path, in which a thin liquid lets the stick swing."""
    folder = tmp_path_factory.mktemp("reference") / "grid"
    folder.mkdir()
    source = Path(str(files("bolfi_liquids.data"))) / "gel_v10.nc"
    whole = xr.load_dataset(source, decode_times=False).isel(time=slice(0, SAMPLES))
    for name, liquid in LIQUIDS.items():
        stir = whole.copy(deep=True)
        for plane in ("inclination_xz", "inclination_yz"):
            stir[plane].values *= liquid.swing
        stir.to_netcdf(folder / f"{name}.nc")
    rows = [
        f"{name}.nc,any,{one.viscosity},0.0503,{one.hidden},{'0.08' if one.hidden else ''}"
        for name, one in LIQUIDS.items()
    ]
    (folder / "truths.csv").write_text("\n".join([HEADER, *rows]) + "\n")
    return folder


@pytest.fixture
def grid(made_grid, tmp_path):
    """The reference's directory, to be altered."""
    return shutil.copytree(made_grid, tmp_path / "grid")


@pytest.fixture(scope="session")
def stirs(made_grid):
    """What that directory holds: name -> stir, from thin to thick."""
    return {one.name: one for one in open_reference_stirs(made_grid).stirs}


@pytest.fixture
def shifted():
    """Makes a simulator: the recording, so many degrees off, by a sign that seeds take in turn."""

    def make(offset=0.0, spread=0.0):
        def simulate(stir, seeds):
            signs = np.where(np.asarray(seeds) % 2, 1.0, -1.0)
            off = np.radians(offset + spread * signs)
            return stir.recording.inclination + off[:, None, None]

        return simulate

    return make


@pytest.fixture(scope="session")
def made_pours(tmp_path_factory):
    """A reference's directory of pours that land in strips."""
    folder = tmp_path_factory.mktemp("poured") / "pours"
    folder.mkdir()
    strip_pours.write_reference(folder)
    return folder


@pytest.fixture
def pours(made_pours, tmp_path):
    """That directory, to be altered."""
    return shutil.copytree(made_pours, tmp_path / "pours")


@pytest.fixture(scope="session")
def poured(made_pours):
    """What that directory holds: name -> liquid."""
    return {one.name: one for one in open_poured_liquids(made_pours)}


@pytest.fixture
def off():
    """Makes a simulator: the reference's strips, moved by so much [m] by the liquid's name."""
    strips = {strip.name: strip for strip in strip_pours.STRIPS}

    def make(retained=0.0, **moved):
        def simulate(liquid, seeds, cell):
            strip = strips[liquid.name]
            speeds = [round(float(np.degrees(one))) for one in liquid.angular_velocity]
            middles = [
                middle + moved.get(liquid.name, 0.0)
                for middle, speed in zip(strip_pours.middles(strip), (45, 90), strict=True)
                if speed in speeds
            ]
            return strip_pours.landed(middles, strip.retained + retained)

        return simulate

    return make
