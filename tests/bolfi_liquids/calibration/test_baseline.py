"""What clean recordings show of the simulator's error is learned once, and taken from its file."""

import json
import math
import re
import shlex
import shutil

import numpy as np
import numpyro.distributions as dist
import pytest
import xarray as xr
from bolfi_liquids.inference import Prior, SimulationBank
from bolfi_liquids.inference.simulations import Compute
from typer.testing import CliRunner

import bolfi_liquids as bl
from bolfi_liquids.calibration.baseline import open_clean, parts_of, prior_warnings, recording_of
from bolfi_liquids.calibration.model_error import CLEAN_RUNS, Clean, clean_residuals
from bolfi_liquids.cli.app import app
from bolfi_liquids.criticism.inputs import open_inputs
from bolfi_liquids.guide import read_page
from bolfi_liquids.inputs.prior import default_prior
from bolfi_liquids.inputs.settings import CriticismSettings
from bolfi_liquids.run.results import read_result, write_result
from bolfi_liquids.wording import degrees

PARTICLES = 200  # as the run of `calibration`


@pytest.fixture(scope="module")
def clean(short_recording, tmp_path_factory):
    """Two recordings of one rig, which simulate in a fraction of a second."""
    folder = tmp_path_factory.mktemp("clean")
    whole = xr.load_dataset(short_recording, decode_times=False)
    for at, name in enumerate(("a.nc", "b.nc")):
        noise = 1e-3 * np.random.default_rng(at).normal(size=whole.sizes["time"])
        whole.assign(inclination_xz=whole["inclination_xz"] + noise).to_netcdf(folder / name)
    return [folder / "a.nc", folder / "b.nc"]


@pytest.fixture(scope="module")
def baseline(clean, tmp_path_factory):
    out = tmp_path_factory.mktemp("rig") / "rig_error.nc"
    return bl.learn_baseline(clean, out=out, particles=PARTICLES, progress=False)


def bank_of(baseline):
    with SimulationBank(baseline.path.with_suffix(".sqlite")) as bank:
        return len(bank)


def test_a_baseline_holds_recordings_and_residuals_to_the_bit(clean, baseline):
    held = bl.Baseline.open(baseline.path)
    assert held.made_from == baseline.made_from and held.hash == baseline.hash
    assert {one.recording.hash for one in held.clean} == set(held.made_from["recordings"])
    for path, made, read in zip(clean, baseline.clean, held.clean, strict=True):
        recording = bl.open_recording(path)
        assert read.recording.hash == recording.hash and read.recording.path.name == path.name
        assert dict(read.recording.attrs) == dict(recording.attrs)
        np.testing.assert_array_equal(read.recording.inclination, recording.inclination)
        np.testing.assert_array_equal(read.recording.gripper.position, recording.gripper.position)
        np.testing.assert_array_equal(read.residual, made.residual)
        assert read.viscosity == made.viscosity
        assert (made.simulations, read.simulations) == (CLEAN_RUNS, 0)


def test_what_was_simulated_for_a_baseline_is_not_simulated_again(clean, tmp_path):
    out, how = tmp_path / "rig.nc", {"particles": PARTICLES, "progress": False}
    first = bl.learn_baseline(clean[0], out=out, **how)
    assert bank_of(first) == CLEAN_RUNS
    written = out.stat().st_mtime_ns
    bl.learn_baseline(clean[0], out=out, **how)
    assert out.stat().st_mtime_ns == written
    both = bl.learn_baseline(clean, out=out, **how)
    assert bank_of(both) == 2 * CLEAN_RUNS
    np.testing.assert_array_equal(both.clean[0].residual, first.clean[0].residual)


def test_the_command_tells_the_error_of_each_recording(clean, baseline):
    typed = ["baseline", *map(str, clean), "--out", str(baseline.path), "--particles"]
    result = CliRunner().invoke(app, [*typed, str(PARTICLES)])
    assert result.exit_code == 0
    for one in baseline.clean:
        assert one.recording.path.name in result.stdout
        assert degrees(math.degrees(one.error)) in result.stdout
    assert str(baseline.path) in result.stdout.replace("\n", "")


def test_clean_recordings_are_known_from_a_baseline_or_learned(calibration, clean, baseline):
    """The same error either way, each recording once, and without those that are used."""
    given = open_clean([clean[0], baseline.path])
    inputs = open_inputs(calibration, CriticismSettings(), [], given)
    assert all(isinstance(one, Clean) for one in inputs.clean) and len(inputs.clean) == 2
    assert inputs.made_from["baseline"] == {given[0].hash: "a.nc", baseline.hash: "rig_error.nc"}
    compute = Compute(batch=CriticismSettings.batch)
    (learned,) = clean_residuals([given[0]], PARTICLES, calibration.prior, compute, lambda *_: None)
    np.testing.assert_array_equal(learned.residual, baseline.clean[0].residual)
    held_out = [bl.open_recording(clean[1])]
    inputs = open_inputs(calibration, CriticismSettings(), held_out, given[1:])
    assert [recording_of(one).path.name for one in inputs.clean] == ["a.nc"]
    assert inputs.left_out == ("b.nc",)


def test_the_guide_names_every_variable(baseline):
    listed = read_page("files").split("\n## A baseline\n", 1)[1].split("\n## ", 1)[0]
    group = read_result(baseline.path)["clean_1"].to_dataset()
    for name in ("@made_from", "clean_1@file", "clean_1@sha256"):
        assert f"`{name}`" in listed
    for name, variable in group.variables.items():
        dims = f" ({', '.join(variable.dims)})" if variable.dims else ""
        unit = f" [{variable.attrs['units']}]" if "units" in variable.attrs else ""
        told = rf"^- `clean_1/(?:\{{.*)?{name}(?:.*\}})?`{re.escape(dims + unit)}: "
        assert re.search(told, listed, re.M), name


def changed(baseline, path, **fields):
    """A copy of the file that says otherwise of what it was made from."""
    tree = read_result(baseline.path)
    tree.attrs["made_from"] = json.dumps({**baseline.made_from, **fields})
    write_result(tree, path)
    return path


def test_a_baseline_that_does_not_fit_is_refused_by_its_file(
    calibration, baseline, clean, tmp_path
):
    damaged = tmp_path / "damaged.nc"
    damaged.write_bytes(b"x" + baseline.path.read_bytes()[1:])
    others = {"model": "0", "engine": "0", "settings": {}}
    other = [changed(baseline, tmp_path / f"{name}.nc", **{name: others[name]}) for name in others]
    for path in (damaged, calibration.path / "posterior.nc", *other):
        with pytest.raises(bl.InputError) as refused:
            open_clean([clean[0], path])
        assert str(path) in refused.value.where
    settings = {**baseline.made_from["settings"], "particles": 0}
    finer = bl.Baseline.open(changed(baseline, tmp_path / "finer.nc", settings=settings))
    for call in (
        lambda: parts_of([finer], [], PARTICLES),
        lambda: bl.calibrate(
            clean[0], baseline=finer, particles=PARTICLES, out=tmp_path / "r", progress=False
        ),
    ):
        with pytest.raises(bl.InputError) as refused:
            call()
        assert "finer.nc" in refused.value.where


def test_a_recording_within_a_baseline_is_refused_by_both_files(
    calibration, baseline, clean, tmp_path
):
    wide = read_result(baseline.path)
    wide["clean_2"].attrs["cup_radius"] = 0.05
    write_result(wide, tmp_path / "wide.nc")
    given = open_clean(tmp_path / "wide.nc")
    for call in (
        lambda: bl.calibrate(
            clean[0], baseline=given, particles=PARTICLES, out=tmp_path / "r", progress=False
        ),
        lambda: open_inputs(calibration, CriticismSettings(), [], given),
    ):
        with pytest.raises(bl.InputError, match="cup_radius") as refused:
            call()
        assert "wide.nc" in refused.value.where and "b.nc" in refused.value.where


@pytest.mark.parametrize("fault", ["damaged", "model", "engine"])
def test_a_baseline_that_is_refused_is_made_again_over_it(clean, baseline, tmp_path, fault):
    """The cure of the refusal, followed by its words."""
    out = tmp_path / "rig.nc"
    shutil.copy(baseline.path.with_suffix(".sqlite"), out.with_suffix(".sqlite"))
    if fault == "damaged":
        out.write_bytes(b"x" + baseline.path.read_bytes()[1:])
    else:
        changed(baseline, out, **{fault: "0"})
    with pytest.raises(bl.InputError) as refused:
        bl.Baseline.open(out)
    typed = shlex.split(refused.value.fix.split("bolfi-liquids ", 1)[1])
    given = {"RECORDING...": list(map(str, clean)), "FILE": [str(out)]}
    words = [word for one in typed for word in given.get(one, [one])]
    result = CliRunner().invoke(app, [*words, "--particles", str(PARTICLES)])
    assert result.exit_code == 0
    assert bl.Baseline.open(out).hash == baseline.hash


def test_no_file_but_a_baseline_is_overwritten(calibration, clean, tmp_path):
    posterior = shutil.copy(calibration.path / "posterior.nc", tmp_path / "posterior.nc")
    for out in (shutil.copy(clean[1], tmp_path / "b.nc"), posterior):
        before = out.read_bytes()
        with pytest.raises(bl.InputError) as refused:
            bl.learn_baseline(clean[0], out=out, particles=PARTICLES, progress=False)
        assert out.name in refused.value.where and out.read_bytes() == before
        assert not out.with_suffix(".sqlite").exists()


def test_another_prior_than_the_baselines_is_told(baseline, clean):
    given = [bl.open_recording(clean[0]), baseline]
    assert not prior_warnings(given, default_prior())
    narrow = {**default_prior().distributions, "viscosity": dist.LogUniform(0.1, 1.0)}
    (notice,) = prior_warnings(given, Prior(narrow))
    assert str(baseline.path) in notice


@pytest.mark.parametrize(
    ("options", "where"),
    [
        ({"particles": 3}, "particles"),
        ({"out": "rig.csv"}, "rig.csv"),
        ({"timeout": -1.0}, "timeout"),
        ({"recordings": []}, "recordings"),
    ],
)
def test_what_no_baseline_can_be_made_of_is_refused_by_its_name(clean, tmp_path, options, where):
    given = {"out": "rig.nc", "recordings": clean, **options}
    given["out"] = tmp_path / given["out"]
    with pytest.raises(bl.InputError) as refused:
        bl.learn_baseline(given.pop("recordings"), progress=False, **given)
    assert where in refused.value.where
    assert not (tmp_path / "rig.nc").exists()


def test_recordings_of_two_rigs_make_no_baseline(clean, tmp_path):
    wide = tmp_path / "wide.nc"
    xr.load_dataset(clean[1], decode_times=False).assign_attrs(cup_radius=0.05).to_netcdf(wide)
    with pytest.raises(bl.InputError, match="cup_radius"):
        bl.learn_baseline([clean[0], wide], out=tmp_path / "rig.nc", progress=False)
