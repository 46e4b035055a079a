"""Seconds and CPU seconds from before the imports to a short stir: a process of its own."""

import time

began, spent = time.perf_counter(), time.process_time()

import sys  # noqa: E402
from typing import NamedTuple  # noqa: E402

import numpy as np  # noqa: E402

from bolfi_liquids import models  # noqa: E402
from bolfi_liquids.inputs.open import open_recording  # noqa: E402

SAMPLES = 10


class Path(NamedTuple):
    time: np.ndarray
    position: np.ndarray


recording = open_recording(sys.argv[1])
path = Path(*(column[:SAMPLES] for column in recording.gripper))
setup = models.StirSetup.from_recording(recording)
models.stir(models.Liquid(0.1, 0.0, 1000.0), path, setup, [0])
print(time.perf_counter() - began, time.process_time() - spent)
