"""The fluid repeats a reference's stirs and pours; `make against REFERENCE=DIR` shows the tables.

CELL is the width of the cells of pours [mm]; without it the simulator takes its own.
"""

import os
from functools import cache
from pathlib import Path

import pytest
from results import table, write_figure, write_record

from .across_pours import mean_rows, shift_rows, wetting_pairs
from .neighbours import judged_pairs, ratio_row
from .pour_replay import HEAD, cell_width, pour_panel, pour_rows, repeat_pours
from .pours import POUR_TRUTHS, open_poured_liquids
from .stir_replay import repeat_stir, stir_panels, stir_rows
from .stirs import STIR_TRUTHS, ReferenceStirs, open_reference_stirs

FOLDER = os.environ.get("REFERENCE")
CELL = float(os.environ["CELL"]) / 1e3 if os.environ.get("CELL") else None

pytestmark = [
    pytest.mark.benchmark,
    pytest.mark.skipif(not FOLDER, reason="REFERENCE names no directory of a reference"),
]


def opened(file, read, none):
    """What the reference holds of a kind, which a table of truths tells."""
    return read(Path(FOLDER)) if FOLDER and (Path(FOLDER) / file).is_file() else none


stirs, left_out = opened(STIR_TRUTHS, open_reference_stirs, ReferenceStirs((), {}))
liquids = opened(POUR_TRUTHS, open_poured_liquids, ())
tables = sorted({one.table for one in liquids})
stirred, poured = cache(repeat_stir), cache(lambda liquid: repeat_pours(liquid, cell=CELL))


def names(pair):
    return "-".join(one.name for one in pair)


def assert_passed(rows):
    missed = [row for row in rows if not row.passed]
    assert not missed, f"\n{table(missed)}"


def test_the_reference_holds_stirs_or_pours():
    assert stirs or liquids, f"{FOLDER} holds neither {STIR_TRUTHS} nor {POUR_TRUTHS}"


@pytest.mark.parametrize(
    "stir",
    [
        *(pytest.param(stir, id=stir.name) for stir in stirs),
        *(
            pytest.param(None, id=name, marks=pytest.mark.skip(f"{effect} has no known size"))
            for name, effect in left_out.items()
        ),
    ],
)
def test_a_stir_is_repeated(stir, results_folder):
    signals, cpu_s = stirred(stir)
    rows, effects = stir_rows(stir, signals), sorted(stir.effects)
    print(f"\n{stir.name}, {stir.viscosity:g} Pa s {' '.join(effects)}: {cpu_s} CPU s a stir")
    print(table(rows))
    write_figure(results_folder / f"{stir.name}.svg", stir_panels(stir, signals))
    about = {"viscosity": stir.viscosity, "effects": effects, "cpu_s": cpu_s}
    write_record(results_folder / f"{stir.name}.json", "stir", {**about, "rows": rows})
    assert_passed(rows)


@pytest.mark.parametrize("pair", judged_pairs(stirs), ids=names)
def test_neighbours_in_viscosity_differ_as_much(pair, results_folder):
    row = ratio_row(*pair, [stirred(stir).signals for stir in pair])
    print(f"\n{table([row])}")
    write_record(results_folder / f"{names(pair)}.json", "neighbours", {"rows": [row]})
    assert_passed([row])


@pytest.mark.parametrize("liquid", liquids, ids=lambda liquid: liquid.name)
def test_the_pours_of_a_liquid_are_repeated(liquid, results_folder):
    pours, cpu_s = poured(liquid)
    rows = pour_rows(pours, liquid.retained_resolved)
    print(f"\n{liquid.name}, {liquid.viscosity:g} Pa s: {cpu_s} CPU s a pour")
    print(HEAD, *pours, table(rows), sep="\n")
    panels = [pour_panel(*pair) for pair in zip(liquid.pours, pours, strict=True)]
    write_figure(results_folder / f"{liquid.name}.svg", panels)
    record = {
        "cell_mm": 1e3 * cell_width(liquid.cups, CELL),
        "liquid": liquid.liquid,
        "viscosity": liquid.viscosity,
        "contact_angle_deg": liquid.contact_angle_deg,
        "cpu_s": cpu_s,
        "excess": [one.excess for one in pours],
        "rows": rows,
    }
    write_record(results_folder / f"{liquid.name}.json", "poured", record)
    assert_passed(rows)


@pytest.mark.parametrize("name", tables)
def test_the_mean_over_a_table_of_pours(name, results_folder):
    own = [one for one in liquids if one.table == name]
    rows = mean_rows(name, [pour for one in own for pour in poured(one).pours])
    leave_across(f"mean_{Path(name).stem}", rows, own[0], results_folder)


@pytest.mark.parametrize("pair", wetting_pairs(liquids), ids=names)
def test_a_contact_angle_shifts_the_landing(pair, results_folder):
    rows = shift_rows(*((one, poured(one).pours) for one in pair))
    leave_across(names(pair), rows, pair[0], results_folder)


def leave_across(name, rows, liquid, folder):
    print(f"\n{table(rows)}")
    cell = 1e3 * cell_width(liquid.cups, CELL)
    write_record(folder / f"{name}.json", "across", {"cell_mm": cell, "rows": rows})
    assert_passed(rows)
