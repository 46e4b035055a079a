"""A run's copies of its recordings: their bytes are compared before they are read."""

import pytest

from bolfi_liquids.errors import InputError
from bolfi_liquids.inputs.bundled import bundled_recording
from bolfi_liquids.inputs.open import read_recording
from bolfi_liquids.run.run import Run

DAMAGES = {
    "cut": lambda whole: whole[: len(whole) // 2],
    "no NetCDF": lambda _: b"time;x;y;z\n0;0;0;0\n",  # of which `import` would be advised
    "empty": lambda _: b"",
    "one bit": lambda whole: whole[:-99] + bytes([whole[-99] ^ 1]) + whole[-98:],
}


def kept(path, *recordings):
    """A run that holds copies of recordings."""
    record = {
        "files": {"recordings": [one.path.name for one in recordings]},
        "inputs": {"sha256": [one.hash for one in recordings]},
    }
    run = Run(path, record)
    run.keep_recordings(recordings)
    return run


def test_a_recording_of_any_name_is_copied(tmp_path):
    water, given = bundled_recording("water"), tmp_path / ("𝄞" * 63 + ".nc")
    given.write_bytes(water.path.read_bytes())
    run = kept(tmp_path, water, read_recording(given))
    copies = [one.path for one in run.recordings]
    assert len(copies) == 2 and set(copies) == set((tmp_path / "recordings").iterdir())
    assert [one.hash for one in run.recordings] == 2 * [water.hash]


def test_a_damaged_copy_is_told_as_one_and_never_to_be_imported(tmp_path):
    run = kept(tmp_path, bundled_recording("water"))
    (copy,) = (tmp_path / "recordings").iterdir()
    whole = copy.read_bytes()
    for damage in DAMAGES.values():
        copy.write_bytes(damage(whole))
        with pytest.raises(InputError) as caught:
            _ = run.recordings
        assert caught.value.where == str(copy)
        assert "put the original back" in caught.value.fix and "import" not in str(caught.value)
