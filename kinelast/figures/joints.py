"""Figures of joints and of life: bearings, pins and eyes, clearance, and the endurance of the links."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np

from elastic import Largest
from kinelast.figures.cycle import Cycle, joint_words
from kinelast.figures.entry import (
    AVERAGE,
    BEARING,
    CLEARANCE,
    CLEARANCES,
    EYE,
    FATIGUED,
    LEAST,
    PIN,
    PLAIN,
    ROLLING,
    Figure,
    Kind,
    averaged,
    each,
    has_part,
    least,
)
from kinelast.scene.data import Scene
from kinelast.scene.limits import Output
from machine.joints import JointCourse, clearance_effects, contact_losses, knocks
from rigid.arrays import Flags, Reals

ROLLER = 10.0 / 3.0  # exponent of the life of roller bearings
STEEPEST = 9.0  # of an S-N line of slope 5 below its knee
OfJoint = Callable[[Any, JointCourse], Any]
"""From the part of a joint, and its force and motion, to values of every position, or of the whole run."""


def numbers_with(scene: Scene, part: Kind) -> list[int]:
    """Numbers of the joints that have a part, or are under [bearings] at all."""
    words = enumerate(joint_words(scene.mechanism))
    return [number for number, (name, _) in words if has_part(scene, name, part.name)]


def of_joints(values: OfJoint, part: Kind) -> Callable[[Cycle], list[Any]]:
    """Values of the joints that have a part."""

    def found(cycle: Cycle) -> list[Any]:
        names = [name for name, _ in joint_words(cycle.scene.mechanism)]
        numbers = numbers_with(cycle.scene, part)
        with np.errstate(divide="ignore", invalid="ignore"):
            return [values(getattr(cycle.scene.bearings[names[number]], part.name, None), cycle.joint(number))
                    for number in numbers]  # fmt: skip

    return found


def _least(values: OfJoint, part: Kind) -> Callable[[Cycle], Largest]:
    """The least over the positions that count."""
    return least(of_joints(values, part))


def _one(values: OfJoint, part: Kind) -> Callable[[Cycle], Largest]:
    """Figures that are of the whole run."""
    return averaged(of_joints(values, part))


def _every(values: OfJoint, part: Kind) -> Callable[[Cycle], Largest]:
    """Largest magnitudes of values at every position."""
    return each(of_joints(values, part))


def lost_contact(cycle: Cycle, number: int) -> Flags:
    """Whether contact is lost in a joint between a position and the next, bool, shape (..., positions)."""
    return contact_losses(cycle.joint(number), cycle.scene.run.turn)


def _knocks(cycle: Cycle) -> list[Any]:
    closed = cycle.scene.run.turn
    return [knocks(lost_contact(cycle, number), closed) for number in numbers_with(cycle.scene, CLEARANCE)]


JOINT_FIGURES: tuple[Figure, ...] = (
    Figure("joint_mean_force", "mean force in a joint, cubic over its angle", "N", BEARING,
           _one(lambda _, course: course.mean_force(), BEARING), AVERAGE),
    Figure("joint_swing", "angle that a joint swings or turns through", "rad", BEARING,
           _one(lambda _, course: course.swing, BEARING), AVERAGE, rigid=True),
    Figure("joint_rate", "angular speed of a joint", "rad/s", BEARING,
           _every(lambda _, course: course.rate, BEARING), rigid=True),
    Figure("bearing_load", "equivalent load of a rolling bearing", "N", ROLLING,
           _one(lambda part, course: part.equivalent_load(course), ROLLING), AVERAGE),
    Figure("bearing_life", "life of a rolling bearing", "s", ROLLING,
           _one(lambda part, course: part.life(course), ROLLING), LEAST, whole=True, power=ROLLER),
    Figure("bearing_revolutions", "revolutions that a rolling bearing reaches", "1", ROLLING,
           _one(lambda part, course: part.revolutions(course), ROLLING), LEAST, whole=True, power=ROLLER),
    Figure("bearing_static_safety", "static safety of a rolling bearing", "1", ROLLING,
           _one(lambda part, course: part.static_safety(course), ROLLING), LEAST, whole=True),
    Figure("bearing_load_share", "equivalent load of a rolling bearing over its dynamic rating", "1", ROLLING,
           _one(lambda part, course: part.load_share(course), ROLLING), LEAST, whole=True),
    Figure("bearing_overlap", "swing over that from rolling element to rolling element", "1", ROLLING,
           _one(lambda part, course: part.overlap(course), ROLLING), LEAST, whole=True, rigid=True),
    Figure("bearing_pressure", "pressure in a plain bearing", "Pa", PLAIN,
           _every(lambda part, course: part.pressure(course), PLAIN)),
    Figure("bearing_speed", "sliding speed in a plain bearing", "m/s", PLAIN,
           _every(lambda part, course: part.speed(course), PLAIN), rigid=True),
    Figure("bearing_pv", "pressure times speed of a plain bearing, mean", "W/m^2", PLAIN,
           _one(lambda part, course: part.pressure_times_speed(course), PLAIN), AVERAGE),
    Figure("pin_shear", "shear stress of a pin", "Pa", PIN, _every(lambda part, course: part.shear(course), PIN)),
    Figure("pin_bending", "bending stress of a pin", "Pa", PIN, _every(lambda part, course: part.bending(course), PIN)),
    Figure("pin_safety", "yield stress over the stress of a pin", "1", PIN,
           _least(lambda part, course: part.safety(course), PIN), LEAST),
    Figure("eye_bearing", "bearing stress of an eye", "Pa", EYE,
           _every(lambda part, course: part.bearing(course), EYE)),
    Figure("eye_net", "tension in the net section of an eye", "Pa", EYE,
           _every(lambda part, course: part.net(course), EYE)),
    Figure("eye_tear_out", "shear stress of tear-out of an eye", "Pa", EYE,
           _every(lambda part, course: part.tear_out(course), EYE)),
    Figure("eye_safety", "yield stress over the stress of an eye", "1", EYE,
           _least(lambda part, course: part.safety(course), EYE), LEAST),
    Figure("contact_losses", "times that contact is lost in a joint with clearance", "1", CLEARANCE,
           averaged(_knocks), AVERAGE, power=0.0),
)  # fmt: skip


def clearance_figures(output: Output | None) -> tuple[Figure, ...]:
    """Figures of the output's displacement by clearance; none where there is no output."""
    if output is None:
        return ()

    def effect(number: int) -> Callable[[Cycle], Any]:
        return lambda cycle: [cycle.once(_effects, output)[number]] if numbers_with(cycle.scene, CLEARANCE) else []

    return (
        Figure("clearance_worst", "displacement of the output by clearance, at worst", output.unit, CLEARANCES,
               each(effect(0)), rigid=True),
        Figure("clearance_pressed", "displacement of the output by clearance, as the forces press", output.unit,
               CLEARANCES, each(effect(1))),
    )  # fmt: skip


def _effects(cycle: Cycle, output: Output) -> tuple[Reals, Reals]:
    """Return the displacements of the output by clearance: of a shared point the larger of all its links."""
    mechanism = cycle.scene.mechanism
    names = [name for name, _ in joint_words(mechanism)]
    numbers = numbers_with(cycle.scene, CLEARANCE)
    gaps: dict[int, Any] = {number: cycle.scene.bearings[names[number]].clearance for number in numbers}
    forces = {number: cycle.deflection.forces.force[number] for number in numbers}
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
