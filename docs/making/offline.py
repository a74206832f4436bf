"""The site needs no network: what the theme would fetch is replaced, and whatever else names a host ends the build."""

from __future__ import annotations

import re
from pathlib import Path, PurePosixPath

SHIM = re.compile(r'<script src="https?://[^"]*iframe-worker[^"]*"></script>')
HOST = re.compile(r"https?://(?:unpkg\.com|cdn\.[\w.-]+|cdnjs\.[\w.-]+|fonts\.[\w.-]+)/[\w./@-]*")
FETCHED = re.compile(
    r'<(?:script|img|iframe|source|video)\b[^>]*\bsrc="(?:https?:)?//|<link\b[^>]*\bhref="(?:https?:)?//'
)


def local(html: str, path: str) -> str:
    """A page with the site's own script in the place of the one that the theme would fetch."""
    up = "../" * (len(PurePosixPath(path).parts) - 1)
    return SHIM.sub(f'<script src="{up}style/worker.js"></script>', html)


def cleaned(site: Path) -> None:
    """Take from the theme's scripts the hosts of what this site has no use for.

    Raises
    ------
    ValueError
        A page would fetch something from another host.
    """
    for script in (site / "assets").rglob("*.js"):
        text = script.read_text(encoding="utf-8")
        if HOST.search(text):
            script.write_text(HOST.sub("", text), encoding="utf-8")
    for beside in (site / "assets").rglob("*.map"):
        beside.unlink()
    fetching = [page.name for page in site.rglob("*.html") if FETCHED.search(page.read_text(encoding="utf-8"))]
    if fetching:
        raise ValueError(f"pages that fetch from a network: {', '.join(sorted(fetching))}")
