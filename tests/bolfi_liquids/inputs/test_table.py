"""Tables that a person writes, as spreadsheets and editors save them."""

import subprocess
import sys

import numpy as np
import pytest

from bolfi_liquids.errors import InputError
from bolfi_liquids.inputs.table import read_table

POINTS = "t (ms),x,note\n0,1.5,a\n1,-2e-3,b\n"
COMMAS = "t (ms);x;note\n0;1,5;a\n1;-2e-3;b\n"


@pytest.mark.parametrize(
    "text", [POINTS, COMMAS, POINTS.replace(",", "\t"), POINTS.replace(",", ";")]
)
@pytest.mark.parametrize("newline", ["\n", "\r\n"])
def test_the_header_tells_the_delimiter_and_with_it_the_decimal_sign(tmp_path, text, newline):
    path = tmp_path / "table.csv"
    path.write_text(text, newline=newline)
    table = read_table(path)
    assert table.header == ("t (ms)", "x", "note")
    np.testing.assert_array_equal(table.numbers("x"), [1.5, -2e-3])


@pytest.mark.parametrize("other", ["24.11.2026", "v1.2", "10.0.0.1", "3.5 g"])
def test_only_whole_numbers_tell_the_decimal_sign(tmp_path, other):
    path = tmp_path / "table.csv"
    path.write_text(f"note;x\n{other};30,5\n{other};1,5e-3\n")
    np.testing.assert_array_equal(read_table(path).numbers("x"), [30.5, 1.5e-3])


@pytest.mark.parametrize("delimiter", ["\t", "|"])
def test_a_map_may_give_other_signs(tmp_path, delimiter):
    path = tmp_path / "table.csv"
    path.write_text(COMMAS.replace(";", delimiter))
    with pytest.raises(InputError):
        read_table(path).numbers("x")
    table = read_table(path, delimiter=delimiter, decimal=",")
    np.testing.assert_array_equal(table.numbers("x"), [1.5, -2e-3])


@pytest.mark.parametrize("encoding", ["utf-8", "utf-8-sig", "utf-16"])
def test_the_encoding_is_utf_8_or_what_the_byte_order_mark_says(tmp_path, encoding):
    path = tmp_path / "table.csv"
    rows = "".join(f"{k};Öl, zähflüssig und süß\n" for k in range(20))
    path.write_bytes(f"Größe;Flüssigkeit\n{rows}".encode(encoding))
    table = read_table(path)
    assert table.header == ("Größe", "Flüssigkeit")
    assert set(table.column("Flüssigkeit")) == {"Öl, zähflüssig und süß"}


def test_another_encoding_is_refused_with_its_byte(tmp_path):
    path = tmp_path / "table.csv"
    path.write_bytes("x,Öl\n1,2\n".encode("cp1252"))
    with pytest.raises(InputError, match="byte 2") as refused:
        read_table(path)
    assert "UTF-8" in refused.value.fix


def test_a_workbook_is_read_as_a_table(tmp_path):
    book = pytest.importorskip("openpyxl").Workbook()
    for row in (["t", "x", "note"], [0, 1.5, "a"], [1, None, ""], [2, 0.1, "b"]):
        book.active.append(row)
    book.save(tmp_path / "table.xlsx")
    table = read_table(tmp_path / "table.xlsx")
    assert table.header == ("t", "x", "note")
    np.testing.assert_array_equal(table.numbers("x"), [1.5, np.nan, 0.1])
    with pytest.raises(InputError, match="line 2, column note"):
        table.numbers("note")


def test_every_double_comes_back_exactly(tmp_path):
    values = np.random.default_rng(0).normal(size=300) * 10.0 ** np.arange(-150, 150)
    path = tmp_path / "table.csv"
    path.write_text("x\n" + "".join(f"{value!r}\n" for value in values.tolist()))
    np.testing.assert_array_equal(read_table(path).numbers("x"), values)


def test_names_are_compared_without_case_and_blanks(tmp_path):
    path = tmp_path / "table.csv"
    path.write_text(" Distance_CM , x\n1,2\n")
    table = read_table(path)
    assert table.has("distance_cm") and table.numbers("distance_cm").tolist() == [1.0]
    assert table.others(["DISTANCE_cm"]) == ("x",)


def test_an_exact_name_comes_before_one_of_other_case(tmp_path):
    path = tmp_path / "table.csv"
    path.write_text("x,X\n1,2\n")
    assert read_table(path).numbers("X").tolist() == [2.0]
    path.write_text("x,X\n1,2\n".replace("X", " x"))
    with pytest.raises(InputError, match="2 columns"):
        read_table(path).numbers("X")


@pytest.mark.parametrize(
    ("text", "line"),
    [
        ("a,b\n1,2\n\n3,4,5\n", 4),  # surplus
        ("a,b\n1,2\n3\n", 3),  # too short for b
        ("a,b\n1,2\n,\n3,x\n", 4),  # no number
        ('a,b\n1,2\n"3,x",4,5\n', 3),
    ],
)
def test_a_bad_line_is_named_by_its_number_in_the_file(tmp_path, text, line):
    path = tmp_path / "table.csv"
    path.write_text(text)
    with pytest.raises(InputError) as refused:
        read_table(path).numbers("b")
    assert refused.value.where.startswith(f"{path}: line {line}")


def test_delimiters_behind_the_last_column_are_no_cells(tmp_path):
    path = tmp_path / "table.csv"
    path.write_text("a,b,\n1,2,\n3,4,,,\n")
    assert read_table(path).numbers("b").tolist() == [2.0, 4.0]


def test_a_cell_may_hold_the_delimiter_in_quotation_marks(tmp_path):
    path = tmp_path / "table.csv"
    path.write_text('name,b\n"water, salted",2\n')
    assert read_table(path).column("name").tolist() == ["water, salted"]


def test_a_file_that_is_no_text_is_refused(tmp_path):
    path = tmp_path / "table.xlsx"
    path.write_bytes(b"PK\x03\x04" + bytes(range(256)) * 20)
    with pytest.raises(InputError, match="table.xlsx"):
        read_table(path)


@pytest.mark.parametrize("content", ["", "\n \n"])
def test_an_empty_file_is_refused(tmp_path, content):
    (tmp_path / "table.csv").write_text(content)
    with pytest.raises(InputError, match=r"table\.csv: is empty"):
        read_table(tmp_path / "table.csv")


def test_a_table_of_which_all_is_skipped_is_not_called_empty(tmp_path):
    (tmp_path / "table.csv").write_text("a,b\n1,2\n")
    assert read_table(tmp_path / "table.csv", skip=5).header == ()


def test_pandas_is_imported_when_a_table_is_read():
    code = "import sys, bolfi_liquids.inputs.pour_table; sys.exit('pandas' in sys.modules)"
    subprocess.run([sys.executable, "-c", code], check=True)


@pytest.mark.parametrize("odd", ["3_0", "٣", "1e999", "inf", "-nan", "1,234.5", "1 000"])
@pytest.mark.parametrize("delimiter", [";", "\t"])
def test_odd_numerals_are_refused_with_their_place(tmp_path, odd, delimiter):
    path = tmp_path / "table.csv"
    path.write_text(f"a;b\n1.5;2\n2;{odd}\n".replace(";", delimiter), encoding="utf-8")
    assert read_table(path).numbers("a").tolist() == [1.5, 2.0]
    with pytest.raises(InputError) as refused:
        read_table(path).numbers("b")
    assert refused.value.where == f"{path}: line 3, column b"
    assert odd in refused.value.what


def test_a_comma_is_a_decimal_sign_only_beside_semicolons(tmp_path):
    path = tmp_path / "table.csv"
    path.write_text("a;b\n1,234;2\n5,678;3\n")
    assert read_table(path).numbers("a").tolist() == [1.234, 5.678]
    path.write_text("a\tb\n1,234\t2\n5,678\t3\n")
    with pytest.raises(InputError, match="1,234"):
        read_table(path).numbers("a")


def test_the_line_that_tells_excel_the_delimiter_is_no_header(tmp_path):
    path = tmp_path / "table.csv"
    path.write_text("sep=;\na;b\n1,5;2\n1,5;x\n")
    table = read_table(path)
    assert table.header == ("a", "b") and table.numbers("a").tolist() == [1.5, 1.5]
    with pytest.raises(InputError, match="line 4, column b"):
        table.numbers("b")


def test_a_table_without_names_is_refused(tmp_path):
    path = tmp_path / "table.csv"
    path.write_text("0,1.5\n1,2.5\n")
    with pytest.raises(InputError, match="line 1: holds numbers"):
        read_table(path)
