"""Time that one frame of one view takes to be measured, on one core, beside its bar.

    python tests/benchmarks/hardware/line_estimation.py --frames 400

Rendered pictures of 640x480 with noise, blur, occlusion and glare, in the order in which a camera
would give them, so that the measurement follows the stick as it does on the rig.
"""

import argparse
import sys
import time
from pathlib import Path

import cv2
import numpy as np
from bolfi_liquids.hardware.rendering import Look, WorldState, prepare
from bolfi_liquids.hardware.vision import Frame, FrameMeter

sys.path.append(str(Path(__file__).parents[2] / "hardware"))
from rendered_faults import fault_of, render_with  # noqa: E402
from rendered_scenes import rehearsal_camera, rehearsal_scene, stick_view  # noqa: E402

BAR = 5.0  # ms, for 95 % of the frames
LOOK = Look()
FAULTS = 0.1  # share of the frames with an occlusion or glare
RATE = 30.0  # Hz
WARM = 20  # frames that are not timed
SWING, TILT = 0.8, np.radians(20.0)  # Hz and amplitude of a stick in motion
REACH, HEIGHT = 0.025, 0.235  # m, of the pivot


def pictures(view: str, count: int) -> list[Frame]:
    """What the camera of a view sees of a stick that swings while its pivot goes in a circle."""
    scene, camera, rng = rehearsal_scene(view), rehearsal_camera(view), np.random.default_rng(0)
    stage = prepare(scene, camera, LOOK, 0)
    frames = []
    for at in range(count):
        turn = 2 * np.pi * SWING * at / RATE
        pivot = np.array([REACH * np.cos(0.3 * turn), REACH * np.sin(0.3 * turn), HEIGHT])
        fault = fault_of(at, FAULTS, stage, 0)
        state = WorldState(at / RATE, pivot, TILT * np.array([np.sin(turn), np.cos(turn)]))
        frames.append(Frame(at, at / RATE, render_with(fault, stage, [state] * 3, rng)))
    return frames


def spent(view: str, count: int) -> np.ndarray:
    """Processor time of each frame [ms]."""
    frames = pictures(view, WARM + count)
    meter = FrameMeter(stick_view(rehearsal_scene(view), rehearsal_camera(view), LOOK))
    times = []
    for frame in frames:
        start = time.process_time()
        meter.measure(frame)
        times.append(1e3 * (time.process_time() - start))
    return np.array(times[WARM:])


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--frames", type=int, default=400)
    count = parser.parse_args().frames
    cv2.setNumThreads(1)
    print(f"{'view':4} {'mean':>6} {'median':>6} {'95 %':>6} {'most':>6}  ms")
    slow = []
    for view in ("xz", "yz"):
        times = spent(view, count)
        most = np.percentile(times, [50, 95, 100])
        slow.append(most[1])
        print(f"{view:4} {times.mean():6.2f} " + " ".join(f"{one:6.2f}" for one in most))
    return int(max(slow) > BAR)


if __name__ == "__main__":
    sys.exit(main())
