from importlib.resources import files

import numpy as np
import pytest

from bolfi_liquids import hardware, open_recording


def test_star_is_the_path_that_another_lab_s_solver_recorded():
    recording = open_recording(files("bolfi_liquids.data") / "glycerin_v10.nc")
    path = hardware.motion.star(speed=0.1, height=0.235)
    recorded = recording.gripper
    replayed = np.stack(
        [np.interp(recorded.time, path.time, path.position[:, axis]) for axis in range(2)], axis=1
    )
    apart = np.linalg.norm(replayed - recorded.position[:, :2], axis=1)
    assert np.sqrt(np.mean(apart**2)) < 1e-3
    assert path.time[-1] == pytest.approx(recorded.time[-1], abs=0.1)


@pytest.mark.parametrize("speed", [0.05, 0.1, 0.5])
def test_speed_and_acceleration_stay_within_their_limits(speed):
    path = hardware.motion.star(speed=speed, height=0.2, acceleration=1.5, rate=1000.0)
    velocity = np.diff(path.position, axis=0) * 1000.0
    assert np.linalg.norm(velocity, axis=1).max() < speed * (1 + 1e-6)
    assert np.linalg.norm(np.diff(velocity, axis=0), axis=1).max() * 1000.0 < 1.5 * 2**0.5 * 1.01


def test_star_closes_and_visits_every_vertex():
    path = hardware.motion.star(speed=0.1, height=0.2, points=7, rate=2000.0)
    radius = np.hypot(*path.position[:, :2].T)
    at_vertex = path.position[radius > 0.025 - 1e-6, :2]
    angles = np.degrees(np.arctan2(*at_vertex.T[::-1])) % 360.0
    assert len(np.unique(np.round(angles * 7 / 360.0) % 7)) == 7
    assert path.position[-1] == pytest.approx([0.025, 0.0, 0.2], abs=1e-9)


@pytest.mark.parametrize(
    ("argument", "value"), [("speed", 0.0), ("radius", float("nan")), ("points", 8)]
)
def test_bad_arguments_are_named(argument, value):
    with pytest.raises(ValueError, match=f"{argument}.*{value}"):
        hardware.motion.star(**{"speed": 0.1, "height": 0.2, argument: value})
