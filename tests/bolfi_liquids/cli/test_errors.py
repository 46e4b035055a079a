"""The error that a person's input causes."""

import pickle

import pytest

from bolfi_liquids.cli.errors import _how_to_go_on
from bolfi_liquids.errors import InputError


def test_it_says_the_same_in_another_process():
    error = InputError("viscosity -1 is negative", where="stir.nc", fix="give one in Pa s")
    again = pickle.loads(pickle.dumps(error))
    assert str(again) == str(error) == "stir.nc: viscosity -1 is negative; give one in Pa s"
    assert (again.what, again.where, again.fix) == (error.what, error.where, error.fix)


@pytest.mark.parametrize("out", [["--out", "run"], ["--out=run"], ["--out", "x", "--out", "run"]])
def test_who_interrupts_is_told_to_resume_only_what_has_begun(tmp_path, monkeypatch, out):
    monkeypatch.chdir(tmp_path)
    typed = ["calibrate", "my stir.nc", *out]
    told = _how_to_go_on(typed)
    assert "--resume" not in told and "'my stir.nc'" in told
    (tmp_path / "run").mkdir()
    assert "--resume" not in _how_to_go_on(typed)
    (tmp_path / "run" / "run.toml").touch()
    assert _how_to_go_on(typed).endswith(" --resume")
    assert _how_to_go_on([*typed, "--resume"]).count("--resume") == 1
    assert "--resume" not in _how_to_go_on(["pour", "run"])
