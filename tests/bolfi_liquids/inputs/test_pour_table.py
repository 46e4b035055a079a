"""Tables of pours: what is read, and what is refused."""

import numpy as np
import pytest

from bolfi_liquids.errors import InputError
from bolfi_liquids.inputs.bundled import POURED_LIQUIDS, bundled_pours
from bolfi_liquids.inputs.cups import bundled_cups
from bolfi_liquids.inputs.pour_table import check_scene, open_pours, table_and_cups, table_of

HEADER = "liquid,angular_velocity_deg_s,distance_cm,received,retained,spilled\n"
ROWS = ["water,45,1.5,90,5,5", "water,90,1.5,80,0,20", "water,90,3,10,10,0", "oil,45,1.5,1,1,2"]


def written(tmp_path, rows, header=HEADER):
    path = tmp_path / "pours.csv"
    path.write_text(header + "".join(f"{row}\n" for row in rows))
    return path


def test_amounts_in_any_unit_become_fractions(tmp_path):
    path = written(tmp_path, ROWS)
    table = open_pours(path, liquid="water")
    assert table.liquid == "water" and table.lines.tolist() == [2, 3, 4]
    np.testing.assert_allclose(table.fractions[0], [0.05, 0.9, 0.05])
    np.testing.assert_allclose(table.fractions.sum(1), 1.0)
    np.testing.assert_allclose(table.observed, [[0.05, 0.2, 0.0], [0.05, 0.0, 0.5]])
    np.testing.assert_allclose(table.angular_velocity, np.radians([45.0, 90.0, 90.0]))
    np.testing.assert_allclose(table.distance, [0.015, 0.015, 0.03])
    assert table_of(table, "given") is table and table_of(None, "given") is None
    with pytest.raises(InputError, match="^given: "):
        table_of(3, "given")  # pyright: ignore[reportArgumentType]


def test_a_spreadsheet_s_form_of_the_table_is_read(tmp_path):
    usual = open_pours(written(tmp_path, ROWS), "water")
    rows = [row.replace(",", ";").replace(".", ",") for row in ROWS]
    path = written(tmp_path, rows, HEADER.replace(",", " ; ").upper())
    path.write_bytes(path.read_text().encode("utf-16"))
    np.testing.assert_array_equal(open_pours(path, "water").fractions, usual.fractions)


def test_a_table_without_names_is_of_one_liquid_whatever_it_is_called(tmp_path):
    assert open_pours(written(tmp_path, ROWS[:3])).liquid == "water"
    nameless = [row.split(",", 1)[1] for row in ROWS[:3]]
    path = written(tmp_path, nameless, HEADER.split(",", 1)[1])
    assert len(open_pours(path, liquid="glycerin").distance) == 3


def test_only_pours_in_the_range_of_the_cups_are_within(tmp_path):
    rows = ["w,30,0,1,1,1", "w,180,7,1,1,1", "w,29.9,1,1,1,1", "w,90,7.01,1,1,1"]
    inside = open_pours(written(tmp_path, rows)).within(bundled_cups())
    assert inside.lines.tolist() == [2, 3] and len(inside.fractions) == 2


REFUSED = {
    "several liquids": (ROWS, HEADER, None, "oil, water"),
    "too few": (ROWS, HEADER, "oil", "at least 3"),
    "no such column": (ROWS, HEADER.replace("retained", "kept"), None, "'retained'"),
    "a missing amount": ([*ROWS[:2], "water,90,1,1,,1"], HEADER, None, "line 4, column retained"),
    "negative": ([*ROWS[:2], "water,90,1,1,-1,1"], HEADER, None, "line 4, column retained"),
    "backwards": ([*ROWS[:2], "water,-30,1,1,1,1"], HEADER, None, "angular_velocity_deg_s: -30"),
    "nothing poured": ([*ROWS[:2], "water,90,1,0,0,0"], HEADER, None, "line 4: spilled"),
    "nothing ever poured": (["w,90,1,0,0,0"] * 3, HEADER, None, "in all: usually 0; remove the"),
    "a missing distance": ([*ROWS[:2], "water,90,,1,1,1"], HEADER, None, "or remove the line;"),
    "another unit": ([*ROWS[:2], "water,90,1,1e4,1,1"], HEADER, None, "line 4: spilled"),
    "liquids": (ROWS, HEADER.replace("liquid", "Liquid name"), "water", "'liquid'"),
    "numbered": (
        [row.replace("water", "1").replace("oil", "2") for row in ROWS],
        HEADER.replace("liquid", "LiquidID"),
        None,
        "'liquid'",
    ),
}


@pytest.mark.parametrize(("rows", "header", "liquid", "said"), REFUSED.values(), ids=REFUSED)
def test_what_cannot_be_used_is_refused_by_name(tmp_path, rows, header, liquid, said):
    path = written(tmp_path, rows, header)
    with pytest.raises(InputError) as refused:
        open_pours(path, liquid)
    assert said in str(refused.value) and str(path) in str(refused.value)


@pytest.mark.parametrize("name", ["liquid_temperature", "remark"])
def test_a_column_that_is_not_read_is_told(tmp_path, caplog, name):
    rows = [row.replace("water", "21.5") for row in ROWS[:3]]
    path = written(tmp_path, rows, HEADER.replace("liquid", name))
    assert open_pours(path).liquid == ""
    (record,) = caplog.records
    assert str(path) in record.getMessage() and name in record.getMessage()


@pytest.mark.parametrize(
    ("rows", "said"),
    [
        (["w,45,15,1,1,1", "w,90,30,1,1,1", "w,90,50,1,1,1"], "distance_cm: 15 cm.* 0 to 7 cm"),
        (["w,45,.01,1,1,1", "w,90,.03,1,1,1", "w,90,.05,1,1,1"], "distance_cm: .*0.05 cm"),
        (["w,1.5,1,1,1,1", "w,2,1,1,1,1", "w,3,1,1,1,1"], "1.5 deg/s.* 30 to 180 deg/s"),
        (["w,45,1,1,1,1", "w,900,1,1,1,1", "w,90,2,1,1,1"], "angular_velocity_deg_s: 900 deg/s"),
    ],
)
def test_pours_that_no_such_cups_could_make_are_refused(tmp_path, rows, said):
    with pytest.raises(InputError, match=said):
        table_and_cups(written(tmp_path, rows), bundled_cups())


def test_bundled_pours_fit_the_bundled_cups_and_cups_need_pours():
    for liquid in POURED_LIQUIDS:
        check_scene(bundled_pours(liquid), bundled_cups())
    with pytest.raises(InputError, match="^cups: "):
        table_and_cups(None, bundled_cups())
    with pytest.raises(InputError, match="^pours: 3 is no table of pours; give a CSV file"):
        table_and_cups(3, None)  # pyright: ignore[reportArgumentType]
