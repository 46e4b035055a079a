"""What a command loads before it refuses: a mistyped word must not cost seconds."""

import json
import subprocess
import sys
from importlib.resources import files

import pytest

MAX_MODULES, OF_HELP = 700, 400  # rich alone is a hundred
STIR = str(files("bolfi_liquids.data") / "oil_v10.nc")
TYPED = {
    "calibrate missing.nc --out run": "missing.nc: no such file",
    "calibrate table.csv --out run": "not a NetCDF file",
    f"calibrate {STIR} --out run --budget 1": "--budget: 1",
    f"calibrate {STIR} --out run --timeout 0": "--timeout: 0",
    f"calibrate {STIR} --out run --resume": "holds no run to resume",
    "criticise run": "no run.toml in it",
    "criticise run --held-out missing.nc": "missing.nc: no such file",
    "criticise run --effects magic": "there is no effect magic",
    "pour run": "no run.toml in it",
    "pour run --cups table.csv": "not TOML",
    "pour run --execute": "no run",
    "report run": "no run.toml in it",
    "record --rig table.csv": "not TOML",
    "simulate stir --viscosity -1": "--viscosity: -1",
    "simulate pour --cups missing.toml": "missing.toml: no such file",
    "import missing.csv --columns columns.toml": "missing.csv: no such file",
    "trim missing.nc": "missing.nc: no such file",
    "check sbc --runs -1": "--runs: -1",
}
CODE = """
import json, sys
from typer.testing import CliRunner
from bolfi_liquids.cli.app import app

heavy = "jax numpyro taichi matplotlib pandas xarray cv2 scipy.spatial scipy.stats arviz_stats"
told = {}
for typed in json.loads(sys.argv[1]):
    result = CliRunner().invoke(app, typed.split())
    loaded = [name for name in heavy.split() if name in sys.modules]
    told[typed] = result.exit_code, result.stderr, loaded
print(json.dumps([told, len(sys.modules)]))
"""


@pytest.fixture
def told(tmp_path):
    """Types commands in one process of its own: code, line and heavy modules of each; modules."""
    (tmp_path / "table.csv").write_text("time,x\n0,1\n")

    def type_all(*typed):
        command = [sys.executable, "-c", CODE, json.dumps(typed)]
        done = subprocess.run(command, capture_output=True, text=True, cwd=tmp_path, check=True)
        return json.loads(done.stdout)

    return type_all


def test_a_refusal_loads_neither_engine_nor_fluid_nor_plots(told):
    said, modules = told(*TYPED)
    wrong = {
        typed: answer
        for typed, answer in said.items()
        if answer[0] != 2 or TYPED[typed] not in answer[1] or answer[2]
    }
    assert not wrong
    assert modules < MAX_MODULES


def test_help_loads_little(told):
    said, modules = told("--help")
    assert said["--help"] == [0, "", []] and modules < OF_HELP
