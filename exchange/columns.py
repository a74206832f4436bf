"""Columns of a CSV file as other programs write them: their headings, their cells, and the line of every row."""

from __future__ import annotations

import csv
import re
from collections.abc import Iterator
from dataclasses import dataclass, replace
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
    titles
        Other lines before the first number: the number of the line, and its text.
    """

    headings: tuple[tuple[int, tuple[str, ...]], ...]
    rows: tuple[tuple[int, tuple[str, ...]], ...]
    titles: tuple[tuple[int, str], ...] = ()

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
    r"""The first columns of a CSV text, between commas, semicolons or tabs.

    Further ones are left out where they are empty, or have headings of their own beside units of the first.

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
        told = [cell.strip() for cell in cells]
        remark = bool(told) and told[0][:1] in COMMENT and bool(told[0])
        if remark:
            told[0] = told[0].lstrip(COMMENT).strip()
        first = next((cell for cell in told if cell), "")
        if not first:
            continue
        if rows or not (remark or not NUMBER.match(first)):
            if not remark:
                rows.append((reader.line_num, told))
            continue
        told = _heading(told, lines[reader.line_num - 1], len(names))
        if told:
            headings.append((reader.line_num, tuple(told)))
        else:
            titles.append((reader.line_num, separator.join(cells).strip(f" {separator}")))
    heads = Columns(tuple((line, told[: len(names)]) for line, told in headings), (), tuple(titles))
    units = [heads.heading(column) for column in range(len(names))]
    named = min(len(dict(headings)[line]) if unit else len(names) for line, unit in units)
    point = [(line, [cell if separator == "," else cell.replace(",", ".") for cell in told]) for line, told in rows]
    return replace(heads, rows=tuple((line, _cells(line, told, names, named)) for line, told in point))


def _heading(told: list[str], line: str, count: int) -> list[str]:
    """Cells of a line that names at least so many columns, also between others than the numbers are; else none."""
    while told and not told[-1]:  # as spreadsheets leave them behind
        told.pop()
    if len(told) >= count:
        return told
    for other in SEPARATORS:
        apart = [cell.strip() for cell in line.lstrip(COMMENT).split(other)]
        if len(apart) >= count and all(UNIT.search(cell) for cell in apart[:count]):
            return apart
    return []


def _cells(line: int, told: list[str], names: tuple[str, ...], named: int) -> tuple[str, ...]:
    """Cells of a line of numbers, as many as there are to be; the others are named, or empty."""
    width = max(number for number, cell in enumerate(told, 1) if cell)  # one has a number
    if not len(names) <= width <= named and not (width < len(names) <= len(told)):
        raise ExchangeError(_miscounted(line, width, names))
    for name, cell in zip(names, told, strict=False):
        if not cell:
            raise ExchangeError(f"line {line}: the {name} is missing: write it, or leave the line out")
    return tuple(told[: len(names)])


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
    return (
        f"{told}: leave the others out, or put them last with headings of their own, beside units of the first;"
        " where decimals have a comma, a semicolon or a tab parts the columns"
    )
