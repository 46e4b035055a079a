"""Online calibration: inference that runs while the robot stirs (Lopez-Guevara et al. 2018).

The path of the gripper is known before the robot moves. So the plan is simulated before and while
it is carried out, every simulation once and to its end, and after each stroke all of them are
compared with the data so far. One process simulates, another learns; no call here blocks the
process that supervises the robot: `update` and `poll` return at once, and what goes wrong is a
status.
"""

import json
import os
import time
from collections.abc import Callable, Mapping
from concurrent.futures import BrokenExecutor, Executor, Future
from contextlib import ExitStack
from enum import StrEnum
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from ..calibration.calibrate import calibrate
from ..errors import Argument, InputError
from ..files import given_path
from ..inputs.cups import bundled_cups
from ..inputs.open import Source
from ..inputs.prior import check_prior, default_prior, describe_prior, read_prior
from ..inputs.recording import planned_recording
from ..pouring.design import joint_prior, whole
from ..pouring.landed_pours import Parcels, pours_in
from ..pouring.landing_map import LandingMap, learn_map
from ..progress import progress_bar
from ..run.lock import alone_in
from ..run.run import RUN_TOML
from ..run.workers import background_process
from ..simulators import PourSimulator, stir_simulator
from .estimate import Answer, Made, OnlineEstimate, Problem, answer, design, proposals
from .plan import Aligned, PartialRecording, stroke_ends
from .settings import OnlineSettings
from .simulate import simulate_plan

if TYPE_CHECKING:
    from ..inference import Prior
    from ..inference.simulations import Job, Simulation
    from ..models import Cups
    from ..models.trajectory import PivotPath

BANK, LOG = "online.sqlite", "online.jsonl"
USUAL_CYCLES = 5  # of the pattern at the most, by default
POLL_SECONDS = 0.02  # s between looks while a caller waits
LEARNER_NICENESS = 5  # control and cameras come first
SIMULATOR_NICENESS = 10  # an estimate matters more than another simulation


class OnlineChoice(NamedTuple):
    """What to calibrate, for which pour, and where.

    Attributes:
        run: The RUN directory to be made.
        cups: Source and receiver of the pour; None takes the bundled ones.
        settings: Target and engine.
        bank: Simulations to reuse and to keep: pours of the same cups and density, and the design
            of the same plan, rig and density. None is a file in `run`.
        prior: Prior of `viscosity` [Pa s] and `cohesion` [1]; None is `default_prior()`.
        cycles: How often the pattern is stirred at the most, by `record_online`.
        told: Called by `record_online` with each estimate.
    """

    run: Path
    cups: "Cups | None" = None
    settings: OnlineSettings = OnlineSettings()
    bank: Path | None = None
    prior: "Prior | None" = None
    cycles: int = USUAL_CYCLES
    told: Callable[[OnlineEstimate], None] | None = None


class OnlinePhase(StrEnum):
    """Phase of an online calibration."""

    PREPARING = "preparing"
    READY = "ready"
    REFUSED = "refused"
    FAILED = "failed"

    @property
    def advice(self) -> str:
        """What it means and what to do next."""
        return _ADVICE[self]


_ADVICE = {
    OnlinePhase.PREPARING: "The design is simulated and the map of landings learned. Let the robot "
    "move after `wait_until_ready`.",
    OnlinePhase.READY: "Hand over the recording so far by `update` after each stroke.",
    OnlinePhase.REFUSED: "The last data cannot be used; `status.detail` says why. Earlier "
    "estimates hold, and later data may be used again.",
    OnlinePhase.FAILED: "No estimate will follow; `status.detail` says why. The recording goes on: "
    "calibrate on it by `finish` afterwards.",
}


class Status(NamedTuple):
    """How an online calibration is doing.

    Attributes:
        phase: What it is doing; `phase.advice` says what to do.
        detail: What is being prepared, or what is wrong; "" if nothing is.
        simulations: Finished, failed ones included.
        in_flight: Being simulated.
    """

    phase: OnlinePhase
    detail: str
    simulations: int = 0
    in_flight: int = 0


class OnlineCalibration:
    """An online calibration under way; made by `start`, closed by `close` or a `with`.

    `poll` and `update` also give the processes their next tasks: call one of them several times a
    second.

    Attributes:
        settings: What decides it.
        plan: The planned stir.
        ends: When each of its strokes ends [s].
        out: The RUN directory that `finish` makes.
        estimates: All so far.
    """

    def __init__(
        self,
        problem: Problem,
        out: Path,
        learn: Callable[[], LandingMap],
        simulate: "Callable[[list[Job]], list[Simulation]]",
        resources: ExitStack,
    ):
        """Begin to prepare.

        Args:
            problem: What stays the same.
            out: See the attribute.
            learn: Learns the map of landings; it can be pickled.
            simulate: Simulates the plan; it can be pickled, without JAX.
            resources: To be closed with it.
        """
        self.settings, self.out = problem.settings, out
        (self.plan,) = problem.stirring.recordings
        self.ends = stroke_ends(self.plan)
        self.estimates: list[OnlineEstimate] = []
        self._problem, self._learn_map, self._simulate_plan = problem, learn, simulate
        self._phase, self._detail = OnlinePhase.PREPARING, "starting"
        self._made: Made = ()
        self._map: LandingMap | None = None
        self._aligned: Aligned | None = None  # what was learned from last
        self._unread: PartialRecording | None = None
        self._simulating: tuple[list[Job], Future[list[Simulation]]] | None = None
        self._no_more = ""  # why nothing is simulated any more
        self._learning: tuple[Future[Any], Callable[[Any], None]] | None = None
        self._resources = resources
        self._learner = resources.enter_context(background_process(LEARNER_NICENESS))
        self._simulator = resources.enter_context(background_process(SIMULATOR_NICENESS))
        self._learn(self._take_design, design, problem)

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
        prior = read_prior(describe_prior(prior))  # as `finish` writes it down
        cups = bundled_cups() if choice.cups is None else choice.cups
        plan = planned_recording(path.time, path.position, attrs)
        problem = Problem(prior, stir_simulator([plan], settings.particles), settings)
        out = given_path(choice.run, Argument("run"))
        bank = out / BANK if choice.bank is None else Path(choice.bank)
        pours = PourSimulator(cups, plan.number("liquid_density"), Parcels())
        with ExitStack() as resources:
            resources.enter_context(alone_in(out))
            if (out / RUN_TOML).exists():
                raise InputError(
                    "holds a run already", where=str(out), fix="choose another directory"
                )
            (out / LOG).unlink(missing_ok=True)
            box = whole(joint_prior(prior, (), cups))
            with (
                SimulationBank(bank) as kept,
                progress_bar("pouring", settings.pours, shown=progress) as advance,
            ):
                poured = pours_in(box, pours, settings.pours, Compute(bank=kept), advance)
            learn = partial(learn_map, box, cups, poured)
            # side by side: nothing else is urgent before the robot moves
            batch = max(settings.in_flight, os.cpu_count() or 1)
            simulate = partial(simulate_plan, problem.stirring, bank, batch)
            made = cls(problem, out, learn, simulate, resources)
            made._resources = resources.pop_all()  # which it closes from now on
            return made

    @property
    def status(self) -> Status:
        """How it was doing at the last `poll` or `update`."""
        in_flight = 0 if self._simulating is None else len(self._simulating[0])
        detail = self._no_more if self._phase == OnlinePhase.READY else self._detail
        return Status(self._phase, detail, len(self._made), in_flight)

    def wait_until_ready(self, timeout: float | None = None) -> bool:
        """Wait until data may come, or preparation failed, or `timeout` [s] has passed.

        Returns:
            Whether it is ready; if not, `status` says why.
        """
        until = np.inf if timeout is None else time.monotonic() + timeout
        while self._phase == OnlinePhase.PREPARING and time.monotonic() < until:
            time.sleep(POLL_SECONDS)
            self.poll()
        return self._phase == OnlinePhase.READY

    def update(self, so_far: PartialRecording) -> OnlineEstimate | None:
        """Hand over the recording so far, at best after each stroke; returns at once.

        What was not looked at yet is replaced. Data of an arm that is off its plan by more than
        `plan.MAX_OFF_PLAN`, or whose delay changed by more than `plan.MAX_DELAY_CHANGE` in a
        stroke, are not learned from: `status` says so.

        Returns:
            As `poll`.
        """
        self._unread = so_far
        return self.poll()

    def poll(self) -> OnlineEstimate | None:
        """Take what the processes have finished, and give them what comes next; returns at once.

        Returns:
            The newest estimate, if one came since the last call.
        """
        before = len(self.estimates)
        if self._phase != OnlinePhase.FAILED:
            try:
                self._advance()
            except BrokenExecutor:
                self._fail("the process that learns has died; the recording goes on")
            except Exception as error:
                self._fail(f"{type(error).__name__}: {error}")
        return self.estimates[-1] if len(self.estimates) > before else None

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
            prior=self._problem.prior,
            budget=budget,
            seed=self.settings.seed,
            surrogate=self.settings.surrogate,
            particles=self.settings.particles,
            progress=progress,
        )
        return calibration.path

    def close(self) -> None:
        """End the other processes; what they have simulated is kept. Closing twice does no harm."""
        self._resources.close()

    def __enter__(self) -> "OnlineCalibration":
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def _advance(self) -> None:
        self._take_simulations()
        if self._learning is not None and self._learning[0].done():
            (future, take), self._learning = self._learning, None
            take(future.result())
        if self._phase == OnlinePhase.PREPARING:
            self._end_preparation()
        elif self._learning is None:
            self._go_on()

    def _end_preparation(self) -> None:
        if self._no_more:
            self._fail(self._no_more)
        elif self._map is not None:
            self._detail = "simulating the plan"
            if self._simulating is None:
                self._phase = OnlinePhase.READY

    def _go_on(self) -> None:
        """Answer data first; in between, simulate the points that they suggest."""
        if self._unread is not None:
            known = 0 if self._aligned is None else self._aligned.strokes
            state = self._problem, self._made, self._map, known, self._unread
            self._unread = None
            self._learn(self._take_answer, answer, *state)
        elif self._aligned is not None and self._simulating is None and not self._no_more:
            n = min(self.settings.in_flight, self.settings.budget - len(self._made))
            if n > 0:
                state = self._problem, self._made, self._aligned.observed, n
                self._learn(self._simulate, proposals, *state)

    def _learn(self, take: Callable[[Any], None], task: Callable[..., Any], *given: Any) -> None:
        """Give the process that learns a task; `take` gets its result."""
        self._learning = _submitted(self._learner, task, *given), take

    def _take_design(self, jobs: "list[Job]") -> None:
        self._simulate(jobs)
        self._detail = "learning the map of landings"
        self._learn(self._take_map, self._learn_map)

    def _take_map(self, learned: LandingMap) -> None:
        self._map = learned

    def _take_answer(self, found: Answer) -> None:
        self._aligned = found.aligned or self._aligned
        refused = bool(found.refusal)
        self._phase = OnlinePhase.REFUSED if refused else OnlinePhase.READY
        self._detail = found.refusal
        if found.estimate is not None:
            self.estimates.append(found.estimate)
            with (self.out / LOG).open("a", encoding="utf-8") as log:
                log.write(json.dumps(found.estimate.as_record()) + "\n")

    def _simulate(self, jobs: "list[Job]") -> None:
        self._simulating = jobs, _submitted(self._simulator, self._simulate_plan, jobs)

    def _take_simulations(self) -> None:
        if self._simulating is None or not self._simulating[1].done():
            return
        (jobs, future), self._simulating = self._simulating, None
        try:
            self._made += tuple(zip(jobs, future.result(), strict=True))
        except BrokenExecutor:  # the others are enough for estimates
            self._no_more = "the process that simulates has died"
        except Exception as error:
            self._no_more = f"the plan cannot be simulated: {type(error).__name__}: {error}"

    def _fail(self, detail: str) -> None:
        self._phase, self._detail, self._simulating = OnlinePhase.FAILED, detail, None


def _submitted(executor: Executor, task: Callable[..., Any], *given: Any) -> Future[Any]:
    """The future of a task, also where the executor's process has died already."""
    try:
        return executor.submit(task, *given)
    except BrokenExecutor as error:
        failed: Future[Any] = Future()
        failed.set_exception(error)
        return failed
