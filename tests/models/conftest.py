from importlib.resources import files
from types import SimpleNamespace

import numpy as np
import pytest
import xarray as xr
from bolfi_liquids.models import effects as registry

from bolfi_liquids import models


def load(name):
    data = xr.load_dataset(files("bolfi_liquids.data") / f"{name}.nc", decode_times=False)
    position = np.stack([data.x, data.y, data.z], axis=1)
    return SimpleNamespace(
        attrs=data.attrs,
        gripper=SimpleNamespace(time=data.time.values, position=position),
        inclination=np.stack([data.inclination_xz, data.inclination_yz], axis=1),
    )


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
