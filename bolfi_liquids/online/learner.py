"""The process that learns from simulations of the plan and answers data with estimates."""

import json
import os
from multiprocessing.connection import Connection, wait
from typing import TYPE_CHECKING, Any

import numpy as np

from ..simulators import PourSimulator, stir_simulator
from .newest_message import newest
from .plan import SoFar, follow, stroke_ends
from .request import PARTNER_GONE, OnlinePhase, Request, Status
from .simulator import step_back

if TYPE_CHECKING:
    from ..inference.simulations import Job
    from .estimate import OnlineEstimate
    from .plan import Followed

NICENESS = 5  # of this process; an estimate matters more than another simulation
SIMULATOR_DIED = "the process that simulates has died"


def learn_online(parent: Connection, simulator: Connection, request: Request) -> None:
    """Prepare, then answer every `SoFar` with an estimate, until `parent` is closed.

    Sends `OnlineEstimate` and `Status`; whatever goes wrong is a status.
    """
    step_back(NICENESS)
    try:
        learner = _Learner(parent, simulator, request)
        if learner.prepare():
            learner.serve()
    except PARTNER_GONE:
        return  # no process is left to report to
    except Exception as error:
        parent.send(Status(OnlinePhase.FAILED, f"{type(error).__name__}: {error}"))
        raise


class _Learner:
    """What the process knows."""

    def __init__(self, parent: Connection, simulator: Connection, request: Request):
        from ..inputs.prior import read_prior
        from .estimate import Problem

        self.parent, self.simulator, self.request = parent, simulator, request
        self.plan = request.plan()
        self.ends = stroke_ends(self.plan)
        stirring = stir_simulator([self.plan], request.settings.particles)
        self.problem = Problem(read_prior(request.prior), stirring, request.settings)
        self.made = self.problem.nothing
        self.flying: list[list[Job]] = []  # in the order sent
        self.asked = 0
        self.simulating = True
        self.followed: Followed | None = None

    def prepare(self) -> bool:
        """Simulate the design; meanwhile learn the map. Whether all went well."""
        from ..inference import SimulationBank
        from ..inference.simulations import Compute
        from ..pouring.landed_pours import Parcels
        from ..pouring.landing_map import map_of_prior
        from .estimate import design

        settings, jobs = self.request.settings, design(self.problem)
        side_by_side = os.cpu_count() or 1  # nothing is urgent before the robot moves
        for start in range(0, len(jobs), side_by_side):
            self._send(jobs[start : start + side_by_side])
        self._tell(OnlinePhase.PREPARING, "learning the map of landings")
        density = self.plan.number("liquid_density")
        pours = PourSimulator(self.request.cups, density, Parcels())
        with SimulationBank(self.request.bank) as bank:
            compute = Compute(bank=bank)
            self.landing_map = map_of_prior(self.problem.prior, pours, settings.pours, compute)
        while self.flying:
            self._tell(OnlinePhase.PREPARING, "simulating the plan")
            self._land()
        if self.made.size < settings.design:
            self._tell(OnlinePhase.FAILED, SIMULATOR_DIED)
            return False
        self._tell(OnlinePhase.READY, "")
        return True

    def serve(self) -> None:
        """Answer data first; in between, simulate the points that they suggest."""
        while True:
            ready = wait([self.parent, *([self.simulator] if self.simulating else [])])
            if self.parent in ready:
                self._answer(newest(self.parent))
            if self.simulator in ready:
                self._land()
                self._tell(OnlinePhase.READY, "")
            self._go_on()

    def _answer(self, so_far: SoFar) -> None:
        try:
            followed = follow(self.plan, self.ends, so_far)
            if followed.refusal:
                self._tell(OnlinePhase.REFUSED, followed.refusal)
            else:
                later = float(so_far.time[-1]) - followed.covered - followed.delay
                self._estimate(followed, so_far.ended - later)
        except ValueError as error:  # these data cannot be used; later ones may
            self._tell(OnlinePhase.REFUSED, str(error))

    def _estimate(self, followed: "Followed", ended: float) -> None:
        from .estimate import estimate

        known = self.followed is not None and followed.strokes <= self.followed.strokes
        if known or not np.isfinite(followed.observed).any():
            return
        self.followed = followed
        found = estimate(self.problem, self.made, followed, self.landing_map, ended)
        self.parent.send(found)
        self._tell(OnlinePhase.READY, "")
        with self.request.log.open("a", encoding="utf-8") as log:
            log.write(json.dumps(as_record(found)) + "\n")

    def _go_on(self) -> None:
        """Keep one batch in flight, from the first stroke on."""
        from .estimate import proposals

        settings = self.request.settings
        n = min(settings.in_flight, settings.budget - self.asked)
        if self.followed is not None and self.simulating and not self.flying and n > 0:
            observed = self.followed.observed
            self._send(proposals(self.problem, self.made, observed, self.asked, n))

    def _send(self, jobs: "list[Job]") -> None:
        self.asked += len(jobs)
        try:
            self.simulator.send(jobs)
        except PARTNER_GONE:
            self._go_alone()
        else:
            self.flying.append(jobs)

    def _land(self) -> None:
        from .estimate import with_results

        try:
            results = self.simulator.recv()
        except PARTNER_GONE:
            self._go_alone()
        else:
            self.made = with_results(self.made, self.flying.pop(0), results)

    def _go_alone(self) -> None:
        """Go on with the simulations that there are: the simulator has died."""
        self.simulating = False
        self.flying.clear()

    def _tell(self, phase: OnlinePhase, detail: str) -> None:
        if phase == OnlinePhase.READY and not self.simulating:
            detail = SIMULATOR_DIED
        in_flight = sum(len(jobs) for jobs in self.flying)
        self.parent.send(Status(phase, detail, self.made.size, in_flight))


def as_record(estimate: "OnlineEstimate") -> dict[str, Any]:
    """An estimate as JSON writes it."""
    parameters = {name: spread._asdict() for name, spread in estimate.parameters.items()}
    return estimate._asdict() | {"parameters": parameters}
