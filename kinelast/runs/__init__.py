"""Computation of a scene: memory estimate, motion, deflection, and checks.

A long run is computed in chunks. Results such as the largest stress are found for each chunk and then merged. Curves,
maps, movies, frequencies and checks of a long run use only `SHOWN` evenly spaced positions.
"""

from __future__ import annotations

import shutil
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from msgspec.structs import replace

from elastic import FIELDS, PRIMARY, Deflection, without_positions
from kinelast.answers.checks import momentum_balances, nonlinear_check, solid_check
from kinelast.answers.results import Results, answered, with_breaks
from kinelast.figures.beam_limits import too_many_beams
from kinelast.figures.cycle import EXTREME_FIELDS
from kinelast.figures.output import output_of
from kinelast.figures.peaks import joined, run_figures
from kinelast.figures.registry import limits_of
from kinelast.scene.data import Scene, require_reached, require_tables, scene_deflection, scene_motion
from kinelast.tasks.progress import SILENT, Progress
from kinelast.tasks.request import Request, RequestError
from kinelast.values.error import SceneError
from rigid import Motion, Posture, Reals, reachable, structure

if TYPE_CHECKING:
    from fem_check import Comparison


HEAVY = 2e8  # [bytes] the user is warned if a run needs more memory or disk space
NUMBER = 8  # [bytes] size of a number in memory or in a binary file
DIGITS = 20  # [bytes] approximate size of a number in a CSV file
MOST_MESHES = 20_000  # maximum number of mesh files
SHARE = 0.8  # largest usable fraction of the free memory or disk space
COPIES = 5  # the finite element check needs memory for this number of copies of its arrays


def require_resources(scene: Scene, request: Request, positions: int, checked: int, out: Path) -> str:
    """Return a warning if a run is large or the mechanism has too many beams, otherwise an empty string.

    Parameters
    ----------
    positions
        Number of positions of the run.
    checked
        Number of positions that the finite element check computes.
    out
        Folder for the results.

    Raises
    ------
    RequestError
        There is not enough memory or disk space, or the run would write too many mesh files.
    """
    beams = len(scene.mechanism.beams)
    if request.mesh and positions > MOST_MESHES:
        raise RequestError(f"--mesh writes a file for every position: use at most {MOST_MESHES} --positions")
    disk = positions * DIGITS * _columns(scene)
    if request.fields:
        disk += 2 * positions * request.stations * sum(field.main for field in FIELDS.values()) * beams * NUMBER
    elements = request.elements or 0
    memory = checked * elements * len(PRIMARY) * max(beams, 1) * NUMBER * COPIES
    for need, free, where, less in (
        (disk, _free_disk(out), "of disk space", "--positions or --stations"),
        (memory, _free_memory(), "of memory", "--positions or elements to --check"),
    ):
        if need > SHARE * free:
            sentence = f"needs about {_words(need)} {where}, but only {_words(free)} are free"
            raise RequestError(f"the request {sentence}: use fewer {less}")
    sentences = [many] if (many := too_many_beams(scene.mechanism)) else []
    if max(disk, memory) >= HEAVY:
        of_memory = f" and {_words(memory)} of memory" if memory else ""
        sentences.append(f"{positions} positions need about {_words(disk)} of disk space{of_memory}")
    return f"{scene.name}: {'; '.join(sentences)}" if sentences else ""


def _columns(scene: Scene) -> int:
    """Return the approximate number of columns of positions.csv."""
    mechanism = scene.mechanism
    points = sum(len(link.points) for link in mechanism.links[1:])
    of_beams = (len(EXTREME_FIELDS) + 1) * len(mechanism.beams)
    return 6 + 2 * len(mechanism.drives) + of_beams + 3 * points + 3 * len(structure(mechanism).joints)


def _free_disk(out: Path) -> float:
    there = next((place for place in (out, *out.absolute().parents) if place.exists()), Path("/"))
    return float(shutil.disk_usage(there).free)


def _free_memory() -> float:
    """Return the free memory [bytes], or inf if unknown."""
    try:
        lines = Path("/proc/meminfo").read_text(encoding="ascii").splitlines()
        return next(1024.0 * int(line.split()[1]) for line in lines if line.startswith("MemAvailable"))
    except (OSError, ValueError, StopIteration):
        return float("inf")


def _words(size: float) -> str:
    return f"{size / 1e9:.3g} GB" if size >= 1e9 else f"{size / 1e6:.3g} MB"


LONG = 100_000  # a run is long if positions * (beams + 1 + PER_LINK * links) > LONG (about 200 MB)
PER_LINK = 0.25  # memory of a link / memory of a beam
SHOWN = 3600  # number of positions of a long run for curves, maps, movies and checks


def is_long(scene: Scene, positions: int) -> bool:
    """Return True if a run is so long that it must be computed in chunks."""
    mechanism = scene.mechanism
    return positions * (len(mechanism.beams) + 1 + PER_LINK * len(mechanism.links)) > LONG


def long_results(
    scene: Scene,
    time: Reals,
    on_chunk: Callable[[Results, int], None],
    require: Callable[[Scene, Deflection], None],
    theory: Callable[[Results], Results] | None = None,
) -> Results:
    """Compute a long run in chunks.

    Results such as the largest stress consider all positions. The deflection is only kept at `SHOWN` evenly spaced
    positions.

    Parameters
    ----------
    time
        Times of the run [s], shape (positions,).
    on_chunk
        Called with the results of each chunk and the index of the first position of the chunk.
    require
        Function that raises an error if a chunk contains an invalid position.
    theory
        Function that converts quasi-static results to the results of the requested theory. It is called once, with the
        results at the `SHOWN` positions. The theory that it selects is also used for the chunks.
    """
    shown = Results(scene, scene_deflection(scene, _shown(scene, time, require)))
    shown = theory(shown) if theory else shown
    output, run, first = output_of(scene), None, 0
    for moved in scene.course.chunks(time):
        require_tables(scene, moved)
        plain = scene_deflection(scene, moved)
        require(scene, plain)
        bent = shown.answer.at(plain) if shown.answer else plain
        if shown.buckles:
            bent = without_positions(plain)
        results = Results(scene, bent)
        on_chunk(results, first)
        run = joined(run, run_figures(results.cycle, output))
        first += len(moved.time)
    return replace(shown, run=None if run is None else with_breaks(shown, run.with_averages(shown.cycle)))


def _shown(scene: Scene, time: Reals, require: Callable[[Scene, Deflection], None]) -> Motion:
    """Return the motion at evenly spaced positions of a long run.

    A mechanism can be assembled in several ways. At each position, it is assembled as at the nearby position of the
    run.
    """
    shown = np.linspace(0.0, scene.run.duration, SHOWN, endpoint=not scene.run.turn)
    if len(time) < SHOWN or not np.isclose(
        time[-1] - time[0], shown[-1], rtol=2 / SHOWN
    ):  # the run has few positions, or leaves out unreachable ones: use every n-th position of the run
        shown = time[:: -(-len(time) // SHOWN)]
    beside = np.clip(np.searchsorted(time, shown), 0, len(time) - 1)
    near, first = [], 0
    for moved in scene.course.chunks(time):
        if not reachable(moved).all():
            require(scene, scene_deflection(scene, moved))
        own = beside[(beside >= first) & (beside < first + len(moved.time))] - first
        near.append((moved.origin[:, own], moved.direction[:, own]))
        first += len(moved.time)
    even = Posture(scene.mechanism, *(np.concatenate(parts, axis=1) for parts in zip(*near, strict=True)))
    return scene.course.near(shown, even)


def computed(scene: Scene, request: Request, progress: Progress = SILENT) -> Results:
    """Return the results of a scene: motion, deflection and requested checks.

    Raises
    ------
    SceneError
        A position is unreachable, a block leaves its beam, a load table ends too early, or the theory has no solution.
    RequestError
        Unreachable positions may be left out, but no position is reachable.
    """
    moved, left_out = _moved(scene, request)
    bent = scene_deflection(scene, moved)
    require_on_beams(scene, bent)
    plain = Results(scene, bent, checked(scene, bent, request, progress), left_out)
    return further_checked(by_theory(plain, request, progress), request, progress)


def by_theory(plain: Results, request: Request, progress: Progress) -> Results:
    """Convert quasi-static results to results by the requested theory, see `kinelast.answers.results.answered`."""
    scene, theory = plain.scene, request.theory_of(plain.scene)
    if theory is not scene.theory:
        scene = replace(scene, theory=theory)
        plain = replace(plain, scene=scene)
    judged = bool(limits_of(scene))
    if scene.labels and not (theory.plain and not judged):
        progress(f"{scene.name}: solving vibration", 0, 1)
    return answered(plain, theory, judged, progress)


def further_checked(results: Results, request: Request, progress: Progress) -> Results:
    """Add the requested checks to the results: momentum balances, nonlinear check, solid check."""
    if request.elements is not None:
        results = replace(results, balances=momentum_balances(results))
    if not results.scene.labels or not (request.nonlinear or request.solid):
        return results
    name, nonlinear, solid = results.scene.name, None, None
    if request.nonlinear:
        nonlinear = nonlinear_check(
            results, lambda share, _: progress(f"{name}: nonlinear check", int(1000 * share), 1000)
        )
    if request.solid:
        progress(f"{name}: solid check", 0, 1)
        solid = solid_check(results)
    return replace(results, nonlinear=nonlinear, solid=solid)


def checked(scene: Scene, bent: Deflection, request: Request, progress: Progress) -> Comparison | None:
    """Compare the quasi-static deflection with finite elements. Return None if this check is not requested."""
    if request.elements is None:
        return None
    from fem_check import compare, solve

    progress(f"{scene.name}: finite element check", 0, 1)
    return compare(bent, solve(bent.motion, scene.sections, request.elements, scene.joints))


def _require_reached(scene: Scene, moved: Motion) -> None:
    """Raise SceneError if the mechanism cannot reach a position."""
    try:
        require_reached(scene, moved)
    except SceneError as error:
        advice = "; --reachable leaves out unreachable positions" if reachable(moved).any() else ""
        raise SceneError(error.file, error.table, error.key, error.problem + advice) from None


def require_chunk(scene: Scene, bent: Deflection) -> None:
    """Raise SceneError if a position in a chunk of a long run is unreachable, or a block leaves its beam.

    If a position is unreachable, the message describes the whole run, not only the chunk.
    """
    if not reachable(bent.motion).all():
        _require_reached(scene, scene_motion(scene, SHOWN, partial=True))
        _require_reached(scene, bent.motion)
    require_on_beams(scene, bent)


def require_on_beams(scene: Scene, bent: Deflection) -> None:
    """Raise SceneError if a block leaves the elastic beam on which it slides."""
    known = np.isfinite(bent.motion.origin).all(axis=0)
    for block in bent.blocks:
        off = known & np.isnan(block.xi)
        if off.any():
            at, beam = scene.mechanism.beams[block.beam]
            link = scene.mechanism.links[at].name
            on_it = (joint.name for joint in bent.motion.structure.joints if joint.owner == at and not joint.turns)
            names = ", ".join(f'"{name}"' for name in on_it)
            problem = f'of {names} leaves the beam "{beam.start}"-"{beam.end}" at {bent.motion.time[off][0]:.6g} s'
            raise SceneError(scene.path, f"links.{link}", "points", f"the block {problem}: let the beam reach further")


def _moved(scene: Scene, request: Request) -> tuple[Motion, int]:
    """Return the motion, and the number of unreachable positions that the motion leaves out."""
    times = scene.course.times(request.positions)
    kept = scene.course.reached(times) if request.reachable else times
    if not len(kept):
        raise RequestError("no position can be reached")
    moved = scene.course.at(kept)
    if not request.reachable:
        _require_reached(scene, moved)
    require_tables(scene, moved)
    return moved, len(times) - len(kept)
