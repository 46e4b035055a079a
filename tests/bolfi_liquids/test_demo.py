"""The demo refuses what is not its own; the README's commands run the whole of it."""

from dataclasses import replace
from importlib.resources import files

import pytest
import tomli_w

from bolfi_liquids.calibration.calibrate import run_record
from bolfi_liquids.demo import RECORDING, STEPS, expected, run_demo
from bolfi_liquids.errors import InputError
from bolfi_liquids.inputs.open import open_recording
from bolfi_liquids.inputs.prior import default_prior
from bolfi_liquids.inputs.settings import CalibrationSettings
from bolfi_liquids.run.run import RUN_TOML
from bolfi_liquids.simulators import stir_simulator


def of_the_demo(**changes):
    """What `calibrate` notes of the demo's recording, with other settings."""
    recording = open_recording(files("bolfi_liquids.data") / RECORDING)
    settings = replace(CalibrationSettings(), **changes)
    stirring = stir_simulator([recording], settings.particles)
    return run_record(settings, default_prior(), stirring)


OTHERS = {
    "another budget": lambda: of_the_demo(budget=8),
    "another recording": lambda: of_the_demo() | {"inputs": {"sha256": ["ab"]}},
    "something else": lambda: {"settings": {"a": 1}, "versions": {"b": "1"}},
}


@pytest.mark.parametrize("name", OTHERS)
def test_another_run_is_left_alone(tmp_path, name):
    held = tomli_w.dumps(OTHERS[name]())
    (tmp_path / RUN_TOML).write_text(held)
    with pytest.raises(InputError, match="another run.*`out`"):
        run_demo(tmp_path)
    assert [path.name for path in tmp_path.iterdir()] == [RUN_TOML]
    assert (tmp_path / RUN_TOML).read_text() == held


def test_the_time_left_follows_how_slow_the_computer_was():
    first, second, *_ = usual = [step.seconds for step in STEPS]
    assert expected(STEPS[0], 0.0) == (first, sum(usual))
    assert expected(STEPS[1], 3.0 * first) == (3.0 * second, 3.0 * sum(usual[1:]))
    # the run held the calibration: this says nothing of the computer
    assert expected(STEPS[1], 0.1) == (second, sum(usual[1:]))


def test_its_own_run_is_gone_on_with(tmp_path, monkeypatch):
    (tmp_path / RUN_TOML).write_text(tomli_w.dumps(of_the_demo()))

    def begins(recording, *, out, resume, **_):
        assert (recording.path.name, out, resume) == (RECORDING, tmp_path, True)
        raise InterruptedError

    monkeypatch.setattr("bolfi_liquids.demo.calibrate", begins)
    with pytest.raises(InterruptedError):
        run_demo(tmp_path)
