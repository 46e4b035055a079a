"""A liquid that wets its cup more than the cups file says, which stirring does not show.

The films that made the paper's gel fail are in the model. What is left of the sticking is how far
the contact angle is from what is written down.
"""

import csv
import json
from collections.abc import Mapping
from hashlib import sha256
from pathlib import Path
from typing import NamedTuple

import numpy as np
from bolfi_liquids.models import Cups
from numpy.typing import NDArray
from xarray import Dataset

from bolfi_liquids import models
from bolfi_liquids.files import write_netcdf, write_whole
from bolfi_liquids.inputs.bundled import bundled_recording
from bolfi_liquids.inputs.cups import bundled_cups
from bolfi_liquids.inputs.open import open_recording
from bolfi_liquids.inputs.recording import Recording, along_path, recording_dataset
from bolfi_liquids.seeds import generator, simulation_seeds

from .calibrations import CAMERA_NOISE, CAMERA_NOISE_SD
from .phases import Phase
from .truths import LIQUIDS, LOG_VISCOSITY_SD

STICKY_LIQUID = "oil"  # thicker liquids heed the wetting less, and thinner ones spill as little
WRITTEN_ANGLE_DEG = 110.0  # contact angle in the cups file, as of wax
ADHESION_RANGE = 0.7, 1.0  # of the truths, whose contact angles are 69 to 49 deg
COHESION_RANGE = 0.6, 1.0  # 0.05 to 0.08 N/m: wetting acts by surface tension
TRAINING = [(w, d) for w in (40.0, 70.0, 110.0) for d in (0.5, 1.5, 2.5, 4.0)]
"""Pours that are seen after the stirring: deg/s, cm."""

_COLUMNS = ("angular_velocity_deg_s", "distance_cm", "spilled", "received", "retained")


class Sticky(NamedTuple):
    """A drawn truth.

    Attributes:
        theta: `viscosity` [Pa s], `cohesion` and `adhesion`.
        seed: Of what is made of it.
    """

    theta: Mapping[str, float]
    seed: int

    @property
    def liquid(self) -> dict[str, float]:
        """Its parameters without adhesion."""
        return {name: value for name, value in self.theta.items() if name != "adhesion"}


def waxed_cups() -> Cups:
    """The bundled cups with `WRITTEN_ANGLE_DEG`."""
    cups = bundled_cups()
    waxed = cups.source.model_copy(update={"contact_angle_deg": WRITTEN_ANGLE_DEG})
    return cups.model_copy(update={"source": waxed})


def draw_sticky(repetition: int, seed: int) -> Sticky:
    """The same whatever the number of repetitions."""
    rng = generator(seed, Phase.STICKY_TRUTHS, repetition)
    viscosity = LIQUIDS[STICKY_LIQUID] * np.exp(LOG_VISCOSITY_SD * rng.standard_normal())
    theta = {
        "viscosity": float(viscosity),
        "cohesion": float(rng.uniform(*COHESION_RANGE)),
        "adhesion": float(rng.uniform(*ADHESION_RANGE)),
    }
    return Sticky(theta, int(rng.integers(2**31)))


def recipe(cups: Cups, particles: int, seed: int) -> str:
    """Short hash of what determines the drawn liquid and its pours.

    Runs of another model are kept elsewhere.
    """
    made_by = [
        Phase.STICKY_TRUTHS.value,
        STICKY_LIQUID,
        LIQUIDS[STICKY_LIQUID],
        LOG_VISCOSITY_SD,
        ADHESION_RANGE,
        COHESION_RANGE,
        TRAINING,
        CAMERA_NOISE_SD,
    ]
    text = json.dumps([*made_by, cups.settings(), particles, seed], sort_keys=True)
    return sha256(text.encode()).hexdigest()[:8]


def stirred(truth: Sticky, particles: int, path: Path) -> Recording:
    """A recording of it, of so many particles, written to `path` unless it is there."""
    if not path.exists():
        dataset = _dataset(bundled_recording(STICKY_LIQUID), truth, particles)
        write_netcdf(dataset, path)
    return open_recording(path)


def poured(truth: Sticky, density: float, cups: Cups, path: Path) -> Path:
    """A table of the pours `TRAINING` of it, each made once, written to `path` unless it is
    there."""
    if not path.exists():
        rows = [_COLUMNS, *_pours(truth, density, cups)]
        write_whole(path, lambda at: _write_rows(at, rows))
    return path


def _dataset(like: Recording, truth: Sticky, particles: int) -> Dataset:
    setup = models.StirSetup.from_recording(like, particles=particles)
    liquid = models.Liquid(**truth.liquid, density=like.number("liquid_density"))
    effects = {"adhesion": truth.theta["adhesion"]}
    own = simulation_seeds(truth.seed, Phase.STICKY_STIR, 1)
    clean = models.stir(liquid, like.gripper, setup, own, effects)[0]
    noisy = CAMERA_NOISE(clean, generator(truth.seed, Phase.CAMERA_NOISE))
    attrs = {**like.attrs, "source": "simulated truth that sticks to its cup"}
    return recording_dataset(along_path(like, noisy), attrs)


def _pours(truth: Sticky, density: float, cups: Cups) -> NDArray[np.float64]:
    """Rows of the table."""
    rate, distance = np.array(TRAINING).T
    own = simulation_seeds(truth.seed, Phase.STICKY_POURS, len(TRAINING))
    made = models.pour(
        models.Liquid(**truth.liquid, density=density),
        models.PourAction(np.radians(rate), distance / 100.0),
        cups,
        own,
        effects={"adhesion": truth.theta["adhesion"]},
    )
    return np.column_stack([rate, distance, made.spilled, made.received, made.retained])


def _write_rows(path: Path, rows: list) -> None:
    with path.open("w", newline="", encoding="utf-8") as file:
        csv.writer(file).writerows(rows)
