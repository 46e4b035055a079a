"""Numbers as people write them."""

import pytest

from bolfi_liquids.inputs.table import parse_number

ODD = ["3_0", "٣", "３", "1e999", "-1e999", "inf", "nan", "infinity", "0x10", "1,5", "1 000", ""]
ODD += [".", "1.2.3", "--1", "1e", "e5", "1.5e2.5", "5%", "½"]


@pytest.mark.parametrize("text", ODD)
def test_what_python_or_people_call_a_number_else_is_refused(text):
    with pytest.raises(ValueError):
        parse_number(text)


@pytest.mark.parametrize(
    ("text", "number"),
    [("1", 1.0), ("-1.5", -1.5), ("+.5", 0.5), ("2.", 2.0), (" 1e-3 ", 1e-3), ("1E3", 1000.0)],
)
def test_plain_numbers_are_read_with_either_decimal_sign(text, number):
    assert parse_number(text) == number
    assert parse_number(text.replace(".", ","), ",") == number


def test_a_point_is_no_number_where_the_decimal_sign_is_a_comma():
    with pytest.raises(ValueError):
        parse_number("1.234", ",")
