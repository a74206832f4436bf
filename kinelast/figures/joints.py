"""Figures of clearance, and of the endurance and life of the links."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np

from elastic import Largest
from kinelast.figures.cycle import Cycle
from kinelast.figures.entry import FATIGUED, LEAST, Figure, each
from kinelast.scene.limits import Output
from kinelast.scene.parts.bearings import CLEARANCE, CLEARANCES, joints_with
from machine.joints import clearance_effects
from rigid.arrays import Reals

STEEPEST = 9.0  # of an S-N line of slope 5 below its knee


def clearance_figures(output: Output | None) -> tuple[Figure, ...]:
    """Figures of the output's displacement by clearance; none where there is no output."""
    if output is None:
        return ()

    def effect(number: int) -> Callable[[Cycle], Any]:
        return lambda cycle: [cycle.once(_effects, output)[number]] if joints_with(cycle.scene, CLEARANCE) else []

    return (
        Figure("clearance_worst", "displacement of the output by clearance, at worst", output.unit, CLEARANCES,
               each(effect(0)), rigid=True),
        Figure("clearance_pressed", "displacement of the output by clearance, as the forces press", output.unit,
               CLEARANCES, each(effect(1))),
    )  # fmt: skip


def _effects(cycle: Cycle, output: Output) -> tuple[Reals, Reals]:
    """Return the displacements of the output by clearance: of a shared point the larger of all its links."""
    mechanism = cycle.scene.mechanism
    gaps: dict[int, Any] = {
        number: cycle.scene.bearings[name].clearance for number, name in joints_with(cycle.scene, CLEARANCE).items()
    }
    forces = {number: cycle.deflection.forces.force[number] for number in gaps}
    ends: list[tuple[int, Any]] = [(mechanism.index[output.link], None)]
    if output.point:
        links = enumerate(mechanism.links)
        ends = [(at, link.points[output.point]) for at, link in links if at and output.point in link.points]
    effects = [clearance_effects(cycle.motion, gaps, forces, *end) for end in ends]
    worst, pressed = (np.maximum.reduce(each) for each in zip(*effects, strict=True))
    return worst, pressed


def _fatigue(find: Callable[[Cycle], Largest]) -> Callable[[Cycle], Largest]:
    """A figure of every beam, of a scene that asks for fatigue."""

    def found(cycle: Cycle) -> Largest:
        none = np.zeros((0, *cycle.columns[:-1]))
        return find(cycle) if cycle.scene.fatigue else Largest(none, np.zeros(none.shape, int))

    return found


def _life(cycle: Cycle) -> Largest:
    """Time until Miner's sum is 1 [s], of beams."""
    cycles = _cycles(cycle)
    return replace(cycles, value=cycles.value * cycle.weights.sum(axis=-1))


def _cycles(cycle: Cycle) -> Largest:
    found = cycle.fatigue.damage
    with np.errstate(divide="ignore"):
        return replace(found, value=1.0 / found.value)


LIFE_FIGURES: tuple[Figure, ...] = (
    Figure("endurance", "safety against endurance", "1", FATIGUED, _fatigue(lambda cycle: cycle.fatigue.safety), LEAST,
           limit="endurance", whole=True),
    Figure("life_cycles", "runs until a link breaks", "1", FATIGUED, _fatigue(_cycles), LEAST, whole=True,
           power=STEEPEST),
    Figure("life", "time until a link breaks", "s", FATIGUED, _fatigue(_life), LEAST, limit="life", whole=True,
           power=STEEPEST),
)  # fmt: skip
