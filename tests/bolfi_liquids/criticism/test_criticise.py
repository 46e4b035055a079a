"""Criticism of a run: what it is given, and the whole way on few simulations."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import bolfi_liquids as bl
from bolfi_liquids.criticism.pours import as_prior
from bolfi_liquids.errors import InputError
from bolfi_liquids.inputs.bundled import bundled_recording
from bolfi_liquids.inputs.prior import default_prior
from bolfi_liquids.run.run import Run


@pytest.mark.slow
def test_what_stirs_taught_becomes_a_prior_of_the_same_mean_and_spread():
    rng = np.random.default_rng(1)
    theta = {
        "viscosity": np.exp(rng.normal(-2.0, 0.4, 4000)),
        "cohesion": rng.uniform(0.0, 1.0, 4000),
    }
    learned = as_prior(theta, np.full(4000, 1 / 4000), default_prior())
    median = learned.from_unit(np.full((1, 2), 0.5))
    assert abs(np.log(median["viscosity"][0]) + 2.0) < 0.05
    upper = learned.from_unit(np.full((1, 2), 0.841))
    assert abs(np.log(upper["viscosity"][0]) + 1.6) < 0.05
    ends = learned.from_unit(np.array([[0.0, 0.0], [1.0, 1.0]]))["cohesion"]
    np.testing.assert_allclose(ends, [0.0, 1.0], atol=1e-6)


def test_a_run_keeps_its_recordings(calibration):
    (kept,) = calibration.run.recordings
    assert [kept.hash] == calibration.record["inputs"]["sha256"]


def test_a_changed_copy_is_refused(calibration, tmp_path):
    (kept,) = calibration.run.recordings
    folder = tmp_path / "recordings"
    folder.mkdir()
    (folder / kept.path.name).write_bytes(kept.path.read_bytes())
    record = {**calibration.record, "inputs": {"sha256": ["another"]}}
    with pytest.raises(InputError, match="not the recording that this run was calibrated on"):
        _ = Run(tmp_path, record).recordings


@pytest.mark.parametrize(
    ("options", "said"),
    [
        ({"effects": ["magic"]}, "there is no effect magic"),
        ({"pours": "nowhere.csv"}, "nowhere.csv: no such file"),
        ({"held_out": "nowhere.nc"}, "nowhere.nc: no such file"),
        ({"seed": -1}, "seed: -1"),
        ({"cups": "cups.toml"}, "cups: "),
        ({"effects": "camera_dealy"}, "there is no effect camera_dealy"),
        ({"accept": "foo"}, "accept: 'foo' is none of the effects"),
        ({"effects": "camera_delay", "accept": ["camera_tilt"]}, "choose from camera_delay"),
    ],
)
def test_what_cannot_be_used_is_refused_before_anything_is_simulated(calibration, options, said):
    with pytest.raises(InputError) as refused:
        bl.criticise(calibration, progress=False, **options)
    assert said in str(refused.value)


def test_what_is_held_out_or_clean_in_a_wrong_frame_is_told(calibration, caplog):
    right = bundled_recording("glycerin")
    xz, yz = right.inclination.T
    given = {
        "held_out": replace(
            right,
            path=Path("turned.nc"),
            hash="a",
            inclination=np.column_stack([xz - yz, xz + yz]) / np.sqrt(2.0),
        ),
        "baseline": replace(
            right, path=Path("mirrored.nc"), hash="b", inclination=np.column_stack([xz, -yz])
        ),
    }
    for name, recording in given.items():
        caplog.clear()
        # the limit of time is looked at last, before anything is simulated
        with pytest.raises(InputError, match="timeout"):
            bl.criticise(calibration, progress=False, timeout=-1.0, **{name: recording})
        (notice,) = [one.getMessage() for one in caplog.records]
        assert notice.startswith(f"{recording.path}: ")
        caplog.clear()
        with pytest.raises(InputError, match="timeout"):
            good = replace(recording, inclination=right.inclination)
            bl.criticise(calibration, progress=False, timeout=-1.0, **{name: good})
        assert caplog.records == []


def test_data_that_were_fitted_prove_nothing(calibration):
    (kept,) = calibration.run.recordings
    with pytest.raises(InputError, match="is what the run was calibrated on"):
        bl.criticise(calibration, held_out=kept, progress=False)


def test_a_run_without_criticism_says_so(calibration):
    with pytest.raises(InputError, match="bolfi-liquids criticise"):
        bl.Criticism.open(calibration.path)
