"""Our CPU seconds beside SPlisHSPlasH's, on one scene and in one run."""

import json
import os
import subprocess
import tempfile
from collections.abc import Iterator
from pathlib import Path

import numpy as np

from .line import Line
from .liquids import LISTED
from .speed import Trial

HERE = Path(__file__).parents[1]
PYTHON = HERE.parents[1] / ".venv-peers" / "pysplishsplash" / "bin" / "python"
SECONDS, FASTER = 3.0, 15.0
LIQUIDS = ("water", "glycerin")


def against_peer(recording: Path, python: Path = PYTHON) -> Iterator[Line]:
    """How many times faster ours is; no lines where the peer's environment is not there."""
    if not python.exists():
        return
    for liquid in LIQUIDS:
        trial = Trial(recording, (LISTED[liquid][0],), seconds=SECONDS)
        trial.run()
        theirs, ours = _theirs(trial, liquid, python), trial.seconds_each(SECONDS)
        name = f"{SECONDS:g} s of {liquid}"
        yield Line(f"{name}, pysplishsplash 2.19 [CPU s]", theirs)
        yield Line(f"{name}, ours [CPU s]", ours)
        yield Line(f"{name}, times faster", theirs / ours, FASTER, least=True)


def _theirs(trial: Trial, liquid: str, python: Path) -> float:
    viscosity, density = LISTED[liquid]
    setup, path = trial.setup, trial.path
    job = {
        "particles": trial.setup.particles,
        "particle_radius": 0.5 * setup.spacing,
        "cup_radius": setup.cup.radius,
        "cup_height": setup.cup.height,
        "stick_radius": setup.stick.radius,
        "stick_length": setup.stick.length,
        "viscosity": viscosity,
        "density": density,
        "time": np.asarray(path.time).tolist(),
        "position": np.asarray(path.position).tolist(),
    }
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "job.json"
        file.write_text(json.dumps(job))
        done = subprocess.run(
            [str(python), str(HERE / "peers" / "run_pysplishsplash.py"), str(file)],
            env={**os.environ, "OMP_NUM_THREADS": "1"},
            capture_output=True,
            text=True,
            check=True,
        )
    return float(json.loads(done.stdout)["cpu_seconds"])
