"""Arguments mean the same in `record` and in `execute_pour`."""

from types import SimpleNamespace

import pytest

import bolfi_liquids as bl
from bolfi_liquids import hardware
from bolfi_liquids.inputs.rigs import rig_of
from bolfi_liquids.online.record import Learning


def test_a_copy_of_a_rig_is_checked_before_anybody_is_asked(tmp_path):
    rig = hardware.bundled_rig()
    wrong = rig.model_copy(update={"limits": rig.limits.model_copy(update={"speed": 2.0})})
    with pytest.raises(hardware.RigError, match="speed"):
        bl.record(wrong, out=tmp_path / "out", ask=lambda plan: pytest.fail(plan))


def test_a_rig_may_be_itself_or_its_file_or_none(tmp_path):
    bundled = hardware.bundled_rig()
    assert rig_of(bundled) is bundled
    assert rig_of(None) == bundled
    for wrong in (tmp_path / "none.toml", {"robot": 1}):
        with pytest.raises(ValueError, match=r"none\.toml|^rig: .* give a TOML file"):
            rig_of(wrong)  # pyright: ignore


def test_what_went_wrong_while_learning_is_logged_once(caplog):
    view = SimpleNamespace(show=lambda: None)
    learning = Learning(SimpleNamespace(phase="failed", detail="no memory"))
    for _ in range(3):
        learning._take(None, view)
    (record,) = caplog.records
    assert record.getMessage() == "calibration failed: no memory"
    assert record.levelname == "WARNING"


def test_neither_or_both_of_ask_and_emulate_are_refused(tmp_path):
    for consent in ({"ask": None, "emulate": False}, {"ask": lambda _: "", "emulate": True}):
        with pytest.raises(ValueError, match="neither or both"):
            bl.execute_pour(tmp_path, **consent)
        with pytest.raises(ValueError, match="neither or both"):
            bl.record(out=tmp_path / "out", **consent)
    assert not (tmp_path / "out").exists()
