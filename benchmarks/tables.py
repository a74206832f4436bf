"""Put the results into docs/performance.md, between its `<!-- results: NAME, TABLE -->` and `<!-- end -->` marks.

`NAME, TABLE; COLUMN | COLUMN; COLUMN = VALUE | VALUE` takes some of a table's columns, and some of its rows.
"""

from __future__ import annotations

import json
import re
from pathlib import Path
from typing import Any

import measuring

PAGE = Path(__file__).parents[1] / "docs" / "performance.md"
MARK = re.compile(r"(<!-- results: (\w+), ([^>]+) -->\n).*?(<!-- end -->)", re.DOTALL)


def table(name: str, wanted: str) -> str:
    """A table of a benchmark in Markdown, or what it was measured on."""
    title, *parts = (part.strip() for part in wanted.split(";"))
    content = json.loads((measuring.RESULTS / f"{name}.json").read_text(encoding="utf-8"))
    if title == "machine":
        return "; ".join(f"{key} {value}" for key, value in content["machine"].items())
    if title == "notes":
        return "\n".join(f"- {note}" for note in content["notes"])
    rows = content["tables"][title]
    for part in parts:
        rows = chosen(rows, part)
    return measuring.as_text(rows)


def chosen(rows: list[dict[str, Any]], part: str) -> list[dict[str, Any]]:
    """Some columns of a table, or its rows in which a column has one of some values."""
    key, equals, values = (text.strip() for text in part.partition("="))
    if equals:
        allowed = [value.strip() for value in values.split("|")]
        return [row for row in rows if ("" if row[key] is None else str(row[key])) in allowed]
    columns = [column.strip() for column in part.split("|")]
    return [{column: row[column] for column in columns} for row in rows]


def main() -> None:
    """Rewrite the page."""
    text = PAGE.read_text(encoding="utf-8")
    PAGE.write_text(MARK.sub(lambda m: f"{m[1]}\n{table(m[2], m[3])}\n\n{m[4]}", text), encoding="utf-8")


if __name__ == "__main__":
    main()
