"""Columns of a CSV file as other programs write them: their headings, their cells, and the line of every row."""

from __future__ import annotations

import csv
import re
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

from exchange.drawing import ExchangeError

SEPARATORS = ";\t,"  # in the order in which a line is looked through: a comma may be a decimal one
UNIT = re.compile(r"\[(.*)\]|\((.*)\)\s*$|/\s*(.+)$")  # as in "angle [deg]", "angle (deg)", "angle / deg"
NUMBER = re.compile(r"[-+]?\.?\d")
COMMENT = "#%"  # that lines of other programs begin with


@dataclass(frozen=True)
class Columns:
    """Cells of a CSV file.

    Attributes
    ----------
    headings
        Lines before the first number, each with its own number, from 1, and its cells; the last one tells most.
    rows
        Lines with numbers: the number of the line, and its cells, a decimal comma being a point.
    """

    headings: tuple[tuple[int, tuple[str, ...]], ...]
    rows: tuple[tuple[int, tuple[str, ...]], ...]

    def heading(self, column: int) -> tuple[int, str]:
        """The line and the unit of a column's heading, or in a line of its own below; empty where none tells one."""
        for line, cells in reversed(self.headings):
            found = UNIT.search(cells[column])
            if found:
                return line, next(part for part in found.groups() if part is not None).strip()
        if len(self.headings) > 1:
            line, cells = self.headings[-1]
            return line, cells[column]
        return 0, ""


def columns_of(text: str, names: tuple[str, ...]) -> Columns:
    r"""The columns of a CSV text, between commas, semicolons or tabs.

    Parameters
    ----------
    names
        Of the columns that there are to be, for messages.

    Raises
    ------
    ExchangeError
        A line has fewer or more cells; the message tells the line.

    Examples
    --------
    >>> found = columns_of("time [ms];angle [deg]\n0;0\n12,5;90", ("time", "angle"))
    >>> found.heading(0), found.rows[1]
    ((1, 'ms'), (3, ('12.5', '90')))
    """
    lines = text.splitlines()
    last = next((line for line in reversed(lines) if line.strip()), "")
    separator = next((each for each in SEPARATORS if each in last), ",")
    headings: list[tuple[int, tuple[str, ...]]] = []
    rows: list[tuple[int, tuple[str, ...]]] = []
    reader = csv.reader(lines, delimiter=separator, skipinitialspace=True)
    for cells in _read(reader):
        told = [cell.strip() for cell in cells]
        remark = bool(told) and told[0][:1] in COMMENT and bool(told[0])
        if remark:
            told[0] = told[0].lstrip(COMMENT).strip()
        while told and not told[-1]:  # as spreadsheets leave them behind
            told.pop()
        if not told:
            continue
        heads = not rows and (remark or not NUMBER.match(told[0]))
        if len(told) != len(names):
            if heads:  # a title, or a remark
                continue
            raise ExchangeError(_miscounted(reader.line_num, len(told), names))
        if heads:
            headings.append((reader.line_num, tuple(told)))
        elif not remark:
            rows.append((reader.line_num, tuple(told if separator == "," else [c.replace(",", ".") for c in told])))
    return Columns(tuple(headings), tuple(rows))


def _read(reader: Any) -> Iterator[list[str]]:
    try:
        yield from reader
    except csv.Error as error:
        raise ExchangeError(f"line {reader.line_num}: {error}") from None


def _miscounted(line: int, count: int, names: tuple[str, ...]) -> str:
    """The message on a line with too few cells, or too many."""
    wanted = f"expected {len(names)} columns, {' and '.join(names)}"
    told = f"line {line}: {wanted}, got {count}"
    if count < len(names):
        return f"{told}: put a comma, a semicolon or a tab between them"
    return f"{told}: leave the others out; where decimals have a comma, a semicolon or a tab parts the columns"
