"""What is given to be written to is checked before anything is written."""

from importlib.resources import files
from pathlib import Path

import numpy as np
import pytest

import bolfi_liquids as bl
from bolfi_liquids.errors import InputError
from bolfi_liquids.files import new_file
from bolfi_liquids.inputs import bundled as bundled_files
from bolfi_liquids.inputs.settings import (
    CalibrationSettings,
    CriticismSettings,
    PourSettings,
    SbcSettings,
)
from bolfi_liquids.online.settings import OnlineSettings


def bundled(name):
    return Path(str(files("bolfi_liquids.data"))) / name


def given_nothing(out):
    """Each function that writes, with `out` for its path."""
    from bolfi_liquids.checks.sbc import check_sbc
    from bolfi_liquids.demo import run_demo
    from bolfi_liquids.inputs.bundled import write_template

    stir = bundled("glycerin_v10.nc")
    return {
        "calibrate": lambda: bl.calibrate(stir, out=out, progress=False),
        "check sbc": lambda: check_sbc(out),
        "demo": lambda: run_demo(out),
        "record": lambda: bl.record(out=out, emulate=True, progress=False),
        "simulate stir": lambda: bl.simulate_stir(out=out, progress=False),
        "simulate pour": lambda: bl.simulate_pour(movie=out, progress=False),
        "import": lambda: bl.import_table(stir, "columns.toml", out),
        "import --template": lambda: write_template("columns.toml", out),
        "rig template": lambda: write_template("rig.toml", out),
    }


def test_an_empty_path_is_not_the_current_directory(monkeypatch, tmp_path):
    monkeypatch.chdir(tmp_path)
    accepted = []
    for name, call in given_nothing(" ").items():
        try:
            call()
        except InputError as err:
            if "is empty" in str(err):
                continue
        accepted.append(name)
    assert not accepted
    assert list(tmp_path.iterdir()) == []


def test_a_file_that_was_made_in_between_stays(monkeypatch, tmp_path):
    mine = tmp_path / "rig.toml"
    mine.write_text("mine")
    monkeypatch.setattr(bundled_files, "new_file", lambda path, *_, **__: path)
    with pytest.raises(FileExistsError):
        bundled_files.write_template("rig.toml", mine)
    assert mine.read_text() == "mine"


def test_a_name_that_ends_otherwise_is_refused(tmp_path):
    for name in (".nc", "stir", "stir.nc.txt"):
        with pytest.raises(InputError, match=r"ends in '"):
            new_file(tmp_path / name, "out", suffix=".nc")
    assert new_file(tmp_path / "stir.nc", "out", suffix=".nc") == tmp_path / "stir.nc"


def test_seeds_are_those_that_every_generator_takes():
    kinds = CalibrationSettings, SbcSettings, PourSettings, CriticismSettings, OnlineSettings
    for settings in kinds:
        for seed in (0, 2**31 - 1, np.int64(7), np.uint8(7), np.array(7)):
            assert type(settings(seed=seed).seed) is int
        for seed in (-1, 2**31, np.uint64(2**63), 1.0, "7", True, None):
            with pytest.raises(InputError, match="seed"):
                settings(seed=seed)
