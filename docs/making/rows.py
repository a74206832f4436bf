"""Rows of tables in Markdown."""

from collections.abc import Iterable


def row(cells: Iterable[str]) -> str:
    """Return a row; bars inside cells are escaped."""
    return f"| {' | '.join(cell.replace('|', chr(92) + '|') for cell in cells)} |\n"
