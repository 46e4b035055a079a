"""A disk on which nothing more can be written costs nothing that was simulated, and is said.

A limit on the size of files (EFBIG) stands for a full disk: it needs no right to mount one.
"""

import errno
import resource
import subprocess
import sys
from contextlib import closing, contextmanager

import numpy as np
import pytest
from bolfi_liquids.inference.checks.many_replicates import ReplicateStore
from bolfi_liquids.inference.checks.one_replicate import Replicate
from bolfi_liquids.inference.simulations import Simulation
from xarray import Dataset, DataTree

import bolfi_liquids as bl
from bolfi_liquids import inference
from bolfi_liquids.cli.errors import explained
from bolfi_liquids.drawing import new_figure, write_figure
from bolfi_liquids.files import disk_errno, write_text
from bolfi_liquids.run.results import write_result
from bolfi_liquids.run.run import Run


@contextmanager
def at_most(size):
    """No file may grow beyond so many bytes."""
    soft, hard = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (size, hard))
    try:
        yield
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, (soft, hard))


def section(folder):
    with at_most(1000):
        write_text(folder / "summary.json", 5000 * "1")


def posterior(folder):
    draws = np.random.default_rng(0).random(99999)
    tree = DataTree.from_dict({"/posterior": Dataset({"x": ("t", draws)})})
    with at_most(20000):
        write_result(tree, folder / "posterior.nc")


def figure(folder):
    drawn = new_figure(4.0, 3.0)
    drawn.subplots().plot(np.random.default_rng(0).random(999))
    with at_most(1000):
        write_figure(drawn, folder, "figure")


def bank(folder):
    with Run(folder, {}).bank() as simulations:
        simulations.put("stir", {}, 0, Simulation(np.zeros(9), None, 1.0))
        with at_most(200_000):
            for seed in range(1, 100):
                simulations.put("stir", {}, seed, Simulation(np.zeros(9999), None, 1.0))


def replicates(folder):
    data = np.random.default_rng(0).random(9999)
    with closing(ReplicateStore(folder / "kept.sqlite", {"a": "b"})) as store, at_most(200_000):
        for n in range(99):
            store.put(Replicate(n, data[:1], data, data[:, None], None, 1.0, 1.0, None))


WRITES = {
    "summary.json": section,
    "posterior.nc": posterior,
    "figure.png": figure,
    "simulations.sqlite": bank,
    "kept.sqlite": replicates,
}


@pytest.mark.parametrize("name", WRITES)
def test_what_cannot_be_written_whole_is_named_and_left_out(tmp_path, name):
    with pytest.raises(OSError) as refused:
        WRITES[name](tmp_path)
    assert refused.value.filename == str(tmp_path / name)
    line = explained(refused.value)
    assert "\n" not in line
    assert line.startswith(f"{tmp_path / name}: ")
    assert (
        "make room" in line and "--resume" in line and "nothing that was simulated is lost" in line
    )
    left = {path.name for path in tmp_path.iterdir()}
    if name.endswith(".sqlite"):
        assert {name} <= left  # with all that was stored before
    else:
        assert left == set()
    if name == "simulations.sqlite":
        with inference.SimulationBank(tmp_path / name) as bank:
            assert len(bank) >= 1
            assert bank.get("stir", {}, 0).signal.tolist() == [0.0] * 9
            bank.put("stir", {}, 999, Simulation(np.ones(1), None, 0.0))


@pytest.mark.parametrize(
    ("number", "cure"), [(errno.EDQUOT, "make room"), (errno.EROFS, "make it writable")]
)
def test_every_way_in_which_a_disk_refuses_has_its_cure(number, cure):
    line = explained(OSError(number, "refused", "runs/mine/report.html"))
    assert line.startswith("runs/mine/report.html: ") and cure in line
    assert disk_errno(FileNotFoundError(errno.ENOENT, "no")) is None


CALIBRATE = """
import resource
resource.setrlimit(resource.RLIMIT_FSIZE, (35_000, resource.RLIM_INFINITY))
from bolfi_liquids.cli.app import main
main()
"""


@pytest.mark.slow
def test_a_calibration_goes_on_once_there_is_room(short_recording, settings, calibration, tmp_path):
    run = tmp_path / "run"
    options = [part for name, value in settings.items() for part in (f"--{name}", str(value))]
    command = ["calibrate", str(short_recording), "--out", str(run), *options]
    done = subprocess.run(
        [sys.executable, "-c", CALIBRATE, *command], capture_output=True, text=True
    )
    assert done.returncode == 2, done.stderr
    *_, line = done.stderr.strip().splitlines()
    assert line.startswith(f"error: {run}") and "make room" in line and "--resume" in line
    again = bl.calibrate(short_recording, out=run, resume=True, progress=False, **settings)
    for name, draws in calibration.posterior.items():
        np.testing.assert_array_equal(again.posterior[name], draws)
