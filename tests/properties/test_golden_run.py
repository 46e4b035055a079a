"""One small run whose numbers are frozen: what is redesigned must keep every bit of it.

`tests/data/golden_run.json` was written by `python tests/properties/test_golden_run.py` and is
written again only where the fluid or the engine changes, with MODEL_VERSION or ENGINE_VERSION.
Bits depend on the processor's vector instructions and on the libraries; where these are others,
the numbers must be near.
"""

import hashlib
import json
import math
import platform
import sqlite3
from contextlib import closing
from importlib.metadata import version
from importlib.resources import files
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
import pytest
import xarray as xr

import bolfi_liquids as bl
from bolfi_liquids.inputs.cups import bundled_cups

GOLDEN = Path(__file__).parents[1] / "data" / "golden_run.json"
LIBRARIES = ("jax", "numpy", "scipy", "taichi", "xarray")
SAMPLES = 90  # 3 s of the demo's recording: the pause and the first strokes
CALIBRATION = {"budget": 8, "batch": 4, "particles": 300, "seed": 2, "chains": 2, "draws": 100}
EFFECTS = ["camera_delay", "gripper_scale"]
POUR = {"budget": 24, "iterations": 7, "draws": 16}
OMITTED = {"seconds", "version", "made_from", "sha256", "hold"}
"""Of summary.json: times, and what says how a result was made."""
NEAR = 0.5  # relative, of numbers that other instructions have rounded: the fluid is chaotic


def machine():
    """What bits depend on besides the program."""
    flags = Path("/proc/cpuinfo")
    vectors = {
        name for name in ("avx2", "avx512f") if flags.exists() and name in flags.read_text().split()
    }
    return [platform.machine(), *sorted(vectors), *(f"{one} {version(one)}" for one in LIBRARIES)]


def digest(*parts):
    whole = hashlib.sha256()
    for part in parts:
        whole.update(part if isinstance(part, bytes) else repr(part).encode())
    return whole.hexdigest()


def numbers(section, path=""):
    """Every number of a section of summary.json, by its dotted name."""
    items = section.items() if isinstance(section, dict) else enumerate(section)
    found = {}
    for key, value in items:
        name = f"{path}.{key}".lstrip(".")
        if key in OMITTED:
            continue
        if isinstance(value, dict | list):
            found |= numbers(value, name)
        elif isinstance(value, int | float) and not isinstance(value, bool):
            found[name] = value
    return found


def made(folder):
    """What the golden run leaves: digests of its bank and draws, and all numbers."""
    stir, run = folder / "stir.nc", folder / "run"
    with xr.open_dataset(
        files("bolfi_liquids.data") / "late_oil_v10.nc", decode_times=False
    ) as one:
        one.isel(time=slice(0, SAMPLES)).to_netcdf(stir)
    calibration = bl.calibrate(stir, out=run, progress=False, **CALIBRATION)
    criticism = bl.criticise(run, effects=EFFECTS, progress=False)
    bundled = bundled_cups()
    cups = bundled.model_copy(
        update={
            "source": bundled.source.model_copy(update={"fill": 0.02}),
            "pour": bundled.pour.model_copy(
                update={"angular_velocity_deg_s": (90.0, 180.0), "hold": 0.4}
            ),
        }
    )
    pour = bl.choose_pour(criticism, cups, force=True, progress=False, **POUR)
    with closing(sqlite3.connect(run / "simulations.sqlite")) as bank:
        rows = bank.execute(
            "SELECT theta, seed, signal, dtype, shape FROM simulation "
            "ORDER BY identity, theta, seed"
        ).fetchall()
    trees = {"posterior": calibration.tree, "criticism": criticism.tree}
    draws = {
        name: digest(
            *(
                part
                for key in sorted(tree["posterior"].data_vars)
                for part in (key, tree["posterior"][key].to_numpy().tobytes())
            )
        )
        for name, tree in trees.items()
    }
    outcomes = pour.tree["chosen"].to_dataset()
    spilled = digest(*(outcomes[key].to_numpy().tobytes() for key in sorted(outcomes.data_vars)))
    return {
        "machine": machine(),
        "digests": {"bank": digest(*rows), **draws, "pour": spilled},
        "simulations": len(rows),
        "numbers": numbers(json.loads((run / "summary.json").read_text(encoding="utf-8"))),
    }


@pytest.mark.slow
@pytest.mark.filterwarnings("ignore::bolfi_liquids.inference.EmulatorWarning")
def test_the_golden_run_keeps_its_bits(tmp_path):
    golden, now = json.loads(GOLDEN.read_text(encoding="utf-8")), made(tmp_path)
    assert now["simulations"] == golden["simulations"]
    assert now["numbers"].keys() == golden["numbers"].keys()
    if now["machine"] == golden["machine"]:
        assert now == golden
        return
    for name in ("calibrate.parameters.viscosity.q50", "pour.angular_velocity_deg_s"):
        was, now_is = golden["numbers"][name], now["numbers"][name]
        assert math.isclose(now_is, was, rel_tol=NEAR), name
    assert np.isfinite(list(now["numbers"].values())).all()


if __name__ == "__main__":
    with TemporaryDirectory() as folder:
        text = json.dumps(made(Path(folder)), indent=1, sort_keys=True)
    GOLDEN.write_text(text + "\n", encoding="utf-8")
