"""The same kernels on a GPU. Not run: the tasks that wrote it had no GPU."""

import json
import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

REFERENCE = Path(__file__).parents[1] / "data/stirring_reference"
STIR = """
import json, sys
import taichi as ti
from bolfi_liquids import models
from bolfi_liquids.inputs.open import open_recording
from bolfi_liquids.models import runtime

recording = open_recording(sys.argv[1]).first(40)
setup = models.StirSetup.from_recording(recording)
runtime.start()
liquid = models.Liquid([0.1, 1.0], 0.0, 1000.0)
angles = models.stir(liquid, recording.gripper, setup, [0, 1])
print(json.dumps({"arch": str(ti.cfg.arch), "angles": angles.tolist()}))
"""


def stirred(arch):
    """The architecture that Taichi took, and angles [rad], shape [2, T, 2]."""
    command = [sys.executable, "-c", STIR, str(REFERENCE / "oil_v10.nc")]
    environment = os.environ | {"TI_ARCH": arch}
    done = subprocess.run(command, env=environment, capture_output=True, text=True, check=True)
    found = json.loads(done.stdout.splitlines()[-1])
    return found["arch"], np.array(found["angles"])


@pytest.mark.gpu
def test_a_stir_on_a_gpu_is_that_of_the_processor():
    arch, angles = stirred("cuda")
    if "cuda" not in arch:
        pytest.skip(f"Taichi found no CUDA device and took {arch}")
    _, expected = stirred("x64")
    # sums of another order; as much as seeds differ by
    assert np.degrees(np.abs(angles - expected).max()) < 0.05
