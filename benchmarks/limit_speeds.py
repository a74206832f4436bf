"""Limit speeds and peaks found from ten speeds, compared with a dense grid: shipped and random scenes."""

import math
import sys
import time
from collections.abc import Iterator, Sequence
from itertools import islice
from typing import Any

import measuring
import numpy as np
from msgspec.structs import replace
from random_scenes import FEATURES, scenes

from elastic import cycle_maxima
from elastic.elastodynamics import BoundUtilisation, SpeedMap, SpeedSearch, SpeedSolutions, prominences
from kinelast.answers.bounds import damping_of
from kinelast.scene.data import Scene
from kinelast.scene.document import read_scene
from kinelast.tasks.task import shipped_scenes
from rigid import ConstantSpeed, MechanismError

SHIPPED = "steel_four_bar", "utenov_four_bar", "offset_slider_crank", "quick_return", "simeon_slider_crank"
DRAWN, SEED = 5, 1919
DENSE, DENSE_OF_DRAWN, REQUESTED = 2000, 600, 10  # speeds
LOWEST, HIGHEST = 1 / 12, 1 / 2.5  # frequency of the cycle, relative to the lowest natural frequency
LIMIT = 0.4  # limit of the deflection, relative to the highest peak on the dense grid
DAMPING = 0.01, 0.003  # damping ratios of the random scenes, alternating
FIELDS = "w", "chord", "M"
MIN_PROMINENCE = 0.02  # of a counted peak, relative to its height
MIN_PEAK = 1e-3  # height of a counted peak, relative to the largest link's


def answers_of(scene: Scene) -> SpeedSolutions:
    """Answers at speeds, with the maxima of `FIELDS` on every beam."""

    def measure(bent: Any, _: Any) -> Any:
        found = cycle_maxima(bent, FIELDS, period=bent.motion.time[:, -1])
        return np.concatenate([found[field].value for field in FIELDS])

    course = scene.course
    return SpeedSolutions(course.at, float(scene.run.cycle), scene.sections, measure, scene.joints, damping_of(scene))


def curves(known: SpeedMap) -> Any:
    """Maxima of `FIELDS`, shape (3, beams, speeds)."""
    return known.values.T.reshape(len(FIELDS), -1, len(known.ratio))


def missed(known: SpeedMap, dense: SpeedMap, width: float) -> tuple[int, float]:
    """Number of peaks on the dense grid, and the largest relative excess of one over the found values nearby."""
    count, worst = 0, 0.0
    for ours, theirs in zip(curves(known), curves(dense), strict=True):
        for own, other in zip(ours, theirs, strict=True):
            for at, share in prominences(other):
                if share < MIN_PROMINENCE or other[at] < MIN_PEAK * np.nanmax(theirs):
                    continue
                near = np.abs(np.log(known.ratio / dense.ratio[at])) < 2 * width
                height = max(np.interp(dense.ratio[at], known.ratio, own), np.nanmax(own[near], initial=0.0))
                count, worst = count + 1, max(worst, 1 - height / other[at])
    return count, worst


def row(scene: Scene, count: int) -> measuring.Row:
    """Limit speed and peaks of a scene, by the search and on the dense grid."""
    first = answers_of(scene)
    base = 2 * math.pi / float(scene.run.cycle)
    low, high = (share * float(first.omega.min()) / base for share in (LOWEST, HIGHEST))
    start = time.process_time()
    first.find(np.geomspace(low, high, count).tolist())
    brute = time.process_time() - start
    dense = first.map()
    chord = curves(dense)[1]
    bound = LIMIT * float(np.nanmax(chord))
    passed = ~(chord <= bound).all(axis=0)
    limit = float(dense.ratio[passed.argmax()]) if passed.any() else math.nan
    start = time.process_time()
    answers = answers_of(scene)
    answers.find(np.linspace(low, high, REQUESTED).tolist())
    search = SpeedSearch(answers, curves)
    search.find_peaks()
    unstable = search.find_stability_limits()
    beams = range(len(scene.labels))
    bracket = search.find_limit(BoundUtilisation(lambda known: curves(known)[1] / bound, [1] * len(beams), beams))
    taken = time.process_time() - start
    found = answers.map()
    seen, worst = missed(found, dense, search.width)
    requested = np.linspace(low, high, REQUESTED)
    on_grid = ~(np.array([curves(answers.map([ratio]))[1] <= bound for ratio in requested])[..., 0]).all(axis=1)
    return {
        "scene": scene.title[:40],
        "damping": search.width,
        "speeds": len(found.ratio),
        "s": taken,
        "dense speeds": count,
        "s, dense": brute,
        "limit speed / dense": bracket[1] / limit if bracket else math.nan,
        "of ten speeds alone": float(requested[max(int(on_grid.argmax()) - 1, 0)]) / limit
        if on_grid.any()
        else high / limit,
        "peaks seen": seen,
        "worst missed": worst,
        "unstable, found": sum(end - begin for begin, end in unstable) / (high - low),
        "unstable, dense": float((~dense.stable * np.gradient(dense.ratio)).sum() / (high - low)),
    }


def chosen() -> Iterator[Scene]:
    """Shipped and random scenes with one drive at constant speed."""
    for name in SHIPPED:
        yield read_scene(shipped_scenes()[name])
    single = (
        scene
        for scene in scenes(SEED)
        if len(scene.laws) == 1 and isinstance(scene.laws[0], ConstantSpeed) and "loads of time" not in scene.title
    )
    for number, scene in enumerate(islice(single, DRAWN)):
        run = replace(scene.course.run, cycle=scene.course.run.duration)
        theory = replace(scene.theory, damping_ratio=DAMPING[number % len(DAMPING)])
        yield replace(scene, course=replace(scene.course, run=run), theory=theory)


def rows(some: Sequence[Scene]) -> Iterator[measuring.Row]:
    for scene in some:
        try:
            yield row(scene, DENSE_OF_DRAWN if scene.title.split(":")[0] in FEATURES else DENSE)
        except MechanismError as error:
            print(f"{scene.title}: {error}", file=sys.stderr)


def main() -> None:
    claim = "The search from ten speeds finds the limit speed and all peaks of a dense grid."
    table = []
    for each in rows([*chosen()]):
        print(measuring.as_text([each]), flush=True)
        table.append(each)
    measuring.report("limit_speeds", claim, {"": table})


if __name__ == "__main__":
    main()
