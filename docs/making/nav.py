"""Replace folder patterns in the navigation of mkdocs.yml by the pages of the folder."""

import re
from fnmatch import fnmatchcase
from pathlib import PurePosixPath
from typing import Any

from mkdocs.structure.files import Files

LINKED = re.compile(r"\]\(([^)#\s]+\.md)")


def expanded(nav: list[Any], files: Files) -> list[Any]:
    """Return the navigation with all patterns replaced."""
    return list(_entry(nav, files, {*_leaves(nav)}))


def _leaves(item: Any) -> list[str]:
    if isinstance(item, str):
        return [item]
    return [leaf for part in (item.values() if isinstance(item, dict) else item) for leaf in _leaves(part)]


def _entry(item: Any, files: Files, named: set[str]) -> Any:
    if isinstance(item, dict):
        ((title, value),) = item.items()
        value = _entry(value, files, named)
        return {title: value} if value else None
    if isinstance(item, list):
        parts = []
        for part in item:
            entry = _entry(part, files, named)
            parts += entry if isinstance(entry, list) else [entry] if entry else []
        return parts
    return _matching(item, files, named) if "*" in item else item


def _matching(pattern: str, files: Files, named: set[str]) -> list[str]:
    """Pages of a folder: its index, then the pages that it links to, then others by name."""
    folder = PurePosixPath(pattern).parent
    pages = {
        file.src_uri: file
        for file in files.documentation_pages()
        if fnmatchcase(file.src_uri, pattern)
        and PurePosixPath(file.src_uri).parent == folder
        and file.src_uri not in named
    }
    heads = [name for name in (f"{folder}/index.md", f"{folder}.md") if files.get_file_from_path(name)]
    order = [
        (PurePosixPath(name).parent / link).as_posix()
        for name in heads
        for link in LINKED.findall(files.get_file_from_path(name).content_string)
    ]

    def place(page: str) -> tuple[Any, ...]:
        return page not in heads, order.index(page) if page in order else len(order), page

    return sorted(pages, key=place)
