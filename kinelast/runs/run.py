"""Compute a scene and write its result folder. If the computation fails, an existing folder stays unchanged."""

import re
import time
import traceback
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from msgspec import UNSET, UnsetType, to_builtins
from msgspec.structs import replace

from kinelast import runs
from kinelast.answers.results import Results
from kinelast.figures.registry import limits_of
from kinelast.outputs import positions as tables
from kinelast.outputs.outbox import EARLIER, complete, foreign
from kinelast.outputs.sealed import files_of, finished, made_from, seal, summary_in, write_json
from kinelast.outputs.table import write_table
from kinelast.outputs.words import headline, questions
from kinelast.reports.report import OptimumReport, Origin, Report, data_of, report_from
from kinelast.runs import SHOWN, computed, is_long
from kinelast.scene.course import OnStep
from kinelast.scene.data import ACCURACY, QUASI_STATIC, Scene
from kinelast.scene.document import Document, document_from_bytes
from kinelast.scene.text import file_bytes
from kinelast.tasks.progress import SILENT, Progress, lasting, stops_kept
from kinelast.tasks.request import Request, RequestError
from kinelast.tasks.task import BUG, CHECK_FAILED, DONE, FINE, MESSAGE, SKIPPED, Outcome, Task, guarded, missing_package
from kinelast.values.error import plain
from kinelast.values.numbers import percent
from kinelast.values.quantities import Speed

STUDIES = "balance", "speeds", "sensitivities", "tolerances"  # studies with separate sections in the report


def try_scene(request: Request, resume: bool, task: Task, progress: Progress = SILENT) -> Outcome:
    """Compute a scene and write its result folder. The outcome contains errors as messages.

    Parameters
    ----------
    resume
        True to skip the computation if the folder already contains the results of the same file and request.
    progress
        Progress callback. If the run is large, the callback receives a message about the size before the run starts.
    """
    start = time.perf_counter()
    with np.errstate(all="ignore"):  # nan marks a missing value and needs no warning
        work = partial(_scene, task, request, resume, progress)
        outcome = guarded(task.name, work, "positions, stations or elements, or --jobs")
    return replace(outcome, seconds=time.perf_counter() - start)


def _scene(task: Task, request: Request, resume: bool, progress: Progress) -> Outcome:
    content = file_bytes(task.path)
    document = document_from_bytes(content, task.path)
    made, folder = made_from(content, request, document.files), task.folder
    earlier = [name for name in files_of(summary_in(folder) or {}) if (folder / name).exists()]
    if resume:
        before, why = finished(folder, to_builtins(made))
        if before:
            report = report_from(before)
            status = FINE if _agrees(report) else CHECK_FAILED
            return Outcome(status, f"{task.name}: already finished -> {folder}", SKIPPED, report=report)
        if why:
            progress.tell(f"{task.name}: computed again: {why}")
    document = document.with_positions(request.positions)
    if request.changes:
        document = document.with_changes(request.changes)
    scene = document.scene
    limits_of(scene)  # an unknown result in a limit raises an error here, before the long computation starts
    positions = scene.run.positions
    long = is_long(scene, positions)
    if long and (request.nonlinear or request.solid):
        raise RequestError(f"--check nonlinear and solid allow at most {SHOWN} positions: use fewer")
    if long and request.tables:
        raise RequestError("--tables: the tables of such a long run are only written as CSV")
    optimum: OptimumReport | UnsetType = UNSET
    if request.optimize:
        from kinelast.outputs.studies import best_design

        document, optimum = best_design(document, progress.within(document.name))
        scene = document.scene
    scene = _in_requested_units(scene, request)
    scene = replace(scene, course=scene.course.reporting(_on_step(scene, progress)))
    if scene.course.interrupted is not None:
        request = replace(request, reachable=True)
        made = replace(made, interrupted=scene.course.interrupted)  # so that --resume computes the scene again
    if heavy := runs.require_resources(scene, request, positions, SHOWN if long else positions, folder):
        progress.tell(heavy)
    if long:
        with complete(folder) as part:
            results = _long(part, scene, request, progress)
            report, sealed = _finish(part, task, (document, optimum), results, made, request, progress)
    else:
        results = computed(scene, request, progress)
        with complete(folder) as part:
            write_tables(part, results, request)
            report, sealed = _finish(part, task, (document, optimum), results, made, request, progress)
    return _outcome(task, report, sealed, earlier)


def _in_requested_units(scene: Scene, request: Request) -> Scene:
    """Return the scene with the display units that the options --units and --speeds request."""
    units, written = request.units or scene.report_units, dict(scene.written)
    if request.speeds and (name := request.speeds[3]):
        one = Speed.read(f"1 {name}")
        written[one.unit] = 1.0 / float(one), name
    return replace(scene, report_units=units, written=written)


def _on_step(scene: Scene, progress: Progress) -> OnStep:
    """Return a function that reports the progress of an integration.

    The function warns the user once if the integration will need more steps than the scene allows.
    """
    stage, end = f"{scene.name}: integrating {scene.run.duration:g} s of motion", scene.run.duration
    times, began, judged = [0.0], time.perf_counter(), False

    def on_step(reached: float) -> None:
        nonlocal judged
        progress(stage, int(1000 * reached / end), 1000)
        times.append(reached)
        if judged:
            return
        from rigid.dynamics import remaining_steps

        ahead = remaining_steps(times, end)
        if not ahead:
            return
        judged = True
        steps, allowed = len(times) - 1, scene.run.steps
        if steps + ahead > allowed:
            lasts = lasting((time.perf_counter() - began) * allowed / steps)
            done = f"after {steps} steps the integration has reached {reached:.3g} s of {end:g} s"
            needed = f"it needs about {float(f'{ahead:.2g}'):,.0f} more of this size"
            limit = f"it stops after {allowed} (steps under [run]), in about {lasts}"
            progress.tell(f"{scene.name}: {done}; {needed}, but {limit}")

    return on_step


def _long(part: Path, scene: Scene, request: Request, progress: Progress) -> Results:
    """Compute a long run, and write its tables chunk by chunk."""
    instants = scene.course.times()
    count = len(instants)
    if request.reachable:
        instants = scene.course.reached(instants)
        if not len(instants):
            raise RequestError("no position can be reached")
    fields = tables.FieldFile(part / "fields.npz", len(instants), request.stations) if request.fields else None

    def on_chunk(results: Results, first: int) -> None:
        for name, table in tables.tables_of_positions(results, request.motion, request.columns).items():
            tables.append_table(part / f"{name}.csv", table, first == 0)
        if fields:
            fields.add(results)
        progress(f"{scene.name}: solving positions", first + len(results.motion.time), len(instants))

    theory = partial(runs.by_theory, request=request, progress=progress)
    results = runs.long_results(scene, instants, on_chunk, runs.require_chunk, theory)
    if fields:
        fields.close()
    comparison = runs.checked(scene, results.quasi_static, request, progress)
    results = replace(results, comparison=comparison, left_out=count - len(instants))
    return runs.further_checked(results, request, progress)


def write_tables(part: Path, results: Results, request: Request) -> None:
    """Write the tables with values at every position and, if requested, fields.npz."""
    for name, table in tables.tables_of_positions(results, request.motion, request.columns).items():
        write_table(part / f"{name}.csv", table, request.tables)
    if request.fields:
        tables.write_fields(part / "fields.npz", results, request.stations)


def _finish(
    part: Path,
    task: Task,
    design: tuple[Document, OptimumReport | UnsetType],
    results: Results,
    made: Origin,
    request: Request,
    progress: Progress,
) -> tuple[Report, dict[str, Any]]:
    """Write all files of a scene, or of its best design, except for the tables and fields at every position.

    Returns
    -------
    The report, and the summary with the checksums of all files.
    """
    from kinelast.reports.summary import report_of

    for name, table in tables.cam_tables(results.scene).items():
        write_table(part / f"{name}.csv", table, request.tables)
    if request.refine and not results.vibrates:
        from kinelast.figures.refined_peaks import refined

        results = refined(results, progress)
    document, optimum = design
    report = replace(report_of(results), made_from=made, optimum=optimum)
    further = {"nonlinear_check": report.nonlinear_check, "solid_check": report.solid_check}
    checks = {name: check for name, check in further.items() if check}
    if report.check or checks:
        write_json(part / "check.json", {**(to_builtins(report.check) or {}), **checks})
    report = _with_studies(part, document, results, report, request, progress)
    failed: dict[str, str] = {}
    report = replace(report, more={**report.more, **task.extra, "failed": failed})
    for name, draw in _drawings(part, results, report, request, progress):
        with _isolated(name, failed):
            draw()
    return report, seal(part, data_of(report))


def _with_studies(
    part: Path, document: Document, results: Results, report: Report, request: Request, progress: Progress
) -> Report:
    """Carry out the requested studies, write their files, and add their results to the report."""
    more: dict[str, Any] = {}
    if request.speeds and results.scene.labels:
        more["speeds"] = _speeds(part, results.scene, request.speeds[:3], request.tables, progress)
        from kinelast.reports.reserves import with_limit_speed

        rows = with_limit_speed(report.breaks_first, more["speeds"], results.scene)
        report = replace(report, breaks_first=rows)
    if request.balance:
        from kinelast.reports.balance import balance_figures, balance_text

        more["balance"] = balance_figures(results)
        if balanced := balance_text(document, more["balance"]):
            (part / "balance.toml").write_text(balanced, encoding="utf-8")
    if request.sensitivities or request.tolerances or request.optimize:
        from kinelast.outputs.studies import write_studies

        more |= write_studies(part, document, report.optimum, request, progress.within(document.name))
    return replace(report, more={**report.more, **more})


def _speeds(
    part: Path, scene: Scene, asked: tuple[float, float, int], others: Sequence[str], progress: Progress
) -> dict[str, Any]:
    """Write the largest values at several drive speeds (speeds.csv, speeds.svg), and return them for the report."""
    from kinelast.outputs.speeds import draw_speeds, speed_figures, speed_table
    from kinelast.speed_study.speeds import speeds

    progress(f"{scene.name}: speeds", 0, 1)
    found = speeds(scene, asked, progress)
    write_table(part / "speeds.csv", speed_table(scene, found), others)
    draw_speeds(part / "speeds.svg", scene, found)
    return speed_figures(found, scene)


def _outcome(task: Task, report: Report, sealed: Mapping[str, Any], earlier: Iterable[str]) -> Outcome:
    """Return the outcome of a finished scene.

    `earlier` contains the names of the files that earlier runs wrote to the result folder.
    """
    of = "best design: " if report.optimum else ""
    line = f"{task.name}: {of}{headline(report)} -> {task.folder}"
    if others := foreign(task.folder, sealed):
        line += f"; other files left there: {plain(', '.join(others[:3]), MESSAGE)}"
    kept = {*sealed["files"], *(re.sub(r"\.edited\d*", "", name) for name in others)}
    if older := sorted({*earlier} - kept):
        line += f"; of an earlier run, moved to {EARLIER}/: {plain(', '.join(older[:3]), MESSAGE)}"
    words = [each for study in STUDIES for each in report.more.get(study, {}).get("words", ())]
    neglected = report.theory.without_vibration or 0.0
    if report.more.get("sensitivities") and report.theory.name != QUASI_STATIC and neglected > ACCURACY:
        change = f"change results by up to {percent(neglected)}"
        words.append(f"sensitivities are quasi-static: they neglect vibration and large displacement, which {change}")
    for each in (*words, *(report.optimum.words if report.optimum else ())):
        line += f"\n{task.name}: {each}"
    failed = report.more["failed"]
    for name, fault in failed.items():
        line += f"\n{task.name}: the program failed on {name}, please report this:\n{fault}"
    status = BUG if failed else FINE if _agrees(report) else CHECK_FAILED
    asked = tuple(f"{task.name}: {each}" for each in questions(report))
    return Outcome(status, line, DONE, asked, report, interrupted=report.run.interrupted is not None)


@contextmanager
def _isolated(name: str, failed: dict[str, str]) -> Iterator[None]:
    """Store an unexpected exception in `failed` instead of raising it.

    If a picture fails, the tables and the summary are therefore still written.
    """
    try:
        with stops_kept():
            yield
    except (RequestError, OSError, MemoryError):
        raise
    except Exception as error:
        if sentence := missing_package(error):
            raise RequestError(f"{name}: {sentence}") from None
        failed[name] = traceback.format_exc()


def _drawings(
    part: Path, results: Results, report: Report, request: Request, progress: Progress
) -> Iterator[tuple[str, Callable[[], Any]]]:
    """Yield the name of each page, picture, mesh and movie to write, and a function that writes it."""
    from kinelast.outputs.page import report_page

    scene = results.scene
    yield "report.html", lambda: (part / "report.html").write_bytes(report_page(results, report))
    if request.handout:
        from kinelast.outputs.print_page import write_page

        yield "report.pdf", partial(write_page, part / "report.pdf", results, report)
    if request.stills or request.dxf or request.animate:
        from kinelast.outputs import pictures
    if request.stills:
        progress(f"{scene.name}: drawing stills", 0, 1)
        yield "stills", partial(pictures.write_stills, part / "stills", results)
    if request.dxf:
        yield "links.dxf", partial(pictures.write_dxf, part / "links.dxf", results)
        for cam in scene.cams:
            yield f"cam_{cam}.dxf", partial(pictures.write_cam, part / f"cam_{cam}.dxf", scene, cam)
    if request.mesh:
        from fem_check import write_vtu_series

        progress(f"{scene.name}: writing meshes", 0, 1)
        yield "mesh", partial(write_vtu_series, results.deflection, part / "mesh")
    films = request.animate
    if films and (results.buckles or not scene.labels):
        films = ("motion",)  # fields cannot be shown if a link buckles or no link has beams
    for diagram in films:
        on_frame = partial(progress, f"{scene.name}: {diagram}")
        yield f"{diagram}.{request.picture}", partial(pictures.draw_film, part, results, diagram, request, on_frame)


def _agrees(report: Report) -> bool:
    """Return True if all checks pass, all limits are met, and the requested accuracy is reached.

    If a best design was searched for, it must also be feasible.
    """
    best, verdict = report.optimum, report.acceptance
    failures = [
        report.check and report.check.passed is False,
        *(
            check and (check.passed is False or check.problem or check.too_close_to_decide or check.cannot_tell)
            for check in (report.nonlinear_check, report.solid_check)
        ),
        best and (not best.feasible or (best.verdict and not best.passed)),
        verdict.verdict and not verdict.passed,
        report.theory.reached is False,
    ]
    return not any(failures)
