"""Seconds: of stirring, of two processes beside one, and from import to the first result."""

import multiprocessing
import subprocess
import sys
import time
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from resource import RUSAGE_CHILDREN, getrusage
from typing import NamedTuple

import numpy as np

from bolfi_liquids import models, open_recording

from .line import Line

Numerics, Viscosities = models.Numerics, tuple[float, ...]

SECONDS = 7.3  # of stirring that a time is scaled to
FULL = 8  # stirs that march together
MOST = {"up to 0.2 Pa s": ((1e-3, 1e-2, 0.05, 0.2), 0.45), "above": ((0.5, 1.0, 6.0, 12.0), 0.6)}
REPEATS = 3
TRIALS = 6  # of each of the processes that run at once
START = """
import sys
from bolfi_liquids.inputs.open import open_recording
from bolfi_liquids.models import Liquid, StirSetup, stir
recording = open_recording(sys.argv[1])
path, setup = recording.first(10).gripper, StirSetup.from_recording(recording)
stir(Liquid(0.1, 0.0, 1000.0), path, setup, [0])
"""


def stirring_seconds(recording: Path) -> Iterator[Line]:
    """CPU s of a stir in a full batch, and how they grow with batch, cells and steps."""
    for name, (viscosities, most) in MOST.items():
        usual = Trial(recording, viscosities * (FULL // 4))
        usual.run()  # compiles
        yield Line(f"stir of {SECONDS:g} s, {name} [CPU s]", usual.seconds_each(), most)
    mixed = MOST["up to 0.2 Pa s"][0] * (FULL // 4)
    one = Trial(recording, mixed).seconds_each()
    many = Trial(recording, mixed * 8).seconds_each()
    yield Line(f"a stir of {8 * FULL} beside one of {FULL}", many / one, 1.05)
    fine = replace(models.Numerics(), cell=0.00321, longest_step=0.012 * 5.0 / 3.21)
    coarse = replace(fine, cell=0.00642, narrowest=0.7, longest_step=0.012 * 5.0 / 6.42)
    yield Line("8 times as many cells", _ratio(recording, mixed, fine, coarse))
    long, short = (replace(models.Numerics(), longest_step=step) for step in (0.016, 0.002))
    yield Line("8 times as many steps", _ratio(recording, mixed, short, long))


def _ratio(recording: Path, viscosities: Viscosities, one: Numerics, other: Numerics) -> float:
    trials = [Trial(recording, viscosities, numerics) for numerics in (one, other)]
    for trial in trials:
        trial.run()
    dear, cheap = (trial.seconds_each() for trial in trials)
    return dear / cheap


class Trajectory(NamedTuple):
    """Times [T] in s and positions [T, 3] in m."""

    time: np.ndarray
    position: np.ndarray


class Trial:
    """A batch of stirs along the first `seconds` of a recorded path."""

    def __init__(
        self,
        recording: Path,
        viscosities: Viscosities,
        numerics: Numerics | None = None,
        seconds: float = np.inf,
    ):
        opened = open_recording(recording)
        part = opened.time <= opened.time[0] + seconds
        self.liquid = models.Liquid(np.array(viscosities), 0.0, 1000.0)
        self.seeds = np.arange(len(viscosities))
        self.path = Trajectory(*(column[part] for column in opened.gripper))
        self.setup = models.StirSetup.from_recording(opened, numerics=numerics)

    def run(self) -> None:
        models.stir(self.liquid, self.path, self.setup, self.seeds)

    def seconds_each(self, seconds: float = SECONDS) -> float:
        """CPU s of one stir of so many seconds, the median of some."""
        duration = self.path.time[-1] - self.path.time[0]
        spent = float(np.median([self._cpu_seconds() for _ in range(REPEATS)]))
        return spent / len(self.seeds) * seconds / duration

    def _cpu_seconds(self) -> float:
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
    trial = Trial(recording, (0.1,))
    trial.run()
    start.wait()
    began = time.perf_counter()
    for _ in range(TRIALS):
        trial.run()
    ends.put(time.perf_counter() - began)


def start_up(recording: Path) -> Iterator[Line]:
    """Seconds from a process's start to its first angles, in processes that find a warm cache."""
    runs = []
    for _ in range(REPEATS + 1):
        began, before = time.perf_counter(), getrusage(RUSAGE_CHILDREN)
        subprocess.run([sys.executable, "-c", START, str(recording)], check=True)
        after = getrusage(RUSAGE_CHILDREN)
        cpu = after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime
        runs.append((time.perf_counter() - began, cpu))
    # the first warms the cache; the least of the others is least disturbed
    wall, cpu = np.min(runs[1:], axis=0)
    yield Line("import to first result, warm cache [s]", float(wall), 3.0)
    yield Line("the same [CPU s]", float(cpu))
