"""A recording in a wrong frame is warned of, fits badly, and leads to no pour by itself."""

import logging
from pathlib import Path

import numpy as np
import pytest

import bolfi_liquids as bl
from bolfi_liquids.calibration.summary import bad_fit
from bolfi_liquids.errors import InputError
from bolfi_liquids.inputs.recording import along_path, recording_dataset
from bolfi_liquids.reporting.warnings import Results, warnings_of

SETTINGS = {"budget": 12, "batch": 4, "chains": 2, "draws": 200, "seed": 3, "sampler": "emcee"}
REFERENCE = Path(__file__).parents[2] / "data/stirring_reference"
SAMPLES = 120  # 4 s, five strokes
TURN = np.exp(0.25j * np.pi)


@pytest.mark.filterwarnings("ignore::bolfi_liquids.inference.surrogates.warnings.EmulatorWarning")
@pytest.mark.slow
@pytest.mark.parametrize(
    ("change", "fault"),
    [
        pytest.param(lambda seen: TURN * seen, "yaw_deg", id="turned by 45 deg"),
        pytest.param(np.conj, "flip", id="sign of yz", marks=pytest.mark.minutes),
        pytest.param(lambda seen: seen, None, id="right"),
    ],
)
def test_a_wrong_frame_is_never_passed_on(tmp_path, caplog, change, fault):
    whole = bl.open_recording(REFERENCE / "glycerin_v10.nc").first(SAMPLES)
    seen = change(whole.inclination[:, 0] + 1j * whole.inclination[:, 1])
    values = along_path(whole, np.column_stack([seen.real, seen.imag]))
    path = tmp_path / "stir.nc"
    recording_dataset(values, whole.attrs).to_netcdf(path)
    with caplog.at_level(logging.WARNING):
        calibration = bl.calibrate(path, out=tmp_path / "run", progress=False, **SETTINGS)
    warned = [record.getMessage() for record in caplog.records]
    found = bad_fit(calibration.summary)
    assert (found is not None) == (fault is not None)
    assert (found in warnings_of(Results.of(calibration.run))) == (fault is not None)
    if fault is None:
        assert not any("stir.nc" in text for text in warned)
        return
    assert any("stir.nc" in text and fault in text for text in warned)
    assert "bad" in repr(calibration)
    assert fault in str(found) and "stir.nc" in str(found)
    with pytest.raises(InputError, match=fault):
        bl.choose_pour(calibration, progress=False)
