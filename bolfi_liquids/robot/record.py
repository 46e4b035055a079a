"""Recording a stir: the arm, the cameras, and the recording that they leave."""

from collections.abc import Callable
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from ..errors import Argument, InputError
from ..files import disk_errno, given_path
from ..inputs.described_liquid import COHESION
from ..inputs.open import check_recording, read_recording
from ..inputs.recording import Recording, planned_recording
from ..inputs.rigs import rig_of
from ..simulation.simulate import described_liquids, simulated
from ..simulators import stir_simulator
from ..wording import command
from .armed_session import (
    Ask,
    SessionView,
    Task,
    armed_session,
    check_consent,
    dry_run,
    told_on_stop,
)
from .stir import StirPlan, follow_plan, plan_stir

if TYPE_CHECKING:
    from ..hardware import Check, HiddenLiquid, Rig
    from ..hardware.motion import PosePath


def record(
    rig: "Rig | str | Path | None" = None,
    *,
    out: str | Path,
    ask: Ask | None = None,
    emulate: "HiddenLiquid | bool" = False,
    cycles: int | None = None,
    progress: bool = True,
) -> Recording:
    """Stir, and record the stir.

    The arm moves only if `ask` returns the sentence that the plan asks for; or there is no arm
    and all of it is emulated. Whatever stops it, what was recorded until then is kept in `out`.

    Args:
        rig: What is there, or its file; None is the bundled one. `hardware.with_motion` gives it
            the motion of a file, such as RUN/next_stir.toml.
        out: Directory of the recording; new or empty.
        ask: Shows a person the plan, returns what the person typed.
        emulate: Use an emulated arm and rendered cameras, which look at this liquid; True takes
            one of 1 Pa s.
        cycles: How often the pattern is repeated; None as in the rig's file.
        progress: Whether to show a live view on stderr, if that is a terminal.

    Returns:
        The recording, of `out`/recording.nc.

    Raises:
        InputError: Neither `ask` nor `emulate` is given, or both; or the stir of the emulated
            liquid cannot be simulated.
        RigError: The rig, the directory or a device cannot be used, or the person did not agree.
        MotionRejected: The plan breaks one of the rig's limits.
        SessionStopped: The arm was stopped; the message says why.
    """

    def wait(view: SessionView, number: int, _: "PosePath") -> bool:
        view.until_done(number)
        return False

    stir = prepare_stir(rig, out, ask, emulate, cycles)
    return carried_out(stir, wait, stir.task.tool, progress=progress)


class PlannedStir(NamedTuple):
    """A stir that is planned and checked, and may be carried out.

    Attributes:
        plan: What the arm will do.
        task: The same for a session, which the rig's cameras look at.
        by: Shows a person the plan; or the liquid of an emulated arm with rendered cameras, which
            nobody is asked about.
    """

    plan: StirPlan
    task: Task
    by: "Ask | HiddenLiquid"


def prepare_stir(
    rig: "Rig | str | Path | None",
    out: str | Path,
    ask: Ask | None,
    emulate: "HiddenLiquid | bool",
    cycles: int | None,
) -> PlannedStir:
    """Check and plan a stir; the arguments and errors of `record`."""
    from ..hardware import HiddenLiquid

    check_consent(ask, emulate, "record")
    opened = rig_of(rig)
    plan, task = _planned(opened, cycles, given_path(out, Argument("out")))
    hidden = HiddenLiquid() if emulate is True else emulate
    by = with_stir(opened, plan, hidden) if hidden else ask
    assert by is not None
    return PlannedStir(plan, task, by)


def dry_stir(rig: "Rig", cycles: int | None, out: Path) -> "tuple[str, list[Check]]":
    """The plan of a stir, and the pre-flight list of a session that cannot move the arm.

    Raises:
        InputError, MotionRejected: As `plan_stir`.
        RigError: `out` holds something, or cannot be used.
    """
    _, task = _planned(rig, cycles, out)
    return dry_run(task)


def _planned(rig: "Rig", cycles: int | None, out: Path) -> tuple[StirPlan, Task]:
    """A plan and its task; a directory that holds something is refused before anything begins."""
    from ..hardware.recorder.directory import check_empty

    plan = plan_stir(rig, cycles)
    if out.is_dir():
        check_empty(out)
    return plan, Task(rig, "stirring", plan.paths, out, cameras=True)


def with_stir(rig: "Rig", plan: StirPlan, liquid: "HiddenLiquid") -> "HiddenLiquid":
    """The liquid, and how the stick hangs that stirs it along a plan.

    It is simulated before the session, along the path of the emulated arm, which lags its plan and
    rounds corners off; the arm replays it.

    Args:
        rig: What is there.
        plan: That will be followed.
        liquid: Of which a viscosity is known; one that has a stir keeps it.

    Raises:
        InputError: The liquid cannot be simulated, or its stir goes wrong.
        ValueError: The rig cannot be simulated.
    """
    from ..hardware import StickMotion, servoed
    from ..hardware.motion import joined
    from ..hardware.recorder.finalise import rig_attributes
    from ..inference.simulations import Compute

    if liquid.stir is not None:
        return liquid
    path = servoed(joined(list(plan.strokes)))
    expected = planned_recording(path.time, path.position, rig_attributes(rig))
    inclination, fault = np.full((1, 2), np.nan), "its result is not finite"
    of = {"viscosity": liquid.viscosity, "cohesion": COHESION, "seed": liquid.seed}
    try:
        liquids = described_liquids(of, density=rig.liquid.density)
        (inclination,) = simulated(stir_simulator([expected], 0), liquids, Compute())
    except InputError as err:
        raise InputError(err.what, where=f"emulated {err.where}", fix=err.fix) from err
    except RuntimeError as err:
        fault = str(err)
    if not np.isfinite(inclination).all():
        raise InputError(
            f"{liquid.viscosity:g} Pa s cannot be stirred along the rig's path: {fault}",
            where="emulated viscosity",
            fix="give another viscosity, or another path under [stirring] of rig.toml",
        )
    return replace(liquid, stir=StickMotion(path.time, path.position, inclination))


def carried_out(
    stir: PlannedStir,
    wait: "Callable[[SessionView, int, PosePath], bool]",
    title: str,
    *,
    progress: bool,
) -> Recording:
    """The recording of a planned stir; what is recorded is kept whatever stops it.

    Args:
        stir: Of `prepare_stir`.
        wait: As of `follow_plan`, of a session with its view.
        title: Of the view.
        progress: Whether to show a live view, if stderr is a terminal.

    Raises:
        InputError: A camera is a file, or the recording cannot be used.
        RigError: The person did not agree, or something cannot be used.
        SessionStopped: The arm was stopped; the message says what was recorded.
    """
    from ..hardware import HiddenLiquid, emulated
    from ..hardware.motion import above_cup

    by, rig, out = stir.by, stir.task.rig, stir.task.out
    if isinstance(by, HiddenLiquid):
        by = emulated(rig, above_cup(rig), liquid=by, truth=out)
    else:
        _check_devices(rig)
    left = partial(what_is_left, out)
    with told_on_stop(left), armed_session(stir.task, by, title, progress=progress) as view:
        follow_plan(view.session, stir.plan, partial(wait, view))
    return finished(out)


def _check_devices(rig: "Rig") -> None:
    for camera in rig.cameras:
        if not camera.is_device:
            raise InputError(
                f"source = {camera.source!r} is a file",
                where=f"rig.toml: camera {camera.view}",
                fix="a real arm moves only while real cameras look on: name a device",
            )


def finished(directory: Path) -> Recording:
    """The recording of a session that has ended.

    Raises:
        SessionStopped: It was aborted so early that its recording cannot be used.
        InputError: It was not, and cannot be used nevertheless.
    """
    from ..hardware import SessionStopped, finalise

    recording = read_recording(finalise(directory))
    try:
        check_recording(recording)
    except InputError as err:
        if recording.attrs.get("status") != "aborted":
            raise
        reason = recording.attrs.get("reason") or "no reason given"
        raise SessionStopped(f"{recording.path}: aborted: {reason}; {err}") from err
    return recording


def what_is_left(directory: Path) -> str:
    """Save the frames taken before a stop as a recording, and say where; see `told_on_stop`."""
    from ..hardware import RigError, finalise

    if not directory.exists():  # `armed_session` has removed it
        return "nothing had moved, and nothing was recorded"
    try:
        return f"what was recorded until then is in {finalise(directory)}"
    except OSError as err:
        cure = "make room" if disk_errno(err) is not None else "make it writable"
        again = command("trim", directory, "--out", "FILE")
        return f"{directory}: {err.strerror or err}: {cure}, then make its recording by: {again}"
    except (RigError, ValueError) as err:
        return f"no recording can be made of it ({err})"
