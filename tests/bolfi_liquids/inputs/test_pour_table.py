"""Tables of pours: what is read, and what is refused."""

import numpy as np
import pytest

from bolfi_liquids.errors import InputError
from bolfi_liquids.inputs.bundled import POURED_LIQUIDS, bundled_pours
from bolfi_liquids.inputs.cups import bundled_cups
from bolfi_liquids.inputs.pour_table import check_scene, open_pours

HEADER = "liquid,angular_velocity_deg_s,distance_cm,received,retained,spilled\n"
ROWS = ["water,45,1.5,90,5,5", "water,90,1.5,80,0,20", "water,90,3,10,10,0", "oil,45,1.5,1,1,2"]


def written(tmp_path, rows, header=HEADER):
    path = tmp_path / "pours.csv"
    path.write_text(header + "".join(f"{row}\n" for row in rows))
    return path


def test_amounts_in_any_unit_become_fractions(tmp_path):
    table = open_pours(written(tmp_path, ROWS), liquid="water")
    np.testing.assert_allclose(table.fractions[0], [0.05, 0.9, 0.05])
    np.testing.assert_allclose(table.fractions.sum(1), 1.0)
    np.testing.assert_allclose(table.observed, [[0.05, 0.2, 0.0], [0.05, 0.0, 0.5]])
    np.testing.assert_allclose(table.angular_velocity, np.radians([45.0, 90.0, 90.0]))
    np.testing.assert_allclose(table.distance, [0.015, 0.015, 0.03])


def test_a_table_without_names_is_of_one_liquid_whatever_it_is_called(tmp_path):
    nameless = [row.split(",", 1)[1] for row in ROWS[:3]]
    path = written(tmp_path, nameless, HEADER.split(",", 1)[1])
    assert len(open_pours(path, liquid="glycerin").distance) == 3


def test_one_liquid_needs_no_name(tmp_path):
    assert open_pours(written(tmp_path, ROWS[:3])).liquid == "water"


@pytest.mark.parametrize(
    ("rows", "header", "liquid", "said"),
    [
        (ROWS, HEADER, None, "holds pours of oil, water; say whose to take by `liquid`"),
        (ROWS, HEADER, "gel", "not of gel"),
        (ROWS, HEADER, "oil", "too few pours: 1; give at least 3"),
        (ROWS, HEADER.replace("retained", "kept"), None, "has no column retained"),
        ([*ROWS[:2], "water,90,x,1,1,1"], HEADER, None, "line 4, column distance_cm: 'x'"),
        ([*ROWS[:2], "water,90,1,1,-1,1"], HEADER, None, "line 4, column retained: '-1'"),
        (
            [*ROWS[:2], "water,-30,1,1,1,1"],
            HEADER,
            None,
            "angular_velocity_deg_s: '-30'",
        ),
        ([*ROWS[:2], "water,90,200,1,1,1"], HEADER, None, "'200' is not between -20 and 50"),
        ([], "", None, "is empty"),
        ([*ROWS[:2], "water,90,1,0,0,0"], HEADER, None, "line 4: spilled, received, retained"),
        (
            [*ROWS[:2], "water,90,1,1e30,1,1"],
            HEADER,
            None,
            "line 4: spilled, received, retained",
        ),
    ],
)
def test_what_cannot_be_used_is_refused_by_name(tmp_path, rows, header, liquid, said):
    path = written(tmp_path, rows, header)
    with pytest.raises(InputError) as refused:
        open_pours(path, liquid)
    assert said in str(refused.value)
    assert str(path) in str(refused.value)


def test_names_in_upper_case_and_decimal_commas_are_read(tmp_path):
    rows = [row.replace(",", ";").replace(".", ",") for row in ROWS[:3]]
    path = written(tmp_path, rows, HEADER.replace(",", " ; ").upper())
    np.testing.assert_array_equal(
        open_pours(path).fractions, open_pours(written(tmp_path, ROWS[:3])).fractions
    )


@pytest.mark.parametrize(
    "header", [HEADER, HEADER.replace("liquid", "Liquid"), HEADER.replace("liquid", " LIQUID ")]
)
@pytest.mark.parametrize("encoding", ["utf-8", "utf-8-sig", "utf-16"])
def test_a_liquid_is_found_however_a_spreadsheet_saves_the_table(tmp_path, header, encoding):
    path = written(tmp_path, ROWS, header)
    path.write_bytes(path.read_text().encode(encoding))
    assert len(open_pours(path, "water").distance) == 3
    with pytest.raises(InputError, match="oil, water"):
        open_pours(path)


@pytest.mark.parametrize("name", ["liquids", "Liquid name", "liqiud", "fluid"])
def test_a_column_that_may_name_the_liquids_is_not_passed_over(tmp_path, name):
    with pytest.raises(InputError, match="'liquid'"):
        open_pours(written(tmp_path, ROWS, HEADER.replace("liquid", name)), "water")


@pytest.mark.parametrize(
    "name", ["liquids", "liquid_id", "Liquid No.", "LiquidID", "liqiud", "fluid", "Fluid number"]
)
def test_liquids_that_are_numbered_are_not_passed_over(tmp_path, name):
    """Pours of several liquids would be judged as those of one."""
    rows = [row.replace("water", "1").replace("oil", "2") for row in ROWS]
    path = written(tmp_path, rows, HEADER.replace("liquid", name))
    with pytest.raises(InputError, match="'liquid'"):
        open_pours(path)
    numbered = written(tmp_path, rows)
    assert open_pours(numbered, "1").liquid == "1"
    with pytest.raises(InputError, match="holds pours of 1, 2"):
        open_pours(numbered)


@pytest.mark.parametrize("name", ["liquid_temperature", "liquid_mass_g", "Liquid density"])
def test_a_measurement_of_the_liquid_does_not_name_it(tmp_path, caplog, name):
    rows = [row.replace("water", "21.5") for row in ROWS[:3]]
    path = written(tmp_path, rows, HEADER.replace("liquid", name))
    assert open_pours(path).liquid == ""
    assert name in caplog.text


def test_columns_that_nobody_reads_are_told(tmp_path, caplog):
    path = written(tmp_path, [f"{row},mine" for row in ROWS[:3]], HEADER.strip() + ",remark\n")
    open_pours(path)
    (record,) = caplog.records
    assert str(path) in record.getMessage() and "remark" in record.getMessage()


def test_a_surplus_cell_is_refused_with_its_line(tmp_path):
    with pytest.raises(InputError, match="line 3: 7 cells, where the header has 6"):
        open_pours(written(tmp_path, [ROWS[0], "water,90,1,5,80,0,20", ROWS[2]]))


@pytest.mark.parametrize(
    ("rows", "said"),
    [
        (["w,45,15,1,1,1", "w,90,30,1,1,1", "w,90,50,1,1,1"], "distance_cm: 15 cm; .* 0 to 7 cm"),
        (
            ["w,45,.01,1,1,1", "w,90,.03,1,1,1", "w,90,.05,1,1,1"],
            "distance_cm: .* 0.05 cm, at least 0.14 cm",
        ),
        (["w,1.5,1,1,1,1", "w,2,1,1,1,1", "w,3,1,1,1,1"], "1.5 deg/s; .* 30 to 180 deg/s"),
        (["w,45,-8,1,1,1", "w,90,1,1,1,1", "w,90,2,1,1,1"], "distance_cm: -8 cm"),
        (["w,45,1,1,1,1", "w,900,1,1,1,1", "w,90,2,1,1,1"], "angular_velocity_deg_s: 900 deg/s"),
    ],
)
def test_pours_that_no_such_cups_could_make_are_refused(tmp_path, rows, said):
    table = open_pours(written(tmp_path, rows))
    with pytest.raises(InputError, match=said):
        check_scene(table, bundled_cups())


@pytest.mark.parametrize("liquid", POURED_LIQUIDS)
def test_bundled_pours_fit_the_bundled_cups(liquid):
    check_scene(bundled_pours(liquid), bundled_cups())
