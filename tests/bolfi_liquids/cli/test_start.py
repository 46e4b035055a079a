"""What a command loads before it refuses: a mistyped word must not cost seconds."""

import subprocess
import sys
from importlib.resources import files

import pytest

HEAVY = "jax numpyro taichi matplotlib pandas xarray cv2 scipy.spatial scipy.stats arviz_stats"
MAX_MODULES, OF_HELP = 700, 400  # rich alone is a hundred
CODE = f"""
import atexit, sys
from bolfi_liquids.cli.app import main
heavy = lambda: print("loaded", len(sys.modules), [n for n in {HEAVY.split()} if n in sys.modules])
atexit.register(heavy)
main()
"""
STIR = str(files("bolfi_liquids.data") / "oil_v10.nc")


@pytest.mark.parametrize(
    ("typed", "told"),
    [
        ("--help", "Usage"),
        ("calibrate missing.nc --out run", "missing.nc: no such file"),
        ("calibrate table.csv --out run", "not a NetCDF file"),
        ("calibrate {stir} --out run --budget 1", "--budget: 1"),
        ("calibrate {stir} --out run --timeout 0", "--timeout: 0"),
        ("calibrate {stir} --out run --resume", "holds no run to resume"),
        ("criticise run", "no run.toml in it"),
        ("criticise run --held-out missing.nc", "missing.nc: no such file"),
        ("criticise run --effects magic", "there is no effect magic"),
        ("pour run", "no run.toml in it"),
        ("pour run --cups table.csv", "not TOML"),
        ("pour run --execute", "no run"),
        ("report run", "no run.toml in it"),
        ("record --rig table.csv", "not TOML"),
        ("simulate stir --viscosity -1", "--viscosity: -1"),
        ("simulate pour --cups missing.toml", "missing.toml: no such file"),
        ("import missing.csv --columns columns.toml", "missing.csv: no such file"),
        ("trim missing.nc", "missing.nc: no such file"),
        ("check sbc --runs -1", "--runs: -1"),
    ],
)
def test_a_refusal_loads_neither_engine_nor_fluid_nor_plots(typed, told, tmp_path):
    (tmp_path / "table.csv").write_text("time,x\n0,1\n")
    words = [word.format(stir=STIR) for word in typed.split()]
    done = subprocess.run(
        [sys.executable, "-c", CODE, *words], capture_output=True, text=True, cwd=tmp_path
    )
    assert told in done.stdout + done.stderr and done.returncode == (0 if typed == "--help" else 2)
    _, count, heavy = done.stdout.splitlines()[-1].split(" ", 2)
    assert heavy == "[]" and int(count) < (OF_HELP if typed == "--help" else MAX_MODULES)
