"""What the script writes is a recording, with what was hidden in it."""

import make_reference_stirs
import numpy as np
import pytest
from stirring_reference import Stir, circle

from bolfi_liquids.inputs.open import open_recording

COARSE = ["--viscosity", "1", "--density", "1260", "--cell-mm", "4.2", "--step-ms", "4"]


def test_a_recording_is_written_and_can_be_simulated(tmp_path):
    asked = [str(tmp_path / "syrup.nc"), *COARSE, "--corners-cm", "0,0", "2,0", "--path-scale", "2"]
    out = make_reference_stirs.main([*asked, "--rest", "0.2", "--true-fill-cm", "5.2"])
    recording = open_recording(out)
    assert recording.number("fill") == 0.05
    np.testing.assert_allclose(np.diff(recording.time), 1 / 30)
    np.testing.assert_allclose(recording.gripper.position[-1], [0.02, 0.0, 0.235], atol=1e-9)
    lag = np.degrees(-recording.inclination[:, 0].min())
    assert 1.0 < lag < 10.0
    assert 0.02 < np.degrees(recording.inclination[:5].std()) < 0.3


def test_a_late_camera_shows_the_stick_as_it_was():
    path = circle(0.02, 0.1, turns=1)
    time = np.linspace(0.0, path.duration, 500)
    angles = np.column_stack([np.sin(3.0 * time), np.cos(3.0 * time)])
    stir = Stir(time, np.zeros((500, 3)), angles)
    values = make_reference_stirs.recorded(stir, path, 0.2, delay=0.1)
    late = values["time"] > 0.1
    seen = values["inclination_xz"][late]
    np.testing.assert_allclose(seen, np.sin(3.0 * (values["time"][late] - 0.1)), atol=1e-6)
    assert (values["z"] == 0.2).all()


def test_a_scaled_path_is_scaled_in_all_its_derivatives():
    path = circle(0.02, 0.1)
    for one, other in zip(
        path.motion(0.8), make_reference_stirs.scaled(path, 0.5).motion(0.8), strict=True
    ):
        assert other == pytest.approx(0.5 * one)
