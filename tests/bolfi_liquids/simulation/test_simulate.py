"""Stirs and pours by numbers, from Python."""

import pickle
import warnings
from concurrent.futures import Executor, Future
from dataclasses import replace

import numpy as np
import pytest
from bolfi_liquids.models import runtime

import bolfi_liquids as bl
from bolfi_liquids import hardware, models
from bolfi_liquids.inputs.bundled import bundled_recording
from bolfi_liquids.inputs.cups import bundled_cups
from bolfi_liquids.inputs.described_liquid import DENSITY
from bolfi_liquids.inputs.recording import Trajectory

pytestmark = pytest.mark.slow  # kernels compile for ten seconds and more

SHORT = hardware.motion.star(speed=0.2, height=0.235, radius=0.02, points=5, rest=0.2)
FEW = {"particles": 120, "progress": False}
PLANES = ("inclination_xz", "inclination_yz")


@pytest.fixture(scope="module")
def pair():
    """Two liquids along a path of our own."""
    return bl.simulate_stir([0.05, 2.0], 0.3, density=1100.0, path=SHORT, seed=[4, 5], **FEW)


def test_a_stir_is_what_the_simulator_returns(pair):
    recording = bundled_recording("glycerin")
    gripper = Trajectory(SHORT.time, SHORT.position)
    planned = replace(recording, gripper=gripper)
    setup = models.StirSetup.from_recording(planned, particles=FEW["particles"])
    setup = replace(setup, tilt=(0.0, 0.0))  # nobody has seen a stir along this path
    liquid = models.Liquid(np.array([0.05, 2.0]), 0.3, 1100.0)
    expected = models.stir(liquid, SHORT, setup, [4, 5])
    for plane, name in enumerate(PLANES):
        assert pair[name].dims == ("simulation", "time")
        np.testing.assert_array_equal(pair[name], expected[..., plane])
    np.testing.assert_array_equal(pair["time"], SHORT.time)
    assert pair["viscosity"].values.tolist() == [0.05, 2.0]
    assert pair.attrs["liquid_density"] == 1100.0 and "viscosity" not in pair.attrs


class Elsewhere(Executor):
    """As if in a process of its own: what is submitted travels, and warnings stay there."""

    def submit(self, fn, /, *args, **kwargs):
        done = Future()
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            done.set_result(pickle.loads(pickle.dumps(fn))(*args, **kwargs))
        return done


def test_one_of_a_pair_is_the_same_alone_and_elsewhere(pair):
    where = {"executor": Elsewhere(), "timeout": 60.0}
    alone = bl.simulate_stir(2.0, 0.3, density=1100.0, path=SHORT, seed=5, **where, **FEW)
    assert alone.attrs["viscosity"] == 2.0
    for name in PLANES:
        assert alone[name].dims == ("time",)
        np.testing.assert_array_equal(alone[name], pair[name][1])


def test_a_stir_that_takes_too_long_is_stopped_and_costs_nothing_else(pair):
    options = {"density": 1100.0, "path": SHORT, "seed": 4, **FEW}
    with pytest.raises(RuntimeError, match="timeout: no signal after 1e-09 s"):
        bl.simulate_stir(0.05, 0.3, timeout=1e-9, **options)
    again = bl.simulate_stir(0.05, 0.3, timeout=60.0, **options)
    np.testing.assert_array_equal(again["inclination_xz"], pair["inclination_xz"][0])


def test_a_simulated_stir_is_a_recording(tmp_path):
    made = bl.simulate_stir(path=SHORT, out=tmp_path / "stir.nc", **FEW)
    read = bl.open_recording(tmp_path / "stir.nc")
    np.testing.assert_array_equal(read.inclination[:, 0], made["inclination_xz"])
    assert read.number("liquid_density") == bundled_recording("glycerin").number("liquid_density")


@pytest.mark.minutes
def test_patterns_have_names_and_a_rig_may_be_another():
    star = bl.simulate_stir(path="star", particles=100, progress=False)
    expected = hardware.motion.star(
        speed=0.1, height=bundled_recording("glycerin").gripper.position[0, 2]
    )
    np.testing.assert_array_equal(star["x"], expected.position[:, 0])
    heavy = bl.simulate_stir(path="star", rig={"stick_density": 4800.0}, particles=100)
    assert np.abs(heavy["inclination_xz"]).max() < np.abs(star["inclination_xz"]).max()


def test_a_pour_is_what_the_simulator_returns():
    action = {"angular_velocity": 2.0, "distance": 0.03}
    made = bl.simulate_pour([0.01, 1.0], 0.2, density=1100.0, seed=3, **action, **FEW)
    expected = models.pour(
        models.Liquid(np.array([0.01, 1.0]), 0.2, 1100.0),
        models.PourAction(**action),
        bundled_cups(),
        [3, 3],
        FEW["particles"],
    )
    for name in ("spilled", "received", "retained"):
        np.testing.assert_array_equal(made[name], getattr(expected, name))
    assert made["landing"].dims == ("simulation", "particle", "axis")
    alone = bl.simulate_pour(1.0, 0.2, density=1100.0, seed=3, **action, **FEW)
    assert alone["spilled"].item() == made["spilled"][1].item()


@pytest.mark.parametrize("executor", [None, Elsewhere()])
def test_what_goes_wrong_is_an_error_wherever_it_is_simulated(tmp_path, executor):
    out = tmp_path / "stir.nc"
    with pytest.raises(RuntimeError, match="failed"):
        bl.simulate_stir(1.0, 0.2, path=SHORT, out=out, executor=executor, timeout=1e-9, **FEW)
    with pytest.raises(RuntimeError, match="failed"):
        bl.simulate_pour(1.0, 0.2, out=out, executor=executor, timeout=1e-9, **FEW)
    assert not out.exists()


@pytest.mark.parametrize("simulate", [bl.simulate_stir, bl.simulate_pour])
def test_what_is_not_finite_is_an_error_though_nobody_warned(monkeypatch, simulate):
    lost = np.full((1, 99, 2), np.nan)
    monkeypatch.setattr(models, "stir", lambda *_: lost)
    monkeypatch.setattr(models, "landings", lambda *_: models.Landings(lost, lost[:, 0, 0]))
    with pytest.raises(RuntimeError, match="not finite"):
        simulate(**FEW)


def test_a_stick_that_is_weighed_anew_replaces_what_the_recording_says(dataset, tmp_path):
    density = dataset.attrs.pop("stick_density")
    radius, length = (dataset.attrs[f"stick_{size}"] for size in ("radius", "length"))
    weighed = tmp_path / "weighed.nc"
    dataset.assign_attrs(stick_mass=density * np.pi * radius**2 * length).to_netcdf(weighed)
    options = {"path": SHORT, "recording": weighed, **FEW}
    made = bl.simulate_stir(rig={"stick_density": 2.0 * density}, **options)
    assert "stick_mass" not in made.attrs and made.attrs["stick_density"] == 2.0 * density
    same = bl.simulate_stir(rig={"stick_density": density}, **options)
    assert not np.array_equal(made["inclination_xz"], same["inclination_xz"])


@pytest.mark.parametrize(
    ("given", "message"),
    [
        ({"density": [1000.0, 1200.0]}, "^density: "),
        ({"rig": {"cup_raduis": 0.02}}, "^rig: cup_raduis is no size of a rig; .*cup_radius"),
        ({"rig": {"cup_radius": -0.02}}, "rig: cup_radius"),
        (
            {"rig": {"stick_mass": 0.01, "stick_density": 4000.0}},
            "rig: stick_mass: .*stick_density or stick_mass",
        ),
        ({"viscosity": [0.1, 0.2], "seed": [1, 2, 3]}, "arrays of one length"),
        ({"viscosity": []}, "^viscosity: no simulation; give at least one value"),
        ({"seed": []}, "^seed: no simulation"),
        ({"cohesion": [[0.1, 0.2]]}, "^cohesion: an array of 2 dimensions"),
        ({"viscosity": [0.1, 0.2], "movie": "a.gif"}, "a.gif: arrays were given"),
    ],
)
def test_what_cannot_be_simulated_is_refused_first(monkeypatch, tmp_path, given, message):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(runtime, "start", lambda: pytest.fail("Taichi was started"))
    with pytest.raises(ValueError, match=message):
        bl.simulate_stir(**given)


def test_the_default_density_is_that_of_the_default_recording():
    recording = bundled_recording("glycerin")
    assert recording.number("liquid_density") == DENSITY
