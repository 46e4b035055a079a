"""Seconds: of stirring, of two processes beside one, and from import to the first result."""

import multiprocessing
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

import numpy as np

from bolfi_liquids import models, open_recording

from .line import Line
from .liquids import LISTED, listed

SECONDS = 8.0  # of stirring that a time is scaled to
MOST = {1000: 0.5, 2000: 1.2}  # particles -> CPU s
REPEATS = 3
TRIALS = 6  # of each of the processes that run at once
START = Path(__file__).parents[1] / "first_result.py"


def stirring_seconds(recording: Path) -> Iterator[Line]:
    """CPU s for 8 s of stirring on one core, by number of particles and liquid."""
    for particles, most in MOST.items():
        for name in LISTED:
            trial = Trial(recording, name, particles)
            trial.run()  # compiles, and lets the packing settle
            spent = float(np.median([trial.cpu_seconds() for _ in range(REPEATS)]))
            what = f"stirring {SECONDS:g} s, N = {particles}, like {name} [CPU s]"
            yield Line(what, spent * SECONDS / trial.duration, most)


class Trajectory(NamedTuple):
    """Times [T] in s and positions [T, 3] in m."""

    time: np.ndarray
    position: np.ndarray


class Trial:
    """One stir along the first `seconds` of a recorded path."""

    def __init__(
        self, recording: Path, liquid: str, particles: int = 1000, seconds: float = np.inf
    ):
        opened = open_recording(recording)
        part = opened.time <= opened.time[0] + seconds
        self.liquid = listed(liquid)
        self.path = Trajectory(*(column[part] for column in opened.gripper))
        self.setup = models.StirSetup.from_recording(opened, particles)

    @property
    def duration(self) -> float:
        """Of the stir [s]."""
        return float(self.path.time[-1] - self.path.time[0])

    def run(self) -> None:
        models.stir(self.liquid, self.path, self.setup, [0])

    def cpu_seconds(self) -> float:
        start = time.process_time()
        self.run()
        return time.process_time() - start


def throughput(recording: Path) -> Iterator[Line]:
    """Trials a second of two processes over those of one."""
    one, two = (_trials_a_second(recording, processes) for processes in (1, 2))
    yield Line("throughput of two processes over one", two / one, 1.8, least=True)


def _trials_a_second(recording: Path, processes: int) -> float:
    # spawned, as Taichi's threads do not survive a fork
    context = multiprocessing.get_context("spawn")
    start, ends = context.Barrier(processes), context.Queue()
    workers = [
        context.Process(target=_work, args=(recording, start, ends)) for _ in range(processes)
    ]
    for worker in workers:
        worker.start()
    slowest = max(ends.get() for _ in workers)
    for worker in workers:
        worker.join()
    return processes * TRIALS / slowest


def _work(recording: Path, start, ends) -> None:
    trial = Trial(recording, "oil")
    trial.run()
    start.wait()
    began = time.perf_counter()
    for _ in range(TRIALS):
        trial.run()
    ends.put(time.perf_counter() - began)


def start_up(recording: Path) -> Iterator[Line]:
    """Seconds from import to the first angles, in processes that find a warm cache."""
    command = [sys.executable, str(START), str(recording)]
    runs = [
        subprocess.run(command, capture_output=True, text=True, check=True).stdout.split()
        for _ in range(REPEATS + 1)
    ]
    # the first warms the cache; the least of the others is least disturbed
    wall, cpu = np.array(runs[1:], dtype=float).min(axis=0)
    yield Line("import to first result, warm cache [s]", float(wall), 2.0)
    yield Line("the same [CPU s]", float(cpu))
