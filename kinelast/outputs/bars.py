"""Bars of the largest sensitivities, as SVG of its own colours or of the page's."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from html import escape

WIDTH, LEFT, ROW, HEAD, GAP = 720, 250, 22, 30, 14  # [px]
LONGEST = 36  # letters of a bar's name


@dataclass(frozen=True)
class Bars:
    """Bars under one heading: name, size and words of each, in their order; a size below zero goes to the left."""

    title: str
    rows: tuple[tuple[str, float, str], ...]


def bars_svg(charts: Sequence[Bars]) -> str:
    """Bars of several headings below each other, each scaled by its own largest."""
    parts, y = [], 0
    for chart in charts:
        parts.append(f'<text x="0" y="{y + 18}" class="head">{escape(chart.title)}</text>')
        y += HEAD
        most = max((abs(size) for _, size, _ in chart.rows), default=0.0) or 1.0
        two_ways = any(size < 0 for _, size, _ in chart.rows)
        room = WIDTH - LEFT - 130
        zero, unit = (LEFT + room / 2, room / 2) if two_ways else (LEFT, room)
        for name, size, words in chart.rows:
            length = unit * abs(size) / most
            start = zero - length if size < 0 else zero
            way = "less" if size < 0 else "more"
            parts.append(f'<text x="{LEFT - 8}" y="{y + 15}" class="name">{escape(_short(name))}</text>')
            parts.append(
                f'<rect x="{start:.1f}" y="{y + 4}" width="{length:.1f}" height="{ROW - 8}" class="{way}"/>'
                f'<text x="{WIDTH - 122}" y="{y + 15}">{escape(words)}</text>'
            )
            y += ROW
        parts.append(f'<path d="M{zero:.1f} {y - ROW * len(chart.rows)}V{y}" class="zero"/>')
        y += GAP
    style = (
        "text{font:13px system-ui,sans-serif;fill:var(--ink,#17202a)}.head{font-weight:600;font-size:14px}"
        ".name{text-anchor:end}.more{fill:var(--accent,#0b5fa5)}.less{fill:var(--amber,#8a5200)}"
        ".zero{stroke:var(--soft,#55606c)}"
    )
    return (
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {WIDTH} {y}" width="{WIDTH}" height="{y}" role="img">'
        f"<style>{style}</style>{''.join(parts)}</svg>\n"
    )


def _short(name: str) -> str:
    return name if len(name) <= LONGEST else f"{name[: LONGEST // 3]}…{name[-(2 * LONGEST // 3 - 1) :]}"
