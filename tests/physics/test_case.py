"""Rows, results, and their output."""

import json
import xml.etree.ElementTree as ET

import numpy as np
import pytest
from case import CaseResult, Curve, Panel, Row
from results import table, write_figure, write_record


def panel(**more):
    x = np.linspace(1.0, 2.0, 5)
    return Panel("x", "y", (Curve("truth", x, x, truth=True), Curve("ours", x, x + 0.1)), **more)


def test_errors_are_relative_or_absolute():
    assert Row.relative("g", 9.81, 10.0, 0.02).error == pytest.approx(0.0194, abs=1e-4)
    assert Row.absolute("g", 0.0, -0.3, 0.2).error == -0.3
    assert not Row.absolute("g", 0.0, -0.3, 0.2).passed
    with pytest.raises(ValueError, match="no relative error"):
        Row.relative("g", 0.0, 1.0, 0.1)


def test_what_is_no_number_fails():
    assert not Row.absolute("g", 1.0, np.nan, 1e9).passed
    assert not Row.absolute("g", 1.0, np.inf, 1e9).passed


def test_results_show_something():
    with pytest.raises(ValueError, match="at least one row"):
        CaseResult((), (panel(),))
    with pytest.raises(ValueError, match="one shape"):
        Panel("x", "y", (Curve("ours", [0, 1], [0]),))


def test_a_table_has_a_line_for_each_row():
    rows = Row.relative("mass [kg]", 2.0, 2.4, 0.05), Row.absolute("speed [m/s]", 0.0, 0.0, 0.1)
    _, mass, speed = table(rows).splitlines()
    assert mass.split() == ["2", "2.4", "0.2", "0.05", "FAIL", "mass", "[kg]"]
    assert speed.endswith("pass  speed [m/s]")


def test_a_figure_has_a_panel_for_each(tmp_path):
    path = tmp_path / "good.svg"
    write_figure(path, [panel(), panel(log="xy")])
    svg = ET.parse(path).getroot()
    text = " ".join(svg.itertext())
    assert svg.tag.endswith("svg") and "good" in text
    assert text.count("ours") == 2


def test_a_record_has_plain_numbers_and_null(tmp_path):
    path = tmp_path / "diverged.json"
    rows = Row.absolute("speed [m/s]", 1.0, np.nan, 0.5), Row("x", 1.0, 1.0, np.float64(0.0), 0.1)
    write_record(path, "case", {"rows": rows})
    record = json.loads(path.read_text())
    assert record["name"] == "diverged" and record["kind"] == "case" and record["model"]
    speed, place = record["rows"]
    assert speed["ours"] is None and speed["passed"] is False
    assert place["error"] == 0.0 and place["passed"] is True
