"""How `record` ends, for scripts that go on with what it recorded."""

import pytest
from bolfi_liquids.hardware import SessionStopped
from typer.testing import CliRunner

import bolfi_liquids as bl
from bolfi_liquids import hardware
from bolfi_liquids.cli.app import app
from bolfi_liquids.robot.armed_session import told_on_stop
from bolfi_liquids.robot.record import finished, what_is_left

REASON = "protective stop at 2.6 s"


@pytest.fixture
def recorded(dataset, tmp_path, monkeypatch):
    """Lets `record` return a recording that ended so; no arm is needed to see how that is told."""

    def returns(**attrs):
        path = tmp_path / "recording.nc"
        dataset.assign_attrs(attrs).to_netcdf(path)
        monkeypatch.setattr(
            "bolfi_liquids.robot.record.record", lambda *_, **__: bl.open_recording(path)
        )
        return path

    return returns


def run(tmp_path):
    return CliRunner().invoke(app, ["record", "--emulator", "--out", str(tmp_path / "stir")])


def test_an_aborted_recording_has_a_status_of_its_own_and_its_reason_in_one_line(
    recorded, tmp_path
):
    path = recorded(status="aborted", reason=REASON)
    result = run(tmp_path)
    assert result.exit_code == 3
    (line,) = result.stderr.strip().splitlines()
    assert line.startswith(f"error: {path}: ") and REASON in line


def test_a_complete_recording_has_none(recorded, tmp_path):
    recorded(status="complete", reason="the plan was carried out")
    result = run(tmp_path)
    assert (result.exit_code, result.stderr) == (0, "")


def test_a_recording_that_was_aborted_too_early_to_be_used_is_aborted(
    dataset, tmp_path, monkeypatch
):
    path = tmp_path / "recording.nc"
    dataset.isel(time=slice(0, 9)).assign_attrs(status="aborted", reason=REASON).to_netcdf(path)
    monkeypatch.setattr(hardware, "finalise", lambda _: path)
    monkeypatch.setattr("bolfi_liquids.robot.record.record", lambda *_, out, **__: finished(out))
    result = run(tmp_path)
    assert result.exit_code == 3
    (line,) = result.stderr.strip().splitlines()
    assert REASON in line and "samples = 9" in line


@pytest.mark.parametrize(
    ("stop", "status"), [(SessionStopped(REASON), 3), (KeyboardInterrupt(), 130)]
)
def test_a_session_that_is_stopped_says_what_is_left(monkeypatch, tmp_path, stop, status):
    def session(*_, out, **__):
        out.mkdir()
        with told_on_stop(lambda: what_is_left(out)):
            raise stop

    monkeypatch.setattr("bolfi_liquids.robot.record.record", session)
    result = run(tmp_path)
    assert result.exit_code == status
    (line,) = result.stderr.strip().splitlines()
    assert "no recording can be made of it" in line
    assert status == 130 or REASON in line
