"""Put the results into docs/performance.md, between its `<!-- results: NAME, TABLE -->` and `<!-- end -->` marks."""

from __future__ import annotations

import json
import re
from pathlib import Path

import measuring

PAGE = Path(__file__).parents[1] / "docs" / "performance.md"
MARK = re.compile(r"(<!-- results: (\w+), ([^>]+) -->\n).*?(<!-- end -->)", re.DOTALL)


def table(name: str, title: str) -> str:
    """A table of a benchmark in Markdown, or what it was measured on."""
    content = json.loads((measuring.RESULTS / f"{name}.json").read_text(encoding="utf-8"))
    if title == "machine":
        return "; ".join(f"{key} {value}" for key, value in content["machine"].items())
    if title == "notes":
        return "\n".join(f"- {note}" for note in content["notes"])
    return measuring.as_text(content["tables"][title])


def main() -> None:
    """Rewrite the page."""
    text = PAGE.read_text(encoding="utf-8")
    PAGE.write_text(MARK.sub(lambda m: f"{m[1]}\n{table(m[2], m[3])}\n\n{m[4]}", text), encoding="utf-8")


if __name__ == "__main__":
    main()
