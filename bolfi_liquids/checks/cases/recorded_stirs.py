"""The bundled recordings, simulated with the liquids that they were made with."""

from importlib.resources import as_file, files

import numpy as np

from ...inputs.open import open_recording
from ...inputs.recording import Recording
from ...models import Liquid, StirSetup, stir
from ...models.validation import (
    Case,
    CaseResult,
    Curve,
    Panel,
    Progress,
    Row,
)

LIQUIDS = {"glycerin": 1.0, "water": 1e-3}
"""Viscosities [Pa s] given to the solver that made the recordings."""
PARTICLES, SEEDS = 1000, 4
TOLERANCE = 0.9  # deg


def run(progress: Progress, seed: int) -> CaseResult:
    """RMS difference of the inclination, over time, planes and packings."""
    rows, panels = [], []
    for number, (name, viscosity) in enumerate(LIQUIDS.items()):
        recording = _bundled(f"{name}_v10.nc")
        liquid = Liquid(viscosity, 0.0, recording.number("liquid_density"))
        signals = repeated(recording, liquid, PARTICLES, seed * SEEDS + np.arange(SEEDS))
        recorded = np.degrees(recording.inclination)
        far = apart(signals, recorded)
        rows.append(Row.absolute(f"{name}, RMS difference [deg]", 0.0, far, TOLERANCE))
        time = recording.gripper.time
        curves = [Curve(f"{name}, recorded", time, recorded[:, 0], truth=True, series=number)]
        curves += [
            Curve("simulated" if k == 0 else "", time, trial[:, 0], series=number)
            for k, trial in enumerate(signals)
        ]
        panels.append(Panel("time [s]", "inclination in the xz plane [deg]", tuple(curves)))
        progress((number + 1) / len(LIQUIDS))
    return CaseResult(tuple(rows), tuple(panels))


def repeated(recording: Recording, liquid: Liquid, particles: int, seeds: np.ndarray) -> np.ndarray:
    """Inclinations [deg] of the recorded stir in a liquid, shape [seeds, T, 2]."""
    setup = StirSetup.from_recording(recording, particles=particles)
    return np.degrees(stir(liquid, recording.gripper, setup, seeds))


def apart(signals: np.ndarray, recorded: np.ndarray) -> float:
    """RMS difference in the signals' unit, samples that were missed left out; NaN if a simulation
    failed."""
    seen = np.isfinite(recorded)
    return float(np.sqrt(np.mean((signals - recorded)[..., seen] ** 2)))


def _bundled(name: str) -> Recording:
    with as_file(files("bolfi_liquids.data") / name) as path:
        return open_recording(path)


CASE = Case(
    name="recorded_stirs",
    title="Stirs by an independent solver",
    truth="the same inclination for the same liquid",
    source="SPlisHSPlasH 2.19, DFSPH; the bundled recordings, not measurements",
    unit="deg",
    tolerance=TOLERANCE,
    settings={"viscosity": LIQUIDS, "particles": PARTICLES, "seeds": SEEDS},
    run=run,
)
