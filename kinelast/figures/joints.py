"""Figures of clearance."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from kinelast.figures.cycle import Cycle
from kinelast.scene.figure import Figure, each
from kinelast.scene.limits import Output
from kinelast.scene.parts.bearings import CLEARANCE, CLEARANCES, joints_with
from machine.joints import clearance_effects
from rigid.arrays import Reals


def clearance_figures(output: Output | None) -> tuple[Figure, ...]:
    """Return figures of the output displacement by clearance; none without an output."""
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
