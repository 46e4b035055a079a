"""Recording and calibrating at the same time: the arm stirs until the pour is known well enough."""

import time
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from ..inputs.recording import Recording
from ..robot.armed_session import Ask
from ..robot.live_view import SessionView
from ..robot.record import finished, prepared, stirring
from ..robot.stir import PATHS_AHEAD, StirPlan
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

    stir = prepared(rig, out, ask, emulate, online.cycles)
    path, attrs = _simulated(stir.plan), rig_attributes(stir.task.rig)
    with OnlineCalibration.start(path, attrs, online, progress=progress) as calibration:
        if not calibration.wait_until_ready():
            raise RuntimeError(f"the calibration is not ready: {calibration.status.detail}")
        with stirring(stir, "stirring and calibrating", progress) as (session, view):
            _Stirring(session, stir.plan, calibration, view).carry_out()
        recording = finished(stir.task.out)
        calibration.finish(recording, progress=progress)
    return recording


class _Stirring:
    """The stir stroke by stroke, with what is learned meanwhile."""

    def __init__(
        self,
        session: "Session",
        plan: StirPlan,
        calibration: OnlineCalibration,
        view: SessionView,
    ):
        self._session, self._plan, self._view = session, plan, view
        self._calibration, self._enough = calibration, False

    def carry_out(self) -> None:
        """To the cup, strokes until it is enough, a rest, and out again."""
        from ..hardware.motion import approach, retract

        session = self._session
        session.follow(approach(session.rig, session.pose()))
        self._view.until_done(session, session.follow(self._plan.insert))
        last = self._stir()
        # the recording ends with a rest, as the plan's last stroke does
        place = self._plan.strokes[last].pose[-1]
        if last + 1 < len(self._plan.strokes):
            session.follow(_still(session.rig, place))
        self._view.until_done(session, session.follow(retract(session.rig, place[:3])))

    def _stir(self) -> int:
        """Follow strokes until it is enough; the last one's place in the plan."""
        ordered: list[int] = []
        for at, stroke in enumerate(self._plan.strokes):
            ordered.append(self._session.follow(stroke))
            if at >= PATHS_AHEAD:
                self._await(ordered[at - PATHS_AHEAD])
            if self._enough:
                break
        for number in ordered[-PATHS_AHEAD:]:
            self._await(number)
        return len(ordered) - 1

    def _await(self, number: int) -> None:
        """Wait for a stroke's end, and hand over the data so far."""
        while not self._session.wait(number, timeout=0.05):
            self._take(self._calibration.poll())
        time.sleep(FOLLOWED_AFTER)
        if (so_far := _so_far(self._session.directory, time.monotonic())) is not None:
            self._take(self._calibration.update(so_far))

    def _take(self, estimate: "OnlineEstimate | None") -> None:
        status = self._calibration.status
        if status.detail and status.phase is not OnlinePhase.PREPARING:
            self._view.warn(f"calibration {status.phase}: {status.detail}")
        if estimate is not None:
            self._enough = estimate.is_enough(self._calibration.settings)
            if not estimate.fits:
                self._view.warn(BAD_FIT)
                for fault in estimate.frame_faults:
                    self._view.warn(fault)
            self._view.say(sentence(estimate))
        self._view.show(self._session)


def sentence(estimate: "OnlineEstimate") -> str:
    """An estimate in one line."""
    parameters = ", ".join(
        f"{name} {spread.q50:.3g} ({spread.q05:.2g} to {spread.q95:.2g})"
        for name, spread in estimate.parameters.items()
    )
    turn = np.degrees(estimate.action["angular_velocity"])
    return (
        f"stroke {estimate.strokes}: {parameters}; best pour {turn:.0f} deg/s at "
        f"{100 * estimate.action['distance']:.1f} cm spills {estimate.expected_spillage:.1%}, "
        f"95 % below {estimate.spillage_q95:.1%} ({estimate.simulations} simulations, "
        f"{estimate.lag:.1f} s late)" + ("" if estimate.fits else f"; {BAD_FIT}")
    )


def _simulated(plan: StirPlan) -> "Trajectory":
    """The plan's stir as often as the cameras see it."""
    from ..hardware.motion import Trajectory, joined

    whole = joined(list(plan.strokes))
    times = np.arange(0.0, whole.duration, 1.0 / PLAN_RATE)
    columns = [np.interp(times, whole.time, axis) for axis in whole.pose[:, :3].T]
    return Trajectory(times, np.column_stack(columns))


def _still(rig: "Rig", pose: np.ndarray) -> "PosePath":
    """The rest at the end of a stir that ends early."""
    from ..hardware.motion import PosePath

    times = np.arange(0.0, rig.stirring.rest, 1.0 / rig.robot.rate)
    return PosePath(times, np.tile(pose, (len(times), 1)), stirring=True)


def _so_far(directory: Path, ended: float) -> PartialRecording | None:
    """The data so far; None while they are too few."""
    from ..hardware import RigError
    from ..hardware.recorder.finalise import partial

    try:
        stir = partial(directory)
    except RigError:
        return None
    return PartialRecording(stir.time, stir.position, stir.inclination, ended)
