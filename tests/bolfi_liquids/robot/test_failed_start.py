"""What a device that fails before the first motion leaves: nothing in the way of the next try."""

from functools import partial

import pytest
from bolfi_liquids.hardware.recorder.events import EventLog
from bolfi_liquids.hardware.session.session import Session
from bolfi_liquids.hardware.session.setup import CONFIRMATION

from bolfi_liquids import hardware
from bolfi_liquids.robot.armed_session import Task, armed_session, told_on_stop
from bolfi_liquids.robot.record import what_is_left
from bolfi_liquids.robot.stir import plan_stir

NOBODY = "127.94.3.2"  # where no controller listens
BUNDLED = hardware.bundled_rig()
RIG = BUNDLED.model_copy(update={"robot": BUNDLED.robot.model_copy(update={"host": NOBODY})})


@pytest.fixture
def task(tmp_path):
    return Task(RIG, "stirring", plan_stir(RIG).paths, tmp_path / "stir")


def session(task):
    """With an arm that does not answer, though somebody has agreed."""
    return armed_session(task, lambda _: CONFIRMATION, task.tool)


def test_a_robot_that_does_not_answer_leaves_no_directory(task):
    with pytest.raises(hardware.RigError, match="no controller answers"), session(task) as one:
        assert task.out.exists()
        one.session.pose()
    assert not task.out.exists()


def test_a_directory_that_was_there_is_neither_used_nor_removed(task):
    task.out.mkdir()
    (task.out / "rig.json").write_text("another recording's")
    with pytest.raises(hardware.RigError, match="already"), session(task):
        pass
    assert (task.out / "rig.json").read_text() == "another recording's"


def test_what_has_moved_is_kept(task):
    with pytest.raises(hardware.RigError), session(task) as one:
        log = EventLog(task.out, "control")
        log.write("began", number=0)
        log.close()
        one.session.pose()
    assert (task.out / "rig.json").exists()


def test_a_session_whose_processes_cannot_start_leaves_no_directory(task, monkeypatch):
    def fails(*_):
        raise OSError(11, "Resource temporarily unavailable")

    monkeypatch.setattr("bolfi_liquids.hardware.session.processes.start", fails)
    with pytest.raises(OSError, match="temporarily"), session(task):
        pass
    assert not task.out.exists()


def test_a_session_that_was_stopped_before_any_motion_says_so(tmp_path):
    stopped = pytest.raises(hardware.SessionStopped, match="robot mode; nothing had moved")
    with stopped, told_on_stop(partial(what_is_left, tmp_path / "gone")):
        raise hardware.SessionStopped("robot mode")


def test_a_dry_run_keeps_what_it_has_seen(tmp_path):
    setup = hardware.SessionSetup(RIG, tmp_path / "dry")
    with Session(setup) as one:
        one.preflight()
    assert (tmp_path / "dry" / "rig.json").exists()
