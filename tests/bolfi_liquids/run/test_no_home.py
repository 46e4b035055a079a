"""Commands and imports work without a home directory, as in a container."""

import os
import shutil
import subprocess
import sys

import pytest

UNKNOWN_USER = "54321"  # without an entry in passwd
AS_UNKNOWN = ["unshare", "--user", f"--map-user={UNKNOWN_USER}", f"--map-group={UNKNOWN_USER}"]


def others_can_be_played():
    if shutil.which("unshare") is None:
        return False
    return subprocess.run([*AS_UNKNOWN, "true"], capture_output=True).returncode == 0


as_unknown = pytest.mark.skipif(not others_can_be_played(), reason="needs user namespaces")
HOMES = {
    "none": lambda folder: {},
    "empty": lambda folder: {"HOME": ""},
    "a file": lambda folder: {"HOME": str(folder / "file")},
    "not writable": lambda folder: {"HOME": "/proc"},
    "relative": lambda folder: {"HOME": "elsewhere"},
}


def without_home(home, folder, code, *arguments):
    """What a process says whose user has no home; it may write in `folder` alone."""
    (folder / "file").touch()
    environment = {"PATH": os.environ["PATH"], "TMPDIR": str(folder)}
    return subprocess.run(
        [*AS_UNKNOWN, sys.executable, "-c", code, *arguments],
        env=environment | HOMES[home](folder),
        cwd=folder,
        capture_output=True,
        text=True,
    )


WHERE = """
import os
from pathlib import Path
import bolfi_liquids
print(Path.home(), os.environ["XDG_CACHE_HOME"], sep="\\n")
"""


@as_unknown
def test_a_home_that_cannot_be_written_stays_home_for_all_but_caches(tmp_path):
    """People read from it; and what they write there must fail, not go elsewhere."""
    done = without_home("not writable", tmp_path, WHERE)
    home, cache = done.stdout.splitlines()
    assert home == HOMES["not writable"](tmp_path)["HOME"]
    assert cache.startswith(str(tmp_path))


DRAW = """
from pathlib import Path
import arviz_stats
from bolfi_liquids.drawing import new_figure, write_figure

figure = new_figure(4.0, 3.0)
figure.subplots().plot([1.0, 2.0])
write_figure(figure, Path(), "drawn")
"""
COMMAND = """
from bolfi_liquids.cli.app import main
main()
"""


@pytest.mark.parametrize(
    "home", ["none", *(pytest.param(home, marks=pytest.mark.slow) for home in [*HOMES][1:])]
)
@as_unknown
def test_libraries_load_and_draw(tmp_path, home):
    code = "import bolfi_liquids\n" + DRAW
    done = without_home(home, tmp_path, code)
    assert done.returncode == 0, done.stderr
    assert done.stderr == "" and (tmp_path / "drawn.png").exists()
    left = {path.name for path in tmp_path.iterdir()}
    assert not left & {"~", "elsewhere", ".cache"}  # no home is made up beside what was asked for


# Taichi, which compiles the fluid, would abort or end by a signal
COMPILE = """
from bolfi_liquids.models import runtime
import taichi as ti

@ti.kernel
def twice(x: ti.f32) -> ti.f32:
    return 2.0 * x

runtime.start()
assert twice(1.5) == 3.0
"""


@pytest.mark.slow
@pytest.mark.parametrize("home", ["none", "not writable"])
@as_unknown
def test_taichi_compiles(tmp_path, home):
    script = tmp_path / "compile.py"  # Taichi reads the source of what it compiles
    script.write_text(COMPILE)
    done = without_home(home, tmp_path, f"import runpy; runpy.run_path({str(script)!r})")
    assert done.returncode == 0, done.stderr
    assert done.stderr == ""


@pytest.mark.slow
@as_unknown
def test_a_command_simulates(tmp_path):
    stir = ["simulate", "stir", "--particles", "2000", "--out", "stir.nc"]
    done = without_home("not writable", tmp_path, COMMAND, *stir)
    assert done.returncode == 0, done.stderr
    assert done.stderr == "" and (tmp_path / "stir.nc").exists()


WRITES = """
import os, sys

def refuse(event, arguments):
    made = event in {"os.mkdir", "os.remove", "os.rmdir", "os.rename"}
    if made or event == "open" and arguments[2] & (os.O_WRONLY | os.O_RDWR | os.O_CREAT):
        raise AssertionError(f"{event} {arguments}")

sys.dont_write_bytecode = True
sys.addaudithook(refuse)
import bolfi_liquids
"""


def test_an_import_writes_nothing():
    done = subprocess.run([sys.executable, "-c", WRITES], capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
