"""Tables that a person writes, as spreadsheets and editors save them."""

import subprocess
import sys
import zipfile

import numpy as np
import pytest

from bolfi_liquids.errors import InputError
from bolfi_liquids.inputs.table import parse_number, read_table

POINTS = "t (ms),x,note\n0,1.5,a\n1,-2e-3,b\n"
COMMAS = "t (ms);x;note\n0;1,5;a\n1;-2e-3;b\n"


@pytest.fixture
def table(tmp_path):
    """Reads a table of this text."""

    def read(text, **signs):
        (tmp_path / "table.csv").write_bytes(text if isinstance(text, bytes) else text.encode())
        return read_table(tmp_path / "table.csv", **signs)

    return read


@pytest.mark.parametrize(
    ("text", "signs"),
    [
        (POINTS, {}),
        (COMMAS.replace("\n", "\r\n"), {}),
        (POINTS.replace(",", ";"), {}),
        (COMMAS.replace("note", "\tnote"), {}),
        (POINTS.replace(",", "\t"), {}),
        ("sep=;\n" + COMMAS, {}),
        (COMMAS.replace(";", "|"), {"delimiter": "|", "decimal": ","}),
        ("by hand\n" + COMMAS.replace(";", "\t"), {"decimal": ",", "skip": 1}),
        ("t (ms),x,note,\n0,1.5,a,\n\n1,-2e-3,b,,,\n", {}),
        (COMMAS.replace("a\n", "24.11.2026\n").replace("b\n", "10.0.0.1\n"), {}),
    ],
)
def test_the_header_tells_the_delimiter_and_with_it_the_decimal_sign(table, text, signs):
    read = table(text, **signs)
    assert read.header == ("t (ms)", "x", "note")
    np.testing.assert_array_equal(read.numbers("x"), [1.5, -2e-3])


@pytest.mark.parametrize("encoding", ["utf-8", "utf-8-sig", "utf-16"])
def test_the_encoding_is_utf_8_or_what_the_byte_order_mark_says(table, encoding):
    rows = "".join(f"{k};Öl, zähflüssig und süß\n" for k in range(20))
    read = table(f"Größe;Flüssigkeit\n{rows}".encode(encoding))
    assert read.header == ("Größe", "Flüssigkeit")
    assert set(read.column("Flüssigkeit")) == {"Öl, zähflüssig und süß"}


def test_a_workbook_is_read_as_a_table(tmp_path):
    book = pytest.importorskip("openpyxl").Workbook()
    for row in (["t", "x", "note"], [0, 1.5, "a"], [1, None, ""], [2, 0.1, "b"]):
        book.active.append(row)
    book.save(tmp_path / "table.xlsx")
    read = read_table(tmp_path / "table.xlsx")
    assert read.header == ("t", "x", "note")
    np.testing.assert_array_equal(read.numbers("x"), [1.5, np.nan, 0.1])
    with pytest.raises(InputError, match="line 2, column note"):
        read.numbers("note")


def test_every_double_comes_back_exactly_with_either_decimal_sign():
    values = np.random.default_rng(0).normal(size=300) * 10.0 ** np.arange(-150, 150)
    for text in [*map(repr, values.tolist()), "+.5", "2.", "1E3", "-0.0"]:
        assert parse_number(f" {text}") == float(text)
        assert parse_number(text.replace(".", ","), ",") == float(text)


def test_names_are_compared_without_case_and_blanks_unless_one_is_exact(table):
    read = table(' Distance_CM , x\n"1",2\n')
    assert read.has("distance_cm") and read.numbers("distance_cm").tolist() == [1.0]
    assert read.others(["DISTANCE_cm"]) == ("x",)
    assert table("x,X\n1,2\n").numbers("X").tolist() == [2.0]


REFUSED = {
    "surplus": ("a,b\n1,2\n\n3,4,5\n", "line 4"),
    "too short": ("a,b\n1,2\n3\n", "line 3"),
    "no number": ("a,b\n1,2\n,\n3,x\n", "line 4, column b"),
    "open quotation mark": ('a,b\n1,"2\n', "line 2"),
    "a comma without semicolons": ("a\tb\n1\t1,234\n", "line 2, column b"),
    "a point beside commas": ("a;b\n1,5;1.234\n", "line 2, column b"),
    "no such column": ("a,c\n1,2\n", "header"),
    "two such columns": ("b, B\n1,2\n".replace("b,", "B ,"), "header"),
    "no header": ("0,1.5\n1,2.5\n", "line 1"),
    "empty": ("\n \n", "table.csv"),
    "another encoding": ("x,Öl\n1,2\n".encode("cp1252"), "byte 2"),
}


@pytest.mark.parametrize(("text", "place"), REFUSED.values(), ids=REFUSED)
def test_what_is_no_such_table_is_refused_by_its_place(table, text, place):
    with pytest.raises(InputError) as refused:
        table(text).numbers("b")
    assert "table.csv" in refused.value.where
    assert place in f"{refused.value.where} {refused.value.what}" and refused.value.fix


@pytest.mark.parametrize("odd", ["3_0", "٣", "1e999", "-nan", "1 000"])
def test_odd_numerals_are_refused(table, odd):
    read = table(f"a;b\n1.5;2\n2;{odd}\n")
    assert read.numbers("a").tolist() == [1.5, 2.0]
    with pytest.raises(InputError, match="line 3, column b") as refused:
        read.numbers("b")
    assert odd in refused.value.what


def test_an_empty_cell_is_missing_unless_the_column_requires_it(table):
    read = table("a,b\n1,\n2,n/a\n3,NaN\n")
    assert np.isnan(read.numbers("b")).all()
    with pytest.raises(InputError, match="line 2, column b.*, or remove the line;"):
        read.numbers("b", required="remove the line")


def test_a_damaged_workbook_is_refused(tmp_path):
    path = tmp_path / "table.xlsx"
    path.write_bytes(b"PK\x03\x04" + bytes(range(256)) * 20)
    with pytest.raises(InputError, match=r"table\.xlsx.*; save it as CSV in UTF-8$"):
        read_table(path)


def test_a_workbook_without_its_reader_names_the_reader(tmp_path, monkeypatch):
    with zipfile.ZipFile(tmp_path / "table.xlsx", "w") as book:
        book.writestr("xl/workbook.xml", "")
    monkeypatch.setitem(sys.modules, "openpyxl", None)
    with pytest.raises(InputError, match="pip install openpyxl"):
        read_table(tmp_path / "table.xlsx")


def test_pandas_is_imported_when_a_table_is_read():
    code = "import sys, bolfi_liquids.inputs.pour_table; sys.exit('pandas' in sys.modules)"
    subprocess.run([sys.executable, "-c", code], check=True)
