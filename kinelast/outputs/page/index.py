"""index.html: all scenes of a folder of results in one table that can be sorted and filtered."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path

from kinelast.outputs.page.report import as_data, filled, shared_parts

MARK = b'<script type="application/json" id="rows">'  # by which a page of this program is known
SCRIPTS = ("numbers", "dom", "theme", "index")
TITLE = b"All scenes"  # whatever the folder is called: a batch made anew is the same byte for byte


def index_page(
    out: Path, head: Sequence[str], rows: Sequence[Sequence[str]], seconds: Mapping[str, float] | None = None
) -> bytes:
    """The page of a folder of results, UTF-8: the rows of its summary.csv, linked to the scenes' own pages.

    Parameters
    ----------
    out
        The folder; a row is linked where its report is there.
    head, rows
        Of summary.csv: the first column names the scene's folder in `out`.
    seconds
        That scenes took, by their folders, where they were computed just now.
    """
    taken = {name: round(time, 4) for name, time in (seconds or {}).items()}
    reports = [row[0] for row in rows if (out / row[0] / "report.html").is_file()]
    return filled(
        "index.html",
        {
            "title": TITLE,
            "rows": as_data(
                {"head": list(head), "rows": [list(row) for row in rows], "reports": reports, "seconds": taken}
            ),
            **shared_parts(SCRIPTS),
        },
    )
