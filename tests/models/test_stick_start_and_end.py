"""How a stick starts and where it ends: cameras that are tilted, the floor, the pivot."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from bolfi_liquids import models

CLEARANCE, DEPTH = 0.015, 0.02  # m, of the stick's end above the floor, by which it is lowered
LENGTH = 0.22  # m


@pytest.fixture
def lowered(glycerin):
    """A setup, and a pivot that is lowered at 5 cm/s until the stick must lean."""
    time = np.arange(0.0, 1.5, 1.0 / 30.0)
    height = CLEARANCE + LENGTH - np.clip(0.05 * (time - 0.3), 0.0, DEPTH)
    path = np.stack([np.zeros_like(time), np.zeros_like(time), height], axis=1)
    return models.StirSetup.from_recording(glycerin), SimpleNamespace(time=time, position=path)


@pytest.mark.parametrize("tilt", [0.0, 0.5])
def test_a_stick_that_is_lowered_onto_the_floor_leans_as_far_as_it_must(lowered, tilt):
    """cos θ = height / length, in liquids of any viscosity."""
    setup, path = lowered
    setup = replace(setup, tilt=(np.radians(tilt), 0.0))
    angles = models.stir(models.Liquid([1e-3, 0.1, 1.0], 0.0, 1000.0), path, setup, [0, 1, 2])
    lean = np.degrees(np.arctan(np.hypot(*np.tan(np.moveaxis(angles, 2, 0)))))
    expected = np.degrees(np.arccos(1.0 - (DEPTH - CLEARANCE) / LENGTH))
    assert np.all(lean.max(axis=1) < expected + 1.0)
    np.testing.assert_allclose(lean[:, -1], expected, atol=0.5)


def test_tilted_cameras_are_no_lean_of_the_stick(reference):
    """A recording of tilted cameras, repeated with the effect, is the one of upright cameras."""
    whole, truth = reference("glycerin_v10")
    first = whole.gripper.time < 2.5  # s; it stirs from the second one on
    gripper = SimpleNamespace(
        time=whole.gripper.time[first], position=whole.gripper.position[first]
    )
    tilt = np.radians(2.0)
    recording, tilted = (
        SimpleNamespace(
            attrs=whole.attrs, gripper=gripper, inclination=whole.inclination[first] + [off, 0.0]
        )
        for off in (0.0, tilt)
    )
    liquid = models.Liquid(truth["viscosity"], 0.0, recording.attrs["liquid_density"])

    def stirred(seen, effects=None):
        setup = models.StirSetup.from_recording(seen)
        return models.stir(liquid, seen.gripper, setup, [0], effects)[0]

    expected = stirred(recording) + [tilt, 0.0]
    assert np.ptp(expected[:, 0]) > tilt
    np.testing.assert_allclose(stirred(tilted, {"camera_tilt": tilt}), expected, atol=1e-6)


def test_a_stick_whose_pivot_is_in_the_liquid_is_refused(glycerin):
    setup = models.StirSetup.from_recording(glycerin)
    with pytest.raises(ValueError, match="submerged must be at most the stick's length"):
        replace(setup, stick=replace(setup.stick, length=0.02))
