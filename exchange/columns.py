"""Columns of CSV files: headings, cells, and the line number of every row."""

import csv
import re
from collections.abc import Iterator
from typing import Any

from msgspec import Struct
from msgspec.structs import replace

from exchange.foreign_mechanism import ExchangeError

SEPARATORS = ";\t,"  # possible column separators; the comma is tried last, because it may be a decimal comma
# unit in a heading, such as "angle [deg]", "angle (deg)", "angle / deg"
UNIT = re.compile(r"\[(.*)\]|\((.*)\)\s*$|/\s*(.+)$")
NUMBER = re.compile(r"[-+]?\.?\d")  # start of a number
COMMENT = "#%"  # characters that start a comment


class Columns(Struct, frozen=True):
    """Cells of a CSV file.

    Attributes
    ----------
    headings
        Line number (from 1) and cells of each heading line before the first row of numbers. If several heading lines
        contain a unit for a column, `heading` returns the unit in the last of these lines.
    rows
        Line number and cells of each row of numbers, with decimal points instead of decimal commas.
    titles
        Line number and text of each other line before the first row of numbers.
    """

    headings: tuple[tuple[int, tuple[str, ...]], ...]
    rows: tuple[tuple[int, tuple[str, ...]], ...]
    titles: tuple[tuple[int, str], ...] = ()

    def heading(self, column: int) -> tuple[int, str]:
        """Return the unit of a column, preceded by the number of the heading line that contains the unit.

        A unit is in brackets or after a slash. If a column has no such unit, the last of several heading lines is taken
        as a line of units. If there is only one heading line, return (0, "").
        """
        for line, cells in reversed(self.headings):
            found = UNIT.search(cells[column])
            if found:
                return line, next(part for part in found.groups() if part is not None).strip()
        if len(self.headings) > 1:
            line, cells = self.headings[-1]
            return line, cells[column]
        return 0, ""


def columns_of(text: str, names: tuple[str, ...]) -> Columns:
    r"""Return the first `len(names)` columns of a CSV text.

    Columns may be separated by commas, semicolons or tabs. Further columns on the right are ignored if they are empty.
    They are also ignored if they have headings and the first `len(names)` columns have units.

    Parameters
    ----------
    names
        Names of the expected columns, for messages.

    Raises
    ------
    ExchangeError
        If a line has too few or too many cells. The message gives the line number.

    Examples
    --------
    >>> found = columns_of("time [ms];angle [deg];remark\n0;0;\n12,5;90;top", ("time", "angle"))
    >>> found.heading(0), found.rows[1]
    ((1, 'ms'), (3, ('12.5', '90')))
    """
    lines = text.splitlines()
    last = next((line for line in reversed(lines) if line.strip()), "")
    separator = next((each for each in SEPARATORS if each in last), ",")
    headings: list[tuple[int, tuple[str, ...]]] = []
    titles: list[tuple[int, str]] = []
    rows: list[tuple[int, list[str]]] = []
    reader = csv.reader(lines, delimiter=separator, skipinitialspace=True)
    for cells in _read(reader):
        texts = [cell.strip() for cell in cells]
        remark = bool(texts) and texts[0][:1] in COMMENT and bool(texts[0])
        if remark:
            texts[0] = texts[0].lstrip(COMMENT).strip()
        first = next((cell for cell in texts if cell), "")
        if not first:
            continue
        if rows or not (remark or not NUMBER.match(first)):
            if not remark:
                rows.append((reader.line_num, texts))
            continue
        texts = _heading(texts, lines[reader.line_num - 1], len(names))
        if texts:
            headings.append((reader.line_num, tuple(texts)))
        else:
            titles.append((reader.line_num, separator.join(cells).strip(f" {separator}")))
    heads = Columns(tuple((line, texts[: len(names)]) for line, texts in headings), (), tuple(titles))
    units = [heads.heading(column) for column in range(len(names))]
    named = min(len(dict(headings)[line]) if unit else len(names) for line, unit in units)
    point = [(line, [cell if separator == "," else cell.replace(",", ".") for cell in texts]) for line, texts in rows]
    return replace(heads, rows=tuple((line, _cells(line, texts, names, named)) for line, texts in point))


def _heading(texts: list[str], line: str, count: int) -> list[str]:
    """Return the cells of a heading line, or [] if no separator gives at least `count` cells.

    `texts` contains the cells of the line, split at the column separator of the file. If there are too few cells, the
    line is split at each other separator. Such a split counts only if each of its first `count` cells contains a unit.
    """
    while texts and not texts[-1]:  # spreadsheets append empty cells
        texts.pop()
    if len(texts) >= count:
        return texts
    for other in SEPARATORS:
        apart = [cell.strip() for cell in line.lstrip(COMMENT).split(other)]
        if len(apart) >= count and all(UNIT.search(cell) for cell in apart[:count]):
            return apart
    return []


def _cells(line: int, texts: list[str], names: tuple[str, ...], named: int) -> tuple[str, ...]:
    """Return the cells of a row in the columns `names`. All other cells of the row must be empty or have a heading."""
    width = max(number for number, cell in enumerate(texts, 1) if cell)  # never empty: each row has a non-empty cell
    if not len(names) <= width <= named and not (width < len(names) <= len(texts)):
        raise ExchangeError(_miscounted(line, width, names))
    for name, cell in zip(names, texts, strict=False):
        if not cell:
            raise ExchangeError(f"line {line}: the {name} is missing: write it, or leave the line out")
    return tuple(texts[: len(names)])


def _read(reader: Any) -> Iterator[list[str]]:
    try:
        yield from reader
    except csv.Error as error:
        raise ExchangeError(f"line {reader.line_num}: {error}") from None


def _miscounted(line: int, count: int, names: tuple[str, ...]) -> str:
    """Return the error message for a line with too few or too many cells."""
    wanted = f"expected {len(names)} columns, {' and '.join(names)}"
    texts = f"line {line}: {wanted}, got {count}"
    if count < len(names):
        return f"{texts}: put a comma, a semicolon or a tab between them"
    return (
        f"{texts}: delete the others, or put them last with headings of their own and give units for the first; with"
        " decimal commas, separate columns by semicolons or tabs"
    )
