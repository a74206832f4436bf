"""Every table format gives back the numbers and texts."""

import csv
import io
import math
import zipfile
from xml.etree import ElementTree

import numpy as np
import pytest

from kinelast.cli.command import main
from kinelast.outputs.table import FORMATS, Column, Table, csv_bytes, csv_rows, xlsx_bytes
from kinelast.tasks.request import RequestError

NUMBERS = np.array([0.1, -1e-17, np.nan, 12345678.125, 5e-324, 3e300, -0.0])
WORDS = ["a", 'b "c", d', "=1+1", "-o: no", "two\nlines", "<b>", None]
TABLE = Table(
    (Column("x", NUMBERS, "m"), Column("word", WORDS), Column("whole", np.arange(7)), Column("ok", [True] * 7))
)


def test_csv_gives_numbers_and_texts_back(tmp_path):
    path = tmp_path / "table.csv"
    path.write_bytes(csv_bytes(TABLE))
    head, *rows = csv_rows(path.read_bytes())
    assert head == ["x [m]", "word", "whole", "ok"]
    np.testing.assert_array_equal([float(row[0] or "nan") for row in rows], NUMBERS)
    assert [row[1] or None for row in rows] == WORDS
    assert csv_bytes(TABLE, head=False) == csv_bytes(TABLE).partition(b"\n")[2]


def test_no_csv_cell_is_a_spreadsheet_formula():
    cells = [row[1] for row in csv.reader(io.StringIO(csv_bytes(TABLE).decode(), newline=""))]
    assert not [cell for cell in cells if cell.startswith(("=", "+", "-", "@"))]


def test_infinity_is_written_as_inf():
    assert csv_bytes(Table((Column("x", np.array([np.inf, -np.inf, np.nan, 2.0])),))) == b"x\ninf\n-inf\n\n2.0\n"


def test_an_empty_table_has_headings():
    assert csv_bytes(Table((Column("x", np.zeros(0), "m"), Column("why", [])))) == b"x [m],why\n"


def test_parquet_gives_numbers_and_texts_back():
    parquet = pytest.importorskip("pyarrow.parquet", reason="pyarrow is not installed")
    back = parquet.read_table(io.BytesIO(FORMATS["parquet"](TABLE))).to_pydict()
    np.testing.assert_array_equal(back["x [m]"], NUMBERS)
    assert back["word"] == WORDS
    assert back["whole"] == list(range(7))


def test_a_workbook_gives_numbers_and_texts_back():
    with zipfile.ZipFile(io.BytesIO(xlsx_bytes(TABLE))) as archive:
        parts = {name: ElementTree.fromstring(archive.read(name)) for name in archive.namelist()}
    sheet = "{http://schemas.openxmlformats.org/spreadsheetml/2006/main}"
    rows = [["".join(cell.itertext()) for cell in row] for row in parts["xl/worksheets/sheet1.xml"].iter(f"{sheet}row")]
    assert rows[0] == ["x [m]", "word", "whole", "ok"]
    np.testing.assert_array_equal([float(row[0] or "nan") for row in rows[1:]], NUMBERS)
    assert [row[1] or None for row in rows[1:]] == WORDS
    assert xlsx_bytes(TABLE) == xlsx_bytes(TABLE)


def test_html_escapes_texts():
    text = FORMATS["html"](TABLE).decode()
    rows = text.partition("<tbody>\n")[2].partition("\n</tbody>")[0]
    page = ElementTree.fromstring(f"<table>{rows}</table>")
    cells = [[cell.text for cell in row] for row in page]
    np.testing.assert_array_equal([float(row[0] or "nan") for row in cells], NUMBERS)
    assert [row[1] for row in cells] == WORDS


def test_units_are_those_of_the_report():
    table = Table((Column("x", np.array([0.5]), "m"), Column("why", ["none"]))).in_units("mm")
    assert table.headings == ["x [mm]", "why"]
    assert math.isclose(table.columns[0].values[0], 500.0)


def test_too_many_rows_for_a_sheet_are_an_error():
    with pytest.raises(RequestError, match="are too many for a sheet of XLSX"):
        xlsx_bytes(Table((Column("x", np.zeros(1_048_576)),)))


@pytest.mark.slow
def test_tables_are_written_in_every_requested_format(tmp_path, capsys):
    call = ["steel_four_bar", "--positions", "12", "--quiet", "-o", str(tmp_path)]
    assert main([*call, "--tables", "html,xlsx", "--speeds", "10:20:2", "--theory", "quasi-static"]) == 0
    names = {path.name for path in (tmp_path / "steel_four_bar").iterdir()}
    for stem in ("positions", "speeds"):
        assert {f"{stem}.csv", f"{stem}.html", f"{stem}.xlsx"} <= names
    assert main([*call, "--tables", "ods"]) == 2
    assert 'unknown format "ods"; formats: csv, parquet, html, xlsx' in capsys.readouterr().err
