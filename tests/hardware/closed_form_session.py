"""The raw data of a session in which everything is as closed forms say."""

import numpy as np
from bolfi_liquids.hardware.recorder.samples import Sample
from bolfi_liquids.hardware.rig_file import bundled_rig
from bolfi_liquids.hardware.vision.frame import FrameMeasurement
from bolfi_liquids.hardware.vision.stick_view import camera_model

RIG = bundled_rig()
WAY = 2.0  # s, down into the cup, and out of it
HOST = 5000.0  # host time of the robot's time 0
DRIFT = -2e-5  # by which this computer's clock runs faster than the robot's
READ_LATE = 0.001  # s, from a sample's time to when it is read
DELAY = {"xz": 0.0323, "yz": 0.0571}  # s, from a picture's exposure to its stamp
NOISE = np.radians(0.03)
MARKER_NOISE = 0.05  # px
COMPLETED = (
    {"source": "control", "kind": "began", "number": 0, "stirring": False},
    {"source": "control", "kind": "done", "number": 0},
    {"source": "control", "kind": "began", "number": 1, "stirring": True},
    {"source": "control", "kind": "done", "number": 1},
    {"source": "control", "kind": "left"},
)


def host_time(robot_time):
    """This computer's time of the robot's [s]."""
    return HOST + robot_time * (1 + DRIFT)


def pivot(robot_time, duration):
    """Position [m], shape (T, 3): down, an eight with rests at both ends, up."""
    t = np.asarray(robot_time, dtype=float)
    stirred = np.clip(t - WAY, 0.0, duration)
    share = np.sin(np.pi * stirred / duration) ** 2
    high = np.clip(np.maximum(WAY - t, t - WAY - duration) / WAY, 0.0, 1.0)
    x, y = np.sin(4.0 * stirred), np.sin(2.7 * stirred)
    return np.stack(
        [0.02 * share * x, 0.02 * share * y, RIG.stirring.height + 0.05 * high**2 * (3 - 2 * high)],
        axis=-1,
    )


def inclination(robot_time):
    """Of the stick [rad], shape (T, 2): it hangs until the gripper has begun to stir."""
    t = np.asarray(robot_time, dtype=float)
    share = np.sin(0.5 * np.pi * np.clip((t - WAY) / 2.0, 0.0, 1.0))[..., None] ** 4
    swing = np.stack([0.15 * np.sin(4.0 * t + 0.3), 0.12 * np.cos(2.7 * t)], axis=-1)
    return share * swing


def frames_of(view, until, duration, rng, rate=30.0):
    """What a perfect measurement says of one view, by projecting two points of the stick."""
    phase = {"xz": 0.0, "yz": 0.013}[view]
    times = np.arange(phase, until, 1 / rate)
    camera = camera_model(RIG.camera(view))
    top = pivot(times, duration)
    tangent = np.tan(inclination(times))
    points = [top + s * np.column_stack([tangent, -np.ones(len(times))]) for s in (0.02, 0.15)]
    (x0, y0), (x1, y1) = (camera.undistort(camera.project(p)).T for p in points)
    slope = (x1 - x0) / (y1 - y0) + NOISE * rng.standard_normal(len(times))
    marker = camera.project(top + np.array(RIG.camera(view).marker))
    marker = marker + MARKER_NOISE * rng.standard_normal(marker.shape)
    stamp = host_time(times) + DELAY[view]
    return [
        FrameMeasurement(
            k,
            float(stamp[k]),
            *marker[k].tolist(),
            angle=float(np.arctan(slope[k])),
            offset=float(x0[k] - slope[k] * y0[k]),
            angle_error=NOISE,
            offset_error=NOISE * 0.1,
            second_angle=float(np.arctan(slope[k])),
            rows=150,
            flags=0,
        )
        for k in range(len(times))
    ]


def samples_of(until, duration):
    rows = []
    for k in range(int(until * 125)):
        t = k / 125
        stirring = int(WAY <= t <= WAY + duration)
        numbers = dict.fromkeys(Sample._fields, 0.0) | {
            "speed_scaling": 1.0,
            "late": 1e-4 * (k % 5),
        }
        x, y, z = pivot(t, duration)
        numbers |= {"x": x, "y": y, "z": z, "time": t, "host": host_time(t) + READ_LATE}
        rows.append(Sample(**numbers | {"index": k, "stirring": stirring, "runtime_state": 2}))
    return rows
