"""Stirs of the recorded liquids against their recordings, with nothing fitted."""

from collections.abc import Iterator
from pathlib import Path

import numpy as np
from bolfi_liquids.models.validation.cases.seed_noise import spread

from bolfi_liquids import open_recording
from bolfi_liquids.checks.cases.recorded_stirs import apart, repeated

from .line import Line
from .liquids import LISTED, listed

PARTICLES = (1000, 4000)
SEEDS = 4
FAR = {"water": 0.75}  # deg RMS from the recording
FAR_OTHERS = 0.45
NOISE = {"water": 0.3, "oil": 0.2, "glycerin": 0.2}  # deg between seeds, at the fewest particles
DRIFT = 0.25  # deg RMS between means, by number of particles


def stirs(folder: Path) -> Iterator[Line]:
    """Of every recording LIQUID_*.nc in a folder."""
    for file in sorted(folder.glob("*.nc")):
        liquid = file.name.split("_")[0]
        if liquid in LISTED:
            yield from _recording(file, liquid)


def _recording(file: Path, liquid: str) -> Iterator[Line]:
    recording, means = open_recording(file), []
    recorded = np.degrees(recording.inclination)
    for particles in PARTICLES:
        signals = repeated(recording, listed(liquid), particles, np.arange(SEEDS))
        name = f"{file.stem}, N = {particles}"
        far = apart(signals, recorded)
        yield Line(f"{name}, RMS to the recording [deg]", far, FAR.get(liquid, FAR_OTHERS))
        bar = NOISE.get(liquid) if particles == PARTICLES[0] else None
        yield Line(f"{name}, between seeds [deg]", spread(signals), bar)
        means.append(signals.mean(axis=0))
    coarse, fine = means
    what = f"{file.stem}, N = {PARTICLES[0]} against {PARTICLES[1]}, means [deg]"
    yield Line(what, apart(coarse, fine), DRIFT)
