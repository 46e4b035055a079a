"""A run's copies of its recordings: their bytes are compared before they are read."""

import hashlib
from types import SimpleNamespace

import pytest

from bolfi_liquids.errors import InputError
from bolfi_liquids.inputs.bundled import bundled_recording
from bolfi_liquids.inputs.open import read_recording
from bolfi_liquids.run.recordings import keep_recordings, kept_recordings

DAMAGES = {
    "cut": lambda whole: whole[: len(whole) // 2],
    "no NetCDF": lambda _: b"time;x;y;z\n0;0;0;0\n",  # of which `import` would be advised
    "empty": lambda _: b"",
    "one bit": lambda whole: whole[:-99] + bytes([whole[-99] ^ 1]) + whole[-98:],
}


@pytest.fixture
def run(tmp_path):
    """The directory of a run, the record of it, and its copy."""
    recording = bundled_recording("water")
    keep_recordings(tmp_path, (recording,))
    (copy,) = (tmp_path / "recordings").iterdir()
    digest = hashlib.sha256(copy.read_bytes()).hexdigest()
    names = {"files": {"recordings": [recording.path.name]}, "inputs": {"sha256": [digest]}}
    return SimpleNamespace(path=tmp_path, record=names, copy=copy)


def test_a_copy_is_the_recording(run):
    (kept,) = kept_recordings(run.path, run.record)
    assert kept.path == run.copy


@pytest.mark.parametrize("name", ["a" * 252 + ".nc", "ä" * 126 + ".nc", "𝄞" * 63 + ".nc"])
def test_a_recording_of_any_name_is_copied(tmp_path, run, name):
    given = tmp_path / name
    given.write_bytes(run.copy.read_bytes())
    recordings = (read_recording(run.copy), read_recording(given))
    keep_recordings(tmp_path, recordings)
    digests = [one.hash for one in recordings]
    names = [one.path.name for one in recordings]
    record = {"files": {"recordings": names}, "inputs": {"sha256": digests}}
    copies = {one.path for one in kept_recordings(tmp_path, record)}
    assert len(copies) == 2 and copies <= set((tmp_path / "recordings").iterdir())


@pytest.mark.parametrize("damage", DAMAGES)
def test_a_damaged_copy_is_told_as_one_and_never_to_be_imported(run, damage):
    run.copy.write_bytes(DAMAGES[damage](run.copy.read_bytes()))
    with pytest.raises(InputError) as caught:
        kept_recordings(run.path, run.record)
    assert caught.value.where == str(run.copy)
    assert "put the original back" in caught.value.fix and "import" not in str(caught.value)
