"""Pages of reference, made from the code."""

from collections.abc import Iterator
from pathlib import Path

import api
import command
import figures
import tables
from made import Made


def pages(root: Path) -> Iterator[Made]:
    """All pages of the folder reference/."""
    yield Made("reference/command.md", command.page())
    yield Made("reference/figures.md", figures.page())
    yield Made("reference/tables.md", tables.page())
    yield from api.pages(root)
