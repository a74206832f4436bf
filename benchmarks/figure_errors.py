"""Errors of figures as they are told, beside those measured by the whole mechanism solved with any displacement.

    python benchmarks/figure_errors.py [mechanisms] [seed]

A row a figure: the deflection of every beam, u, its rotation and the deflection from the chord, its section forces and
its stress, for the quasi-static answer and the elastodynamic one. What beam theory leaves out is on neither side.
docs/validity.md says what came out.
"""

from __future__ import annotations

import csv
import sys
import time
from collections.abc import Iterator
from dataclasses import replace
from typing import Any

import measuring
import numpy as np
from random_scenes import scenes

from elastic import sample
from fem_check.nonlinear import DoesNotCloseError, NotCheckedError, nonlinear_steady_state, refined_deflection
from kinelast.figures.errors import BEAM_THEORY, ROUND_OFF
from kinelast.figures.results import Results
from kinelast.runs import computed
from kinelast.scene.data import ELASTODYNAMIC, QUASI_STATIC, Scene
from kinelast.scene.error import SceneError
from kinelast.tasks.request import Request

COUNT, SEED = 40, 1900
SHOWN = 0.001  # of the figure, from which errors are counted
TOLERANCE = 2e-3  # of the check
MOST = 240  # positions at which the check's section forces are found
LONGEST = 6.0  # seconds of the processor that a check may take
FORCES = ("N", "V", "M")
KEYS = {"u": "u", "w": "deflection", "phi": "phi", "chord": "chord", "N": "N", "V": "V", "M": "M"}


class TooLongError(Exception):
    """The check takes too long."""


def reference(scene: Scene, results: Results) -> tuple[dict[str, Any], Any, float]:
    """Fields of the check at the nodes, (beams, positions, nodes), the nodes, and its own error as a share."""
    end = time.process_time() + LONGEST

    def watch(*_: Any) -> None:
        if time.process_time() > end:
            raise TooLongError

    times, period = results.motion.time, results.period
    closed = bool(np.isfinite(period))
    assert results.answer
    assert results.answer.vibrating
    beta = results.answer.vibrating.damping.beams
    finish = float(times[0] + period if closed else times[-1])
    given = scene.mechanism, scene.sections, scene.laws, times, finish, closed, TOLERANCE, scene.joints, beta
    found = refined_deflection(*given, watch)
    fields = {"u": found.moved[0], "w": found.moved[1], "phi": found.moved[2], "chord": found.chord}
    if closed and 2 * found.steps <= MOST:
        positions = max(len(times), 2 * found.steps)
        positions = len(times) * -(-positions // len(times))
        whole = nonlinear_steady_state(
            scene.mechanism, scene.sections, scene.laws, period, positions, found.elements, scene.joints, beta,
            float(times[0]), watch,
        )  # fmt: skip
        every = slice(None, None, positions // len(times))
        if np.abs(whole.chord[:, every] - found.chord).max() < 0.002 * np.abs(found.chord).max():
            fields |= {key: getattr(whole, key)[:, every] for key in FORCES}
    return fields, found.xi, found.error


def rows_of(scene: Scene) -> Iterator[dict[str, Any]]:
    """Told and measured errors of one scene, as shares of each figure."""
    answers = {name: computed(scene, Request(theory=name)) for name in (ELASTODYNAMIC,)}
    vibrating = answers[ELASTODYNAMIC]
    assert vibrating.answer
    if vibrating.answer.unknown:
        raise SceneError("", "", "", vibrating.answer.unknown)
    fields, xi, own = reference(scene, vibrating)
    plain = computed(replace(scene, theory=replace(scene.theory, accuracy=0.99)), Request())
    answers |= {QUASI_STATIC: plain} if plain.answer and plain.answer.theory == QUASI_STATIC else {}
    for theory, results in answers.items():
        assert results.answer
        for field, values in fields.items():
            here = np.abs(sample(results.deflection, field, xi)).max(axis=(1, 2))
            there = np.abs(values).max(axis=(1, 2))
            for beam, label in enumerate(scene.labels):
                error = results.answer.errors[KEYS[field]][beam].without((BEAM_THEORY, ROUND_OFF))
                if not here[beam] > 1e-9 * here.max() or not np.isfinite(there[beam]):
                    continue
                yield {
                    "mechanism": f"{scene.name} {scene.title}",
                    "theory": theory,
                    "figure": f"{KEYS[field]}.{label}",
                    "of the largest": here[beam] / here.max(),
                    "told": error.size / here[beam],
                    "measured": abs(here[beam] - there[beam]) / here[beam],
                    "check's own": own,
                    **{name: abs(part) / here[beam] for name, part in error.parts.items()},
                }


def main() -> None:
    count = int(sys.argv[1]) if len(sys.argv) > 1 else COUNT
    seed = int(sys.argv[2]) if len(sys.argv) > 2 else SEED
    rows: list[dict[str, Any]] = []
    outcomes: list[str] = []
    for number, scene in enumerate(scenes(seed)):
        if number == count:
            break
        try:
            new = [*rows_of(scene)]
            rows += new
            outcomes.append(f"{scene.title}: {len(new)} figures")
        except (NotCheckedError, DoesNotCloseError, SceneError, TooLongError, AssertionError) as error:
            outcomes.append(f"{scene.title}: {type(error).__name__} {str(error)[:80]}")
        print(number, outcomes[-1], flush=True)
        written(rows)
    summed(rows)


def written(rows: list[dict[str, Any]]) -> None:
    """All of them, to `results/figure_errors.csv`."""
    head = list(dict.fromkeys(key for row in rows for key in row))
    with (measuring.RESULTS / "figure_errors.csv").open("w", newline="", encoding="utf-8") as stream:
        writer = csv.DictWriter(stream, head)
        writer.writeheader()
        writer.writerows([{k: f"{v:.4g}" if isinstance(v, float) else v for k, v in row.items()} for row in rows])


def summed(rows: list[dict[str, Any]]) -> None:
    """Print how well the told errors hold, for figures of which either is beyond `SHOWN`."""
    for theory in (QUASI_STATIC, ELASTODYNAMIC):
        own = [row for row in rows if row["theory"] == theory and max(row["told"], row["measured"]) > SHOWN]
        ratio = np.array([row["told"] / max(row["measured"], row["check's own"], 1e-12) for row in own])
        measured = np.array([row["measured"] for row in own])
        if not own:
            continue
        near = ((ratio > 0.5) & (ratio < 2.0)).mean()
        low = (ratio < 1 / 3) & (measured > SHOWN)
        print(f"{theory}: {len(own)} figures, {near:.1%} within a factor of two, {low.sum()} told three times too low")
        for row, each in zip(own, ratio, strict=True):
            if each < 1 / 3 and row["measured"] > SHOWN:
                print("   ", row["mechanism"], row["figure"], f"told {row['told']:.3g} measured {row['measured']:.3g}")


if __name__ == "__main__":
    main()
