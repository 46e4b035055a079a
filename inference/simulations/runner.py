"""Simulating what the bank lacks: in batches here, or on an executor."""

import pickle
from collections.abc import Callable, Iterable, Sequence
from concurrent.futures import BrokenExecutor, CancelledError, Future, wait
from contextlib import ExitStack, nullcontext
from functools import partial
from itertools import batched
from typing import NamedTuple

from ..arguments import check_identity
from ..types import Simulator
from .bank import Simulation, SimulationBank
from .compute import Compute, is_pool, killed_its_worker
from .failures import FailureKind, NoSignals, is_unusable, raised, unusable
from .job import BATCH, BatchSimulator, Job, OneByOne, of_one_shape, run_batch

CALLED = {
    BatchSimulator: "; simulate is called with theta, name -> [b], and seeds [b], and returns b "
    "signals; if it makes one run, give vectorised=False",
    OneByOne: "; with vectorised=False simulate is called with theta, name -> float, and one seed",
}
POLL_SECONDS = 0.2  # seconds between looks at what somebody else is simulating


class Order(NamedTuple):
    """A simulation that is wanted; `outcome` is done once the bank holds it."""

    job: Job
    outcome: "Future[Simulation]"


class Runner:
    """A simulator with the bank that keeps what it returns; close it, or use it in a `with`.

    Nothing that the bank holds is simulated again but what raised, whose cause, such as a full
    disk, may have gone, and what was given up after less time than is allowed now. What another
    thread or process is simulating for the same bank is waited for.

    A run for which the simulator returns something else than a signal is a failed one, and is not
    kept. Where none of the first runs gives a signal, all would fail in the same way: `result`
    then raises.

    Args:
        simulate: The user's simulator.
        compute: Where simulations are made and kept; the caller decides on batches.
        shape: Of one signal; None accepts any.
        identity: The simulator's name in the bank.

    Attributes:
        seconds: That all results took.
    """

    def __init__(
        self,
        simulate: Simulator,
        compute: Compute,
        *,
        shape: tuple[int, ...] | None = None,
        identity: str = "",
    ):
        if compute.bank is not None:
            check_identity(identity, "bank", compute.bank.path)
        self.simulate, self.shape = simulate, shape
        self._results = self._unusable = 0
        self._checked = False
        self.seconds = 0.0
        self._resources = ExitStack()
        own = SimulationBank() if compute.bank is None else nullcontext(compute.bank)
        self.bank = self._resources.enter_context(own)
        self.executor, self.timeout, self.identity = compute.executor, compute.timeout, identity
        self._elsewhere: list[Order] = []  # claimed by somebody else
        self._mine: dict[Future[Simulation], Job] = {}  # claimed here, by outcome
        self._submitted: set[Future[list[Simulation]]] = set()

    def how_called(self, errors: Iterable[str]) -> str:
        """How a user's function is called, as the end of a message, where every error suggests a
        wrong call."""
        misread = all(error.startswith(("TypeError", "IndexError")) for error in errors)
        return CALLED.get(type(self.simulate), "") if misread else ""

    def __enter__(self) -> "Runner":
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def close(self) -> None:
        """Cancel what has not begun and claim nothing any more.

        What is running is not waited for; it is stored when finished, if the bank is open then.
        """
        self._elsewhere.clear()
        for future in list(self._submitted):
            future.cancel()
        for outcome in list(self._mine):
            self._release(outcome)
        self._resources.close()

    def run(self, batch: Sequence[Job]) -> list[Simulation]:
        """Results of all jobs, in order, once all are finished.

        Raises:
            ValueError: none of the first runs gave a signal of this shape.
            RuntimeError: the executor lost a simulation.
        """
        return [self.result(outcome) for outcome in self.start(batch)]

    def start(self, batch: Sequence[Job]) -> "list[Future[Simulation]]":
        """Begin all jobs that the bank lacks; without an executor this also ends them.

        Returns:
            An outcome per job, for `result`. With an executor those of a call are stored the
            moment it is finished, in whatever order.
        """
        orders = [Order(job, Future()) for job in batch]
        self._elsewhere += orders
        self._begin()
        return [order.outcome for order in orders]

    def result(self, outcome: "Future[Simulation]") -> Simulation:
        """The simulation, once it is finished, here or by whoever else is making it.

        Raises: see `run`.
        """
        while self._elsewhere and not outcome.done():
            wait([outcome], timeout=POLL_SECONDS)
            self._begin()
        made = outcome.result()
        self._results += 1
        self.seconds += made.seconds
        if is_unusable(made.error):
            self._unusable += 1
            if self._unusable == self._results == BATCH:
                raise NoSignals(made.error.text)
        return made

    def _begin(self) -> None:
        """Take from the bank or simulate whatever nobody else is simulating."""
        waiting, self._elsewhere = self._elsewhere, []
        mine: list[Order] = []
        for order in waiting:
            if self._found(order):
                continue
            if not self.bank.claim(self.identity, *order.job):
                self._elsewhere.append(order)
                continue
            self._mine[order.outcome] = order.job
            if self._found(order):  # finished by the last claimant after the first look
                self._release(order.outcome)
            else:
                mine.append(order)
        for part in batched(mine, self._together(len(mine))):
            self._simulate(part)

    def _found(self, order: Order) -> bool:
        """Whether the bank holds what need not be tried again: a signal, also one of NaN, and a
        timeout unless more time is allowed now; not what raised."""
        found = self.bank.get(self.identity, *order.job)
        if found is None:
            return False
        if found.error is not None:
            late = found.error.kind is FailureKind.TIMEOUT
            if not late or self.timeout is None or self.timeout > found.seconds:
                return False
        if found.signal is not None and self.shape not in (None, found.signal.shape):
            told = (
                f"the bank {self.bank.path} holds a signal of shape {found.signal.shape} under "
                f"identity={self.identity!r}, where {self.shape} is expected; it is another "
                "simulator's: give each its own identity=, or choose another bank"
            )
            found = Simulation(None, unusable(told), found.seconds)
        order.outcome.set_result(found)
        return True

    def _together(self, count: int) -> int:
        """How many of so many runs are one call: here all of them, unless each is kept when it is
        finished; of a pool as many as the simulator likes, even if a worker then idles, for half a
        call takes nearly as long; elsewhere one, for a worker may die alone, and a call with it."""
        if self.executor is None:
            return 1 if isinstance(self.simulate, OneByOne) else max(count, 1)
        if isinstance(self.simulate, BatchSimulator) and is_pool(self.executor):
            return self.simulate.together
        return 1

    def _simulate(self, orders: Sequence[Order]) -> None:
        """Make the runs in one call, here or on the executor."""
        here = self.executor is None or is_pool(self.executor)
        if here and not self._checked and isinstance(self.simulate, OneByOne):
            self.simulate._check_here()
            self._checked = True
        batch = [order.job for order in orders]
        work = partial(run_batch, self.simulate, batch, self.shape, self.timeout)
        if self.executor is None:
            for order, made in zip(orders, work(), strict=True):
                self._keep(order, made)
            return
        try:
            future = self.executor.submit(work)
        except Exception as error:
            self._fail(orders, self._explained(error, submitting=True))
            return
        self._submitted.add(future)
        future.add_done_callback(partial(self._receive, orders))

    def _receive(self, orders: Sequence[Order], future: "Future[list[Simulation]]") -> None:
        """Store what an executor finished; called by one of its threads."""
        self._submitted.discard(future)
        try:
            made = future.result()
        except BaseException as error:
            if not killed_its_worker(error):
                self._fail(orders, self._explained(error))
                return
            made = [Simulation(None, raised(error), 0.0) for _ in orders]
        for order, one in zip(orders, made, strict=True):
            try:
                self._keep(order, one)
            except BaseException as error:  # for `result` to raise: nobody hears this thread
                self._fail([order], error)

    def _keep(self, order: Order, made: Simulation) -> None:
        if not is_unusable(made.error):  # which the next call tries again, as it does what raised
            self.bank.put(self.identity, *order.job, made)
        self._release(order.outcome)
        order.outcome.set_result(made)

    def _fail(self, orders: Sequence[Order], error: BaseException) -> None:
        for order in orders:
            self._release(order.outcome)
            order.outcome.set_exception(error)

    def _release(self, outcome: "Future[Simulation]") -> None:
        job = self._mine.pop(outcome, None)
        if job is not None:
            self.bank.release(self.identity, *job)

    def _explained(self, error: BaseException, submitting: bool = False) -> BaseException:
        """An executor's own error in the user's terms."""
        if isinstance(error, BrokenExecutor | CancelledError):
            jobs = "; ".join(f"{job.theta}, seed {job.seed}" for job in list(self._mine.values()))
            told = RuntimeError(
                f"the executor lost its workers ({raised(error)}): one was killed, ran out of "
                "memory, crashed in the simulator or could not import it. "
                f"In flight: {jobs}. {self.bank.where}; "
                "mend the cause and repeat the call with a new executor to go on from there"
            )
        elif _is_of_pickling(error, self.simulate):
            told = TypeError(
                "simulate must be picklable to reach the executor's workers "
                f"({error}); define it at the top level of a module"
            )
        elif submitting and isinstance(error, RuntimeError):
            told = RuntimeError(
                f"the executor is shut down ({error}); pass an open one. {self.bank.where}"
            )
        else:
            return error
        told.__cause__ = error
        return told


def _is_of_pickling(error: BaseException, simulate: Simulator) -> bool:
    """Whether an executor's error says that the simulator cannot be pickled.

    Python raises an AttributeError for a local function and a TypeError for what holds a lock,
    and other mistakes raise these, too.
    """
    try:
        pickle.dumps(simulate)
    except Exception:
        return isinstance(error, pickle.PicklingError | AttributeError | TypeError)
    return isinstance(error, pickle.PicklingError)


def run_missing(
    simulate: Simulator,
    jobs: Sequence[Job],
    compute: Compute,
    shape: tuple[int, ...] | None = None,
    *,
    identity: str = "",
    advance: Callable[[int], object] = lambda count: None,
) -> list[Simulation]:
    """Results of all jobs, in order; those that the bank lacks are simulated.

    Args:
        simulate: The user's simulator.
        jobs: What is wanted.
        compute: Where simulations are made and kept.
        shape: Of one signal; None accepts any.
        identity: The simulator's name in the bank.
        advance: Called with 1 for each result, in order; those of a batch come together.

    Raises:
        ValueError: the simulator returned something else than signals for all of the first runs.
    """
    at_once = None if compute.executor is not None else compute.batch
    results = []
    with Runner(simulate, compute, shape=shape, identity=identity) as runner:
        for part in batched(jobs, at_once or max(len(jobs), 1)):
            for outcome in runner.start(part):
                results.append(runner.result(outcome))
                advance(1)
    return of_one_shape(results, jobs) if shape is None else results
