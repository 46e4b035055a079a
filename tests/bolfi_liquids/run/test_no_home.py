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
cache = os.environ.get("XDG_CACHE_HOME", os.path.join(Path.home(), ".cache"))
os.makedirs(cache, exist_ok=True)
print(os.environ["HOME"], cache, os.access(cache, os.W_OK), sep="\\n")
"""


@as_unknown
def test_libraries_find_a_place_for_their_caches_and_a_named_home_stays(tmp_path):
    """People read from their home; and what they write there must fail, not go elsewhere."""
    for home, of in HOMES.items():
        done = without_home(home, tmp_path, WHERE)
        now, cache, writable = done.stdout.splitlines()
        assert cache.startswith(str(tmp_path)) and writable == "True", home
        named = of(tmp_path).get("HOME", "")
        assert now == named if os.path.isabs(named) else now.startswith(str(tmp_path)), home


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


@pytest.mark.slow
@pytest.mark.parametrize("home", HOMES)
@as_unknown
def test_libraries_load_and_draw(tmp_path, home):
    code = "import bolfi_liquids\n" + DRAW
    done = without_home(home, tmp_path, code)
    assert done.returncode == 0, done.stderr
    assert done.stderr == "" and (tmp_path / "drawn.png").exists()
    left = {path.name for path in tmp_path.iterdir()}
    assert not left & {"~", "elsewhere", ".cache"}  # no home is made up beside what was asked for


@pytest.mark.slow
@pytest.mark.parametrize("home", ["none", "not writable"])
@as_unknown
def test_a_command_simulates(tmp_path, home):
    """Taichi, which compiles the fluid, would abort or end by a signal."""
    stir = ["simulate", "stir", "--particles", "2000", "--out", "stir.nc"]
    done = without_home(home, tmp_path, COMMAND, *stir)
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
