"""CPU seconds of one stirring trial; run with `pytest -m benchmark -s`. Asserts no time."""

import platform
import subprocess
import time
from importlib.resources import files
from types import SimpleNamespace

import numpy as np
import pytest
import xarray as xr

from bolfi_liquids import models

BATCH = 8
REPEATS = 3


@pytest.mark.benchmark
@pytest.mark.parametrize("particles", [500, 1000, 1500, 2000])
def test_seconds_a_trial(particles, record_property):
    data = xr.load_dataset(files("bolfi_liquids.data") / "glycerin_v10.nc", decode_times=False)
    position = np.stack([data.x, data.y, data.z], axis=1)
    gripper = SimpleNamespace(time=data.time.values, position=position)
    recording = SimpleNamespace(attrs=data.attrs, gripper=gripper)
    setup = models.StirSetup.from_recording(recording, particles=particles)
    liquid = models.Liquid(np.geomspace(1e-3, 10.0, BATCH), 0.2, 1260.0)

    def trial():
        cpu, wall = time.process_time(), time.perf_counter()
        models.stir(liquid, gripper, setup, np.arange(BATCH))
        return (time.process_time() - cpu) / BATCH, (time.perf_counter() - wall) / BATCH

    trial()  # compiles
    cpu, wall = np.median([trial() for _ in range(REPEATS)], axis=0)
    commit = subprocess.run(
        ["git", "rev-parse", "--short", "HEAD"], capture_output=True, text=True, check=False
    ).stdout.strip()
    duration = gripper.time[-1] - gripper.time[0]
    line = (
        f"{particles} particles, {duration:.1f} s of stirring, batch {BATCH}: "
        f"{cpu:.2f} CPU s, {wall:.2f} s a trial ({platform.machine()}, {commit})"
    )
    record_property("seconds", line)
    print(line)
