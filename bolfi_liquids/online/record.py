"""Recording and calibrating at the same time: the arm stirs until the pour is known well enough."""

import time
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from ..inputs.recording import Recording
from ..robot.armed_session import Ask
from ..robot.live_view import SessionView
from ..robot.record import finished, prepare_stir, stir_session
from ..robot.stir import StirPlan, follow_plan
from ..wording import at_most, spilled
from .online import OnlineCalibration, OnlineChoice, OnlinePhase
from .plan import PartialRecording

if TYPE_CHECKING:
    from ..hardware import HiddenLiquid, Rig, Session
    from ..hardware.motion import PosePath, Trajectory
    from .estimate import OnlineEstimate

BAD_FIT = (
    "the fit is bad; the gripper's and the camera's frames may differ: do not rely on this "
    "estimate; stirring does not end by it"
)
PLAN_RATE = 30.0  # Hz, of the simulated plan; the cameras'
FOLLOWED_AFTER = (
    0.2  # s, after which arm, cameras and files have followed a stroke's last set-point
)


def record_online(
    rig: "Rig | str | Path | None" = None,
    *,
    out: str | Path,
    online: OnlineChoice,
    ask: Ask | None = None,
    emulate: "HiddenLiquid | bool" = False,
    progress: bool = True,
) -> Recording:
    """Stir, record, and infer meanwhile; stop stirring when the pour is known well enough.

    After every stroke the engine gets the data so far; the posterior and the expected spillage
    of the best pour come back, late by what inference takes. Stirring ends when the spillage is
    under the target, or after `online.cycles`. The finished recording is then calibrated on as
    usual.

    Args:
        rig: What is there.
        out: Directory of the recording; new or empty.
        online: What to calibrate, and where.
        ask: As of `record`.
        emulate: As of `record`.
        progress: Whether to show progress on stderr.

    Returns:
        The recording; the run is in `online.run`.

    Raises:
        InputError: Something given cannot be used.
        RigError: The rig, the directory or a device cannot be used, or the person did not agree.
        RuntimeError: The calibration could not be prepared; nothing has moved.
        SessionStopped: The arm was stopped.
    """
    from ..hardware.recorder.finalise import rig_attributes

    stir = prepare_stir(rig, out, ask, emulate, online.cycles)
    path, attrs = _simulated(stir.plan), rig_attributes(stir.task.rig)
    with OnlineCalibration.start(path, attrs, online, progress=progress) as calibration:
        if not calibration.wait_until_ready():
            raise RuntimeError(f"the calibration is not ready: {calibration.status.detail}")
        with stir_session(stir, "stirring and calibrating", progress) as (session, view):
            follow_plan(session, stir.plan, _Learning(session, calibration, view).wait)
        recording = finished(stir.task.out)
        calibration.finish(recording, progress=progress)
    return recording


@dataclass
class _Learning:
    """What is learned while the arm stirs."""

    session: "Session"
    calibration: OnlineCalibration
    view: SessionView
    enough: bool = False

    def wait(self, number: int, path: "PosePath") -> bool:
        """Wait for a path's end, and hand over the data so far after a stroke; whether the pour is
        known well enough."""
        while not self.session.wait(number, timeout=0.05):
            self._take(self.calibration.poll())
        if path.stirring:
            time.sleep(FOLLOWED_AFTER)
            if (so_far := _so_far(self.session.directory, time.monotonic())) is not None:
                self._take(self.calibration.update(so_far))
        return self.enough

    def _take(self, estimate: "OnlineEstimate | None") -> None:
        status = self.calibration.status
        if status.detail and status.phase is not OnlinePhase.PREPARING:
            self.view.warn(f"calibration {status.phase}: {status.detail}")
        if estimate is not None:
            self.enough = estimate.is_enough(self.calibration.settings)
            if not estimate.fits:
                self.view.warn(BAD_FIT)
                for fault in estimate.frame_faults:
                    self.view.warn(fault)
            self.view.say(sentence(estimate))
        self.view.show(self.session)


def sentence(estimate: "OnlineEstimate") -> str:
    """An estimate in one line."""
    parameters = ", ".join(
        f"{name} {spread.q50:.3g} ({spread.q05:.2g} to {spread.q95:.2g})"
        for name, spread in estimate.parameters.items()
    )
    turn = np.degrees(estimate.action["angular_velocity"])
    return (
        f"stroke {estimate.strokes}: {parameters}; best pour {turn:.0f} deg/s at "
        f"{100 * estimate.action['distance']:.1f} cm spills {spilled(estimate.expected_spillage)}, "
        f"{at_most(estimate.spillage_q95)} in 19 of 20 cases ({estimate.simulations} simulations, "
        f"{estimate.lag:.1f} s late)" + ("" if estimate.fits else f"; {BAD_FIT}")
    )


def _simulated(plan: StirPlan) -> "Trajectory":
    """The plan's stir as often as the cameras see it."""
    from ..hardware.motion import Trajectory, joined

    whole = joined(list(plan.strokes))
    times = np.arange(0.0, whole.duration, 1.0 / PLAN_RATE)
    columns = [np.interp(times, whole.time, axis) for axis in whole.pose[:, :3].T]
    return Trajectory(times, np.column_stack(columns))


def _so_far(directory: Path, ended: float) -> PartialRecording | None:
    """The data so far; None while they are too few."""
    from ..hardware import RigError
    from ..hardware.recorder.finalise import partial

    try:
        stir = partial(directory)
    except RigError:
        return None
    return PartialRecording(stir.time, stir.position, stir.inclination, ended)
