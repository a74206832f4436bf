"""HTML pages with the results of a sweep: a page for all designs, and a page for each selected design."""

import hashlib
from collections.abc import Mapping, Sequence
from functools import partial
from typing import Any

import numpy as np

from kinelast import __version__
from kinelast.designs.evaluate import Evaluation
from kinelast.outputs.outbox import complete, put
from kinelast.outputs.page import designs_page, first_axes, front, is_greater
from kinelast.outputs.sealed import finished, seal
from kinelast.runs.run import try_scene
from kinelast.scene.document import Document
from kinelast.sweep.store import NUMBER
from kinelast.sweep.tally import Tally, answers_as_data
from kinelast.tasks.progress import Progress
from kinelast.tasks.request import Batch, Request, RequestError
from kinelast.tasks.task import BAD_INPUT, BUG, FINE, MESSAGE, Task, shipped_scenes
from kinelast.values.error import plain
from kinelast.values.reading import known

MAX_GRID = 1000  # pages of single designs have a slider if the sweep has at most this number of designs
FOLDER = "designs"  # subfolder of the results
"""The subfolder contains a folder for each selected design. The name of this folder is the index of the design."""


def paged_designs(columns: Mapping[str, Any], pair: Sequence[str], best: int | None, most: int) -> list[int]:
    """Return the indices of the designs for which pages are written.

    The selected designs are the best design, and designs that are evenly distributed on the Pareto front of two
    columns.

    Parameters
    ----------
    columns
        Values of all designs by column name, shape (designs,); nan if unknown.
    pair
        Names of the two columns for the Pareto front.
    best
        Index of the best design, or None.
    most
        Maximum number of selected designs.

    Examples
    --------
    >>> columns = {"mass": np.arange(8.0), "deflection": -np.arange(8.0)}
    >>> paged_designs(columns, ("mass", "deflection"), 3, 4)
    [3, 0, 4, 7]
    """
    values = [np.asarray(columns[name], float) * (-1 if is_greater(name) else 1) for name in pair]
    first = [] if best is None else [best]
    others = [number for number in front(*values).tolist() if number != best]
    remaining = max(0, most - len(first))
    if len(others) > remaining:
        others = [others[at] for at in np.linspace(0, len(others) - 1, remaining).round().astype(int)]
    return [*first, *others][:most]


def design_text(document: Document, number: int, values: Mapping[str, float], file: str) -> str:
    """Return the text of a scene file for one design. `file` is the name of the scene file of the sweep."""
    return document.with_values(values, f"design {number}").text(f"Design {number} of the sweep of {file}.")


def write_pages(
    task: Task, evaluation: Evaluation, tally: Tally, positions: int | None, batch: Batch, progress: Progress
) -> tuple[int, str]:
    """Write the page of all designs, and a folder for each selected design.

    The page of all designs is written first, so that this page exists even if a folder cannot be written.

    Parameters
    ----------
    task
        Scene file and folder of the sweep.
    evaluation
        Scene, plan and figures of the sweep.
    tally
        Summary of the sweep, which must contain all designs.
    positions
        Number of positions at which the selected designs are computed. None means the number of positions in the scene.
    batch
        Options: number of designs with pages, and whether existing pages are reused.

    Returns
    -------
    Exit status, and error messages for pages that could not be written. These errors do not affect the stored designs.
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
        shown_in=evaluation.base.scene.shown_in,
        answered=answers_as_data(tally, evaluation.units),
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
    extra = {number: what_if(evaluation, columns, reasons, number) for number in texts}
    numbers, status, why = _folders(task, texts, extra, positions, batch.resume, progress)
    pages = {number: f"{FOLDER}/{number}/report.html" for number in numbers}
    put(task.folder / "designs.html", page(pages=pages, scene=scene, options=options))
    return status, why


def what_if(evaluation: Evaluation, columns: Mapping[str, Any], reasons: Sequence[str], number: int) -> dict[str, Any]:
    """Return a dictionary in which `what_if` contains the data for a slider that changes the varied input value.

    The dictionary is empty if several input values vary, or if the sweep has more than `MAX_GRID` designs. The data are
    sorted by increasing input value. The entry `here` is the index of design `number` in the sorted data.
    """
    path, *others = evaluation.plan.paths
    if others or len(reasons) > MAX_GRID:
        return {}
    order = np.argsort(columns[path], kind="stable")
    figures = [
        {"name": name, "unit": unit, "values": [known(columns[name][at]) for at in order]}
        for name, unit in evaluation.units.items()
        if name != path
    ]
    values = [float(columns[path][at]) for at in order]
    here, reasons_here = int(np.flatnonzero(order == number)[0]), [reasons[at] for at in order]
    grid = {"path": path, "unit": evaluation.units[path], "values": values, "here": here, "reasons": reasons_here}
    return {"what_if": {**grid, "figures": figures}}


def _folders(
    task: Task,
    texts: Mapping[int, str],
    extra: Mapping[int, Mapping[str, Any]],
    positions: int | None,
    resume: bool,
    progress: Progress,
) -> tuple[list[int], int, str]:
    """Write the folders of the selected designs. If a file cannot be written, write no folder.

    The results on the pages are computed by the theory that the scene names.

    Returns
    -------
    Indices of the designs with a page, exit status, and error messages.
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
                outcome = try_scene(request, False, Task(path, folder, f"page of design {number}", extra[number]))
                if outcome.interrupted:  # stop, because the results of an interrupted integration are incomplete
                    raise KeyboardInterrupt
                if outcome.unwritten:  # discard all pages, so that --resume writes them again
                    raise RequestError(outcome.line.replace(str(part), str(target)))
                if (folder / "report.html").is_file():
                    pages.append(number)
                if outcome.status >= BAD_INPUT:
                    failed.append(outcome.line.replace(str(part), str(target)))
                    status = max(status, outcome.status if outcome.status == BUG else FINE)
            lasting = {"kinelast": __version__, "made_from": made, "pages": pages, "failed": failed}
            seal(part, lasting)
    except (RequestError, OSError) as error:
        message = error.strerror.lower() if isinstance(error, OSError) and error.strerror else str(error)
        return [], BAD_INPUT, plain(f"no pages of single designs: {message}", MESSAGE)
    return pages, status, "\n".join(failed)
