"""Rows, results and the registry."""

import sys
import textwrap
from importlib import import_module

import numpy as np
import pytest
from bolfi_liquids.models.validation import (
    Case,
    CaseResult,
    Curve,
    Panel,
    Row,
    cases,
    cup_cases,
    discover,
    wet_cases,
)


def panel():
    return Panel("x", "y", (Curve("truth", [0, 1], [0, 1], truth=True),))


def case(**changes):
    fields = {
        "name": "falling",
        "title": "A fall",
        "truth": "g",
        "source": "Galilei",
        "unit": "relative",
        "tolerance": 0.1,
        "settings": {},
        "run": lambda progress, seed: None,
    }
    return Case(**(fields | changes))


def test_errors_are_relative_or_absolute():
    assert Row.relative("g", 9.81, 10.0, 0.02).error == pytest.approx(0.0194, abs=1e-4)
    assert Row.absolute("g", 0.0, -0.3, 0.2).error == -0.3
    assert not Row.absolute("g", 0.0, -0.3, 0.2).passed
    with pytest.raises(ValueError, match="no relative error"):
        Row.relative("g", 0.0, 1.0, 0.1)


def test_what_is_no_number_fails():
    assert not Row.absolute("g", 1.0, np.nan, 1e9).passed
    assert not Row.absolute("g", 1.0, np.inf, 1e9).passed
    good, bad = Row.absolute("a", 1, 1, 0), Row.absolute("b", 1, 2, 0.5)
    assert CaseResult((good,), (panel(),)).passed
    assert not CaseResult((good, bad), (panel(),)).passed


def test_results_show_something():
    with pytest.raises(ValueError, match="at least one row"):
        CaseResult((), (panel(),))
    with pytest.raises(ValueError, match="one shape"):
        Panel("x", "y", (Curve("ours", [0, 1], [0]),))
    with pytest.raises(ValueError, match="name"):
        case(name="Not a module")
    with pytest.raises(ValueError, match="tolerance"):
        case(tolerance=-1.0)


def package(root, **modules):
    root.mkdir()
    (root / "__init__.py").touch()
    for name, source in modules.items():
        (root / f"{name}.py").write_text(textwrap.dedent(source))
    return root


@pytest.fixture
def importable(tmp_path, monkeypatch):
    monkeypatch.syspath_prepend(tmp_path)
    yield tmp_path
    for name in [name for name in sys.modules if name.startswith("found_")]:
        del sys.modules[name]


GOOD = """
from bolfi_liquids.models.validation import Case
CASE = Case("{name}", "t", "t", "s", "relative", 0.1, {{}}, lambda progress, seed: None)
"""


def test_a_case_is_found_by_being_there(importable):
    package(
        importable / "found_two",
        second=GOOD.format(name="second"),
        first=GOOD.format(name="first"),
        _shared="CASE = None",
    )
    assert list(discover(import_module("found_two"))) == ["first", "second"]


@pytest.mark.parametrize(
    ("modules", "message"),
    [
        ({"empty": "x = 1"}, "must define CASE"),
        ({"one": GOOD.format(name="other")}, "must hold the case 'one'"),
    ],
)
def test_a_module_without_its_case_is_named(importable, modules, message):
    package(importable / "found_bad", **modules)
    with pytest.raises(ValueError, match=message):
        discover(import_module("found_bad"))


def test_names_are_unique_over_packages(importable):
    for name in ("found_left", "found_right"):
        package(importable / name, one=GOOD.format(name="one"))
    with pytest.raises(ValueError, match="two cases"):
        discover(import_module("found_left"), import_module("found_right"))


def test_every_case_of_the_models_says_what_it_is():
    for name, found in discover(cases, cup_cases, wet_cases).items():
        assert name == found.name
        assert found.title and found.truth and found.source
        assert not found.truth.endswith(".") and not found.title.endswith(".")
