"""No entry point moves an arm unless it is armed and a person has typed the sentence."""

import ast
import os
import re
import signal
import subprocess
import sys
import time
import tomllib
from importlib.resources import files
from itertools import count
from pathlib import Path
from typing import NamedTuple

import cv2
import numpy as np
import pexpect
import pytest
import typer.main
from bolfi_liquids.hardware.emulated.arm import EmulatedController
from bolfi_liquids.hardware.session.setup import CONFIRMATION, Confirmation
from pexpect.fdpexpect import fdspawn

import bolfi_liquids as bl
from bolfi_liquids import hardware
from bolfi_liquids.cli.app import app
from bolfi_liquids.run.run import Run

sys.path.append(str(Path(__file__).parents[1] / "hardware"))
from ur_controller.process import ControllerProcess  # noqa: E402

# a dry run of them looks at the arm, whose controller may not be silent for long
LOOKS = ("record", "pour")
ALONE = [pytest.mark.alone, pytest.mark.slow]
ROOT = Path(__file__).parents[2]
PARTS = ("bolfi_liquids", "hardware", "inference", "models")
SOURCES = {str(p.relative_to(ROOT)): p for part in PARTS for p in (ROOT / part).rglob("*.py")}
REFUSED = 2
# they are read at once, and the pre-flight list would wait for cameras that have ended
PICTURES = 900
DIFFERENT = 20

# what makes each command that knows of a rig do the most that it can without being armed
OF_A_RIG = {
    "record": ["--cycles", "1", "--calibrate", "CALIBRATED"],
    "pour": ["RUN", "--execute"],
    "rig check": [],
    "rig calibrate-cameras": ["--boards", "BOARDS"],
}


def commands():
    """Every command's words, with its parameters' names."""

    def walk(command, words):
        if hasattr(command, "commands"):
            for name, inner in command.commands.items():
                yield from walk(inner, [*words, name])
        else:
            yield " ".join(words), {parameter.name for parameter in command.params}

    return dict(walk(typer.main.get_command(app), []))


@pytest.fixture(scope="module")
def pictures(tmp_path_factory):
    directory = tmp_path_factory.mktemp("pictures")
    noise = np.random.default_rng(0)
    for k in range(PICTURES):
        path = directory / f"{k:03d}.png"
        if k < DIFFERENT:
            cv2.imwrite(str(path), noise.integers(90, 110, (480, 640), dtype=np.uint8))
        else:
            path.hardlink_to(directory / f"{k % DIFFERENT:03d}.png")
    return directory


@pytest.fixture(scope="module")
def boards(pictures, tmp_path_factory):
    directory = tmp_path_factory.mktemp("boards")
    for path in sorted(pictures.iterdir())[:DIFFERENT]:
        (directory / path.name).hardlink_to(path)
    return directory


@pytest.fixture(scope="module")
def emulator():
    rig = hardware.bundled_rig()
    with ControllerProcess.at_pose(rig, hardware.motion.above_cup(rig)) as running:
        yield running


@pytest.fixture
def rig_file(tmp_path, emulator, pictures):
    """The bundled rig, its arm the emulator and its cameras pictures in a directory."""
    text = (files("bolfi_liquids.hardware.data") / "rig.toml").read_text()
    text = text.replace('host = "127.0.0.1"', f'host = "{emulator.address}"')
    text = re.sub(r"source = [01]", f'source = "{pictures}"', text)
    path = tmp_path / "rig.toml"
    path.write_text(text)
    return path


def bolfi_liquids(*arguments, typed=""):
    code = "from bolfi_liquids.cli.app import main; main()"
    return subprocess.run(
        [sys.executable, "-c", code, *map(str, arguments)],
        input=typed,
        capture_output=True,
        text=True,
        timeout=120,
    )


def in_a_terminal(*arguments, typed, until=None):
    """Run the command as a person does, who answers the question; exit status and last words.

    With `until` it is interrupted as soon as that is so.
    """
    words = " ".join(map(str, arguments))
    code = f"""
import signal
from bolfi_liquids.cli.app import app

# these tests may themselves be run where it is ignored
signal.signal(signal.SIGINT, signal.default_int_handler)
app({words!r}.split())
"""
    # not pexpect.spawn, which forks this process with all of its threads
    ours, its = os.openpty()
    command = [sys.executable, "-c", code]
    with subprocess.Popen(command, stdin=its, stdout=its, stderr=its) as process:
        os.close(its)
        with fdspawn(ours, timeout=60.0) as terminal:
            terminal.expect("to go on: ")
            terminal.sendline(typed)
            if until is not None:
                wait_for(until)
                process.send_signal(signal.SIGINT)
            terminal.expect(pexpect.EOF)
            said = terminal.before.decode()
    return process.returncode, said


def wait_for(condition, seconds=60.0):
    end = time.monotonic() + seconds
    while not condition():
        assert time.monotonic() < end
        time.sleep(0.01)


def test_every_command_is_known_here():
    with_rig = {words for words, names in commands().items() if "rig" in names}
    assert with_rig == set(OF_A_RIG)
    armable = {words for words, names in commands().items() if "arm" in names}
    assert armable == {"record", "pour"}


def test_there_are_no_other_entry_points():
    project = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]
    assert project["scripts"] == {"bolfi-liquids": "bolfi_liquids.cli.app:main"}
    assert not [name for name in SOURCES if name.endswith("__main__.py")]


def gives(argument, path):
    """Whether a call in a file gives an argument of that name anything but False."""
    calls = (node for node in ast.walk(ast.parse(path.read_text())) if isinstance(node, ast.Call))
    given = (keyword for call in calls for keyword in call.keywords if keyword.arg == argument)
    return any(not (isinstance(k.value, ast.Constant) and k.value.value is False) for k in given)


def sources(pattern):
    return {name for name, path in SOURCES.items() if re.search(pattern, path.read_text())}


def test_one_file_knows_the_library_that_moves_arms():
    assert sources(r"rtde_control\"\)|import rtde_control") == {"hardware/robot/ur.py"}
    assert sources(r"\bURArm\(") == {"hardware/robot/ur.py"}
    armed = {name for name, path in SOURCES.items() if gives("armed", path)}
    # the others hand it on
    session = {f"hardware/session/{name}.py" for name in ("session", "setup")}
    inside = {"hardware/robot/control_loop.py", *session}
    assert armed == {"bolfi_liquids/robot/armed_session.py", *inside}


@pytest.mark.parametrize(
    "words",
    [pytest.param(one, marks=ALONE if one in LOOKS else []) for one in OF_A_RIG],
)
def test_unarmed_command_moves_nothing(words, rig_file, poured_run, boards, emulator):
    before = emulator.admin.motions()
    names = {
        "RUN": poured_run,
        "BOARDS": boards,
        "CALIBRATED": rig_file.parent / "c",
    }
    arguments = [names.get(one, one) for one in OF_A_RIG[words]]
    # the sentence is typed all the same
    result = bolfi_liquids(*words.split(), *arguments, "--rig", rig_file, typed=f"{CONFIRMATION}\n")
    assert "Traceback" not in result.stderr, result.stderr
    assert emulator.admin.motions() == before
    if words in ("record", "pour"):
        assert "nothing was moved" in result.stdout, result.stderr


@pytest.mark.parametrize("words", ["record", "pour"])
def test_a_sentence_through_a_pipe_was_typed_by_nobody(
    words, rig_file, poured_run, emulator, tmp_path
):
    before = emulator.admin.motions()
    extra = {"record": ["--out", tmp_path / "out"], "pour": [poured_run, "--execute"]}[words]
    command = [words, *extra, "--rig", rig_file, "--arm"]
    result = bolfi_liquids(*command, typed=f"{CONFIRMATION}\n")
    assert result.returncode == REFUSED, result.stderr
    # cameras that are files are refused even earlier
    assert ("no terminal" if words == "pour" else "name a device") in result.stderr
    assert emulator.admin.motions() == before


@pytest.mark.parametrize("typed", ["", "yes", CONFIRMATION.upper()])
@pytest.mark.parametrize("words", ["record", "pour"])
def test_armed_without_the_sentence_moves_nothing(
    words, typed, rig_file, poured_run, emulator, tmp_path
):
    before = emulator.admin.motions()
    # a real arm asks for real cameras, which nobody opens before the sentence is there
    devices = count()
    text = re.sub(r'source = ".*"', lambda _: f"source = {next(devices)}", rig_file.read_text())
    rig_file.write_text(text)
    extra = {"record": ["--out", tmp_path / "out"], "pour": [poured_run, "--execute"]}[words]
    status, said = in_a_terminal(words, *extra, "--rig", rig_file, "--arm", typed=typed)
    assert status == REFUSED, said
    assert emulator.admin.motions() == before


@pytest.mark.slow
@pytest.mark.alone  # a look at an arm, whose controller may not be silent for long
def test_a_stale_pour_is_refused(poured_run, rig_file, emulator):
    before = emulator.admin.motions()
    run = Run.open(poured_run)
    tree = run.required("pour")
    run.keep("pour", tree, {"after": "another posterior", "given": ""}, {})
    command = ["pour", poured_run, "--execute", "--rig", rig_file]
    for armed in ([], ["--arm"]):
        told = bolfi_liquids(*command, *armed, typed=f"{CONFIRMATION}\n")
        # refused before the plan, not for want of a terminal
        assert told.returncode == REFUSED and told.stdout == ""
        assert "bolfi-liquids pour" in told.stderr and "terminal" not in told.stderr
    assert emulator.admin.motions() == before


@pytest.mark.punctual
@pytest.mark.parametrize(
    "whole",
    [
        pytest.param(False, marks=pytest.mark.slow, id="interrupted"),
        pytest.param(True, marks=pytest.mark.minutes, id="whole"),
    ],
)
def test_the_sentence_does_move_the_arm(whole, poured_run, tmp_path):
    """Without this the tests above could not fail."""
    rig = hardware.bundled_rig()
    chosen = bl.Pour.open(poured_run).chosen
    ready = hardware.motion.ready_to_pour(rig, chosen.distance, 0.2)
    with ControllerProcess.at_pose(rig, ready, "pouring") as running:
        text = (files("bolfi_liquids.hardware.data") / "rig.toml").read_text()
        path = tmp_path / "rig.toml"
        path.write_text(text.replace('host = "127.0.0.1"', f'host = "{running.address}"'))
        command = ["pour", poured_run, "--execute", "--rig", path, "--arm"]
        motions = running.admin.motions
        until = None if whole else lambda: motions() > 0
        status, said = in_a_terminal(*command, typed=CONFIRMATION, until=until)
        assert (status == 0) == whole, said
        assert motions() > 0


def test_python_asks_for_the_same(tmp_path):
    rig = hardware.bundled_rig()
    with pytest.raises(ValueError, match="ask="):
        bl.record(rig, out=tmp_path / "a")
    with pytest.raises(ValueError, match="armed without a confirmation"):
        hardware.SessionSetup(rig, tmp_path / "b", armed=True)
    with pytest.raises(TypeError, match="comes from confirm"):
        Confirmation(object(), "plan", "127.0.0.1")
    with pytest.raises(ValueError, match="ask="):
        bl.execute_pour(tmp_path, rig)


class Lookalike(NamedTuple):
    """A controller that calls itself emulated, and moves who knows what."""

    address: str = "emulated"
    emulated: bool = True


class Derived(EmulatedController):
    """It may open any arm."""


def test_one_kind_of_arm_alone_moves_without_the_sentence(tmp_path):
    rig = hardware.bundled_rig()
    mine = hardware.emulated(rig, hardware.motion.above_cup(rig)).controller
    assert hardware.SessionSetup(rig, tmp_path, mine, armed=True).rehearsal
    for other in (Lookalike(), Derived(*mine), hardware.URController("127.0.0.1"), None):
        with pytest.raises(ValueError, match="armed without a confirmation"):
            hardware.SessionSetup(rig, tmp_path, other, armed=True)
        # nor do its guards bear what only an emulated arm may bear
        setup = hardware.SessionSetup(rig, tmp_path, other)
        assert not setup.rehearsal and setup.guarded_rig.limits == rig.limits
