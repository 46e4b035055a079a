"""Online calibration: inference that runs while the robot stirs (Lopez-Guevara et al. 2018).

The path of the gripper is known before the robot moves. So the plan is simulated before and while
it is carried out, every simulation once and to its end, and after each stroke all of them are
compared with the data so far. One process simulates, another learns; `poll` takes what they have
finished and orders what is next. No call here blocks the process that supervises the robot:
`update` and `poll` return at once, and what goes wrong is a status.
"""

import json
import os
import time
from collections.abc import Callable, Mapping
from concurrent.futures import BrokenExecutor, Future
from contextlib import ExitStack
from enum import StrEnum
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

from ..calibration.calibrate import calibrate
from ..errors import Argument, InputError
from ..files import given_path
from ..inputs.cups import bundled_cups
from ..inputs.open import Source
from ..inputs.prior import default_prior
from ..inputs.recording import planned_recording
from ..pouring.landing_map import LandingMap, learn_map
from ..pouring.parcels import Parcels
from ..pouring.pours import pours_of_all
from ..run.compute import background_process
from ..run.run import RUN_TOML, alone_in
from ..simulators import PourSimulator, stir_simulator
from .estimate import (
    Answer,
    Made,
    OnlineEstimate,
    Problem,
    answer,
    design,
    proposals,
    simulate_plan,
)
from .plan import Aligned, PartialRecording, stroke_ends
from .settings import OnlineSettings

if TYPE_CHECKING:
    from ..inference.simulations import Job
    from ..models import Cups
    from ..models.trajectory import PivotPath

BANK, LOG = "online.sqlite", "online.jsonl"
USUAL_CYCLES = 5  # of the pattern at the most, by default
POLL_SECONDS = 0.02  # s between looks, while it is prepared
LEARNER_NICENESS = 5  # control and cameras come first
SIMULATOR_NICENESS = 10  # an estimate matters more than another simulation


class OnlineChoice(NamedTuple):
    """Choices of an online calibration: its run, cups and settings.

    Attributes:
        run: The RUN directory to be made.
        cups: Source and receiver of the pour; None takes the bundled ones.
        settings: Target and engine.
        cycles: How often the pattern is stirred at the most, by `record_online`.
    """

    run: Path
    cups: "Cups | None" = None
    settings: OnlineSettings = OnlineSettings()
    cycles: int = USUAL_CYCLES


class OnlinePhase(StrEnum):
    """Phase of an online calibration.

    Attributes:
        PREPARING: The design is simulated and the map of landings learned. Let the robot move after
            `wait_until_ready`.
        READY: Hand over the recording so far by `update` after each stroke.
        REFUSED: The last data cannot be used. Earlier estimates hold, and later data may be used
            again.
        FAILED: No estimate will follow. The recording goes on: calibrate on it by `finish`.
    """

    PREPARING = "preparing"
    READY = "ready"
    REFUSED = "refused"
    FAILED = "failed"


class OnlineCalibration:
    """An online calibration under way; made by `start`, closed by `close` or a `with`.

    Attributes:
        settings: What decides it.
        plan: The planned stir.
        ends: When each of its strokes ends [s].
        out: The RUN directory that `finish` makes.
        phase: What it was doing at the last `poll`.
        detail: What is being prepared, or what is wrong; "" if nothing is.
        made: Finished simulations, failed ones included.
        estimates: All so far.
    """

    def __init__(
        self,
        problem: Problem,
        out: Path,
        learn_pours: Callable[[], LandingMap],
        simulate: "Callable[[list[Job]], Made]",
        resources: ExitStack,
    ):
        """Begin to prepare.

        Args:
            problem: What stays the same.
            out: See the attribute.
            learn_pours: Learns the map of landings; it can be pickled.
            simulate: Simulates the plan; it can be pickled, without JAX.
            resources: To be closed with it; they are taken over unless it cannot begin.
        """
        self.settings, self.out = problem.settings, out
        (self.plan,) = problem.stirring.recordings
        self.ends = stroke_ends(self.plan)
        self.made: Made = ()
        self.estimates: list[OnlineEstimate] = []
        self.phase = OnlinePhase.PREPARING
        self.detail = "learning the map of landings, and simulating the plan"
        self._problem, self._learn_pours, self._simulate_plan = problem, learn_pours, simulate
        self._map: LandingMap | None = None
        self._unread: PartialRecording | None = None
        self._aligned: Aligned | None = None  # the data that were learned from last
        self._learning: tuple[Future, Callable[[Any], None]] | None = None  # task, and what follows
        self._simulating: Future[Made] | None = None
        self._no_more = ""  # why nothing is simulated any more
        with ExitStack() as processes:
            self._learner = processes.enter_context(background_process(LEARNER_NICENESS))
            self._simulator = processes.enter_context(background_process(SIMULATOR_NICENESS))
            self._learn(self._designed, design, problem)
            resources.push(processes.pop_all())
        self._resources = resources.pop_all()

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
            InputError: The plan or the directory of the run cannot be used.
        """
        from ..inference import SimulationBank
        from ..inference.simulations import Compute

        settings, prior = choice.settings, default_prior()
        cups = bundled_cups() if choice.cups is None else choice.cups
        plan = planned_recording(path.time, path.position, attrs)
        problem = Problem(prior, stir_simulator([plan], settings.particles), settings)
        out = given_path(choice.run, Argument("run"))
        bank = out / BANK
        pours = PourSimulator(cups, plan.number("liquid_density"), Parcels())
        with ExitStack() as resources:
            resources.enter_context(alone_in(out))
            if (out / RUN_TOML).exists():
                raise InputError(
                    "holds a run already", where=str(out), fix="choose another directory"
                )
            (out / LOG).unlink(missing_ok=True)
            with SimulationBank(bank) as kept:
                compute = Compute(bank=kept)
                box, poured = pours_of_all(prior, pours, settings.pours, compute, progress=progress)
            learn = partial(learn_map, box, cups, poured)
            # side by side: nothing else is urgent before the robot moves
            batch = max(settings.in_flight, os.cpu_count() or 1)
            simulate = partial(simulate_plan, problem.stirring, bank, batch)
            return cls(problem, out, learn, simulate, resources)

    def wait_until_ready(self, timeout: float = float("inf")) -> bool:
        """Wait until data may come, or preparation failed, or `timeout` [s] has passed.

        Returns:
            Whether it is ready; if not, `detail` says why.
        """
        until = time.monotonic() + timeout
        while self.phase is OnlinePhase.PREPARING and time.monotonic() < until:
            time.sleep(POLL_SECONDS)
            self.poll()
        return self.phase is OnlinePhase.READY

    def update(self, so_far: PartialRecording) -> OnlineEstimate | None:
        """Hand over the recording so far, at best after each stroke; returns at once.

        What was not looked at yet is replaced. Data of an arm that is off its plan by more than
        `plan.MAX_OFF_PLAN`, or whose delay changed by more than `plan.MAX_DELAY_CHANGE` in a
        stroke, are not learned from: `phase` and `detail` say so.

        Returns:
            As `poll`.
        """
        self._unread = so_far
        return self.poll()

    def poll(self) -> OnlineEstimate | None:
        """Take what the processes have finished, and order what is next; returns at once.

        Returns:
            The estimate that was finished, if one was.
        """
        if self.phase is OnlinePhase.FAILED:
            return None
        before = len(self.estimates)
        try:
            self._take_simulations()
            if self._learning is not None and self._learning[0].done():
                (finished, then), self._learning = self._learning, None
                then(finished.result())
            if self._learning is None:
                self._go_on()
        except BrokenExecutor:
            self.phase = OnlinePhase.FAILED
            self.detail = "the process that learns has died; the recording goes on"
        except Exception as error:
            self.phase, self.detail = OnlinePhase.FAILED, f"{type(error).__name__}: {error}"
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
            budget=budget,
            seed=self.settings.seed,
            surrogate="discrepancy",
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

    def _learn(self, then: Callable[[Any], None], task: Callable[..., Any], *given: Any) -> None:
        """Order a task of the process that learns; `then` takes what it returns."""
        self._learning = self._learner.submit(task, *given), then

    def _go_on(self) -> None:
        """Order what the process that learns is to do next, if there is something."""
        if self.phase is OnlinePhase.PREPARING:
            if self._simulating is None:  # the design is there
                self.phase, self.detail = OnlinePhase.READY, ""
        elif self._unread is not None:
            so_far, self._unread = self._unread, None
            known = 0 if self._aligned is None else self._aligned.strokes
            state = self._problem, self.made, self._map, known, so_far
            self._learn(self._answered, answer, *state)
        elif self._aligned is not None and self._simulating is None and not self._no_more:
            n = min(self.settings.in_flight, self.settings.budget - len(self.made))
            if n > 0:
                state = self._problem, self.made, self._aligned.observed, n
                self._learn(self._simulate, proposals, *state)

    def _designed(self, jobs: "list[Job]") -> None:
        """Learn the map of landings while the design is simulated."""
        self._simulate(jobs)
        self._learn(self._mapped, self._learn_pours)

    def _mapped(self, landing_map: LandingMap) -> None:
        self._map = landing_map

    def _answered(self, found: Answer) -> None:
        """Keep an estimate, or say why data cannot be used."""
        if found.estimate is not None:
            self.estimates.append(found.estimate)
            with (self.out / LOG).open("a", encoding="utf-8") as log:
                log.write(json.dumps(found.estimate.as_record()) + "\n")
        self.phase = OnlinePhase.REFUSED if found.refusal else OnlinePhase.READY
        self.detail = found.refusal or self._no_more
        self._aligned = found.aligned or self._aligned

    def _simulate(self, jobs: "list[Job]") -> None:
        try:
            self._simulating = self._simulator.submit(self._simulate_plan, jobs)
        except BrokenExecutor as error:
            self._simulating = Future()
            self._simulating.set_exception(error)

    def _take_simulations(self) -> None:
        if self._simulating is None or not self._simulating.done():
            return
        future, self._simulating = self._simulating, None
        try:
            self.made += future.result()
        except BrokenExecutor:  # the others are enough for estimates
            self._no_more = "the process that simulates has died"
        except Exception as error:
            self._no_more = f"the plan cannot be simulated: {type(error).__name__}: {error}"
        if not self._no_more:
            return
        if self.phase is OnlinePhase.PREPARING:
            self.phase, self.detail = OnlinePhase.FAILED, self._no_more
        self.detail = self.detail or self._no_more
