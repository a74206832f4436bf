"""Tables, and the file formats of tables (CSV, Parquet, HTML and XLSX). Each column has a name and a unit.

To add a format, write a function that converts a table to bytes, and add the function to `FORMATS`. The option
`--tables` accepts all formats in `FORMATS`. Its help text in `kinelast/tasks/request.py` names them.
"""

from __future__ import annotations

import io
import math
import re
from collections.abc import Callable, Iterable, Mapping, Sequence
from fnmatch import fnmatchcase
from pathlib import Path
from typing import Any

import msgspec
import numpy as np
from msgspec import Struct
from msgspec.structs import replace

from kinelast.tasks.request import RequestError
from kinelast.values.numbers import REPORT_UNITS

ROWS_OF_A_SHEET = 1_048_576  # maximum number of rows of an XLSX sheet, including the row with headings
FORMULA = re.compile(r"'?(?:[=@+\t]|-(?![\d.]+(?:e[-+]?\d+)?$))")  # text that a spreadsheet reads as a formula
INERT = re.compile(rf"'(?:{FORMULA.pattern})")  # text that consists of a single quote and a formula


class Column(Struct, frozen=True, eq=False):
    """A column of a table.

    Attributes
    ----------
    name, unit
        Name and unit for the heading of the column. If there is no unit, `unit` is empty.
    values
        Values of the column. Either an array of numbers, shape (rows,), in which unknown numbers are nan. Or a sequence
        of strings, booleans and numbers, in which unknown values are None.
    """

    name: str
    values: Any
    unit: str = ""

    @property
    def heading(self) -> str:
        """Heading of the column: the name, followed by the unit in brackets."""
        return f"{self.name} [{self.unit}]" if self.unit else self.name

    @property
    def is_numeric(self) -> bool:
        """Whether `values` is an array of numbers."""
        return isinstance(self.values, np.ndarray) and self.values.dtype.kind in "fiu"

    @property
    def is_finite(self) -> bool:
        """Whether `values` is an array of numbers without infinities. JSON cannot represent infinities."""
        return self.is_numeric and not np.isinf(self.values).any()


class Table(Struct, frozen=True, eq=False):
    """A table: several columns with equal numbers of rows."""

    columns: tuple[Column, ...]

    @classmethod
    def of_rows(cls, headings: Sequence[str], rows: Iterable[Sequence[Any]]) -> Table:
        """Return a table with the given headings and rows."""
        columns = list(zip(*rows, strict=True)) or [()] * len(headings)
        return cls(tuple(Column(name, values) for name, values in zip(headings, columns, strict=True)))

    @property
    def headings(self) -> list[str]:
        """Headings of the columns."""
        return [column.heading for column in self.columns]

    def in_units(self, system: str) -> Table:
        """Convert a table with SI units to the unit system `system`: "SI", "mm" or "in"."""
        factors = REPORT_UNITS.get(system)
        if not factors:
            return self

        def converted(column: Column) -> Column:
            factor, unit = factors.get(column.unit, (1.0, column.unit))
            return replace(column, unit=unit, values=column.values * factor if factor != 1.0 else column.values)

        return Table(tuple(map(converted, self.columns)))

    def chosen(self, patterns: Sequence[str]) -> Table:
        """Return a table with the first column, and all columns with a name that matches a pattern.

        A pattern may contain the wildcards `*` and `?`. If `patterns` is empty, return the whole table.
        """
        if not patterns:
            return self
        first, *others = self.columns
        return Table((first, *(each for each in others if any(fnmatchcase(each.name, one) for one in patterns))))

    def rows(self) -> list[tuple[Any, ...]]:
        """Return the rows of the table. Values that are nan become None."""
        columns = (column.values.tolist() if column.is_numeric else column.values for column in self.columns)
        return list(zip(*([None if value != value else value for value in each] for each in columns), strict=True))  # noqa: PLR0124


def csv_bytes(table: Table, head: bool = True) -> bytes:
    """Return a table as CSV. If `head` is False, leave out the headings.

    A number is written with the fewest digits from which the number can be read back exactly. The cell of an unknown
    value is empty. If a spreadsheet would interpret a text as a formula, a single quote is put in front of the text.
    """
    lines = [",".join(map(quoted, table.headings)).encode()] if head else []
    lines += _lines(table.columns)
    return b"\n".join([*lines, b""])


def _lines(columns: Sequence[Column]) -> Iterable[bytes]:
    """Return the columns as lines of a CSV file, without headings.

    If all columns contain only floats without infinities, one call encodes all columns, which is faster than one call
    for each column. The result is then one piece of bytes that contains all lines.
    """
    if all(len(column.values) and column.is_finite and column.values.dtype.kind == "f" for column in columns):
        rows = np.array([column.values for column in columns]).T.tolist()
        return [msgspec.json.encode(rows)[2:-2].replace(b"null", b"").replace(b"],[", b"\n")]
    return map(b",".join, zip(*map(_cells, columns), strict=True))


def _cells(column: Column) -> list[bytes]:
    """Return the values of a column as cells of a CSV file."""
    if not column.is_finite:
        return [_cell(value) for value in (column.values.tolist() if column.is_numeric else column.values)]
    if not len(column.values):
        return []
    return msgspec.json.encode(column.values.tolist())[1:-1].replace(b"null", b"").split(b",")


def _cell(value: Any) -> bytes:
    if value is None or (isinstance(value, float) and math.isnan(value)):
        return b""
    if isinstance(value, float) and math.isfinite(value):
        return msgspec.json.encode(float(value))
    if isinstance(value, str):
        return quoted(f"'{value}" if FORMULA.match(value) else value).encode()
    return str(value).encode()


def quoted(text: str) -> str:
    """Return a text as a cell of a CSV file. If the text contains a comma, quote or line break, put it in quotes."""
    return '"{}"'.format(text.replace('"', '""')) if any(letter in text for letter in ',"\n\r') else text


def csv_rows(content: bytes) -> list[list[str]]:
    """Return the rows of a CSV file from `csv_bytes`, including the headings.

    If `csv_bytes` has put a single quote in front of a text, the single quote is removed.
    """
    import csv

    rows = csv.reader(io.StringIO(content.decode(), newline=""))
    return [[cell[INERT.match(cell) is not None :] for cell in row] for row in rows]


def parquet_bytes(table: Table, about: Mapping[str, str] | None = None) -> bytes:
    """Return a table as a Parquet file with the metadata `about`. This function needs the package pyarrow."""
    import pyarrow
    import pyarrow.parquet

    def array(column: Column) -> Any:
        if column.is_numeric or column.unit:
            return pyarrow.array(column.values, None if column.is_numeric else pyarrow.float64())
        values = list(column.values)
        return pyarrow.array(values, pyarrow.string() if all(value is None for value in values) else None)

    whole = pyarrow.Table.from_arrays([array(column) for column in table.columns], table.headings)
    whole = whole.replace_schema_metadata(dict(about) if about else None)
    words = [column.heading for column in table.columns if not column.is_numeric]
    target = io.BytesIO()
    pyarrow.parquet.write_table(whole, target, compression="zstd", use_dictionary=words)
    return target.getvalue()


def html_bytes(table: Table) -> bytes:
    """Return a table as a self-contained HTML page."""
    from html import escape

    head = "".join(f"<th>{escape(heading)}</th>" for heading in table.headings)
    body = "\n".join(
        "<tr>" + "".join(f"<td>{escape('' if cell is None else str(cell))}</td>" for cell in row) + "</tr>"
        for row in table.rows()
    )
    style = "td{text-align:right;padding:0 .5em;font-variant-numeric:tabular-nums}"
    return (
        f'<!doctype html>\n<meta charset="utf-8">\n<style>{style}</style>\n<table>\n<thead><tr>{head}</tr></thead>\n'
        f"<tbody>\n{body}\n</tbody>\n</table>\n"
    ).encode()


SHEET = {  # names and content of the files in an XLSX workbook with one sheet: ECMA-376, part 1, annex L.2
    "[Content_Types].xml": '<Types xmlns="http://schemas.openxmlformats.org/package/2006/content-types">'
    '<Default Extension="rels" ContentType="application/vnd.openxmlformats-package.relationships+xml"/>'
    '<Override PartName="/xl/workbook.xml"'
    ' ContentType="application/vnd.openxmlformats-officedocument.spreadsheetml.sheet.main+xml"/>'
    '<Override PartName="/xl/worksheets/sheet1.xml"'
    ' ContentType="application/vnd.openxmlformats-officedocument.spreadsheetml.worksheet+xml"/></Types>',
    "_rels/.rels": '<Relationships xmlns="http://schemas.openxmlformats.org/package/2006/relationships">'
    '<Relationship Id="rId1" Target="xl/workbook.xml"'
    ' Type="http://schemas.openxmlformats.org/officeDocument/2006/relationships/officeDocument"/></Relationships>',
    "xl/_rels/workbook.xml.rels": '<Relationships xmlns="http://schemas.openxmlformats.org/package/2006/relationships">'
    '<Relationship Id="rId1" Target="worksheets/sheet1.xml"'
    ' Type="http://schemas.openxmlformats.org/officeDocument/2006/relationships/worksheet"/></Relationships>',
    "xl/workbook.xml": '<workbook xmlns="http://schemas.openxmlformats.org/spreadsheetml/2006/main"'
    ' xmlns:r="http://schemas.openxmlformats.org/officeDocument/2006/relationships">'
    '<sheets><sheet name="table" sheetId="1" r:id="rId1"/></sheets></workbook>',
    "xl/worksheets/sheet1.xml": '<worksheet xmlns="http://schemas.openxmlformats.org/spreadsheetml/2006/main">'
    "<sheetData>{rows}</sheetData></worksheet>",
}


def xlsx_bytes(table: Table) -> bytes:
    """Return a table as an XLSX workbook with one sheet. Equal tables give equal bytes.

    Raises
    ------
    RequestError
        The table has more rows than an XLSX sheet can contain.
    """
    import zipfile

    rows = table.rows()
    if len(rows) >= ROWS_OF_A_SHEET:
        raise RequestError(f"{len(rows)} rows are too many for a sheet of XLSX, which has {ROWS_OF_A_SHEET - 1}")
    body = "".join(f"<row>{''.join(map(_sheet_cell, row))}</row>" for row in (tuple(table.headings), *rows))
    target = io.BytesIO()
    with zipfile.ZipFile(target, "w", zipfile.ZIP_DEFLATED) as archive:
        for name, text in SHEET.items():
            whole = f'<?xml version="1.0" encoding="UTF-8" standalone="yes"?>\n{text.replace("{rows}", body)}'
            archive.writestr(zipfile.ZipInfo(name), whole, zipfile.ZIP_DEFLATED)
    return target.getvalue()


def _sheet_cell(value: Any) -> str:
    if value is None:
        return "<c/>"
    if isinstance(value, bool):
        return f'<c t="b"><v>{value:d}</v></c>'
    if isinstance(value, (int, float)) and math.isfinite(value):
        return f"<c><v>{value!r}</v></c>"
    from html import escape

    return f'<c t="inlineStr"><is><t xml:space="preserve">{escape(str(value), quote=False)}</t></is></c>'


FORMATS: dict[str, Callable[[Table], bytes]] = {
    "csv": csv_bytes,
    "parquet": parquet_bytes,
    "html": html_bytes,
    "xlsx": xlsx_bytes,
}


def require_formats(names: Sequence[str]) -> None:
    """Raise RequestError if `FORMATS` does not contain one of the names."""
    for name in names:
        if name not in FORMATS:
            raise RequestError(f'--tables: unknown format "{name}"; formats: {", ".join(FORMATS)}')


def write_table(path: Path, table: Table, others: Sequence[str] = ()) -> None:
    """Write a table to a CSV file and, for each format in `others`, to a file with the extension of this format."""
    for kind in dict.fromkeys(("csv", *others)):
        path.with_suffix(f".{kind}").write_bytes(FORMATS[kind](table))
