"""The engines that can be compared: where they run, and what decides their results."""

import hashlib
import os
import sys
from functools import cache
from pathlib import Path
from typing import NamedTuple

from tasks import Task

HERE = Path(__file__).parent
ROOT = HERE.parents[1]
SHARED = (HERE / "tasks", HERE / "peers" / "job.py")
ONE_THREAD = {
    "OMP_NUM_THREADS": "1",
    "OPENBLAS_NUM_THREADS": "1",
    "MKL_NUM_THREADS": "1",
    "XLA_FLAGS": "--xla_cpu_multi_thread_eigen=false intra_op_parallelism_threads=1",
    "JAX_PLATFORMS": "cpu",
}


class Engine(NamedTuple):
    """Who runs it, as which module and on which tasks.

    Attributes:
        python: Interpreter of its environment.
        module: What that runs.
        sources: Files and directories that decide its results, besides `SHARED`.
        outputs: Fewest outputs with noise of a known covariance that it needs; 0 takes any task.
    """

    python: Path
    module: str
    sources: tuple[Path, ...]
    outputs: int = 0

    def takes(self, task: Task) -> bool:
        return self.outputs <= (0 if task.noise is None else len(task.noise))


def _ours() -> Engine:
    return Engine(Path(sys.executable), "peers.run_ours", (ROOT / "inference",))


def _peer(environment: str, module: str, outputs: int = 0) -> Engine:
    python = ROOT / ".venv-peers" / environment / "bin" / "python"
    pins = HERE / "peers" / f"{environment}.txt"
    return Engine(python, f"peers.{module}", (pins,), outputs)


ENGINES = {
    "signal": _ours(),
    "discrepancy": _ours(),
    "elfi": _peer("elfi", "run_elfi"),
    "npe": _peer("sbi", "run_sbi"),
    "nle": _peer("sbi", "run_sbi"),
    "npe_pfn": _peer("sbi", "run_sbi"),
    # a run tells the likelihood only where the noise is known
    "vbmc": _peer("pyvbmc", "run_vbmc", outputs=1),
    "vbmc_noisy": _peer("pyvbmc", "run_vbmc", outputs=1),
    "surmise": _peer("surmise", "run_surmise", outputs=5),  # it refuses fewer
}
OURS = tuple(name for name, engine in ENGINES.items() if engine.module == "peers.run_ours")


def command(name: str, job: str) -> tuple[list[str], dict[str, str]]:
    """Arguments and environment of the process that does `job`."""
    engine = ENGINES[name]
    environment = {**os.environ, **ONE_THREAD, "PYTHONPATH": str(HERE)}
    return [str(engine.python), "-m", engine.module, job], environment


@cache
def digest(name: str | None) -> str:
    """Of all sources that decide an engine's results, or the tasks'; new ones make those stale."""
    places = [*SHARED]
    if name is not None:
        engine = ENGINES[name]
        places += [HERE / f"{engine.module.replace('.', '/')}.py", *engine.sources]
    content = hashlib.sha256()
    for place in places:
        for file in sorted(place.rglob("*.py")) if place.is_dir() else [place]:
            content.update(file.read_bytes())
    return content.hexdigest()[:12]
