"""Stated errors of figures compared with true ones, on random mechanisms.

    python benchmarks/figure_errors.py [MECHANISMS] [SECONDS] [SEED]    (continues results/figure_errors.csv)

The CSV file has a row for each answer: the default one and one of every theory. All figures of a run count, except
those of rigid links. Errors are relative to the figure, or to a hundredth of the largest figure of its unit if that is
more. Both sides exclude the error of beam theory.

The reference is the geometrically exact answer with fine steps, discretized once more. It is the program's own theory,
so it is independent only of the effects that the answers neglect. A figure does not count if the last refinement
changes the reference by more than `KNOWN` of the error. For some mechanisms `fem_check.nonlinear` checks the reference;
that check shares neither motion nor loads nor theory. docs/validity.md lists the results.
"""

import sys
import time
import warnings
from collections import Counter
from collections.abc import Iterator
from typing import Any

import measuring
import numpy as np
from random_scenes import scenes

from elastic import sample
from elastic.elastodynamics import Elastodynamic, finer_solution, finer_vibration, geometrically_exact
from fem_check.nonlinear import DoesNotCloseError, NotCheckedError, refined_deflection
from kinelast.answers.answer import Answer
from kinelast.answers.results import Results
from kinelast.answers.theory import _Theories, _vibrating, answer
from kinelast.figures.cycle import Cycle
from kinelast.figures.errors import MIN_SHARE_OF_UNIT
from kinelast.figures.figure_error import NOT_OF_MOTION
from kinelast.figures.measures import magnitudes
from kinelast.scene.data import ACCURACY, Scene, scene_deflection, scene_motion
from kinelast.values.error import SceneError
from rigid import MechanismError, Reals

COUNT, SECONDS, SEED = 300, 200.0, 1919
MIN_ERROR = 0.001  # smallest error that counts, relative to its figure
USUAL = 2e-4  # tolerance of the answers at the default accuracy
FINE = 1e-5  # tolerance of the reference
MAX_RESIDUAL = 1e-3  # of the reference, relative to the displacements
MAX_SECONDS = 20.0  # processor time of a mechanism
KNOWN = 0.25  # largest error of the reference, relative to the stated or true error, whichever is larger
CHECKED_EVERY = 5  # mechanisms, one of which gets the nonlinear check
TAKEN = "as taken"
CHECKED = "reference minus nonlinear check"
Reference = tuple[Cycle, ...]  # discretized finer, and before
PATH = measuring.RESULTS / "figure_errors.csv"


def relative_errors(scene: Scene, result: Answer, reference: Reference) -> Iterator[tuple[bool, float, float, float]]:
    """Yield for each figure: graded or not, its stated and true error and that of the reference, all relative."""
    figures = [figure for figure in result.figures if not figure.rigid]
    here, there, rough = (magnitudes(cycle, figures) for cycle in (result.cycle, *reference))
    units = {figure.key: figure.units(scene) for figure in figures}
    greatest: dict[str, float] = {}
    for key, values in there.items():
        for unit, value in zip(units[key], values, strict=True):
            if np.isfinite(value):
                greatest[unit] = max(greatest.get(unit, 0.0), float(abs(value)))
    graded = {(each.key, each.item) for each in result.main_figures}
    for key, values in here.items():
        for item, (value, true) in enumerate(zip(values, there[key], strict=True)):
            base = max(abs(float(value)), MIN_SHARE_OF_UNIT * greatest.get(units[key][item], 0.0))
            if base > 0.0 and np.isfinite(value) and np.isfinite(true):
                error = result.errors[key][item].without(NOT_OF_MOTION).size
                own = float(abs(true - rough[key][item])) / base
                yield (key, item) in graded, error / base, float(abs(value - true)) / base, own


def row_of(scene: Scene, name: str, result: Answer, reference: Reference) -> dict[str, Any]:
    """Return the row of one answer."""
    row = {"mechanism": scene.name, "title": scene.title, "answer": name, "theory": result.theory}
    if result.unknown:
        return {**row, "unknown": result.unknown}
    found = np.array([*relative_errors(scene, result, reference)])
    ratio, worst = found[:, 1] / np.maximum(found[:, 2], 1e-12), found[:, 1:3].max(axis=1)
    shown = worst > MIN_ERROR
    counted = shown & (found[:, 3] <= KNOWN * worst)
    graded = found[:, 0] > 0
    return {
        **row,
        "figures": int(counted.sum()),
        "not known well enough": int((shown & ~counted).sum()),
        "within a factor of two": int((counted & (ratio > 0.5) & (ratio < 2.0)).sum()),
        "more than two times too low": int((counted & (ratio <= 0.5)).sum()),
        "more than three times too low": int((counted & (ratio < 1 / 3)).sum()),
        "more than two times too high": int((counted & (ratio >= 2.0)).sum()),
        "graded": int((counted & graded).sum()),
        "graded, within a factor of two": int((counted & graded & (ratio > 0.5) & (ratio < 2.0)).sum()),
        "graded, stated error": float(found[graded, 1].max(initial=0.0)),
        "graded, true error": float(found[graded, 2].max(initial=0.0)),
    }


def independent(scene: Scene, results: Results, exact: Elastodynamic) -> float:
    """Largest relative difference of u, w, phi and the chord deflection of any beam from the nonlinear check."""
    times, period = results.motion.time, results.period
    closed = bool(np.isfinite(period))
    finish = float(times[0] + period if closed else times[-1])
    laws: Any = scene.laws
    given = scene.mechanism, scene.sections, laws, times, finish, closed, 2e-3, scene.joints, exact.damping.beams
    try:
        with measuring.processor_limit(MAX_SECONDS):
            found = refined_deflection(*given)
    except (NotCheckedError, DoesNotCloseError, measuring.TooLongError):
        return np.nan
    fields: dict[str, Reals] = dict(zip(("u", "w", "phi"), found.moved, strict=True))
    apart = []
    for name, values in {**fields, "chord": found.chord}.items():
        here, there = (np.abs(each).max(axis=(1, 2)) for each in (sample(exact.deflection, name, found.xi), values))
        apart.append(np.abs(here - there) / np.maximum(here, MIN_SHARE_OF_UNIT * here.max()))
    return float(np.max(apart))


def rows_of(scene: Scene, number: int) -> Iterator[dict[str, Any]]:
    """Yield the rows of one mechanism: the default answer, then one of every theory."""
    motion = scene_motion(scene)
    plain = scene_deflection(scene, motion)
    results = Results(scene, plain)
    fine = _vibrating(scene, plain, scene.course.at, results.period, FINE)
    exact = geometrically_exact(fine, FINE)
    finer, left = finer_solution(exact, finer_vibration(exact), FINE)
    settled = exact.exact and max(exact.exact.convergence_error, left, exact.time_error) < MAX_RESIDUAL
    if fine.stable and not settled:
        raise SceneError("", "", "", "the reference does not settle")
    bent = finer.deflection, exact.deflection
    reference: Reference = tuple(Cycle(scene, motion, each, sampled=True) for each in bent)
    row = row_of(scene, TAKEN, answer(results.cycle, scene.theory, results.period), reference)
    if number % CHECKED_EVERY == 0 and fine.stable:
        row[CHECKED] = independent(scene, results, exact)
    yield row
    usual = _vibrating(scene, plain, scene.course.at, results.period, USUAL)
    for candidate in _Theories(results.cycle, scene.theory).candidates(usual, USUAL, 0.0):
        yield row_of(scene, candidate.theory, candidate, reference)


def main() -> None:
    count = int(sys.argv[1]) if len(sys.argv) > 1 else COUNT
    seconds = float(sys.argv[2]) if len(sys.argv) > 2 else SECONDS
    seed = int(sys.argv[3]) if len(sys.argv) > 3 else SEED
    warnings.simplefilter("ignore")
    known = measuring.read_rows(PATH)
    rows, others = ([row for row in known if (_seed(row) == seed) == own] for own in (True, False))
    done = {row["mechanism"] for row in rows}
    for number, scene in enumerate(scenes(seed)):
        if number == count or time.process_time() > seconds:
            break
        if scene.name in done:
            continue
        try:
            with measuring.processor_limit(MAX_SECONDS):
                rows += [*rows_of(scene, number)]
        except (SceneError, MechanismError, ValueError, measuring.TooLongError) as error:
            words = getattr(error, "problem", "") or str(error) or type(error).__name__
            rows.append({"mechanism": scene.name, "title": scene.title, "answer": TAKEN, "left out": words[:80]})
        measuring.write_rows(PATH, [*others, *rows])
    summarize([*others, *rows])


def _seed(row: dict[str, Any]) -> int:
    return int(row["mechanism"].split("-")[0])


def summarize(rows: list[dict[str, Any]]) -> None:
    """Print and write the summary of each seed and kind of answer."""
    found: list[dict[str, Any]] = []
    for seed in dict.fromkeys(map(_seed, rows)):
        own = [row for row in rows if _seed(row) == seed]
        left = sum(bool(row.get("left out")) for row in own)
        print(f"{seed}: {len({row['mechanism'] for row in own})} mechanisms, {left} left out")
        known = [row for row in own if not row.get("left out") and not row.get("unknown")]
        for name in dict.fromkeys(row["answer"] for row in known):
            found.append({"seed": seed, **summary_of(name, [row for row in known if row["answer"] == name])})
            print("; ".join(f"{key}: {value}" for key, value in found[-1].items()))
        checked = [float(row.get(CHECKED) or "nan") for row in own]
        differences = [difference for difference in checked if not np.isnan(difference)]
        if differences:
            print(f"{CHECKED}: {len(differences)}, median {np.median(differences):.2g}, largest {max(differences):.2g}")
    measuring.write_rows(PATH.with_stem(f"{PATH.stem}-summary"), found)


def summary_of(name: str, rows: list[dict[str, Any]]) -> dict[str, Any]:
    """Summary of the answers of one kind, with 95 % intervals by bootstrap over the mechanisms."""
    theories = Counter(row["theory"] for row in rows)

    def counts(key: str) -> Any:
        return np.array([float(row.get(key) or 0) for row in rows])

    figures, graded = counts("figures"), counts("graded")
    again = np.random.default_rng(1).integers(0, len(rows), (4000, len(rows)))

    def share(key: str) -> str:
        own = counts(key)
        many = own[again].sum(axis=1) / np.maximum(figures[again].sum(axis=1), 1)
        low, high = np.quantile(many, (0.025, 0.975))
        return f"{own.sum() / max(figures.sum(), 1):.1%} ({low:.1%} to {high:.1%})".replace("%", " %")

    stated, true = counts("graded, stated error"), counts("graded, true error")
    good, mixed = stated <= ACCURACY, len(theories) > 1
    return {
        "answer": f"{name} ({', '.join(f'{n} {key}' for key, n in theories.items())})" if mixed else name,
        "mechanisms": len(rows),
        "figures": int(figures.sum()),
        "within a factor of two": share("within a factor of two"),
        "more than twice too high": share("more than two times too high"),
        "more than three times too low": int(counts("more than three times too low").sum()),
        "graded, within a factor of two": f"{counts('graded, within a factor of two').sum():.0f} of {graded.sum():.0f}",
        "stated below 5 %, truly above": f"{(good & (true > ACCURACY)).sum()} of {good.sum()}",
        "stated above 5 %, truly below": f"{(~good & (true <= ACCURACY)).sum()} of {(~good).sum()}",
    }


if __name__ == "__main__":
    main()
