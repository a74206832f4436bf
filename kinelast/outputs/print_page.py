"""One-page print as PDF: verdict, picture, main figures, limits, assumptions, checks."""

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from textwrap import wrap
from typing import Any

from kinelast.figures.limits import BROKEN, KEPT
from kinelast.figures.report import Report
from kinelast.figures.results import Results
from kinelast.outputs.charts import INK, SOFT, STYLE
from kinelast.outputs.pictures import draw_mechanism
from kinelast.outputs.words import (
    LEVELS,
    assumptions,
    checked,
    error_words,
    least_safety,
    limit_rows,
    magnitude,
    size,
    verdict_words,
)
from kinelast.scene.numbers import number
from kinelast.scene.reading import GOOD, Reading

PAPER, MARGIN = 8.27 + 11.69j, 0.6  # [in] A4
LEAST_PICTURE, MOST_PICTURE, GAP = 1.5, 4.6, 0.12  # [in]
LETTER, LINE = 0.55, 1.35  # width of a letter and height of a line, relative to the font size
MOST_LIMITS = 12
MOST_LINES = 3  # font sizes of the title and the source
GREEN, RED, AMBER = "#1c6b3a", "#a8201a", "#8a5200"


@dataclass(frozen=True)
class Paragraph:
    """Words of one size [pt], colour and weight, with the space above [in]."""

    words: str
    size: float = 8.5
    colour: str = INK
    weight: str = "normal"
    above: float = 0.0
    most: int = 100

    @property
    def lines(self) -> list[str]:
        """The words as lines that fit the paper."""
        fitting = int((PAPER.real - 2 * MARGIN) * 72 / (LETTER * self.size))
        return wrap(self.words, fitting, max_lines=self.most, placeholder=" …")

    @property
    def height(self) -> float:
        """Height with the space above [in]."""
        return self.above + len(self.lines) * self.size * LINE / 72


def write_page(path: Path, results: Results, report: Report) -> None:
    """Write the page as PDF. The picture fills the remaining space."""
    from matplotlib import rc_context
    from matplotlib.backends.backend_pdf import FigureCanvasPdf
    from matplotlib.figure import Figure

    head, foot = list(_head(report)), list(_foot(report))
    room = PAPER.imag - 2 * MARGIN - sum(each.height for each in (*head, *foot)) - 2 * GAP
    tall = min(max(room, LEAST_PICTURE), MOST_PICTURE)
    with rc_context({**STYLE, "pdf.fonttype": 42}):
        figure = Figure(figsize=(PAPER.real, PAPER.imag))
        FigureCanvasPdf(figure)
        below = _write(figure, head, PAPER.imag - MARGIN) - GAP - tall
        wide = PAPER.real - 2 * MARGIN
        box = (MARGIN / PAPER.real, below / PAPER.imag, wide / PAPER.real, tall / PAPER.imag)
        draw_mechanism(results, figure.add_axes(box, frameon=False), complex(wide, tall))
        _write(figure, foot, below - GAP)
        figure.savefig(path, format="pdf", metadata=dict.fromkeys(("CreationDate", "Producer", "Creator")))


def _write(figure: Any, paragraphs: list[Paragraph], top: float) -> float:
    """Write paragraphs downwards from a height [in], and return the height at the end."""
    for each in paragraphs:
        top -= each.above
        for line in each.lines:
            place = MARGIN / PAPER.real, top / PAPER.imag
            style = {"fontsize": each.size, "color": each.colour, "fontweight": each.weight}
            figure.text(*place, line, va="top", parse_math=False, **style)
            top -= each.size * LINE / 72
    return top


def _head(report: Report) -> Iterator[Paragraph]:
    """Yield title and verdict."""
    scene, accepted, trust = report.scene, report.acceptance, report.reliability
    yield Paragraph(scene.title, 15, weight="bold", most=MOST_LINES)
    yield Paragraph(scene.source, 7.5, SOFT, most=MOST_LINES)
    colour = AMBER if accepted.verdict else INK
    if accepted.passed is not None:
        colour = GREEN if accepted.passed else RED
    words = verdict_words(report)
    yield Paragraph(f"{words[:1].upper()}{words[1:]}.", 11, colour, "bold", GAP)
    if trust.level != GOOD:
        yield Paragraph(f"{LEVELS[trust.level].capitalize()}: {', '.join(trust.reasons)}.", 9, AMBER)


def _foot(report: Report) -> Iterator[Paragraph]:
    """Yield main figures, limits, assumptions, checks, and the scene's checksum."""
    yield from (Paragraph(words) for words in _figures(report))
    rows = limit_rows(report)
    if rows:
        yield Paragraph("Limits and their use", 10, weight="bold", above=GAP)
    for limit, used, outcome in rows[:MOST_LIMITS]:
        share = "?" if used is None else f"{number(100 * used, 3)} %"
        yield Paragraph(f"{share}  {limit}: {outcome}", colour={KEPT: INK, BROKEN: RED}.get(outcome, AMBER))
    if len(rows) > MOST_LIMITS:
        yield Paragraph(f"{len(rows) - MOST_LIMITS} more limits, each used less.", colour=SOFT)
    yield Paragraph("Assumptions", 10, weight="bold", above=GAP)
    yield from (Paragraph(each, most=MOST_LINES) for each in assumptions(report))
    yield Paragraph("Checked", 10, weight="bold", above=GAP)
    words = checked(report)
    yield Paragraph(f"{words[:1].upper()}{words[1:]}", most=MOST_LINES)
    made = report.made_from.sha256 if report.made_from else ""
    yield Paragraph(f"kinelast {report.kinelast}; scene {report.scene.name}, SHA-256 {made}", 7, SOFT, above=GAP)


def _figures(report: Report) -> Iterator[str]:
    """Yield sentences on stress and safety, the output, and the drives."""

    def words(found: Reading) -> str:
        return size(found, report.shown_in) + error_words(found, report.shown_in)

    if stress := report.largest_stress:
        safety = least_safety(report)
        factor = f"{size(safety[1], report.shown_in, 3)} in {safety[0]}" if safety else "unknown"
        yield f"Largest stress {words(stress)} in {stress.member}; least safety against yield {factor}."
    if moved := report.largest_deflection:
        yield f"Largest deflection {words(magnitude(moved))} of {moved.member}."
    if (output := report.output) and output.value is not None:
        yield f"Error of the output, {output.kind} {output.name}: {words(output)}."
    for name, drive in report.drives.items():
        if drive["effort"].value is not None:
            yield f"Drive of {name}: at most {words(magnitude(drive['effort']))}."
