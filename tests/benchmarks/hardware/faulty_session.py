"""The session that `faults.py` disturbs, in a process of its own; flags in a directory act on it.

    python faulty_session.py DIRECTORY ADDRESS

It stirs with the arm of the controller at ADDRESS, and prints its processes' ids as JSON once that
moves.
"""

import json
import os
import sys
import time
from pathlib import Path
from typing import NamedTuple

import numpy as np
from bolfi_liquids.hardware.cameras.base import Frame
from bolfi_liquids.hardware.motion.stir_paths import PosePath, stir
from bolfi_liquids.hardware.recorder.samples import SAMPLES
from bolfi_liquids.hardware.rig import Rig
from bolfi_liquids.hardware.rig_file import bundled_rig
from bolfi_liquids.hardware.robot.orders import Follow
from bolfi_liquids.hardware.robot.ur import URController
from bolfi_liquids.hardware.session.session import Session, SessionStopped
from bolfi_liquids.hardware.session.setup import CONFIRMATION, SessionSetup, confirm, describe

IMAGE_SIZE = (160, 120)  # px
FOCAL_LENGTH = 200.0  # px; they show what larger ones do


class NoiseCamera:
    """Small pictures of noise at 30 Hz; flags in a directory stop or freeze it."""

    def __init__(self, flags: Path):
        self._flags = flags
        self._random = np.random.default_rng(0)
        self._image = np.zeros(IMAGE_SIZE[::-1], np.uint8)
        self._index = 0
        self._due = time.monotonic()

    def read(self) -> Frame | None:
        """The next picture; waits for it, for ever if it was told to stop."""
        self._due += 1.0 / 30.0
        time.sleep(max(self._due - time.monotonic(), 0.0))
        while (self._flags / "camera_stops").exists():
            time.sleep(1.0)
        if not (self._flags / "camera_freezes").exists():
            self._image = self._random.integers(0, 255, IMAGE_SIZE[::-1], dtype=np.uint8)
        self._index += 1
        now = time.monotonic()
        return Frame(self._index, now, self._image)

    def close(self) -> None:
        """Nothing to let go."""


class MakeCamera(NamedTuple):
    """Opens a `NoiseCamera` in the process that reads it."""

    flags: Path

    def __call__(self) -> NoiseCamera:
        return NoiseCamera(self.flags)


def small_rig() -> Rig:
    """The bundled rig with small pictures and short rests."""
    rig = bundled_rig()
    cameras = tuple(
        camera.model_copy(
            update={
                "width": IMAGE_SIZE[0],
                "height": IMAGE_SIZE[1],
                "focal_length": FOCAL_LENGTH,
            }
        )
        for camera in rig.cameras
    )
    stirring = rig.stirring.model_copy(update={"rest": 0.2})
    return rig.model_copy(update={"cameras": cameras, "stirring": stirring})


def run_main(directory: Path, address: str) -> None:
    """Stir until something stops it; a flag makes it send an order that no limit allows."""
    rig = small_rig()
    plan = [stir(rig, 3)]
    make = {"xz": MakeCamera(directory), "yz": MakeCamera(Path("/nonexistent"))}
    arm, recording = URController(address), directory / "recording"
    leave = confirm(describe(plan, rig, "stirring"), CONFIRMATION, address)
    setup = SessionSetup(rig, recording, arm, make, armed=True, confirmation=leave, plan=plan)
    with Session(setup) as session:
        session.pose()
        session.follow(plan[0])
        session.wait(0, timeout=0.05)
        # the faults' files lie beside the samples' for `_fill_disk`
        (directory / SAMPLES).symlink_to(recording / SAMPLES)
        pids = {child.name: child.process.pid for child in session._processes.children}
        print(json.dumps(pids | {"main": os.getpid()}), flush=True)
        try:
            while not session.wait(timeout=0.005):
                _order_nonsense(session, directory, plan[0])
        except SessionStopped as err:
            print(err, file=sys.stderr)


def _order_nonsense(session: Session, flags: Path, path: PosePath) -> None:
    pose = path.pose.copy()
    if (flags / "order_nan").exists():
        pose[3, 1] = np.nan
    elif (flags / "order_outside").exists():
        pose[:, 0] += 0.2
    else:
        return
    # as a fault in main would: past the check that `follow` makes there
    session._processes.send(Follow(path._replace(pose=pose)))


if __name__ == "__main__":
    run_main(Path(sys.argv[1]), sys.argv[2])
