"""Sections of summary.json are what their types say, and come back from a result as they were."""

import json
from dataclasses import replace

import numpy as np

from bolfi_liquids.calibration.summary import CalibrationSummary
from bolfi_liquids.criticism.summary import CriticismSummary


def test_sections_survive_writing_and_reading(calibration, criticism_summary, pour):
    for summary in (calibration.summary, criticism_summary, pour.summary):
        assert type(summary).from_json(json.loads(json.dumps(summary.to_json()))) == summary
    stroke, speed = criticism_summary.to_json()["where"]
    assert "speed" not in stroke and speed["speed"] and speed["stroke"] is None


def test_what_json_cannot_hold_is_null_and_comes_back(calibration):
    section = replace(calibration.summary, rhat_max=np.nan).to_json()
    assert section["rhat_max"] is None
    assert np.isnan(CalibrationSummary.from_json(section).rhat_max)


def test_effects_that_were_considered(criticism_summary):
    few = replace(criticism_summary, made_from={"settings": {"effects": ["stick_mass"]}})
    assert isinstance(few, CriticismSummary) and few.considered == ("stick_mass",)
