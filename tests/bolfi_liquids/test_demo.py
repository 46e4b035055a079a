"""The demo refuses what is not its own; the README's commands run the whole of it."""

import shutil

import pytest

from bolfi_liquids.demo import run_demo
from bolfi_liquids.errors import InputError


def test_another_run_is_left_alone(calibration, tmp_path):
    run = shutil.copytree(calibration.path, tmp_path / "run")
    before = {path: path.read_bytes() for path in run.rglob("*") if path.is_file()}
    with pytest.raises(InputError, match="another run.*`out`"):
        run_demo(run)
    assert {path: path.read_bytes() for path in run.rglob("*") if path.is_file()} == before
