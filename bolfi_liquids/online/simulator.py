"""The process that simulates the plan; it loads no JAX."""

import os
import signal
from multiprocessing.connection import Connection

from ..simulators import stir_simulator
from .request import PARTNER_GONE, Request

NICENESS = 10  # of this process; control and cameras come first


def simulate_plan(link: Connection, request: Request) -> None:
    """Simulate the lists of jobs that come through `link` and send their results back.

    Ends when the other end of `link` is closed.
    """
    from ..inference import SimulationBank
    from ..inference.simulations import Compute, run_missing

    step_back(NICENESS)
    stirring = stir_simulator([request.plan()], request.settings.particles)
    with SimulationBank(request.bank) as bank:
        known = {"compute": Compute(bank=bank), "identity": stirring.identity}
        while True:
            try:
                jobs = link.recv()
                link.send(run_missing(stirring.simulate, jobs, **known))
            except PARTNER_GONE:
                return


def step_back(niceness: int) -> None:
    """Run at a lower priority, and ignore Ctrl-C; the supervising process handles it."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    if hasattr(os, "nice"):
        os.nice(niceness)
