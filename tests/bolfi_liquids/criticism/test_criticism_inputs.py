"""What a criticism is given: read, checked and written down."""

from dataclasses import replace
from importlib.resources import files

import numpy as np
import pytest
import xarray as xr

from bolfi_liquids.calibration.model_error import Clean, regime_distance, usual_for
from bolfi_liquids.calibration.stirs import camera_noise, held_out_noise, stir_experiment
from bolfi_liquids.criticism.inputs import check_effects, open_inputs
from bolfi_liquids.errors import Argument, InputError
from bolfi_liquids.inputs.cups import open_cups
from bolfi_liquids.inputs.open import open_recordings
from bolfi_liquids.inputs.settings import CriticismSettings
from bolfi_liquids.simulators import stir_simulator

HEADER = "angular_velocity_deg_s,distance_cm,spilled,received,retained"
ROWS = ["45,1,5,90,5", "90,2,10,85,5", "60,3,20,75,5"]
AT_REST, RHO, SD = 16, 0.6, np.radians(0.2)


def given(calibration, settings=None, **some):
    settings, unopened = settings or CriticismSettings(), {"held_out": (), "baseline": ()} | some
    check_effects(settings)
    opened = {
        name: open_recordings(paths, Argument(name)) if name in ("held_out", "baseline") else paths
        for name, paths in unopened.items()
    }
    poured = opened.pop("pours", None), opened.pop("held_out_pours", None)
    return open_inputs(calibration, settings, **opened, poured=poured)


@pytest.fixture
def other(dataset, tmp_path):
    """(name, **attributes) -> path of a recording that is like the bundled one, but for them."""

    def write(name, **attrs):
        path = tmp_path / name
        dataset.assign_attrs(attrs, note=name).to_netcdf(path)
        return path

    return write


@pytest.fixture
def table(tmp_path):
    def write(name, rows=ROWS):
        path = tmp_path / name
        path.write_text("\n".join([HEADER, *rows]) + "\n")
        return path

    return write


def test_what_a_result_was_made_from_names_every_file(calibration, other, table):
    inputs = given(
        calibration, baseline=[other("clean.nc")], held_out=other("o.nc"), pours=table("p.csv")
    )
    made_from = inputs.made_from
    assert set(made_from["baseline"]) == {"clean.nc"} and set(made_from["held_out"]) == {"o.nc"}
    assert set(made_from["pours"]) == {"p.csv"} and made_from["settings"]["seed"] == 0
    assert made_from["poured"]["cups"]["source"]
    assert inputs.level == 0.025  # of each of two sources


def test_other_settings_files_or_cups_are_another_question(calibration, other, table):
    asked = [
        given(calibration),
        given(calibration, CriticismSettings(seed=1)),
        given(calibration, baseline=other("clean.nc")),
        given(calibration, held_out=other("clean.nc")),
        given(calibration, pours=table("p.csv")),
        given(calibration, pours=table("p.csv"), held_out_pours=table("q.csv", ROWS[::-1])),
    ]
    made_from = [inputs.made_from for inputs in asked]
    assert all(one != two for i, one in enumerate(made_from) for two in made_from[:i])
    assert made_from[0] == given(calibration).made_from


def test_a_clean_recording_that_is_criticised_or_held_out_is_no_baseline(
    calibration, other, short_recording
):
    held = other("held.nc")
    inputs = given(calibration, held_out=held, baseline=[short_recording, held, other("c.nc")])
    assert [recording.path.name for recording in inputs.baseline] == ["c.nc"]
    assert set(inputs.left_out) == {short_recording.name, "held.nc"}
    assert inputs.made_from != given(calibration, held_out=held, baseline=other("c.nc")).made_from


def refused(said, calibration, **some):
    with pytest.raises(InputError) as error:
        given(calibration, **some)
    assert said in str(error.value)


def test_what_is_no_file_is_refused_by_its_option(calibration, other, table):
    recordings = (path for path in [other("held.nc")])  # any iterable will do
    assert [one.path.name for one in given(calibration, held_out=recordings).held_out] == [
        "held.nc"
    ]
    for option in ("held_out", "baseline"):
        for wrong in (3, [other("a.nc"), None]):
            refused("is no recording", calibration, **{option: wrong})
    refused("baseline: ", calibration, baseline=3)
    refused("3 is no table of pours", calibration, pours=3)
    refused("held_out_pours: ", calibration, pours=table("p.csv"), held_out_pours=[1])


def test_cups_are_given_by_their_file_and_with_pours(calibration, table, tmp_path):
    path = tmp_path / "cups.toml"
    bundled = (files("bolfi_liquids.data") / "cups.toml").read_text(encoding="utf-8")
    path.write_text(bundled.replace("lip_height = 0.20", "lip_height = 0.21"), encoding="utf-8")
    for given_as in (path, str(path)):
        inputs = given(calibration, pours=table("p.csv"), cups=given_as)
        assert inputs.cups == open_cups(path)
    refused("is no pair of cups", calibration, pours=table("p.csv"), cups=3)
    with pytest.raises(InputError) as error:
        given(calibration, cups=path)
    assert error.value.where == "cups"


def test_columns_that_nobody_reads_are_logged(calibration, tmp_path, caplog):
    path = tmp_path / "p.csv"
    path.write_text("\n".join([f"{HEADER},who", *(f"{row},me" for row in ROWS)]) + "\n")
    given(calibration, pours=path)
    (notice,) = caplog.records
    assert str(path) in notice.getMessage() and "who" in notice.getMessage()


def test_a_recording_is_held_out_once_and_under_its_own_name(calibration, other, tmp_path):
    path = other("held.nc")
    refused("is held out twice", calibration, held_out=[path, path])
    (tmp_path / "b").mkdir()
    copy = tmp_path / "b" / "held.nc"
    xr.load_dataset(path, decode_times=False).assign_attrs(note="b").to_netcdf(copy)
    refused("or has the name of another", calibration, held_out=[path, copy])


def test_a_baseline_of_another_rig_or_frame_rate_is_refused(calibration, other, dataset, tmp_path):
    wide = other("wide.nc", cup_radius=0.05)
    for option in ("baseline", "held_out"):
        refused("cup_radius is 0.05", calibration, **{option: wide})
    slow = tmp_path / "slow.nc"
    dataset.isel(time=slice(0, None, 2)).to_netcdf(slow)
    refused("samples a second", calibration, baseline=slow)


def test_held_out_pours_are_other_pours(calibration, table):
    refused("no pours to learn from", calibration, held_out_pours=table("q.csv"))
    pours = table("p.csv")
    refused("the pours that are fitted", calibration, pours=pours, held_out_pours=pours)


def test_pours_need_an_effect_that_acts_in_them(calibration, table):
    refused(
        "none of the effects acts in a pour",
        calibration,
        settings=CriticismSettings(effects=("camera_delay",)),
        pours=table("p.csv"),
    )


# What the recordings themselves tell of their noise.


@pytest.fixture(scope="module")
def stirred(calibration):
    """The run's recording."""
    return given(calibration).stirring.recordings[0]


def recorded(recording, rng, sd=SD):
    """The recording, its samples at rest AR(1) noise and the rest a smooth signal."""
    noise = sd * rng.normal(size=recording.inclination.shape)
    for i in range(1, len(noise)):
        noise[i] = RHO * noise[i - 1] + np.sqrt(1.0 - RHO**2) * noise[i]
    return replace(recording, inclination=noise)


def test_the_cameras_noise_is_that_of_the_rest_and_correlated(stirred):
    """On average over recordings: one of them knows it to a third only."""
    rng = np.random.default_rng(0)
    found = [camera_noise([recorded(stirred, rng)]) for _ in range(40)]
    assert {one.samples for one in found} == {2 * AT_REST}
    # the median of the posterior's sizes, and of their correlations, on average
    sizes = [np.median(one.sd) / SD for one in found]
    error = np.std(sizes) / np.sqrt(len(sizes))
    assert abs(np.mean(sizes) - 1.0) < 4.0 * error + 0.1
    assert np.mean([np.mean(one.correlation) for one in found]) > 0.25


def test_fitted_recordings_tell_of_the_cameras_that_saw_those_held_out(stirred):
    rng = np.random.default_rng(0)
    one, other = (recorded(stirred, rng) for _ in range(2))
    assert held_out_noise(one, [other]).samples == 2 * camera_noise([one]).samples
    slower = replace(other, time=1.1 * other.time)
    assert held_out_noise(one, [slower]).samples == camera_noise([one]).samples


def test_a_camera_without_any_noise_is_not_believed(stirred):
    still = recorded(stirred, np.random.default_rng(0), sd=0.0)
    with pytest.raises(InputError, match="does not change at all"):
        camera_noise([still])
    half = replace(
        still, inclination=0.3 + still.inclination
    )  # its mean is not 0.3 to the last bit
    half.inclination[:, 0] += np.random.default_rng(0).normal(size=len(still.time))
    with pytest.raises(InputError, match="does not change at all"):
        camera_noise([half])
    seen = recorded(stirred, np.random.default_rng(0))
    with pytest.raises(InputError, match="does not change at all"):
        held_out_noise(still, [seen])


def test_clean_recordings_of_the_same_path_say_where_it_errs(stirred):
    rng = np.random.default_rng(0)
    recording = recorded(stirred, rng)
    residual = 10.0 * SD * np.sin(np.linspace(0.0, 9.0, len(recording.time)))[:, None] * [1.0, 0.5]
    clean = [Clean(recording, residual, 1.0, 1)]
    stirring = stir_simulator([recording], 200)
    same, elsewhere = (usual_for(stirring, clean, 0.5, elsewhere=other) for other in (False, True))
    assert [one.same for one in same.clean] == [True]
    assert [one.same for one in elsewhere.clean] == [False]
    cameras = camera_noise([recording])
    noise = stir_experiment(stirring, cameras, same, "stir").noise
    assert [type(part).__name__ for part in noise.parts] == ["AutoregressiveNoise", "UsualResidual"]
    assert usual_for(stirring, [], 0.5) is None
    assert stir_experiment(stirring, cameras, None, "stir").noise is cameras


def test_liquids_are_as_far_apart_as_their_viscosities():
    """In doublings; all are alike where one is unknown."""
    np.testing.assert_allclose(regime_distance([0.1, 0.4, 1.6], 0.4, 0.005), [-2.0, 0.0, 2.0])
    assert (regime_distance([0.001, 0.1], None, 0.005) == 0.0).all()
    assert (regime_distance([None, 1.0], 1.0, 0.005) == 0.0).all()
    # water is water, wherever below the least viscosity it was fitted
    np.testing.assert_allclose(regime_distance([3e-4, 0.004, 0.01], 0.001, 0.005), [0.0, 0.0, 1.0])


@pytest.mark.parametrize("option", ["pours", "held_out_pours"])
def test_pours_that_the_cups_could_not_make_are_refused(calibration, table, option):
    tables = {
        "pours": table("p.csv"),
        option: table("q.csv", ["45,10,5,90,5", *ROWS, "60,50,33,33,34"]),
    }
    with pytest.raises(InputError, match=r"q\.csv: distance_cm: 50 cm; "):
        given(calibration, **tables)
