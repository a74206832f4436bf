"""One scene: everything that was asked of it, written to its folder all at once or not at all."""

from __future__ import annotations

import traceback
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from importlib import metadata
from pathlib import Path
from typing import Any

import numpy as np

from elastic import Deflection, deflection
from kinelast.figures.results import Peak, Results, peaks
from kinelast.folder import Request, RequestError, complete, finished, made_from, write_json
from kinelast.scene.reading import Scene, SceneError, read_scene, scene_motion, scene_motion_at
from rigid import MechanismError, Motion
from rigid.analysis import reachable

FINE, CHECK_FAILED, BAD_INPUT, BUG = 0, 1, 2, 3
Progress = Callable[[str, int, int], None]


@dataclass(frozen=True)
class Outcome:
    """How a scene went: the exit status it calls for, and one line about it."""

    status: int
    line: str


def _nothing(stage: str, done: int, total: int) -> None:
    pass


def require_pictures(request: Request) -> None:
    """Raise where pictures are asked for that there are none of, or that cannot be drawn on this machine."""
    if not request.animate:
        return
    from animations import DIAGRAMS, RenderingUnavailable, probe

    for name in request.animate:
        if name not in DIAGRAMS:
            raise RequestError(f'--animate: there is no diagram "{name}", choose from {", ".join(DIAGRAMS)}')
    try:
        probe()
    except RenderingUnavailable as error:
        raise RequestError(f"--animate: {error}") from None


def try_scene(path: Path, out: Path, request: Request, resume: bool = False, progress: Progress = _nothing) -> Outcome:
    """Compute a scene and write its folder; what goes wrong becomes the outcome.

    Parameters
    ----------
    out
        Where the folder named after the scene is put.
    resume
        Leave a folder as it is that came from the same file and request.
    progress
        Called with what is being done, and how much of it is done and to be done.
    """
    try:
        return _scene(path, out, request, resume, progress)
    except (SceneError, MechanismError, RequestError) as error:
        return Outcome(BAD_INPUT, f"{path.stem}: {error}")
    except OSError as error:
        place = f"{error.filename}: " if error.filename else ""
        return Outcome(BAD_INPUT, f"{path.stem}: not written: {place}{(error.strerror or str(error)).lower()}")
    except Exception:  # one scene that the program fails on must not take the others with it
        return Outcome(BUG, f"{path.stem}: the program failed, please report this:\n{traceback.format_exc()}")


def _scene(path: Path, out: Path, request: Request, resume: bool, progress: Progress) -> Outcome:
    folder = out / path.stem
    if resume and (before := finished(folder, made_from(path, request))):
        return Outcome(CHECK_FAILED if _differs(before) else FINE, f"{path.stem}: finished before -> {folder}")
    scene = read_scene(path)
    made = made_from(path, request)
    results = computed(scene, request, progress)
    from kinelast.figures.refinement import refined_peaks
    from kinelast.figures.summary import summary

    found = peaks(results)
    if request.refine:
        found = refined_peaks(results, found)
    figures = {"kinelast": metadata.version("kinelast"), **summary(results, found), "made_from": made}
    with complete(folder) as part:
        _write(part, results, found, figures, request, progress)
    return Outcome(CHECK_FAILED if _differs(figures) else FINE, f"{path.stem}: {_line(figures)} -> {folder}")


def computed(scene: Scene, request: Request, progress: Progress = _nothing) -> Results:
    """Motion, deflection and, where asked for, the check of a scene.

    Raises
    ------
    SceneError, RequestError
        A position is out of reach; positions that are to be left out leave none.
    """
    course, left_out = _course(scene, request)
    bent = deflection(course, scene.sections, joints=scene.joints)
    _require_on_beams(scene, bent)
    if request.check is None:
        return Results(scene, bent, left_out=left_out)
    from fem_check import compare, solve

    progress(f"{scene.name}: finite elements", 0, 1)
    checked = solve(course, scene.sections, request.check, scene.joints)
    return Results(scene, bent, compare(bent, checked), left_out)


def _require_on_beams(scene: Scene, bent: Deflection) -> None:
    """Raise where a block leaves the elastic beam that it slides on."""
    known = np.isfinite(bent.motion.origin).all(axis=0)
    for contact in bent.contacts:
        off = known & np.isnan(contact.xi)
        if off.any():
            at, beam = scene.mechanism.beams[contact.beam]
            link = scene.mechanism.links[at].name
            names = ", ".join(f'"{slider.name}"' for slider in scene.mechanism.sliders if slider.on == link)
            problem = f'of {names} leaves the beam "{beam.start}"-"{beam.end}" at {bent.motion.time[off][0]:.6g} s'
            raise SceneError(scene.path, f"links.{link}", "points", f"the block {problem}: let the beam reach further")


def _course(scene: Scene, request: Request) -> tuple[Motion, int]:
    """The motion, and how many positions were left out."""
    course = scene_motion(scene, request.positions, partial=True)
    good = reachable(course)
    if good.all():
        return course, 0
    if not request.reachable:
        try:
            scene_motion(scene, request.positions)
        except SceneError as error:
            advice = "; --reachable leaves out what cannot be reached"
            problem = error.problem + (advice if good.any() else "")
            raise SceneError(error.file, error.table, error.key, problem) from None
    if not good.any():
        raise RequestError("no position can be reached")
    return scene_motion_at(scene, course.time[good]), int((~good).sum())


def _write(
    part: Path,
    results: Results,
    found: dict[str, list[Peak]],
    figures: dict[str, Any],
    request: Request,
    progress: Progress,
) -> None:
    """All files of a scene."""
    from kinelast.page.report import report_html
    from kinelast.tables import write_fields, write_positions

    name = results.scene.name
    (part / "report.html").write_text(report_html(results, found, figures), encoding="utf-8")
    write_positions(part / "positions.csv", results)
    if request.fields:
        write_fields(part / "fields.npz", results, request.stations)
    if figures["check"]:
        write_json(part / "check.json", figures["check"])
    if request.mesh:
        from fem_check import write_vtu_series

        progress(f"{name}: meshes", 0, 1)
        write_vtu_series(results.deflection, part / "mesh")
    for diagram in request.animate:
        from animations import Style, movie

        style = Style(title=results.scene.title, outlines=results.scene.outlines)
        target = part / f"{diagram}.{request.picture}"
        try:
            movie(results.deflection, diagram, target, request.frames, style, partial(progress, f"{name}: {diagram}"))
        except ValueError as error:
            raise RequestError(f"--animate {diagram}: {error}") from None
    figures["files"] = sorted({entry.name for entry in part.iterdir()} | {"summary.json"})
    write_json(part / "summary.json", figures)


def _differs(figures: dict[str, Any]) -> bool:
    check = figures.get("check")
    return check is not None and not check["passed"]


def _or_nan(value: float | None) -> float:
    return float("nan") if value is None else value


def _safe(factor: float | None) -> str:
    return "" if factor is None else f", safety {factor:.3g}"


def _line(figures: dict[str, Any]) -> str:
    """The gist of a scene in one line."""
    from kinelast.figures.trust import GOOD, verdict
    from kinelast.page.numbers import coordinate, number, quantity

    words = ["nothing bends: no link has beams" if not figures["links"] else "no position could be computed"]
    largest = figures["largest_deflection"]
    if largest:
        place = quantity(largest["along"]["value"], "m", 3)
        drives = (f"{name} at {coordinate(item['value'], item['unit'])}" for name, item in largest["drive"].items())
        size = quantity(abs(largest["value"]), largest["unit"])
        words = [f"largest deflection {size} ({largest['label']}, {place} along it, {', '.join(drives)})"]
    stress = figures["largest_stress"]
    if stress:
        safety = figures["strength"][stress["label"]]["safety_factor"]["value"]
        words.append(f"stress {quantity(stress['value'], 'Pa', 3)} ({stress['label']}{_safe(safety)})")
    condition = figures["run"]["largest_condition"]["value"]
    if condition is not None:
        words.append(f"condition {number(condition, 3)}")
    if figures["run"]["singular"]:
        words.append(f"{figures['run']['singular']} singular positions")
    if figures["run"]["left_out"]:
        words.append(f"{figures['run']['left_out']} positions out of reach")
    if figures["check"]:
        result = "agrees" if figures["check"]["passed"] else "FAILED"
        size = number(_or_nan(figures["check"]["largest"]), 2)
        nothing = figures["check"]["passed"] and not (figures["links"] and figures["check"]["compared"])
        words.append("check has nothing to compare" if nothing else f"check {result} ({size})")
    level, reasons = verdict(figures["trust"])
    if level != GOOD:
        words.append(f"{level}: {', '.join(reasons)}")
    return "; ".join(words)
