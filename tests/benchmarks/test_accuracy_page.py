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
    about = {"title": "Rest", "truth": "nothing | moves", "source": "Stevin 1586"}
    return {**about, "unit": unit, "error": None, "rows": list(rows)}


def test_the_page_of_the_guide_is_that_of_what_is_kept(measured):
    """Edit accuracy.md.jinja and run accuracy_page.py; the page itself is not written by hand."""
    assert accuracy_page.PAGE.read_text(encoding="utf-8") == accuracy_page.page(measured)


def test_a_new_check_takes_the_place_of_the_old_one(measured):
    model = measured["physics"]["made"]["model"]
    found = accuracy_page.kept(
        {"model": model, "cases": {"still": case(row("speed [m/s]", 0.02, 0.1))}}
    )
    now = accuracy_page.merged(measured, found)
    assert list(now["physics"]["cases"]) == ["still"]
    assert now["stirs"] == measured["stirs"] and now["pours"] == measured["pours"]
    text = accuracy_page.page(now)
    assert "`still`" in text and "nothing \\| moves" in text
    assert "0.02 m/s | 0.1 m/s | speed |" in text


def test_comparisons_of_one_tolerance_and_unit_share_a_row():
    rows = accuracy_page.case_rows(
        case(row("a [mm]", 0.5, 1.0), row("b [mm]", -0.25, 1.0), row("c [s]", 0.1, 1.0))
    )
    assert [one["count"] for one in rows] == ["2", "1"]
    assert rows[0]["errors"] == "-0.25 to 0.5 mm" and rows[0]["farthest"] == "a"
    (relative,) = accuracy_page.case_rows(case(row("a [mm]", -0.083, 0.1), unit="relative"))
    assert relative["errors"] == "-8.3 %" and relative["tolerance"] == "10 %"


def test_what_misses_its_bar_is_listed(measured):
    changed = copy.deepcopy(measured)
    changed["physics"]["cases"] = {"still": case(row("speed [m/s]", 0.2, 0.1))}
    changed["stirs"]["recordings"]["gel_v10"]["passed"] = False
    listed = accuracy_page.page(changed).partition("## Bars that are missed")[2]
    listed = listed.partition("\n## ")[0]
    assert "still: speed" in listed and "gel_v10" in listed


def test_a_failed_case_is_listed_and_leaves_no_figures(measured):
    changed = copy.deepcopy(measured)
    changed["physics"]["cases"] = {"still": case() | {"error": "ValueError: no"}}
    assert "still: ValueError: no" in accuracy_page.page(changed)


def test_another_file_is_refused():
    with pytest.raises(ValueError, match="physics.json"):
        accuracy_page.kept({"created": "2026", "cases": {}})


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
