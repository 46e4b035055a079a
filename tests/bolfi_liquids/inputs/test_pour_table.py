"""Tables of pours: what is read, and what is refused."""

import numpy as np
import pytest

from bolfi_liquids.errors import InputError
from bolfi_liquids.inputs.pour_table import open_pours

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
        (ROWS, HEADER, None, "holds pours of oil, water; say whose to take: --liquid NAME"),
        (ROWS, HEADER, "gel", "not of gel"),
        (ROWS, HEADER, "oil", "too few pours: 1; give at least 3"),
        (ROWS, HEADER.replace("retained", "kept"), None, "has no column retained"),
        ([*ROWS[:2], "water,90,x,1,1,1"], HEADER, None, "line 4, column distance_cm: 'x'"),
        ([*ROWS[:2], "water,90,1,1,-1,1"], HEADER, None, "line 4, column retained: -1"),
        (
            [*ROWS[:2], "water,-30,1,1,1,1"],
            HEADER,
            None,
            "angular_velocity_deg_s: -30",
        ),
        ([*ROWS[:2], "water,90,200,1,1,1"], HEADER, None, "200 is not between -20 and 50"),
        ([], "", None, "is empty"),
        ([*ROWS[:2], "water,90,1,0,0,0"], HEADER, None, "line 4: spilled, received and retained"),
    ],
)
def test_what_cannot_be_used_is_refused_by_name(tmp_path, rows, header, liquid, said):
    path = written(tmp_path, rows, header)
    with pytest.raises(InputError) as refused:
        open_pours(path, liquid)
    assert said in str(refused.value)
    assert str(path) in str(refused.value)


def test_columns_that_nobody_reads_are_listed(tmp_path):
    path = written(tmp_path, [f"{row},mine" for row in ROWS[:3]], HEADER.strip() + ",remark\n")
    assert open_pours(path).unused == ("remark",)
    assert open_pours(written(tmp_path, ROWS[:3])).unused == ()


def test_names_in_upper_case_and_decimal_commas_are_read(tmp_path):
    rows = [row.replace(",", ";").replace(".", ",") for row in ROWS[:3]]
    path = written(tmp_path, rows, HEADER.replace(",", " ; ").upper())
    np.testing.assert_array_equal(
        open_pours(path).fractions, open_pours(written(tmp_path, ROWS[:3])).fractions
    )
