"""Recording and calibrating at the same time: the arm stirs until the pour is known well enough."""

import logging
import time
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from ..inputs.recording import Recording
from ..robot.armed_session import Ask, SessionView
from ..robot.record import carried_out, prepare_stir
from ..robot.stir import StirPlan
from ..wording import at_most, spilled
from .online import OnlineCalibration, OnlineChoice, OnlinePhase
from .plan import PartialRecording

if TYPE_CHECKING:
    from ..hardware import HiddenLiquid, Rig
    from ..hardware.motion import PosePath, Trajectory
    from .estimate import OnlineEstimate

logger = logging.getLogger(__name__)

BAD_FIT = (
    "the fit is bad; the gripper's and the camera's frames may differ: do not rely on this "
    "estimate; stirring does not end by it"
)
PLAN_RATE = 30.0  # Hz, of the simulated plan; the cameras'
FOLLOWED_AFTER = 0.2  # s, until arm, cameras and files have followed a stroke's last set-point


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
            raise RuntimeError(f"the calibration is not ready: {calibration.detail}")
        learning, title = Learning(calibration), "stirring and calibrating"
        recording = carried_out(stir, learning.wait, title, progress=progress)
        calibration.finish(recording, progress=progress)
    return recording


@dataclass
class Learning:
    """Online calibration while the arm stirs.

    Attributes:
        calibration: Learns.
        enough: Whether the pour is known well enough.
        warned: Of what a person was warned.
    """

    calibration: OnlineCalibration
    enough: bool = False
    warned: set[str] = field(default_factory=set)

    def wait(self, view: SessionView, number: int, path: "PosePath") -> bool:
        """Wait for a path's end, and hand over the data so far after a stroke; whether the pour is
        known well enough."""
        while not view.session.wait(number, timeout=0.05):
            self._take(self.calibration.poll(), view)
        if path.stirring:
            time.sleep(FOLLOWED_AFTER)
            if (so_far := _so_far(view.session.directory, time.monotonic())) is not None:
                self._take(self.calibration.update(so_far), view)
        return self.enough

    def _take(self, estimate: "OnlineEstimate | None", view: SessionView) -> None:
        phase, detail = self.calibration.phase, self.calibration.detail
        if detail and phase is not OnlinePhase.PREPARING:
            self._warn(f"calibration {phase}: {detail}")
        if estimate is not None:
            self.enough = estimate.is_enough(self.calibration.settings)
            if not estimate.fits:
                for notice in (BAD_FIT, *estimate.frame_faults):
                    self._warn(notice)
            view.say(sentence(estimate))
        view.show()

    def _warn(self, notice: str) -> None:
        """Log a line, once."""
        if notice not in self.warned:
            self.warned.add(notice)
            logger.warning(notice)


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
