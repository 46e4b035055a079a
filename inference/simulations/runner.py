"""Simulating what the bank lacks: in batches here, or on an executor."""

import pickle
from collections.abc import Callable, Iterable, Sequence
from concurrent.futures import BrokenExecutor, CancelledError, Executor, Future, wait
from contextlib import ExitStack, nullcontext
from functools import partial
from typing import NamedTuple

from ..types import Simulator
from .bank import Simulation, SimulationBank
from .compute import Compute
from .executors import killed_its_worker, workers_of
from .failures import FailureKind, NoSignals, raised, unusable
from .job import (
    BATCH,
    BatchSimulator,
    Job,
    OneByOne,
    is_unusable,
    of_one_shape,
    run_batch,
)

POLL_SECONDS = 0.2  # seconds between looks at what somebody else is simulating

Shape = tuple[int, ...] | None
"""Of one signal; None accepts any."""


class Order(NamedTuple):
    """A simulation that is wanted; `outcome` is done once the bank holds it."""

    job: Job
    shape: Shape
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
        identity: The simulator's name in the bank.
    """

    def __init__(self, simulate: Simulator, compute: Compute, identity: str = ""):
        self.simulate = simulate
        self._misshapen_until = BATCH  # results, whatever the batch; 0 once another came
        self._misshapen = 0
        self._resources = ExitStack()
        own = SimulationBank() if compute.bank is None else nullcontext(compute.bank)
        self.bank = self._resources.enter_context(own)
        self.executor, self.timeout, self.identity = compute.executor, compute.timeout, identity
        self._elsewhere: list[Order] = []  # claimed by somebody else
        self._mine: dict[Future[Simulation], Job] = {}  # claimed here, by outcome
        self._submitted: set[Future[list[Simulation]]] = set()

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

    def run(self, batch: Sequence[Job], shape: Shape) -> list[Simulation]:
        """Results of all jobs, in order, once all are finished.

        Raises:
            NoSignals: none of the first runs gave a signal of this shape.
            RuntimeError: the executor lost a simulation.
        """
        return [self.result(outcome) for outcome in self.start(batch, shape)]

    def start(self, batch: Sequence[Job], shape: Shape) -> "list[Future[Simulation]]":
        """Begin all jobs that the bank lacks; without an executor this also ends them.

        Returns:
            An outcome per job, for `result`. With an executor those of a call are stored the
            moment it is finished, in whatever order.
        """
        orders = [Order(job, shape, Future()) for job in batch]
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
        self._check_first(made)
        return made

    def _check_first(self, made: Simulation) -> None:
        if not self._misshapen_until:
            return
        if made.error is None or not is_unusable(made):
            self._misshapen_until = 0
            return
        self._misshapen += 1
        if self._misshapen == self._misshapen_until:
            raise NoSignals(made.error.text)

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
        if self.executor is not None:
            for part in self._shared_out(mine, self.executor):
                self._submit(self.executor, part)
        elif mine:
            self._simulate_here(mine)

    def _found(self, order: Order) -> bool:
        found = self.bank.get(self.identity, *order.job)
        if found is None or not is_final(found, self.timeout):
            return False
        if found.signal is not None and order.shape not in (None, found.signal.shape):
            told = (
                f"the bank {self.bank.path} holds a signal of shape {found.signal.shape} under "
                f"identity={self.identity!r}, where {order.shape} is expected; it is another "
                "simulator's: give each its own identity=, or choose another bank"
            )
            found = Simulation(None, unusable(told), found.seconds)
        order.outcome.set_result(found)
        return True

    def _simulate_here(self, orders: list[Order]) -> None:
        single = isinstance(self.simulate, OneByOne)  # each run is kept when it is finished
        for part in [[order] for order in orders] if single else [orders]:
            batch = [order.job for order in part]
            made = run_batch(self.simulate, batch, orders[0].shape, self.timeout)
            for order, simulation in zip(part, made, strict=True):
                self._keep(order, simulation)

    def _shared_out(self, orders: list[Order], executor: Executor) -> "Iterable[list[Order]]":
        """What goes to the executor in one call: as much as the simulator likes, even if a worker
        then idles: half a call takes nearly as long. One by one where a worker may die alone: a
        call with it."""
        pool = workers_of(executor) is not None
        each = self.simulate.together if pool and isinstance(self.simulate, BatchSimulator) else 1
        return (orders[start : start + each] for start in range(0, len(orders), each))

    def _submit(self, executor: Executor, orders: list[Order]) -> None:
        batch = [order.job for order in orders]
        work = partial(run_batch, self.simulate, batch, orders[0].shape, self.timeout)
        try:
            future = executor.submit(work)
        except Exception as error:
            told = self._refused(error)
            for order in orders:
                self._fail(order, told)
            return
        self._submitted.add(future)
        future.add_done_callback(partial(self._receive, orders))

    def _receive(self, orders: list[Order], future: "Future[list[Simulation]]") -> None:
        """Store what an executor finished; called by one of its threads."""
        self._submitted.discard(future)
        try:
            made = future.result()
        except BaseException as error:
            if not killed_its_worker(error):
                told = self._explained(error)
                for order in orders:
                    self._fail(order, told)
                return
            made = [Simulation(None, raised(error), 0.0) for _ in orders]
        for order, one in zip(orders, made, strict=True):
            try:
                self._keep(order, one)
            except BaseException as error:  # for `result` to raise: nobody hears this thread
                self._fail(order, error)

    def _keep(self, order: Order, made: Simulation) -> None:
        if not is_unusable(made):  # which the next call tries again, as it does what raised
            self.bank.put(self.identity, *order.job, made)
        self._release(order.outcome)
        order.outcome.set_result(made)

    def _fail(self, order: Order, error: BaseException) -> None:
        self._release(order.outcome)
        order.outcome.set_exception(error)

    def _release(self, outcome: "Future[Simulation]") -> None:
        job = self._mine.pop(outcome, None)
        if job is not None:
            self.bank.release(self.identity, *job)

    def _refused(self, error: Exception) -> BaseException:
        """What to tell the user of an executor that takes no simulation."""
        told = self._explained(error)
        if told is not error or not isinstance(error, RuntimeError):
            return told
        told = RuntimeError(
            f"executor takes no simulation ({error}); give one that is open, which nobody has shut "
            f"down. {self.bank.where}"
        )
        told.__cause__ = error
        return told

    def _explained(self, error: BaseException) -> BaseException:
        """What to tell the user of an executor's own error."""
        if _is_of_pickling(error, self.simulate):
            told = TypeError(
                "simulate must be picklable to reach the executor's workers "
                f"({error}); define it at the top level of a module"
            )
        elif isinstance(error, BrokenExecutor | CancelledError):
            jobs = "; ".join(f"{job.theta}, seed {job.seed}" for job in list(self._mine.values()))
            told = RuntimeError(
                f"the executor lost its workers ({raised(error)}): one was killed, ran out of "
                "memory, crashed in the simulator or could not import it. "
                f"In flight: {jobs}. {self.bank.where}; "
                "mend the cause and repeat the call with a new executor to go on from there"
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
    if isinstance(error, pickle.PicklingError):
        return True
    if not isinstance(error, AttributeError | TypeError):
        return False
    try:
        pickle.dumps(simulate)
    except Exception:
        return True
    return False


def is_final(found: Simulation, timeout: float | None) -> bool:
    """Whether a stored simulation need not be tried again.

    A signal is final, also one of NaN, and so is a timeout unless more time is allowed now; what
    raised is not.
    """
    if found.error is None:
        return True
    if found.error.kind is not FailureKind.TIMEOUT:
        return False
    return timeout is not None and timeout <= found.seconds


def run_missing(
    simulate: Simulator,
    jobs: Sequence[Job],
    compute: Compute,
    shape: Shape = None,
    *,
    identity: str = "",
    advance: Callable[[int], object] = lambda count: None,
) -> list[Simulation]:
    """Results of all jobs, in order; those that the bank lacks are simulated, see `Runner`.

    Args:
        simulate: The user's simulator.
        jobs: What is wanted.
        compute: Where simulations are made and kept.
        shape: Of one signal; None accepts any.
        identity: The simulator's name in the bank.
        advance: Called with 1 for each result, in order; those of a batch come together.

    Raises:
        NoSignals: the simulator returned something else than signals for all of the first runs.
    """
    shared_out = compute.executor is not None
    at_once = compute.batch if compute.batch is not None and not shared_out else len(jobs)
    results = []
    with Runner(simulate, compute, identity) as runner:
        for start in range(0, len(jobs), max(at_once, 1)):
            for outcome in runner.start(jobs[start : start + at_once], shape):
                results.append(runner.result(outcome))
                advance(1)
    return of_one_shape(results, jobs, shape)
