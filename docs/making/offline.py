"""Make the site work without a network: replace fetched files of the theme, reject any other host."""

import re
from pathlib import Path, PurePosixPath

SHIM = re.compile(r'<script src="https?://[^"]*iframe-worker[^"]*"></script>')
EMPTY_HEAD = re.compile(r"<th([^>]*)></th>")
SEARCH = '<div class="md-search" data-md-component="search" role="dialog" aria-label="Search">'
HOST = re.compile(r"https?://(?:unpkg\.com|cdn\.[\w.-]+|cdnjs\.[\w.-]+|fonts\.[\w.-]+)/[\w./@-]*")
FETCHED = re.compile(
    r'<(?:script|img|iframe|source|video)\b[^>]*\bsrc="(?:https?:)?//|<link\b[^>]*\bhref="(?:https?:)?//'
)


def local(html: str, path: str) -> str:
    """Return a page that uses local scripts, with a label for its search and without empty heads."""
    up = "../" * (len(PurePosixPath(path).parts) - 1)
    named = html.replace('<div class="md-search" data-md-component="search" role="dialog">', SEARCH)
    named = EMPTY_HEAD.sub(r"<td\1></td>", named)
    return SHIM.sub(f'<script src="{up}style/worker.js"></script>', named)


def cleaned(site: Path) -> None:
    """Remove the hosts of unused features from the theme's scripts.

    Raises
    ------
    ValueError
        A page would fetch something from another host.
    """
    for script in (site / "assets").rglob("*.js"):
        text = script.read_text(encoding="utf-8")
        if HOST.search(text):
            script.write_text(HOST.sub("", text), encoding="utf-8")
    (site / "404.html").unlink()  # only a server needs it
    for beside in (site / "assets").rglob("*.map"):
        beside.unlink()
    fetching = [page.name for page in site.rglob("*.html") if FETCHED.search(page.read_text(encoding="utf-8"))]
    if fetching:
        raise ValueError(f"pages that fetch from a network: {', '.join(sorted(fetching))}")
