"""Sweep of a scene: compute and store all designs, find the best design, and write a summary.

The results of a design are called figures, e.g. the largest stress.
"""

import hashlib
import time
from contextlib import suppress
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from kinelast import __version__
from kinelast.designs.base import base_of
from kinelast.designs.evaluate import Evaluation
from kinelast.designs.plan import ListedValues, Plan, plan_of
from kinelast.figures.registry import limits_of
from kinelast.outputs.outbox import put
from kinelast.outputs.sealed import beside_digests, json_bytes
from kinelast.reports.limits import LIMITS_KEPT, LIMITS_MARGIN, verdict_on
from kinelast.scene.data import QUASI_STATIC
from kinelast.scene.document import Document, document_from_bytes, read_document
from kinelast.scene.text import file_bytes, of_file
from kinelast.sweep.manifest import Manifest, read_manifest
from kinelast.sweep.pages import design_text, write_pages
from kinelast.sweep.running import filled, run_plan
from kinelast.sweep.store import NUMBER, stored_chunks
from kinelast.sweep.tally import Aim, FullAnswers, Rows, Tally, answers_as_data, tallied
from kinelast.tasks.processes import cores
from kinelast.tasks.progress import SILENT, Progress, lasting
from kinelast.tasks.request import Batch, Request, RequestError
from kinelast.tasks.task import BUG, CHECK_FAILED, DONE, FINE, Outcome, Task, guarded
from kinelast.values.error import SceneError, fault
from kinelast.values.numbers import error_percent, quantity, round_down
from kinelast.values.reading import known
from rigid import counted

MIN_ANNOUNCED = 10.0  # [s] if a sweep is expected to last longer, the expected duration is printed
TRIAL_DESIGNS = 200  # maximum number of designs that are timed to estimate the duration of the sweep
MAX_PAGED = 1_000_000  # no HTML pages are written if a sweep has more designs
MIN_DESIGN_TIME = 1e-7  # [s] smallest assumed time per design; avoids a division by zero
# [s] planned computing time per chunk; if a run is stopped, each core loses at most one chunk. The arrays of larger
# chunks do not fit into the cache of the processor.
CHUNK_TIME = 0.5
MAX_TRIAL = 0.3  # [s] no further designs are timed if the first design takes longer than this
ADVICE = "positions or --jobs"
MAX_REASONS = 20  # the summary contains at most this number of reasons for missing figures, most frequent first
ERROR_UNKNOWN = "designs are computed without vibration; only full answers have an error"
MAX_SHOWN = 3  # the last printed line shows at most this number of input values of the best design


def try_sweep(request: Request, batch: Batch, task: Task, progress: Progress = SILENT) -> Outcome:
    """Compute all designs of a sweep and write the results to a folder.

    An error is not raised, but reported in the returned outcome.

    Parameters
    ----------
    progress
        Progress callback, which also prints the expected duration.
    """
    return guarded(task.name, partial(_sweep, task, request, batch, progress), ADVICE, str(task.folder))


def try_design(number: int, task: Task, _: Progress = SILENT) -> Outcome:
    """Write the scene file of one design as SCENE_design_NUMBER.toml, next to the folder of the results."""
    return guarded(task.name, partial(_design, task, number), ADVICE, str(task.folder))


def _design(task: Task, number: int) -> Outcome:
    document = read_document(task.path)
    with of_file(document.path):
        plan = plan_of(document, task.path.parent)
        if number >= plan.count:
            raise RequestError(
                f"--design: there is no design {number}, the last design of the sweep is {plan.count - 1}"
            )
        values = dict(zip(plan.paths, plan.values(number, number + 1)[0].tolist(), strict=True))
        new = design_text(document, number, values, task.path.name).encode()
    target = task.folder.with_name(f"{task.folder.name}_design_{number}.toml")
    if target.exists() and target.read_bytes() != new:
        raise RequestError(f"{target} already exists: move it, or choose another -o")
    target.parent.mkdir(parents=True, exist_ok=True)
    put(target, new)
    return Outcome(FINE, f"{task.name}: design {number} -> {target}", DONE)


def _sweep(task: Task, request: Request, batch: Batch, progress: Progress) -> Outcome:
    content = file_bytes(task.path)
    document = document_from_bytes(content, task.path).with_positions(request.positions)
    with of_file(document.path):
        plan = plan_of(document, task.path.parent)
        figures, aim = _figures_and_aim(document, plan)
    evaluation = Evaluation(document, plan, figures)
    each = _duration(evaluation)
    takes = each * plan.count / (batch.jobs or cores())
    if plan.count > batch.most:
        advice = "reduce the number, or increase --most"
        raise RequestError(f"{plan.count:.6g} designs would take about {lasting(takes)}: {advice}")
    if takes > MIN_ANNOUNCED:
        progress.tell(f"{task.name}: {plan.count} designs, about {lasting(takes)}")
    if document.scene.theory.demanded:
        progress.tell(f"{task.name}: the designs are computed without vibration, regardless of theory and accuracy")
    identity = _identity(content, plan, evaluation, request.positions)
    rows = Rows(evaluation)
    outcome = run_plan(
        plan.count,
        rows,
        task.folder,
        identity,
        _chunk(task.folder if batch.resume else None, each, plan.count),
        batch.jobs or cores(),
        batch.scheduler,
        progress,
        batch.resume,
    )
    manifest = outcome.manifest
    if manifest.failed:
        number, why = min(manifest.failed.items())
        first, _ = manifest.span(number)
        return Outcome(BUG, f"{task.name}: {plan.count - outcome.kept} designs failed, from no. {first} on: {why}")
    tally = tallied(rows.stored(stored_chunks(task.folder, manifest)), aim, keep=plan.count <= MAX_PAGED)
    FullAnswers(rows, tally, progress.within(task.name))()
    manifest = filled(outcome, rows.cells(tally)).manifest
    summary = _summary(task, evaluation, tally, manifest)
    put(task.folder / "sweep.json", json_bytes(summary, indent=1) + b"\n")
    refused = tally.best is None or (tally.accepted and not tally.accepted.passed)
    status, line = CHECK_FAILED if refused else FINE, f"{task.name}: {_closing(evaluation, tally)}"
    failed, why = FINE, ""
    if tally.kept:
        failed, why = write_pages(task, evaluation, tally, request.positions, batch, progress)
    message = f"{line} -> {task.folder}" + "".join(f"\n{task.name}: {each}" for each in why.splitlines())
    return Outcome(max(status, failed), message, DONE)


def _figures_and_aim(document: Document, plan: Plan) -> tuple[tuple[str, ...], Aim]:
    """Return the names of the figures to compute, and the figure to minimise or maximise."""
    sweep = document.table.sweep
    if sweep.smallest is not None and sweep.largest is not None:
        raise fault("sweep", "largest", "give either smallest or largest")
    try:
        base = base_of(document, plan.paths, None)
        known = [measure.name for measure in base.measures]
        names = list(sweep.figures or known)
        aim = Aim(sweep.smallest or sweep.largest or names[0], sweep.largest is not None)
        limits = [LIMITS_KEPT, LIMITS_MARGIN] if limits_of(base.scene) else []
        names = list(dict.fromkeys([*names, aim.figure, *limits]))
        base_of(document, plan.paths, names)
    except SceneError as error:
        raise (fault("sweep", error.key, error.problem) if error.key == "figures" else error) from None
    return tuple(names), aim


def _duration(evaluation: Evaluation) -> float:
    """Return the computing time per design on one core [s], measured for the first designs."""
    evaluation(0, 1)  # warm-up
    count, took = 0, 0.0
    for count in (1, min(TRIAL_DESIGNS, evaluation.plan.count)):
        begin = time.process_time()  # processor time, which does not depend on other processes
        evaluation(0, count)
        took = time.process_time() - begin
        if took > MAX_TRIAL:
            break
    return took / count


def _chunk(folder: Path | None, each: float, count: int) -> int:
    """Return the number of designs per chunk, so that computing a chunk takes about `CHUNK_TIME`.

    If `folder` contains a sweep to be resumed, the result is the number in the manifest of this sweep. `each` is the
    computing time per design [s], and `count` the number of designs.
    """
    with suppress(RequestError):  # ignore an unreadable manifest: `run_plan` raises this error later
        if folder and (kept := read_manifest(folder)):
            return kept.chunk
    return min(count, max(1, int(round_down(CHUNK_TIME / max(each, MIN_DESIGN_TIME)))))


def _identity(content: bytes, plan: Plan, evaluation: Evaluation, positions: int | None) -> dict[str, Any]:
    """Return all inputs on which the results of a sweep depend.

    The inputs are the names of the figures, the number of positions, and checksums. The checksums are computed from the
    scene file, from listed input values, and from other files that the scene uses.
    """
    drawn = hashlib.sha256()
    for factor in plan.factors:
        if isinstance(factor, ListedValues):
            drawn.update(factor.rows.tobytes())
    return {
        "sha256": hashlib.sha256(content).hexdigest(),
        "values": drawn.hexdigest(),
        "figures": list(evaluation.figures or ()),
        "positions": positions,
        **beside_digests(evaluation.document.files),
    }


def _summary(task: Task, evaluation: Evaluation, tally: Tally, manifest: Manifest) -> dict[str, Any]:
    """Return the summary of a sweep as plain data."""
    units = {NUMBER: "1", **evaluation.units}

    def figure(name: str, value: float) -> dict[str, Any]:
        return {"value": known(value), "unit": units[name]}

    best = tally.best
    return {
        "kinelast": __version__,
        "scene": task.path.stem,
        "designs": tally.designs,
        "numbers": {path: units[path] for path in evaluation.plan.paths},
        "figures": {name: units[name] for name in evaluation.figures or ()},
        "theory": QUASI_STATIC,
        "error": None,
        "error_unknown": ERROR_UNKNOWN,
        "aim": {"figure": tally.aim.figure, "best": "largest" if tally.aim.largest else "smallest"},
        "best": None if best is None else {name: figure(name, value) for name, value in best.items() if name != NUMBER},
        "best_design": None if best is None else int(best[NUMBER]),
        "acceptance": tally.accepted,
        "answered": [{"design": number, **answer} for number, answer in answers_as_data(tally, units).items()],
        "near": tally.near,
        "limits_kept": tally.limits_kept,
        "without_figures": sum(tally.reasons.values()),
        "reasons": dict(tally.reasons.most_common(MAX_REASONS)),
        "ranges": {name: [figure(name, end) for end in ends] for name, ends in tally.ranges.items() if name != NUMBER},
        "store": manifest.store,
        "made_from": manifest.identity,
    }


def _verdict(tally: Tally) -> str:
    """Return the verdict on the best design as text; empty if there is no verdict."""
    accepted = tally.accepted
    if accepted is None:
        return ""
    if accepted.passed:
        assert tally.best is not None
        aim, sign = tally.aim.figure, tally.aim.sign
        rows = {int(row[NUMBER]): sign * row[aim] for row in tally.leading}
        best = sign * tally.best[aim]
        refused = [number for number, found in tally.answered.items()
                   if rows.get(number, np.inf) < best and not verdict_on(found.judgements).passed]  # fmt: skip
        passed_over = f"; full answers refused {counted(len(refused), 'better design')}"
        return f", {accepted.verdict}{passed_over if refused else ''}"
    why = f": {accepted.problem}" if accepted.problem else ""
    return f", {accepted.verdict.upper()}{why}; {len(tally.answered)} full answers, none acceptable"


def _closing(evaluation: Evaluation, tally: Tally) -> str:
    """Return a one-line summary of a sweep."""
    units, words, shown_in = evaluation.units, [f"{tally.designs} designs"], evaluation.base.scene.shown_in
    if tally.limits_kept is not None:
        words.append(f"{tally.limits_kept} meet all limits, ignoring vibration and error")
    aim = tally.aim
    if tally.best is None:
        words.append("none acceptable" if tally.limits_kept == 0 else f"no design has the figure {aim.figure}")
    else:
        found = tally.answered.get(int(tally.best[NUMBER]))
        value, error = (found.figures if found else {}).get(aim.figure, (tally.best[aim.figure], 0.0))
        size = quantity(value, units[aim.figure], shown_in=shown_in)
        if found and value and np.isfinite(error) and error:
            size += f" ± {error_percent(error / abs(value))}"
        paths = evaluation.plan.paths[:MAX_SHOWN]
        numbers = [f"{path} {quantity(tally.best[path], units[path], shown_in=shown_in)}" for path in paths]
        which = "largest" if aim.largest else "smallest"
        verdict = _verdict(tally)
        words.append(f"{which} {aim.figure} {size}: no. {tally.best[NUMBER]:.0f} ({', '.join(numbers)}){verdict}")
    if tally.reasons:
        reason, count = tally.reasons.most_common(1)[0]
        others = "" if len(tally.reasons) == 1 else f", {count} of them"
        words.append(f"{sum(tally.reasons.values())} without figures{others}: {reason}")
    return "; ".join(words)
