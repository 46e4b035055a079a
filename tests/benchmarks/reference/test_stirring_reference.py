"""The Navier-Stokes reference against exact solutions, published drag, symmetry and a recording."""

import csv
from pathlib import Path

import numpy as np
import pytest
from scipy.interpolate import CubicSpline
from stirring_reference import (
    CylinderScene,
    GripperPath,
    Liquid,
    Motion,
    Resolution,
    StirScene,
    circle,
    force_on_cylinder,
    polygon,
    reference_stir,
    star,
)
from stirring_reference import stir as stir_module
from truths.cylinder_drag import DENNIS_CHANG
from truths.oscillating_rod import stokes_reaction_in_cup

from bolfi_liquids.inputs.open import open_recording

RECORDINGS = Path(__file__).parents[2] / "data" / "stirring_reference"
RADIUS, CUP_RADIUS = 0.0045, 0.04
AHEAD = np.array([1.0, 0.0, 0.0])
COARSE = Resolution(cell=4.2e-3, step=2e-3)


def shaken(cycles, offset, angular_frequency, amplitude):
    """Along x, from the end of a cycle, around a point off the grid's middle."""

    def motion(time):
        sine, cosine = np.sin(angular_frequency * time), np.cos(angular_frequency * time)
        return Motion(
            np.array([*offset, 0.0]) - amplitude * cosine * AHEAD,
            amplitude * angular_frequency * sine * AHEAD,
            amplitude * angular_frequency**2 * cosine * AHEAD,
        )

    return GripperPath(motion, cycles * 2.0 * np.pi / angular_frequency)


def reaction_errors(liquid, resolution, cycles, offset=(0.25, 0.1)):
    """Relative errors of damping and added mass of a cylinder shaken in a cup at 1.4 Hz.

    Offsets to the grid in cells.
    """
    omega, amplitude = 2.0 * np.pi * 1.4, 1e-4
    cell = resolution.cell
    path = shaken(cycles, (offset[0] * cell, offset[1] * cell), omega, amplitude)
    tank = 2.0 * CUP_RADIUS + 4.0 * cell
    scene = CylinderScene(RADIUS, (tank, tank), CUP_RADIUS)
    found = force_on_cylinder(scene, liquid, path, resolution)
    last = found.time >= (cycles - 1.0) * 2.0 * np.pi / omega
    phase = omega * found.time[last]
    waves = np.column_stack([np.cos(phase), np.sin(phase), np.ones_like(phase)])
    fit = np.linalg.lstsq(waves, found.force[last, 0], rcond=None)[0]
    displaced = liquid.density * np.pi * RADIUS**2 * amplitude * omega**2
    exact = stokes_reaction_in_cup(RADIUS, CUP_RADIUS, omega, liquid.viscosity / liquid.density)
    return (
        -fit[1] / displaced / exact.damping - 1.0,
        -fit[0] / displaced / exact.added_mass - 1.0,
    )


@pytest.mark.parametrize(
    ("liquid", "cycles", "damping", "added_mass"),
    [(Liquid(1.0, 1260.0), 1.2, 0.03, 0.05), (Liquid(0.1, 1000.0), 1.5, 0.02, 0.08)],
    ids=["glycerin", "oil"],
)
def test_a_shaken_cylinder_feels_the_exact_unsteady_stokes_flow(
    liquid, cycles, damping, added_mass
):
    errors = reaction_errors(liquid, Resolution(2.1e-3, 2e-3), cycles)
    assert np.abs(errors[0]) < damping
    assert np.abs(errors[1]) < added_mass


def test_points_on_the_surface_itself_would_act_as_a_thicker_cylinder():
    """The fault that `drawn_in` mends: the tolerances above tell it."""
    damping, _ = reaction_errors(Liquid(1.0, 1260.0), Resolution(2.1e-3, 2e-3, drawn_in=0.0), 1.2)
    assert damping > 0.1


@pytest.mark.slow
def test_smaller_cells_come_nearer_to_the_exact_flow():
    offsets = [(0.0, 0.0), (0.25, 0.1), (0.5, 0.3)]
    liquid, resolution = Liquid(1.0, 1260.0), Resolution(1.5e-3, 1e-3)
    errors = np.mean([reaction_errors(liquid, resolution, 1.2, o) for o in offsets], axis=0)
    assert (np.abs(errors) < 0.02).all()


def drag(reynolds, resolution):
    """Mean drag coefficient from 11.5 to 12.5 diameters of the way, in a tank of 44 by 27."""
    diameter, speed, density = 2.0 * RADIUS, 0.1, 1000.0
    liquid = Liquid(density * speed * diameter / reynolds, density)
    ends = 6.5 * diameter * np.array([[-1.0, 0.0], [1.0, 0.0]])
    path = polygon(ends, speed, acceleration=2.0, lead=0.0, tail=0.0)
    found = force_on_cylinder(CylinderScene(RADIUS, (0.24, 0.4)), liquid, path, resolution)
    late = np.abs(found.time * speed / diameter - 12.0) < 0.5
    return -found.force[late, 0].mean() / (0.5 * density * speed**2 * diameter)


@pytest.mark.parametrize("reynolds", [pytest.param(20.0, marks=pytest.mark.slow), 40.0])
def test_a_towed_cylinder_has_the_published_drag(reynolds):
    """Within 5 %, of which the tank's sides, 44 diameters apart, take some 2 %."""
    coefficient = drag(reynolds, Resolution(2.1e-3, 4e-3))
    assert coefficient == pytest.approx(DENNIS_CHANG[reynolds], rel=0.05)


def test_a_stick_that_hangs_in_liquid_at_rest_stays():
    path = GripperPath(lambda time: Motion(*np.zeros((3, 3))), 0.02)
    stir = reference_stir(StirScene(), Liquid(0.1, 900.0), path, COARSE)
    assert stir.time.shape == (11,) and stir.pivot.shape == (11, 3)
    np.testing.assert_allclose(stir.pivot, np.tile([0, 0, 0.235], (11, 1)))
    np.testing.assert_allclose(stir.inclination, 0.0, atol=1e-12)


def test_a_mirrored_path_stirs_the_mirror_image():
    scene, liquid = StirScene(tilt=(0.01, 0.02)), Liquid(0.1, 900.0)
    mirrored = StirScene(tilt=(0.01, -0.02))
    corners = np.array([[0.0, 0.0], [0.01, 0.02]])
    one, other = (
        reference_stir(s, liquid, polygon(way, 0.1, lead=0.0), COARSE, seconds=0.15)
        for s, way in ((scene, corners), (mirrored, corners * [1, -1]))
    )
    assert np.degrees(np.abs(one.inclination[-1])).min() > 0.5
    np.testing.assert_allclose(one.inclination, other.inclination * [1, -1], atol=1e-9)


def farthest_reach(scene):
    """Of the stick's surface from the cup's axis [m]; the fractions that were told of progress.

    A gripper that stops near the wall swings a steel stick into it.
    """
    path = polygon([[0.0, 0.0], [0.034, 0.0]], 0.3, acceleration=3.0, lead=0.0)
    liquid, resolution, told = Liquid(0.001, 1000.0), Resolution(COARSE.cell, 4e-3), []
    stir = reference_stir(scene, liquid, path, resolution, seconds=0.5, progress=told.append)
    slope = np.tan(stir.inclination)
    down = scene.stick_length / np.sqrt(1.0 + (slope**2).sum(1))
    end = stir.pivot[:, :2] + slope * down[:, None]
    return np.linalg.norm(end, axis=1).max() + scene.stick_radius, told


def test_the_sticks_end_stops_at_the_wall(monkeypatch):
    steel = StirScene(stick_density=7800.0)
    reach, told = farthest_reach(steel)
    assert reach == pytest.approx(steel.cup_radius, abs=1e-5)
    assert told == pytest.approx(np.arange(1, 126) / 125)
    monkeypatch.setattr(stir_module, "stopped_at_wall", lambda stick, *_: stick)
    reach, _ = farthest_reach(steel)
    assert reach > steel.cup_radius + 1e-3


def test_what_is_hidden_shows():
    """Warming liquid lets the stick lag less, a heavier stick and dry friction change its lag."""
    path = polygon([[0.0, 0.0], [0.02, 0.0]], 0.1, lead=0.0, tail=0.0)
    liquid, resolution = Liquid(1.0, 1260.0), Resolution(COARSE.cell, 4e-3)
    usual = reference_stir(StirScene(), liquid, path, resolution).inclination[:, 0]
    lag = np.abs(usual).max()
    for scene, other in (
        (StirScene(), Liquid(1.0, 1260.0, warming=4.0)),
        (StirScene(extra_mass=0.2), liquid),
        (StirScene(dry_friction=1e-3), liquid),
    ):
        changed = reference_stir(scene, other, path, resolution).inclination[:, 0]
        assert np.abs(changed - usual).max() > 0.01 * lag


@pytest.mark.parametrize(
    ("wrong", "message"),
    [
        (lambda: Liquid(-1.0, 1000.0), "viscosity must be positive"),
        (lambda: StirScene(fill=0.01), "dip in"),
        (lambda: StirScene(stick_radius=0.05), "stick_radius"),
        (lambda: StirScene(dry_friction=-1.0), "dry_friction"),
        (lambda: StirScene(extra_mass=-1.0), "extra_mass"),
        (lambda: Resolution(1e-3, 0.0), "step must be positive"),
        (lambda: Resolution(1e-3, 1e-3, sweeps=0), "sweeps"),
    ],
)
def test_wrong_numbers_are_refused(wrong, message):
    with pytest.raises(ValueError, match=message):
        wrong()


def test_scenes_that_cannot_be_solved_are_refused():
    path = star(0.025, 0.1)
    with pytest.raises(ValueError, match="not resolved by cells"):
        reference_stir(StirScene(stick_radius=1e-3), Liquid(1.0, 1e3), path, COARSE)
    with pytest.raises(ValueError, match="heavier stick"):
        reference_stir(StirScene(stick_density=300.0), Liquid(1.0, 1e3), path, COARSE)
    with pytest.raises(ValueError, match="does not fit a tank"):
        force_on_cylinder(CylinderScene(0.01, (0.05, 0.1), 0.04), Liquid(1.0, 1e3), path, COARSE)


@pytest.mark.filterwarnings("ignore::RuntimeWarning")
def test_a_step_that_is_too_long_is_told():
    path = circle(0.02, 2.0, turns=20, ramp=0.1, lead=0.0)
    with pytest.raises(FloatingPointError, match="shorter than"):
        reference_stir(StirScene(), Liquid(1e-4, 1000.0), path, Resolution(4.2e-3, 0.02))


def test_each_recording_has_its_truth_and_can_be_read():
    rows = list(csv.DictReader((RECORDINGS / "truths.csv").read_text().splitlines()))
    names = {path.name for path in RECORDINGS.glob("*.nc")}
    assert {row["file"] for row in rows} == names
    for row in rows:
        recording = open_recording(RECORDINGS / row["file"])
        assert abs(recording.number("fill") - float(row["true_fill_m"])) < 1e-3


@pytest.mark.minutes
def test_the_first_seconds_of_a_recording_are_repeated_in_coarse_cells():
    """Camera noise is 0.1 degrees, coarse cells add their error; the signal is 3 degrees."""
    recording = open_recording(RECORDINGS / "glycerin_v10.nc")
    time = recording.time[recording.time <= 3.0]
    x, y = recording.inclination[:4].mean(0)
    scene = StirScene(fill=0.05012, tilt=(float(x), float(y)))
    liquid = Liquid(1.0, recording.number("liquid_density"))
    stir = reference_stir(scene, liquid, star(0.025, 0.1), Resolution(3e-3, 2e-3), seconds=3.0)
    ours = CubicSpline(stir.time, stir.inclination)(time)
    gap = np.degrees(ours - recording.inclination[: len(time)])
    assert np.sqrt((gap**2).mean()) < 0.18
