"""The guide's effect of one's own runs as it stands, in every process."""

import os
import re
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
import xarray as xr
from bolfi_liquids.inference.criticism import KnownNoise
from bolfi_liquids.models import effects as registry

from bolfi_liquids.guide import read_page
from bolfi_liquids.inputs.bundled import bundled_recording
from bolfi_liquids.motions import proposed
from bolfi_liquids.simulators import effect_versions, stir_simulator

EXAMPLE = Path(__file__).parents[2] / "extensions" / "clock_drift.py"
COMMAND = Path(sys.executable).with_name("bolfi-liquids")
STIR = ["simulate", "stir", "--viscosity", "0.1", "--particles", "200"]


def example():
    """The section's Python."""
    section = read_page("liquids").split("\n## Effects of your own\n")[1].split("\n## ")[0]
    return re.search(r"```python\n(.*?)```", section, re.DOTALL)[1]


def run(arguments, effects, where):
    environment = {**os.environ, registry.OWN_EFFECTS: os.pathsep.join(map(str, effects))}
    return subprocess.run(
        [COMMAND, *arguments], env=environment, cwd=where, capture_output=True, text=True
    )


def test_the_example_is_the_one_that_contract_tests_hold_to_the_rules():
    assert example() == EXAMPLE.read_text(encoding="utf-8")


@pytest.mark.slow
def test_the_example_acts_in_worker_processes(tmp_path):
    (tmp_path / "clock_drift.py").write_text(example(), encoding="utf-8")
    acting = ["--effect", "clock_drift=0.02", "--workers", "2"]
    for name, extra in {"plain": [], "late": acting}.items():
        made = run([*STIR, *extra, "--out", f"{name}.nc"], ["clock_drift.py"], tmp_path)
        assert made.returncode == 0, made.stderr
    plain, late = (
        xr.load_dataset(tmp_path / f"{n}.nc", decode_times=False) for n in ("plain", "late")
    )
    for plane in ("inclination_xz", "inclination_yz"):
        # a straight line between samples errs by (omega step)^2 / 8 of an angle
        told = np.interp(0.98 * plain.time, plain.time, plain[plane])
        assert np.abs(late[plane] - told).max() < 0.01 * np.abs(plain[plane]).max()
        assert np.abs(late[plane] - plain[plane]).max() > 0.05 * np.abs(plain[plane]).max()


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("from bolfi_liquids.models import Effect\nEffect('cohesion', 0, 0, 0, 0, 0, 0)", "taken"),
        (None, "FileNotFoundError"),
        ("1 / 0", "ZeroDivisionError"),
        ("effect = 1", "defines EFFECT"),
        ("EFFECT = 1", "models.Effect"),
        ("from bolfi_liquids.models import EFFECTS\nEFFECT = EFFECTS['warming']", "already"),
    ],
)
def test_a_file_that_defines_no_effect_is_refused(tmp_path, text, message):
    if text is not None:
        (tmp_path / "mine.py").write_text(text, encoding="utf-8")
    refused = run(STIR, [tmp_path / "mine.py"], tmp_path)
    assert refused.returncode == 2 and message in refused.stderr
    assert str(tmp_path / "mine.py") in refused.stderr
    assert len(refused.stderr.splitlines()) == 1
    assert ("Python file that defines" in refused.stderr) == (text in ("effect = 1", "EFFECT = 1"))


def test_a_changed_file_is_another_simulator(tmp_path, monkeypatch):
    for name in ("_registered", "_digests"):
        monkeypatch.setattr(registry, name, dict(getattr(registry, name)))
    stirring = stir_simulator([bundled_recording("glycerin")], 200)
    assert stirring.identity_with_effects == stirring.identity
    found = []
    for text in (example(), example(), example() + "# changed\n"):
        (tmp_path / "clock_drift.py").write_text(text, encoding="utf-8")
        registry._load(str(tmp_path / "clock_drift.py"))
        kind, own = effect_versions(["camera_delay", "clock_drift"])
        assert kind == "camera_delay" and own.startswith("clock_drift ")
        planned = proposed(stirring, "again", KnownNoise(0.01))
        found.append((own, stirring.identity_with_effects))
        assert planned.identity == stirring.identity_with_effects
        del registry._registered["clock_drift"]
    assert found[0] == found[1] and not set(found[0]) & {*found[2], stirring.identity}


def test_every_file_that_defines_an_effect_decides(tmp_path, monkeypatch):
    """That of a hook in another file, too; what was typed is never the same twice."""
    for name in ("_registered", "_digests"):
        monkeypatch.setattr(registry, name, dict(getattr(registry, name)))
    monkeypatch.syspath_prepend(tmp_path)
    mine, hook = tmp_path / "mine.py", tmp_path / "own_hook.py"

    def digest(register):
        effect = register()
        registry._registered.pop("clock_drift", effect)
        return registry._digests["clock_drift"]

    def loaded(text):
        hook.write_text(f"def signal(time, angles, c):\n    return angles  # {text}\n")
        sys.modules.pop("own_hook", None)
        registry._load(str(mine))

    replaced = "EFFECT = dataclasses.replace(EFFECT, signal=own_hook.signal)"
    text = "\n".join((example(), "import dataclasses, own_hook", replaced))
    mine.write_text(text, encoding="utf-8")
    first, same, other = (digest(lambda text=text: loaded(text)) for text in "aab")
    assert first == same != other
    exec(example(), typed := {"__name__": "typed"})
    one, two = (digest(lambda: registry.register(typed["EFFECT"])) for _ in range(2))
    assert one != two
