"""The stir that tells most of the liquid of a run."""

import tomllib

import pytest
from typer.testing import CliRunner

import bolfi_liquids as bl
from bolfi_liquids import next_stir
from bolfi_liquids.cli.app import app
from bolfi_liquids.inputs.rigs import rig_of
from bolfi_liquids.motions import Motion
from bolfi_liquids.next_stir import FILE


def test_a_bad_fit_is_warned_of(calibration, monkeypatch, caplog):
    class Enough(Exception):
        pass

    def stopped(*_):
        raise Enough

    monkeypatch.setattr(next_stir, "family", stopped)
    for bad in ("the fit is bad", None):
        caplog.clear()
        monkeypatch.setattr(next_stir, "bad_fit", lambda _, bad=bad: bad)
        with pytest.raises(Enough):
            bl.design_stir(calibration, progress=False)
        assert [bad in one.getMessage() for one in caplog.records] == [True] * bool(bad)


@pytest.mark.slow
def test_a_run_gets_the_motion_that_is_expected_to_tell_most(calibration, monkeypatch):
    monkeypatch.setattr(next_stir, "MOTIONS", 2)
    found = bl.design_stir(calibration, progress=False)
    assert 0.0 < found.sd_after < found.sd_before
    again = bl.design_stir(calibration.path, progress=False)
    assert again == found
    if found.motion is None:
        assert found.label == next_stir.AGAIN
    else:
        assert found.motion == calibration.path / FILE
        assert Motion(**tomllib.loads(found.motion.read_text())).label == found.label
        rig_of(None, found.motion)


def test_that_no_stir_can_be_simulated_is_said(calibration, monkeypatch):
    monkeypatch.setattr(next_stir, "family", lambda *_: [])
    monkeypatch.setattr(next_stir, "_proposals", lambda *_: iter(()))
    with pytest.raises(RuntimeError, match="no proposed stir could be simulated"):
        bl.design_stir(calibration, progress=False)


def test_where_the_same_stir_is_best_no_motion_is_left(monkeypatch, tmp_path):
    for motion, said in (
        (None, "There is no motion file"),
        (tmp_path / FILE, f"record --motion {tmp_path / FILE}"),
    ):
        stir = next_stir.NextStir("the same stir again", 7.0, 0.1, 0.05, motion)
        monkeypatch.setattr(next_stir, "design_stir", lambda *_, stir=stir, **__: stir)
        result = CliRunner().invoke(app, ["design", str(tmp_path)])
        assert result.exit_code == 0 and said in result.output.replace("\n", "")
        assert ("next: " in result.output) == (motion is not None)
