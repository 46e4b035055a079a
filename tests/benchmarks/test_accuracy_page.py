"""The guide's page of accuracy is written from records, whatever these hold."""

import copy
import json

import accuracy_page
import pytest


@pytest.fixture
def measured():
    return json.loads(accuracy_page.MEASURED.read_text(encoding="utf-8"))


def row(quantity, error, tolerance):
    numbers = {"truth": 1.0, "ours": 1.0 + error, "error": error, "tolerance": tolerance}
    return {"quantity": quantity, **numbers, "passed": abs(error) <= tolerance}


def case(*rows, unit=""):
    about = {"truth": "nothing | moves", "source": "Stevin 1586"}
    return {**about, "unit": unit, "rows": list(rows)}


def record(kind, model, name="still", **more):
    return {"kind": kind, "name": name, "model": model, "created": "2026-11-27", **more}


def test_the_page_of_the_guide_is_that_of_what_is_kept(measured):
    """Edit accuracy.md.jinja and run accuracy_page.py; the page itself is not written by hand."""
    assert accuracy_page.PAGE.read_text(encoding="utf-8") == accuracy_page.page(measured)


def test_new_records_take_the_place_of_the_old_ones(measured):
    model = measured["physics"]["made"]["model"]
    still = record("case", model, **case(row("speed [m/s]", 0.02, 0.1)))
    now = accuracy_page.merged(measured, accuracy_page.kept([still]))
    assert list(now["physics"]["cases"]) == ["still"]
    assert now["stirs"] == measured["stirs"] and now["pours"] == measured["pours"]
    text = accuracy_page.page(now)
    assert "`still`" in text and "nothing \\| moves" in text
    assert "0.02 m/s | 0.1 m/s | speed |" in text


def test_records_of_stirs_and_pours_are_kept_by_kind():
    bars = row("RMS difference [deg]", 0.3, 0.36), row("spread over seeds [deg]", 0.01, 0.05)
    oil = {"viscosity": 0.1, "effects": [], "cpu_s": 0.6, "rows": bars}
    water = {"liquid": "water", "viscosity": 0.001, "contact_angle_deg": 60.0, "cpu_s": 0.2}
    across = row("shift, water", 1.0, 3.0), row("mean RMS, pours.csv", 0.05, 0.085)
    found = accuracy_page.kept(
        [
            record("stir", "1", "oil_v10", **oil),
            record("neighbours", "1", rows=[row("difference", -0.1, 0.25)]),
            record("across", "1", cell_mm=4.0001, rows=across),
            record("poured", "1", "water_60", cell_mm=4.0, excess=[0.01], rows=[], **water),
            record("poured", "1", "water_60", cell_mm=3.0, excess=[0.02], rows=[], **water),
        ]
    )
    assert found["stirs"]["ratios"] == [0.9]
    assert found["stirs"]["recordings"]["oil_v10"]["bar"] == 0.36
    assert found["stirs"]["recordings"]["oil_v10"]["passed"]
    assert set(found["pours"]) == {"4", "3"}
    assert found["pours"]["3"]["liquids"]["water_60"]["excess"] == [0.02]
    assert [one["quantity"] for one in found["pours"]["4"]["across"]] == [
        "mean RMS, pours.csv",
        "shift, water",
    ]


def test_what_misses_its_bar_is_listed(measured):
    changed = copy.deepcopy(measured)
    changed["physics"]["cases"] = {"still": case(row("speed [m/s]", 0.2, 0.1))}
    changed["stirs"]["recordings"]["gel_v10"]["passed"] = False
    listed = accuracy_page.page(changed).partition("## Bars that are missed")[2]
    listed = listed.partition("\n## ")[0]
    assert "still: speed" in listed and "gel_v10" in listed


@pytest.mark.parametrize("kind", accuracy_page.KINDS)
def test_figures_of_two_models_make_no_page(measured, kind):
    changed = copy.deepcopy(measured)
    part = changed[kind]
    for one in part.values() if kind == "pours" else [part]:
        one["made"]["model"] = "another"
    with pytest.raises(ValueError, match="another"):
        accuracy_page.page(changed)
    with pytest.raises(ValueError, match=kind):
        accuracy_page.page({**measured, kind: {}})
