"""Online calibration: inference that runs while the robot stirs (Lopez-Guevara et al. 2018).

The path of the gripper is known before the robot moves. So the plan is simulated before and while
it is carried out, every simulation once and to its end, and after each stroke all of them are
compared with the data so far. Two processes do the work; no call here blocks the process that
supervises the robot: `update` and `poll` return at once, and what goes wrong is a status.
"""

import multiprocessing
import time
from collections.abc import Iterator, Mapping
from contextlib import ExitStack
from multiprocessing.connection import Connection
from multiprocessing.process import BaseProcess
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from ..calibration.calibrate import calibrate
from ..errors import Argument, InputError
from ..files import given_path
from ..inputs.cups import bundled_cups
from ..inputs.open import Source, open_recording
from ..inputs.prior import (
    check_prior,
    default_prior,
    describe_prior,
    read_prior,
)
from ..inputs.recording import Recording
from ..pouring.design import joint_prior, whole
from ..pouring.landed_pours import Parcels, pours_in
from ..progress import progress_bar
from ..run.lock import alone_in
from ..run.run import RUN_TOML
from ..simulators import PourSimulator
from .learner import learn_online
from .newest_message import Outbox
from .online_choice import OnlineChoice
from .plan import SoFar, planned, stroke_ends
from .request import PARTNER_GONE, OnlinePhase, Request, Status
from .simulator import simulate_plan

if TYPE_CHECKING:
    from ..models.trajectory import PivotPath
    from .estimate import OnlineEstimate

BANK, LOG = "online.sqlite", "online.jsonl"
POLL_SECONDS = 0.02  # s between looks while a caller waits
JOIN_SECONDS = 2.0  # s that the processes have to end by themselves


class OnlineCalibration:
    """An online calibration under way; made by `start`, closed by `close` or a `with`.

    Attributes:
        settings: What decides it.
        plan: The planned stir.
        ends: When each of its strokes ends [s].
        out: The RUN directory that `finish` makes.
        status: How it is doing; `poll` and `update` renew it.
        estimates: All so far.
    """

    def __init__(self, request: Request, out: Path, alone: ExitStack):
        self.settings, self.plan, self.out = request.settings, request.plan(), out
        self.ends = stroke_ends(self.plan)
        self.status = Status(OnlinePhase.PREPARING, "starting")
        self.estimates: list[OnlineEstimate] = []
        self._prior = read_prior(request.prior)
        self._link, self._workers = _launch(request)
        self._outbox = Outbox(self._link)
        self._alone = alone  # in `out`, until it is closed

    @classmethod
    def start(
        cls,
        path: "PivotPath",
        attrs: Mapping[str, float | str],
        choice: OnlineChoice,
        *,
        progress: bool = True,
    ) -> "OnlineCalibration":
        """Make the pours of the map of landings, unless the bank has them, and start to prepare.

        The first time the pours take minutes, in this process; everything after that happens in
        two others (they are spawned: a script needs `if __name__ == "__main__":`). Let the robot
        move when `wait_until_ready` says so: then a design all over the prior is simulated.

        Args:
            path: Planned: times [s] and gripper positions [m], sampled about as often as the
                cameras do, up to the end of the last cycle that may be stirred.
            attrs: As a recording's: geometry and densities.
            choice: What to calibrate, for which pour, and where.
            progress: Whether to show a bar on stderr while pours are made.

        Raises:
            InputError: The plan, the prior or the directory of the run cannot be used.
        """
        from ..inference import SimulationBank
        from ..inference.simulations import Compute

        settings = choice.settings
        prior = default_prior() if choice.prior is None else choice.prior
        check_prior(prior)
        cups = bundled_cups() if choice.cups is None else choice.cups
        plan, out = (
            planned(path.time, path.position, attrs),
            given_path(choice.run, Argument("run")),
        )
        bank = out / BANK if choice.bank is None else Path(choice.bank)
        density = plan.number("liquid_density")
        with ExitStack() as alone:
            alone.enter_context(alone_in(out))
            if (out / RUN_TOML).exists():
                raise InputError(
                    "holds a run already", where=str(out), fix="choose another directory"
                )
            (out / LOG).unlink(missing_ok=True)
            with (
                SimulationBank(bank) as kept,
                progress_bar("pouring", settings.pours, shown=progress) as advance,
            ):
                # to be found there by the process that learns, which shows no bar
                pours_in(
                    whole(joint_prior(prior, (), cups)),
                    PourSimulator(cups, density, Parcels()),
                    settings.pours,
                    Compute(bank=kept),
                    advance,
                )
            request = Request(
                time=plan.gripper.time,
                position=plan.gripper.position,
                attrs=dict(attrs),
                cups=cups,
                prior=describe_prior(prior),
                settings=settings,
                bank=bank,
                log=out / LOG,
            )
            return cls(request, out, alone.pop_all())

    def wait_until_ready(self, timeout: float | None = None) -> bool:
        """Wait until data may come, or preparation failed, or `timeout` [s] has passed.

        Returns:
            Whether it is ready; if not, `status` says why.
        """
        until = np.inf if timeout is None else time.monotonic() + timeout
        while self.status.phase == OnlinePhase.PREPARING and time.monotonic() < until:
            time.sleep(POLL_SECONDS)
            self.poll()
        return self.status.phase == OnlinePhase.READY

    def update(self, so_far: SoFar) -> "OnlineEstimate | None":
        """Hand over the recording so far, at best after each stroke; returns at once.

        What was not looked at yet is replaced. Data of an arm that is off its plan by more than
        `plan.MAX_OFF_PLAN`, or whose delay changed by more than `plan.MAX_DELAY_CHANGE` in a
        stroke, are not learned from: `status` says so.

        Returns:
            As `poll`.
        """
        self._outbox.put(so_far)
        return self.poll()

    def poll(self) -> "OnlineEstimate | None":
        """Take what has come from the other processes; returns at once.

        Returns:
            The newest estimate, if one came since the last call.
        """
        before = len(self.estimates)
        try:
            while self.status.phase != OnlinePhase.FAILED and self._link.poll():
                message = self._link.recv()
                if isinstance(message, Status):
                    self.status = message
                else:
                    self.estimates.append(message)
        except (*PARTNER_GONE, OSError):
            self._workers["learner"].join(POLL_SECONDS)
            code = self._workers["learner"].exitcode
            detail = f"the process that learns has died (exit code {code}); the recording goes on"
            self.status = self.status._replace(phase=OnlinePhase.FAILED, detail=detail)
        return self.estimates[-1] if len(self.estimates) > before else None

    def enough(self, estimate: "OnlineEstimate") -> bool:
        """Whether the pour is known well enough for stirring to end; see `OnlineSettings`."""
        from .estimate import enough

        return enough(estimate, self.settings)

    def finish(self, recording: Source, *, budget: int = 20, progress: bool = True) -> Path:
        """Calibrate on the finished recording by the ordinary `calibrate`, into `out`.

        It simulates anew, along the path that the gripper really took: the online simulations
        are of the planned one. Its result can be repeated bit for bit, while how many simulations
        an online estimate rests on depends on how fast the computer was.

        Returns:
            The RUN directory; `online.jsonl` in it holds the estimates that led here.

        Raises:
            InputError: The recording cannot be used.
        """
        self.close()
        calibration = calibrate(
            recording,
            out=self.out,
            prior=self._prior,
            budget=budget,
            seed=self.settings.seed,
            surrogate=self.settings.surrogate,
            particles=self.settings.particles,
            progress=progress,
        )
        return calibration.path

    def close(self) -> None:
        """End the other processes; what they have simulated is kept. Closing twice does no harm."""
        self._outbox.close()
        for worker in self._workers.values():
            worker.join(JOIN_SECONDS if worker.name == "learner" else 0.1)
            worker.terminate()  # a simulation is not worth waiting for
            worker.join(JOIN_SECONDS)
            if worker.is_alive():
                worker.kill()
        self._alone.close()

    def __enter__(self) -> "OnlineCalibration":
        return self

    def __exit__(self, *_: object) -> None:
        self.close()


def replay(
    recording: Source, online: OnlineCalibration, *, realtime: bool = False
) -> "Iterator[OnlineEstimate]":
    """Feed a finished recording stroke by stroke, as if it were just being made.

    Args:
        recording: Of the stir that was planned.
        online: Ready.
        realtime: Whether strokes come as fast as they were made; else each waits for the
            estimate of the one before.

    Yields:
        Estimates, until one is good enough, the strokes end, or nothing more will come.
    """
    recording = recording if isinstance(recording, Recording) else open_recording(recording)
    began = time.monotonic() - float(recording.time[0])
    for end in online.ends:
        if realtime:
            yield from _arriving(online, began + end)
        estimate = online.update(_until(recording, end))
        while not realtime and estimate is None and online.status.phase == OnlinePhase.READY:
            time.sleep(POLL_SECONDS)
            estimate = online.poll()
        if estimate is not None:
            yield estimate
        if online.status.phase != OnlinePhase.READY:
            return
        if any(map(online.enough, online.estimates[-1:])):
            return
    if realtime:
        yield from _arriving(online, time.monotonic() + JOIN_SECONDS)


def _arriving(online: OnlineCalibration, until: float) -> "Iterator[OnlineEstimate]":
    """Estimates that come before `until`, by `time.monotonic` [s]."""
    while time.monotonic() < until:
        time.sleep(POLL_SECONDS)
        if (estimate := online.poll()) is not None:
            yield estimate
            if estimate.strokes == len(online.ends):
                return


def _until(recording: Recording, end: float) -> SoFar:
    """The recording up to a time [s]; taken just now."""
    seen = recording.time <= end + 1e-9
    path: NDArray = recording.gripper.position[seen]
    return SoFar(recording.time[seen], path, recording.inclination[seen], time.monotonic())


def _launch(request: Request) -> tuple[Connection, dict[str, BaseProcess]]:
    """Start both processes; they end when the returned connection closes."""
    context = multiprocessing.get_context("spawn")  # neither JAX nor Taichi survives a fork
    link, theirs = context.Pipe()
    to_simulator, simulators = context.Pipe()
    workers: dict[str, BaseProcess] = {
        "learner": context.Process(
            target=learn_online, args=(theirs, to_simulator, request), name="learner", daemon=True
        ),
        "simulator": context.Process(
            target=simulate_plan, args=(simulators, request), name="simulator", daemon=True
        ),
    }
    for worker in workers.values():
        worker.start()
    for end in (theirs, to_simulator, simulators):
        end.close()  # here, so that each process sees the other's end
    return link, workers
