"""How a stick starts and where it ends: cameras that are tilted, friction, the floor, the pivot."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from bolfi_liquids.models.stir_setup import start_tilt

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


FIRST, REST = np.radians([0.5, 0.1]), np.radians([0.9, -0.2])
LEAN = np.arctan(np.hypot(*np.tan(REST)))


@pytest.mark.parametrize(
    ("borne", "offset", "expected"),
    [
        (0.0, (0.0, 0.0), FIRST),
        (0.5, (0.0, 0.0), (FIRST + REST) / 2),
        (1.0, (0.0, 0.0), REST),
        (3.0, (0.0, 0.0), REST),
        (0.0, np.radians([0.9, -0.2]), FIRST - REST),
        (1e-6, np.radians([0.9, -0.2]), (0.0, 0.0)),  # cameras show a stick that hangs
    ],
)
def test_rest_tells_the_start_of_a_stick_that_friction_holds(borne, offset, expected):
    """In air, by the share of its weight's torque, mass g length sin(lean) / 2, that is borne."""
    stick = models.Stick(0.0045, LENGTH, 0.0168)
    cup = models.Cup(0.04, 0.075, 0.05)
    setup = models.StirSetup(cup, stick, 0.035, tilt=tuple(FIRST), rest=tuple(REST))
    friction = borne * stick.mass * 9.81 * LENGTH / 2 * np.sin(LEAN)
    path = np.array([[[0.0, 0.0, cup.fill + LENGTH]]])  # its tip is above the liquid
    rig = models.Rig(np.array([stick.mass]), np.array([friction]), np.array([cup.fill]), path)
    found = start_tilt(setup, rig, np.array([1000.0]), np.array([offset]))[0]
    np.testing.assert_allclose(found, expected, rtol=1e-12, atol=1e-12)
    if borne == 0.0:
        assert (found == FIRST - offset).all()


def test_a_stick_afloat_is_held_where_archimedes_puts_it(glycerin):
    """By any friction: there its weight and its lift are in balance."""
    setup = models.StirSetup.from_recording(glycerin)
    stick = replace(setup.stick, mass=0.2 * setup.stick.mass)
    density, above = 1260.0, LENGTH - setup.submerged
    # of a rod that is wet from `dry` on: density area (length² - dry²) = mass length
    dry = np.sqrt(LENGTH**2 - stick.mass * LENGTH / (density * np.pi * stick.radius**2))
    afloat = np.arccos(above / dry)
    setup = replace(setup, stick=stick, tilt=(afloat - 0.01, 0.0), rest=(afloat, 0.0))
    path = np.array([[[0.0, 0.0, setup.cup.fill + above]]])
    rig = models.Rig(np.array([stick.mass]), np.array([1e-6]), np.array([setup.cup.fill]), path)
    found = start_tilt(setup, rig, np.array([density]), np.zeros((1, 2)))
    np.testing.assert_allclose(found, [[afloat, 0.0]], atol=1e-12)


@pytest.mark.parametrize(
    ("name", "friction"), [("hidden_oil_pivot_v10", 3e-4), ("oil_v10_rest", 0.0)]
)
def test_a_stick_with_dry_friction_rests_where_it_was_seen(reference, name, friction):
    """Less is missed of the rest than by the first samples; without friction these alone count."""
    whole, truth = reference(name)
    rest = whole.gripper.time < 2.0  # s
    gripper = SimpleNamespace(time=whole.gripper.time[rest], position=whole.gripper.position[rest])
    liquid = models.Liquid(truth["viscosity"], 0.0, whole.attrs["liquid_density"])
    setup = models.StirSetup.from_recording(whole)
    assert setup.rest == pytest.approx(whole.inclination[rest].mean(axis=0), abs=2e-4)

    def missed(setup):
        seen = models.stir(liquid, gripper, setup, [0], {"pivot_friction": friction})[0]
        off = np.degrees(seen - whole.inclination[rest])
        return np.sqrt(max(np.mean(off**2) - 0.1**2, 0.0))  # without the cameras' noise

    by_first = missed(replace(setup, rest=None))
    assert missed(setup) < 0.5 * by_first if friction else missed(setup) == by_first


def test_a_stick_whose_pivot_is_in_the_liquid_is_refused(glycerin):
    setup = models.StirSetup.from_recording(glycerin)
    with pytest.raises(ValueError, match="submerged must be at most the stick's length"):
        replace(setup, stick=replace(setup.stick, length=0.02))
