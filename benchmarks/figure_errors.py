"""Errors of figures as they are told, beside those found by the geometrically exact answer with fine steps.

    python benchmarks/figure_errors.py [mechanisms] [seconds] [seed]    (goes on where results/figure_errors.csv ends)

Rows of other seeds stay.
A row for each answer to a mechanism drawn at random: as users get it, and of every theory. All figures of a run count,
but those of rigid links, against themselves or a hundredth of the greatest of their unit. What beam theory leaves out
is on neither side. The reference is the program's own theory, and independent of what the answers leave out alone. It
is discretized finer once more; a figure that this changes by more than a part of the error that it is to judge is not
counted. For some mechanisms it is itself held against `fem_check.nonlinear`, which shares neither motion nor loads nor
theory.
docs/validity.md says what came out.
"""

from __future__ import annotations

import csv
import signal
import sys
import time
import warnings
from collections import Counter
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import measuring
import numpy as np
from random_scenes import scenes

from elastic import sample
from elastic.elastodynamics import Elastodynamic, discretized_finer, finer_vibration, geometrically_exact
from fem_check.nonlinear import DoesNotCloseError, NotCheckedError, refined_deflection
from kinelast.figures.cycle import Cycle
from kinelast.figures.entry import magnitudes
from kinelast.figures.errors import LITTLE, NOT_OF_MOTION
from kinelast.figures.results import Results
from kinelast.figures.theory import Answer, _Rungs, _vibrating, answer
from kinelast.scene.data import ACCURACY, Scene, scene_deflection, scene_motion
from kinelast.scene.error import SceneError
from rigid import MechanismError, Reals

COUNT, SECONDS, SEED = 300, 200.0, 1919
SHOWN = 0.001  # of a figure, from which its errors are counted
USUAL = 2e-4  # tolerance of the answers at the accuracy that is taken where nothing is asked
FINE = 1e-5  # of the reference
UNSETTLED = 1e-3  # of the displacements, beyond which the reference is none
LONGEST = 20.0  # seconds of the processor for a mechanism
KNOWN = 0.25  # of the error told or found, the greater: by so much may the reference itself be off
EVERY = 5  # of how many mechanisms one is put to the nonlinear check
TAKEN = "as taken"
Reference = tuple[Cycle, ...]  # discretized finer, and before
PATH = measuring.RESULTS / "figure_errors.csv"


class TooLongError(Exception):
    """The mechanism takes too long."""


def shares(scene: Scene, told: Answer, reference: Reference) -> Iterator[tuple[bool, float, float, float]]:
    """Of every figure whether it is read, and the errors told and found, and that of the reference, as shares."""
    figures = [figure for figure in told.figures if not figure.rigid]
    here, there, rough = (magnitudes(cycle, figures) for cycle in (told.cycle, *reference))
    units = {figure.key: figure.units(scene) for figure in figures}
    greatest: dict[str, float] = {}
    for key, values in there.items():
        for unit, value in zip(units[key], values, strict=True):
            if np.isfinite(value):
                greatest[unit] = max(greatest.get(unit, 0.0), float(abs(value)))
    read = {(each.key, each.item) for each in told.graded}
    for key, values in here.items():
        for item, (value, true) in enumerate(zip(values, there[key], strict=True)):
            base = max(abs(float(value)), LITTLE * greatest.get(units[key][item], 0.0))
            if base > 0.0 and np.isfinite(value) and np.isfinite(true):
                error = told.errors[key][item].without(NOT_OF_MOTION).size
                own = float(abs(true - rough[key][item])) / base
                yield (key, item) in read, error / base, float(abs(value - true)) / base, own


def row_of(scene: Scene, name: str, told: Answer, reference: Reference) -> dict[str, Any]:
    """What came out of one answer."""
    row = {"mechanism": scene.name, "title": scene.title, "answer": name, "theory": told.theory}
    if told.unknown:
        return {**row, "unknown": told.unknown}
    found = np.array([*shares(scene, told, reference)])
    ratio, worst = found[:, 1] / np.maximum(found[:, 2], 1e-12), found[:, 1:3].max(axis=1)
    shown = worst > SHOWN
    counted = shown & (found[:, 3] <= KNOWN * worst)
    read = found[:, 0] > 0
    return {
        **row,
        "figures": int(counted.sum()),
        "not known well enough": int((shown & ~counted).sum()),
        "within a factor of two": int((counted & (ratio > 0.5) & (ratio < 2.0)).sum()),
        "more than two times too low": int((counted & (ratio <= 0.5)).sum()),
        "more than three times too low": int((counted & (ratio < 1 / 3)).sum()),
        "more than two times too high": int((counted & (ratio >= 2.0)).sum()),
        "read": int((counted & read).sum()),
        "read, within a factor of two": int((counted & read & (ratio > 0.5) & (ratio < 2.0)).sum()),
        "read, told": float(found[read, 1].max(initial=0.0)),
        "read, found": float(found[read, 2].max(initial=0.0)),
    }


def independent(scene: Scene, results: Results, exact: Elastodynamic) -> float:
    """Greatest difference of u, w, phi and the chord deflection of any beam from the nonlinear check, as a share."""
    times, period = results.motion.time, results.period
    closed = bool(np.isfinite(period))
    finish = float(times[0] + period if closed else times[-1])
    laws: Any = scene.laws
    given = scene.mechanism, scene.sections, laws, times, finish, closed, 2e-3, scene.joints, exact.damping.beams
    try:
        signal.setitimer(signal.ITIMER_PROF, LONGEST)
        found = refined_deflection(*given)
    except (NotCheckedError, DoesNotCloseError, TooLongError):
        return np.nan
    finally:
        signal.setitimer(signal.ITIMER_PROF, LONGEST)
    fields: dict[str, Reals] = dict(zip(("u", "w", "phi"), found.moved, strict=True))
    apart = []
    for name, values in {**fields, "chord": found.chord}.items():
        here, there = (np.abs(each).max(axis=(1, 2)) for each in (sample(exact.deflection, name, found.xi), values))
        apart.append(np.abs(here - there) / np.maximum(here, LITTLE * here.max()))
    return float(np.max(apart))


def rows_of(scene: Scene, number: int) -> Iterator[dict[str, Any]]:
    """What came out of one mechanism."""
    motion = scene_motion(scene)
    plain = scene_deflection(scene, motion)
    results = Results(scene, plain)
    fine = _vibrating(scene, motion, scene.course.at, results.period, FINE)
    exact = geometrically_exact(fine, FINE)
    finer, left = discretized_finer(exact, finer_vibration(exact), FINE)
    if fine.stable and not (exact.exact and max(exact.exact.open, left) < UNSETTLED and exact.time_error < UNSETTLED):
        raise SceneError("", "", "", "the reference does not settle")
    reference: Reference = tuple(Cycle(scene, motion, bent, sampled=True) for bent in (finer, exact.deflection))
    told = row_of(scene, TAKEN, answer(results.cycle, scene.theory, results.period), reference)
    if number % EVERY == 0 and fine.stable:
        told["reference beside the nonlinear check"] = independent(scene, results, exact)
    yield told
    usual = _vibrating(scene, motion, scene.course.at, results.period, USUAL)
    for rung in _Rungs(results.cycle, scene.theory).climbed(usual, USUAL, 0.0):
        yield row_of(scene, rung.theory, rung, reference)


def main() -> None:
    count = int(sys.argv[1]) if len(sys.argv) > 1 else COUNT
    seconds = float(sys.argv[2]) if len(sys.argv) > 2 else SECONDS
    seed = int(sys.argv[3]) if len(sys.argv) > 3 else SEED
    warnings.simplefilter("ignore")
    signal.signal(signal.SIGPROF, _late)
    known = _read()
    rows, others = ([row for row in known if (_seed(row) == seed) == own] for own in (True, False))
    done = {row["mechanism"] for row in rows}
    for number, scene in enumerate(scenes(seed)):
        if number == count or time.process_time() > seconds:
            break
        if scene.name in done:
            continue
        signal.setitimer(signal.ITIMER_PROF, LONGEST)
        try:
            rows += [*rows_of(scene, number)]
        except (SceneError, MechanismError, ValueError, TooLongError) as error:
            words = getattr(error, "problem", "") or str(error) or type(error).__name__
            rows.append({"mechanism": scene.name, "title": scene.title, "answer": TAKEN, "left out": words[:80]})
        signal.setitimer(signal.ITIMER_PROF, 0.0)
        _write([*others, *rows])
    summed([*others, *rows])


def _late(*_: Any) -> None:
    raise TooLongError("too long")


def _read() -> list[dict[str, Any]]:
    if not PATH.exists():
        return []
    with PATH.open(encoding="utf-8") as stream:
        return [*csv.DictReader(stream)]


def _seed(row: dict[str, Any]) -> int:
    return int(row["mechanism"].split("-")[0])


def _write(rows: list[dict[str, Any]], path: Path = PATH) -> None:
    head = list(dict.fromkeys(key for row in rows for key in row))
    with path.open("w", newline="", encoding="utf-8") as stream:
        writer = csv.DictWriter(stream, head)
        writer.writeheader()
        writer.writerows([{k: f"{v:.4g}" if isinstance(v, float) else v for k, v in row.items()} for row in rows])


def summed(rows: list[dict[str, Any]]) -> None:
    """Write how well the told errors hold by seed, of every kind of answer, and print it."""
    found: list[dict[str, Any]] = []
    for seed in dict.fromkeys(map(_seed, rows)):
        own = [row for row in rows if _seed(row) == seed]
        left = sum(bool(row.get("left out")) for row in own)
        print(f"{seed}: {len({row['mechanism'] for row in own})} mechanisms, {left} left out")
        known = [row for row in own if not row.get("left out") and not row.get("unknown")]
        for name in dict.fromkeys(row["answer"] for row in known):
            found.append({"seed": seed, **held(name, [row for row in known if row["answer"] == name])})
            print("; ".join(f"{key}: {value}" for key, value in found[-1].items()))
        checked = [float(row.get("reference beside the nonlinear check") or "nan") for row in own]
        beside = [apart for apart in checked if not np.isnan(apart)]
        if beside:
            print(f"reference beside the nonlinear check: {len(beside)}, {np.median(beside):.2g}, {max(beside):.2g}")
    _write(found, PATH.with_stem(f"{PATH.stem}-summary"))


def held(name: str, rows: list[dict[str, Any]]) -> dict[str, Any]:
    """How well the told errors hold of answers of a kind; 95 % of mechanisms drawn again from these."""
    theories = Counter(row["theory"] for row in rows)

    def counts(key: str) -> Any:
        return np.array([float(row.get(key) or 0) for row in rows])

    figures, read = counts("figures"), counts("read")
    again = np.random.default_rng(1).integers(0, len(rows), (4000, len(rows)))

    def share(key: str) -> str:
        own = counts(key)
        many = own[again].sum(axis=1) / np.maximum(figures[again].sum(axis=1), 1)
        low, high = np.quantile(many, (0.025, 0.975))
        return f"{own.sum() / max(figures.sum(), 1):.1%} ({low:.1%} to {high:.1%})".replace("%", " %")

    told, found = counts("read, told"), counts("read, found")
    mixed = len(theories) > 1
    return {
        "answer": f"{name} ({', '.join(f'{n} {key}' for key, n in theories.items())})" if mixed else name,
        "mechanisms": len(rows),
        "figures": int(figures.sum()),
        "within a factor of two": share("within a factor of two"),
        "more than twice too high": share("more than two times too high"),
        "more than three times too low": int(counts("more than three times too low").sum()),
        "read, within a factor of two": f"{counts('read, within a factor of two').sum():.0f} of {read.sum():.0f}",
        "told within 5 %, and not": f"{((told <= ACCURACY) & (found > ACCURACY)).sum()} of {(told <= ACCURACY).sum()}",
        "told beyond, and not": f"{((told > ACCURACY) & (found <= ACCURACY)).sum()} of {(told > ACCURACY).sum()}",
    }


if __name__ == "__main__":
    main()
