"""The summary of a sweep, its page, and pages of single designs that it leads to: the best and those on the front."""

from __future__ import annotations

import hashlib
import re
from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import partial
from typing import Any

import numpy as np

from kinelast import __version__
from kinelast.designs.base import base_of
from kinelast.designs.evaluate import Evaluation, evaluated
from kinelast.figures.limits import LIMITS_KEPT, judgements_on, limits_of_items, room, verdict_on
from kinelast.outputs.outbox import complete, put
from kinelast.outputs.page import designs_page, first_axes, front, is_greater
from kinelast.outputs.sealed import finished, seal
from kinelast.runs.run import try_scene
from kinelast.scene.document import Document
from kinelast.scene.error import plain
from kinelast.sweep.store import NUMBER
from kinelast.tasks.progress import Progress
from kinelast.tasks.request import Batch, Request, RequestError
from kinelast.tasks.task import BAD_INPUT, BUG, FINE, MESSAGE, Task, shipped_scenes

LEADING = 1000  # designs of which one is looked for that is acceptable by its full answer
GRID = 1000  # designs at most that a report has a slider over
SHORTLIST = 8  # of them that are answered in full
NUMBERS = re.compile(r"(?<![\w\"\[])[-+]?\d[\d.]*(?:e[-+]?\d+)?(?![\w\"\]])")  # which differ by design in a reason


@dataclass(frozen=True)
class Aim:
    """Which figure is to be small, or large."""

    figure: str
    largest: bool


@dataclass
class Tally:
    """Summary of a sweep's designs: how many have no figures and why, ranges of figures, the best; or all.

    Attributes
    ----------
    limits_kept
        How many keep all limits by their quasi-static figures; None without limits.
    leading
        The best of these, the best first.
    best
        The first of them, or where there are limits the first that is acceptable.
    answered
        Numbers of those that were answered in full, and the verdicts on them.
    """

    aim: Aim
    designs: int = 0
    reasons: Counter[str] = field(default_factory=Counter)
    limits_kept: int | None = None
    ranges: dict[str, tuple[float, float]] = field(default_factory=dict)
    leading: list[dict[str, float]] = field(default_factory=list)
    best: dict[str, float] | None = None
    answered: list[tuple[int, dict[str, Any]]] = field(default_factory=list)
    kept: list[tuple[Mapping[str, Any], Sequence[str]]] = field(default_factory=list)

    def add(self, columns: Mapping[str, Any], reasons: Sequence[str]) -> None:
        """Count some more designs."""
        self.designs += len(reasons)
        self.reasons.update(NUMBERS.sub("...", reason) for reason in reasons if reason)
        for name, values in columns.items():
            known = values[np.isfinite(values)]
            if len(known):
                low, high = self.ranges.get(name, (np.inf, -np.inf))
                self.ranges[name] = min(low, float(known.min())), max(high, float(known.max()))
        good = np.isfinite(columns[self.aim.figure])
        if LIMITS_KEPT in columns:
            good &= columns[LIMITS_KEPT] == 1.0
            self.limits_kept = (self.limits_kept or 0) + int(np.count_nonzero(columns[LIMITS_KEPT] == 1.0))
        sign = -1.0 if self.aim.largest else 1.0
        order = np.argsort(np.where(good, sign * columns[self.aim.figure], np.inf), kind="stable")
        some = order[: min(LEADING, int(np.count_nonzero(good)))].tolist()
        rows = [{name: float(values[at]) for name, values in columns.items()} for at in some]
        self.leading = sorted([*self.leading, *rows], key=lambda row: sign * row[self.aim.figure])[:LEADING]
        self.best = self.leading[0] if self.leading else None

    @property
    def accepted(self) -> dict[str, Any] | None:
        """The verdict on the best design; None where there are no limits, or no design keeps them."""
        return next((told for number, told in self.answered if self.best and number == self.best[NUMBER]), None)


def tallied(chunks: Iterable[tuple[Mapping[str, Any], Sequence[str]]], aim: Aim, keep: bool) -> Tally:
    """The tally of all designs; `keep` them too."""
    tally = Tally(aim)
    for columns, reasons in chunks:
        tally.add(columns, reasons)
        if keep:
            tally.kept.append((columns, reasons))
    return tally


def answer_leading(evaluation: Evaluation, tally: Tally, progress: Progress) -> None:
    """Answer leading designs in full, the best first, until one is acceptable: that is the best then.

    A design whose figures would not keep a limit, if the full answer changed them as it did those of one before, is
    passed over.
    """
    document, paths = evaluation.document, evaluation.plan.paths
    values = np.array([[row[path] for path in paths] for row in tally.leading])
    limits = limits_of_items(document.scene)
    columns = evaluated(base_of(document, paths, list(dict.fromkeys(limit.figure for limit in limits))), values).columns
    alike = not any(path.startswith("limits.") for path in paths)
    left = np.ones(len(values), bool)
    for done in range(SHORTLIST):
        if not left.any():
            break
        progress("the best designs, answered in full", done, SHORTLIST)
        at = int(left.argmax())
        left[at] = False
        scene = document.with_values(dict(zip(paths, values[at].tolist(), strict=True))).scene
        judgements = judgements_on(scene, limits_of_items(scene))
        tally.answered.append((int(tally.leading[at][NUMBER]), verdict_on(judgements)))
        if tally.answered[-1][1]["passed"]:
            tally.best = tally.leading[at]
            break
        for judged in judgements if alike else ():
            known = columns[judged.limit.figure]
            left &= replace(judged.limit, bound=room(judged, float(known[at]))).kept(known)


FOLDER = "designs"  # in that of the scene
"""Each of its folders bears the number of its design."""


def paged_designs(columns: Mapping[str, Any], pair: Sequence[str], best: int | None, most: int) -> list[int]:
    """Numbers of the designs that have pages of their own: the best first, then the front, evenly thinned.

    Parameters
    ----------
    columns
        By name the values of all designs, shape (designs,), nan where unknown.
    pair
        Names of the two columns whose front it is.
    most
        How many designs, at most.

    Examples
    --------
    >>> columns = {"mass": np.arange(8.0), "deflection": -np.arange(8.0)}
    >>> paged_designs(columns, ("mass", "deflection"), 3, 4)
    [3, 0, 4, 7]
    """
    values = [np.asarray(columns[name], float) * (-1 if is_greater(name) else 1) for name in pair]
    first = [] if best is None else [best]
    others = [number for number in front(*values).tolist() if number != best]
    room = max(0, most - len(first))
    if len(others) > room:
        others = [others[at] for at in np.linspace(0, len(others) - 1, room).round().astype(int)]
    return [*first, *others][:most]


def design_text(document: Document, number: int, values: Mapping[str, float], file: str) -> str:
    """The text of the scene of one design, from the swept scene and the name of its file."""
    return document.with_values(values, f"design {number}").text(f"Design {number} of the sweep of {file}.")


def write_pages(
    task: Task, evaluation: Evaluation, tally: Tally, positions: int | None, batch: Batch, progress: Progress
) -> tuple[int, str]:
    """Write the page of all designs of a sweep, and the folders of single ones that it leads to.

    The page stands there before the folders do, so that it is not lost with them.

    Parameters
    ----------
    task
        The scene that is swept; the folder of its sweep.
    evaluation
        Of its designs.
    found
        The designs, all of them kept.
    positions
        Of a single design, where they are not the scene's own.
    batch
        Tells how many designs have pages of their own, and whether those that are there are kept.

    Returns
    -------
    Exit status, and lines on the pages that failed; the sweep is whole all the same.
    """
    paths, figures = list(evaluation.plan.paths), list(evaluation.figures or ())
    columns = {name: np.concatenate([part[name] for part, _ in tally.kept]) for name in evaluation.units}
    reasons = [reason for _, part in tally.kept for reason in part]
    best = None if tally.best is None else int(tally.best[NUMBER])
    document = evaluation.document
    title = document.table.title or task.path.stem
    page = partial(
        designs_page,
        title,
        columns,
        evaluation.units,
        reasons,
        paths,
        figures,
        best,
        told_in=evaluation.base.scene.told_in,
    )
    scene = task.path.stem if task.path in shipped_scenes().values() else task.path.name
    options = f"--positions {positions}" if positions else ""
    put(task.folder / "designs.html", page(scene=scene, options=options))
    if not batch.pages:
        return FINE, ""
    texts = {}
    for number in paged_designs(columns, first_axes(paths, figures), best, batch.pages):
        values = {path: float(columns[path][number]) for path in paths}
        texts[number] = design_text(document, number, values, task.path.name)
    beside = {number: what_if(evaluation, columns, reasons, number) for number in texts}
    numbers, status, why = _folders(task, texts, beside, positions, batch.resume, progress)
    pages = {number: f"{FOLDER}/{number}/report.html" for number in numbers}
    put(task.folder / "designs.html", page(pages=pages, scene=scene, options=options))
    return status, why


def what_if(evaluation: Evaluation, columns: Mapping[str, Any], reasons: Sequence[str], number: int) -> dict[str, Any]:
    """Figures of all designs against the one number that is varied, under `what_if`; nothing where there are several.

    `here` is the place of the design of that number among the values, which grow.
    """
    path, *others = evaluation.plan.paths
    if others or len(reasons) > GRID:
        return {}
    order = np.argsort(columns[path], kind="stable")
    figures = [
        {"name": name, "unit": unit, "values": [_known(columns[name][at]) for at in order]}
        for name, unit in evaluation.units.items()
        if name != path
    ]
    values = [float(columns[path][at]) for at in order]
    here, told = int(np.flatnonzero(order == number)[0]), [reasons[at] for at in order]
    grid = {"path": path, "unit": evaluation.units[path], "values": values, "here": here, "reasons": told}
    return {"what_if": {**grid, "figures": figures}}


def _known(value: float) -> float | None:
    return float(value) if np.isfinite(value) else None


def _folders(
    task: Task,
    texts: Mapping[int, str],
    beside: Mapping[int, Mapping[str, Any]],
    positions: int | None,
    resume: bool,
    progress: Progress,
) -> tuple[list[int], int, str]:
    """Make the folders of single designs, all at once or, where something stands in the way, none.

    Numbers of those that have a page; status and words of those that failed. They are full answers, by the scene's own
    theory, of the positions of the sweep.
    """
    request, target = Request(positions=positions), task.folder / FOLDER
    hashes = {str(number): hashlib.sha256(each.encode()).hexdigest() for number, each in texts.items()}
    made = {"sha256": hashes, "positions": positions}
    if resume and (before := finished(target, made)[0]):
        return before["pages"], FINE, ""
    pages: list[int] = []
    failed: list[str] = []
    status = FINE
    try:
        with complete(target) as part:
            for done, (number, each) in enumerate(texts.items()):
                progress(f"{task.name}: pages of designs", done, len(texts))
                path, folder = part / f"{task.folder.name}_design_{number}.toml", part / str(number)
                path.write_text(each, encoding="utf-8", newline="")
                outcome = try_scene(request, False, Task(path, folder, f"page of design {number}", beside[number]))
                if outcome.interrupted:  # an integration, which keeps what it has until then: no whole page
                    raise KeyboardInterrupt
                if outcome.unwritten:  # none then, so that --resume makes all of them
                    raise RequestError(outcome.line.replace(str(part), str(target)))
                if (folder / "report.html").is_file():
                    pages.append(number)
                if outcome.status >= BAD_INPUT:
                    failed.append(outcome.line.replace(str(part), str(target)))
                    status = max(status, outcome.status if outcome.status == BUG else FINE)
            lasting = {"kinelast": __version__, "made_from": made, "pages": pages, "failed": failed}
            seal(part, lasting)
    except (RequestError, OSError) as error:
        told = error.strerror.lower() if isinstance(error, OSError) and error.strerror else str(error)
        return [], BAD_INPUT, plain(f"no pages of single designs: {told}", MESSAGE)
    return pages, status, "\n".join(failed)
