import csv
from importlib.resources import files
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
import xarray as xr
from bolfi_liquids.models import effects as registry

from bolfi_liquids import models

REFERENCE = Path(__file__).parents[1] / "data/stirring_reference"


def load(name):
    return as_recording(
        xr.load_dataset(files("bolfi_liquids.data") / f"{name}.nc", decode_times=False)
    )


def as_recording(data):
    position = np.stack([data.x, data.y, data.z], axis=1)
    return SimpleNamespace(
        attrs=data.attrs,
        gripper=SimpleNamespace(time=data.time.values, position=position),
        inclination=np.stack([data.inclination_xz, data.inclination_yz], axis=1),
    )


@pytest.fixture(scope="session")
def reference():
    """Gives a recording of the reference solver by name, with its viscosity and true fill."""
    rows = csv.DictReader((REFERENCE / "truths.csv").read_text().splitlines())
    truths = {row["file"]: row for row in rows}

    def of(name):
        row = truths[f"{name}.nc"]
        truth = {"viscosity": float(row["viscosity_Pa_s"]), "fill": float(row["true_fill_m"])}
        return as_recording(xr.load_dataset(REFERENCE / f"{name}.nc", decode_times=False)), truth

    return of


@pytest.fixture(scope="session")
def glycerin():
    return load("glycerin_v10")


@pytest.fixture(scope="session")
def water():
    return load("water_v10")


@pytest.fixture(scope="session")
def cups():
    return models.Cups.from_toml(files("bolfi_liquids.data") / "cups.toml")


@pytest.fixture
def register(monkeypatch):
    """Registers effects for one test."""

    def add(effect):
        monkeypatch.setitem(registry._registered, effect.name, effect)
        monkeypatch.delitem(registry._registered, effect.name)
        return models.register(effect)

    return add
