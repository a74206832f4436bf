"""Put results into pages of docs, between `<!-- results: NAME, TABLE -->` and `<!-- end -->` marks.

`NAME, TABLE; COLUMN | COLUMN; COLUMN = VALUE | VALUE` selects columns and rows of a table.
A result with only a CSV file has one table, named `all`.
"""

import json
import re
from pathlib import Path
from typing import Any

import measuring

DOCS = Path(__file__).parents[1] / "docs"
PAGES = [DOCS / f"{name}.md" for name in ("performance", "validity", "theory", "robustness")]
MARK = re.compile(r"(<!-- results: ([\w-]+), ([^>]+) -->\n).*?(<!-- end -->)", re.DOTALL)


def table(name: str, wanted: str) -> str:
    """A table of a benchmark in Markdown, or its notes, or its machine."""
    title, *parts = (part.strip() for part in wanted.split(";"))
    content = results(name)
    if title == "machine":
        return "; ".join(f"{key} {value}" for key, value in content["machine"].items())
    if title == "notes":
        return "\n".join(f"- {note}" for note in content["notes"])
    rows = content["tables"][title]
    for part in parts:
        rows = chosen(rows, part)
    return measuring.as_text(rows)


def results(name: str) -> dict[str, Any]:
    """Content of a benchmark's file: tables by title, notes, machine."""
    path = measuring.RESULTS / f"{name}.json"
    if path.exists():
        content: dict[str, Any] = json.loads(path.read_text(encoding="utf-8"))
        return content
    rows = measuring.read_rows(path.with_suffix(".csv"))
    return {"tables": {"all": [{key: number(word) for key, word in row.items()} for row in rows]}}


def number(word: str) -> int | float | str:
    """A cell as a number if it is one."""
    for kind in (int, float):
        try:
            return kind(word)
        except ValueError:
            pass
    return word


def chosen(rows: list[dict[str, Any]], part: str) -> list[dict[str, Any]]:
    """Rows with the selected columns, or the rows with a selected value."""
    key, equals, values = (text.strip() for text in part.partition("="))
    if equals:
        allowed = [value.strip() for value in values.split("|")]
        return [row for row in rows if ("" if row[key] is None else str(row[key])) in allowed]
    columns = [column.strip() for column in part.split("|")]
    return [{column: row[column] for column in columns} for row in rows]


def filled(text: str) -> str:
    """Text of a page with its tables replaced."""
    return MARK.sub(lambda mark: f"{mark[1]}\n{table(mark[2], mark[3])}\n\n{mark[4]}", text)


def main() -> None:
    """Rewrite the pages of docs."""
    for page in PAGES:
        page.write_text(filled(page.read_text(encoding="utf-8")), encoding="utf-8")


if __name__ == "__main__":
    main()
