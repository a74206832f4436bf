"""One scene computed: its motion, its deflection, and the checks that were asked for."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from elastic import Deflection
from kinelast.figures.long_runs import SHOWN
from kinelast.figures.results import Results
from kinelast.process.progress import SILENT, Progress
from kinelast.scene.data import Scene
from kinelast.scene.error import SceneError
from kinelast.scene.motion import require_reached, require_tables, scene_deflection, scene_motion
from kinelast.tasks.request import Request, RequestError
from rigid import Motion, reachable

if TYPE_CHECKING:
    from fem_check import Comparison


def computed(scene: Scene, request: Request, progress: Progress = SILENT) -> Results:
    """Motion, deflection and, where asked for, the check of a scene.

    Raises
    ------
    SceneError, RequestError
        A position is out of reach; positions that are to be left out leave none.
    """
    moved, left_out = _moved(scene, request)
    bent = scene_deflection(scene, moved)
    require_on_beams(scene, bent)
    plain = Results(scene, bent, checked(scene, bent, request, progress), left_out)
    return further_checked(by_theory(plain, request, progress), request, progress)


def by_theory(plain: Results, request: Request, progress: Progress) -> Results:
    """The results of the theory of motion that is asked for, from those without vibration.

    A long run keeps these, and is told how far off they are.
    """
    scene, theory = plain.scene, request.theory_of(plain.scene)
    if theory.plain or not scene.labels:
        return plain
    from kinelast.figures.theory import answer

    progress(f"{scene.name}: vibration", 0, 1)
    found = answer(scene, plain.deflection, theory, plain.period, only_told=plain.run is not None)
    return replace(plain, deflection=found.deflection, answer=found)


def further_checked(results: Results, request: Request, progress: Progress) -> Results:
    """The results with the checks that take the whole answer, or other theories, where they are asked for."""
    if request.elements is not None:
        from kinelast.figures.checks import momentum_balances

        results = replace(results, balances=momentum_balances(results))
    if not results.scene.labels or not (request.nonlinear or request.solid):
        return results
    from kinelast.figures.checks import nonlinear_check, solid_check

    name, nonlinear, solid = results.scene.name, None, None
    if request.nonlinear:
        nonlinear = nonlinear_check(results, lambda share, _: progress(f"{name}: nonlinear", int(1000 * share), 1000))
    if request.solid:
        progress(f"{name}: plane bodies", 0, 1)
        solid = solid_check(results)
    return replace(results, nonlinear=nonlinear, solid=solid)


def checked(scene: Scene, bent: Deflection, request: Request, progress: Progress) -> Comparison | None:
    """The comparison with finite elements, where it is asked for."""
    if request.elements is None:
        return None
    from fem_check import compare, solve

    progress(f"{scene.name}: finite elements", 0, 1)
    return compare(bent, solve(bent.motion, scene.sections, request.elements, scene.joints))


def _require_reached(scene: Scene, moved: Motion) -> None:
    """Raise where a motion goes where the mechanism does not reach."""
    try:
        require_reached(scene, moved)
    except SceneError as error:
        advice = "; --reachable leaves out what cannot be reached" if reachable(moved).any() else ""
        raise SceneError(error.file, error.table, error.key, error.problem + advice) from None


def require_chunk(scene: Scene, bent: Deflection) -> None:
    """Raise where a chunk of a long run cannot be reached, told of all the run at fewer positions, or loses a beam."""
    if not reachable(bent.motion).all():
        _require_reached(scene, scene_motion(scene, SHOWN, partial=True))
        _require_reached(scene, bent.motion)
    require_on_beams(scene, bent)


def require_on_beams(scene: Scene, bent: Deflection) -> None:
    """Raise where a block leaves the elastic beam that it slides on."""
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
    """The motion, and how many positions were left out."""
    times = scene.course.times(request.positions)
    kept = scene.course.reached(times) if request.reachable else times
    if not len(kept):
        raise RequestError("no position can be reached")
    moved = scene.course.at(kept)
    if not request.reachable:
        _require_reached(scene, moved)
    require_tables(scene, moved)
    return moved, len(times) - len(kept)
