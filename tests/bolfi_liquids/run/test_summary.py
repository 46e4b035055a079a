"""Sections of summary.json: what was written before the sections had types opens as it was."""

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from bolfi_liquids.calibration.summary import CalibrationSummary
from bolfi_liquids.criticism.summary import CriticismSummary
from bolfi_liquids.criticism.verdict import Verdict
from bolfi_liquids.errors import InputError
from bolfi_liquids.pouring.result import PourSummary
from bolfi_liquids.run.summary import read_summary

KINDS = {kind.SECTION: kind for kind in (CalibrationSummary, CriticismSummary, PourSummary)}
WRITTEN = {
    path.stem: json.loads(path.read_text(encoding="utf-8"))
    for path in sorted((Path(__file__).parent / "summaries_of_format_3").glob("*.json"))
}
FATE = {
    *("expected_received", "received_q05", "received_q95"),
    *("expected_retained", "retained_q05", "retained_q95"),
}
ADDED_SINCE = {
    "calibrate": {
        *("simulator_error_deg", "fit_to_noise", "fit_status", "frame_faults"),
        *("model_error_deg", "clean", "confirmed"),
    },
    "criticise": {"frame_faults"},
    "pour": {"fit_status", "map_error", "given", "hold", *FATE},
}
SECTIONS = [(name, section) for name, written in WRITTEN.items() for section in written]


def test_every_section_is_among_the_files():
    assert {section for _, section in SECTIONS} == set(KINDS)


@pytest.mark.parametrize(("name", "section"), SECTIONS)
def test_a_section_of_a_file_survives_reading_and_writing(name, section, tmp_path):
    written = WRITTEN[name][section]
    summary = KINDS[section].from_json(written)
    now = summary.to_json()
    assert now.keys() - written.keys() == ADDED_SINCE.get(section, set())
    kept = {key: value for key, value in now.items() if key in written}
    if "plug_in" in kept:
        own = written["plug_in"]
        kept["plug_in"] = {key: value for key, value in kept["plug_in"].items() if key in own}
        assert now["plug_in"].keys() - own.keys() == FATE
    assert kept == written
    assert list(kept) == list(written)
    summary.write(tmp_path)
    assert read_summary(tmp_path) == {section: now}
    assert KINDS[section].read(tmp_path) == summary


def test_numbers_of_a_file_are_where_the_type_has_them():
    written = WRITTEN["effect"]["criticise"]
    summary = CriticismSummary.from_json(written)
    assert summary.verdict is Verdict.EFFECT and summary.verdict == "effect"
    assert summary.gap.before == written["gap_deg"]["before"]
    assert summary.where[0].rms_deg == written["where"][0]["rms_deg"]
    assert summary.coefficient["camera_delay"].q95 == written["coefficient"]["camera_delay"]["q95"]
    assert summary.considered == ("camera_delay", "stick_mass")
    assert CriticismSummary.from_json(WRITTEN["none"]["criticise"]).gap.after is None


def test_a_criticism_made_by_hand_survives_as_well(criticism_summary):
    again = CriticismSummary.from_json(json.loads(json.dumps(criticism_summary.to_json())))
    assert again == criticism_summary
    stroke, speed = criticism_summary.to_json()["where"]
    assert "speed" not in stroke and speed["speed"] and speed["stroke"] is None


def test_what_json_cannot_hold_is_null_and_comes_back(tmp_path):
    summary = CalibrationSummary.from_json(WRITTEN["effect"]["calibrate"])
    replace(summary, rhat_max=np.nan).write(tmp_path)
    assert read_summary(tmp_path)["calibrate"]["rhat_max"] is None
    assert np.isnan(CalibrationSummary.read(tmp_path).rhat_max)


@pytest.mark.parametrize(
    ("section", "field", "value"),
    [
        ("criticise", "verdict", "perhaps"),
        ("criticise", "gap_deg", {}),
        ("calibrate", "n_simulations", "many"),
        ("pour", "plug_in", None),
    ],
)
def test_a_damaged_section_is_named_with_its_field(tmp_path, section, field, value):
    damaged = WRITTEN["effect"] | {section: WRITTEN["effect"][section] | {field: value}}
    (tmp_path / "summary.json").write_text(json.dumps(damaged), encoding="utf-8")
    with pytest.raises(InputError) as refused:
        KINDS[section].read(tmp_path)
    assert f"{section}.{field}" in str(refused.value)
    assert str(tmp_path / "summary.json") in str(refused.value)
