"""One-page report for printing, as PDF: verdict, picture, main results, limits, assumptions and checks."""

from collections.abc import Iterator
from datetime import date
from functools import cached_property
from pathlib import Path
from typing import Any

from msgspec import Struct

from kinelast.answers.results import Results
from kinelast.outputs.assumptions import assumptions
from kinelast.outputs.charts import INK, SOFT, STYLE
from kinelast.outputs.pictures import draw_mechanism
from kinelast.outputs.words import (
    checked,
    error_words,
    least_safety,
    limit_rows,
    magnitude,
    output_words,
    size,
    to_read,
    trust_words,
    verdict_words,
)
from kinelast.reports.limits import BROKEN, KEPT
from kinelast.reports.report import Report
from kinelast.values.numbers import capitalized, number
from kinelast.values.reading import GOOD, Reading

PAPER, MARGIN = 8.27 + 11.69j, 0.6  # width and height of A4 paper as a complex number, and margin; both in inches
WIDTH = PAPER.real - 2 * MARGIN  # [in] width of text and picture
# [in] smallest and largest height of the picture, and gap above and below the picture
LEAST_PICTURE, MOST_PICTURE, GAP = 1.5, 4.6, 0.12
LINE = 1.35  # line spacing / font size
MOST_LIMITS = 12  # maximum number of limits that the page lists
MOST_LINES = 3  # maximum number of lines of a long paragraph, such as the title
GREEN, RED, AMBER = "#1c6b3a", "#a8201a", "#8a5200"


class Paragraph(Struct, frozen=True, dict=True):
    """A paragraph: text, font size [pt], colour, font weight, space above [in], and maximum number of lines."""

    words: str
    size: float = 8.5
    colour: str = INK
    weight: str = "normal"
    above: float = 0.0
    most: int = 100

    @cached_property
    def lines(self) -> list[str]:
        """Lines of the paragraph, broken so that each line fits the width of the page."""
        lines: list[str] = []
        for word in self.words.split():
            longer = f"{lines[-1]} {word}" if lines else ""
            if longer and self._width(longer) <= WIDTH:
                lines[-1] = longer
            else:
                lines.append(word)
        return lines if len(lines) <= self.most else [*lines[: self.most - 1], f"{lines[self.most - 1]} …"]

    def _width(self, words: str) -> float:
        """Return the width of a text on one line [in]."""
        from matplotlib.font_manager import FontProperties
        from matplotlib.textpath import text_to_path

        font = FontProperties(size=self.size, weight=self.weight)
        return float(text_to_path.get_text_width_height_descent(words, font, ismath=False)[0]) / 72

    @property
    def height(self) -> float:
        """Height of the paragraph [in], including the space above it."""
        return self.above + len(self.lines) * self.size * LINE / 72


def write_page(path: Path, results: Results, report: Report) -> None:
    """Write the page as PDF.

    The picture is below the title and the verdict, and above the other paragraphs. It fills the space between them.
    """
    from matplotlib import rc_context
    from matplotlib.backends.backend_pdf import FigureCanvasPdf
    from matplotlib.figure import Figure

    report = to_read(report)
    head, foot = list(_head(report)), list(_foot(report))
    room = PAPER.imag - 2 * MARGIN - sum(each.height for each in (*head, *foot)) - 2 * GAP
    tall = min(max(room, LEAST_PICTURE), MOST_PICTURE)
    with rc_context({**STYLE, "pdf.fonttype": 42}):
        figure = Figure(figsize=(PAPER.real, PAPER.imag))
        FigureCanvasPdf(figure)
        below = _write(figure, head, PAPER.imag - MARGIN) - GAP - tall
        box = (MARGIN / PAPER.real, below / PAPER.imag, WIDTH / PAPER.real, tall / PAPER.imag)
        draw_mechanism(results, figure.add_axes(box, frameon=False), complex(WIDTH, tall))
        _write(figure, foot, below - GAP)
        figure.savefig(path, format="pdf", metadata=dict.fromkeys(("CreationDate", "Producer", "Creator")))


def _write(figure: Any, paragraphs: list[Paragraph], top: float) -> float:
    """Write paragraphs. Return the height of the lower edge of the last paragraph.

    `top` is the height of the upper edge of the first paragraph. Heights are measured from the lower edge of the paper
    [in].
    """
    for each in paragraphs:
        top -= each.above
        for line in each.lines:
            place = MARGIN / PAPER.real, top / PAPER.imag
            style = {"fontsize": each.size, "color": each.colour, "fontweight": each.weight}
            figure.text(*place, line, va="top", parse_math=False, **style)
            top -= each.size * LINE / 72
    return top


def _head(report: Report) -> Iterator[Paragraph]:
    """Yield the paragraphs above the picture: title, verdict, and reliability of the results."""
    scene, accepted = report.scene, report.acceptance
    yield Paragraph(scene.title, 15, weight="bold", most=MOST_LINES)
    yield Paragraph(scene.source, 7.5, SOFT, most=MOST_LINES)
    colour = AMBER if accepted.verdict else INK
    if accepted.passed is not None:
        colour = GREEN if accepted.passed else RED
    verdict, yields = verdict_words(report), report.yields or ""
    said = [verdict, yields] if accepted.verdict or not yields else [yields]
    words = " ".join(f"{capitalized(each)}." for each in said if each and (each is verdict or each not in verdict))
    yield Paragraph(words, 11, RED if yields else colour, "bold", GAP)
    words, level = trust_words(report)
    yield Paragraph(f"{capitalized(words)}.", 9, INK if level == GOOD else AMBER)


def _foot(report: Report) -> Iterator[Paragraph]:
    """Yield the paragraphs below the picture: main results, limits, assumptions, checks, and checksum of the scene."""
    yield from (Paragraph(words) for words in _figures(report))
    rows = limit_rows(report)
    if rows:
        yield Paragraph("Limits and their utilisation", 10, weight="bold", above=GAP)
    for limit, used, outcome in rows[:MOST_LIMITS]:
        share = "?" if used is None else f"{number(100 * used, 3)} %"
        yield Paragraph(f"{share}  {limit}: {outcome}", colour={KEPT: INK, BROKEN: RED}.get(outcome, AMBER))
    if len(rows) > MOST_LIMITS:
        yield Paragraph(f"{len(rows) - MOST_LIMITS} more limits, each used less.", colour=SOFT)
    yield Paragraph("Assumptions", 10, weight="bold", above=GAP)
    yield from (Paragraph(each, most=MOST_LINES) for each in assumptions(report))
    yield Paragraph("Checked", 10, weight="bold", above=GAP)
    yield Paragraph(capitalized(checked(report)), most=MOST_LINES)
    made = report.made_from.sha256 if report.made_from else ""
    words = f"kinelast {report.kinelast}; {date.today().isoformat()}; scene {report.scene.name}, SHA-256 {made}"
    yield Paragraph(words, 7, SOFT, above=GAP)


def _figures(report: Report) -> Iterator[str]:
    """Yield sentences about the largest stress, safety, deflection, output error, and efforts of the drives."""

    def words(found: Reading) -> str:
        return size(found, report.shown_in) + error_words(found, report.shown_in)

    if stress := report.largest_stress:
        safety = least_safety(report)
        factor = f"{size(safety[1], report.shown_in, 3)} in {safety[0]}" if safety else "unknown"
        yield f"Largest stress {words(stress)} in {stress.member}; least safety against yield {factor}."
    if moved := report.largest_deflection:
        yield f"Largest deflection {words(magnitude(moved))} of {moved.member}."
    if (output := report.output) and output.value is not None:
        yield f"Error of the output, {output_words(output)}: {words(output)}."
    for name, drive in report.drives.items():
        if drive["effort"].value is not None:
            yield f"Drive of {name}: at most {words(magnitude(drive['effort']))}."
