"""Forces on displaced points: springs and dampers, forces that rotate with their link, and arms of rigid parts.

Each effect is a stiffness or damping between two components of displacement: a force along the first component per unit
of the second.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from elastic.elastodynamics.displacements import Displacements, Points, under
from elastic.links.beam_trees import trees_of
from elastic.solution import Deflection
from rigid import Lump, Mechanism, Motion, PointLoad, Spring, TorsionSpring, position_of, structure, velocity_of
from rigid.arrays import Columns, Complexes, Reals
from rigid.joints import Joint
from rigid.kinetostatics import friction_joints
from rigid.plane import dot
from rigid.plane import number as plain


@dataclass(frozen=True, eq=False)
class PointRow:
    """Component of the displacements of points: a sum of dot(way, displacement) and share * rotation.

    Attributes
    ----------
    ways
        Vector in ground axes, complex, shape (positions,), by chosen point.
    shares
        Factor of the rotation, shape (positions,) or scalar, by chosen point.
    """

    ways: Mapping[int, Complexes] = field(default_factory=dict)
    shares: Mapping[int, Columns] = field(default_factory=dict)

    def __call__(self, moved: Displacements) -> Reals:
        """Evaluate the component for each kind of displacement, shape (positions, c)."""
        total: Any = 0.0
        for point, way in self.ways.items():
            total = total + dot(way[:, None], moved.moves[:, point])
        for point, share in self.shares.items():
            total = total + np.reshape(share, (-1, 1)) * moved.turns[:, point]
        return total

    def times(self, factor: float) -> PointRow:
        """Return the component times a factor."""
        ways, shares = ({point: factor * value for point, value in part.items()} for part in (self.ways, self.shares))
        return PointRow(ways, shares)

    def __getitem__(self, positions: Any) -> PointRow:
        """Select positions."""
        ways, shares = (
            {point: value[positions] if np.ndim(value) else value for point, value in part.items()}
            for part in (self.ways, self.shares)
        )
        return PointRow(ways, shares)


@dataclass(frozen=True, eq=False)
class PointEffect:
    """Force -(stiffness * cause + damping * d cause/dt) along the component `felt`, shape (positions,).

    `elastic` is True for the stiffness of a spring, as opposed to that of a force on displaced points. `rubs` is True
    for friction, which is part of the joint forces.
    """

    felt: PointRow
    cause: PointRow
    stiffness: Reals
    damping: Any = 0.0
    elastic: bool = False
    rubs: bool = False

    def __getitem__(self, positions: Any) -> PointEffect:
        """Select positions."""
        return replace(
            self, felt=self.felt[positions], cause=self.cause[positions], stiffness=self.stiffness[positions]
        )

    def form(self, felt: Displacements, cause: Displacements) -> Reals:
        """Return the stiffness between two sets of displacements, shape (positions, c responding, c causing)."""
        return (self.stiffness[:, None] * self.felt(felt))[..., None] * self.cause(cause)[:, None]

    def loads(self, amount: Reals) -> Iterator[tuple[int, Columns, Columns]]:
        """Yield a force along `felt` at its points: chosen point, force [N], complex, and moment [N m]."""
        for point, way in self.felt.ways.items():
            yield point, amount * way, 0.0
        for point, share in self.felt.shares.items():
            yield point, 0.0, amount * share


def chosen_points(mechanism: Mechanism) -> tuple[tuple[int, str], ...]:
    """Return the points with lumps, loads, springs or joints that need displacements, and one of each rigid link."""
    points = [(at, lump.point) for at, lump in lumps_of(mechanism)]
    for load in mechanism.loads:
        if isinstance(load, Spring):
            points += [(mechanism.index[load.link], load.point), (mechanism.index[load.on], load.anchor)]
        if isinstance(load, TorsionSpring):
            points += [(mechanism.index[link], load.at) for link in (load.link, load.on)]
        if isinstance(load, PointLoad):
            points.append((mechanism.index[load.link], load.point))
    for at, link in enumerate(mechanism.links):
        if at and not link.beams:
            points.append((at, next(iter(link.points))))
    points += _joint_points(mechanism)
    return tuple(dict.fromkeys(points))


def _joint_points(mechanism: Mechanism) -> Iterator[tuple[int, str]]:
    """Yield the points of blocks, of the beams under them, of toothed wheels, and of pins with friction."""
    rails, rubbing = trees_of(mechanism).rails, {number for number, _ in friction_joints(mechanism)}
    for number, joint in enumerate(structure(mechanism).joints):
        pins: list[Joint] = [joint] if number in rubbing and joint.turns else []
        if not joint.turns:
            yield joint.block, joint.point(joint.block) or ""
            if number in rails:
                yield joint.owner, under(number)
        elif joint.gear is not None and joint.gear.driver.turns:
            pins = [joint, joint.gear.driver]
        for pin in pins:
            yield from ((at, pin.point(at) or "") for at in (pin.child, pin.parent) if at)


def lumps_of(mechanism: Mechanism) -> list[tuple[int, Lump]]:
    """Return the lumps of the moving links, with the indices of the links."""
    return [(at, lump) for at, link in enumerate(mechanism.links) if at for lump in link.lumps]


def point_effects(bent: Deflection, chosen: Points) -> list[PointEffect]:
    """Return the effects of displaced points under the forces of a quasi-static deflection."""
    motion = bent.motion
    numbers = {where: number for number, where in enumerate(chosen)}
    effects = [*_lump_arms(motion, numbers), *_rigid_links(bent, numbers), *_blocks(bent, numbers)]
    still = np.zeros(motion.columns)
    for (_, friction), row in zip(friction_joints(motion.mechanism), sliding_rows(motion, chosen), strict=True):
        if friction.viscosity:
            effects.append(PointEffect(row, row, still, friction.viscosity, rubs=True))
    for load in motion.mechanism.loads:
        if isinstance(load, Spring):
            effects += _spring(motion, load, numbers)
        if isinstance(load, TorsionSpring):
            effects.append(_torsion_spring(motion, load, numbers))
        if isinstance(load, PointLoad) and load.turning:
            effects += _turning_load(motion, load, numbers)
    return effects


Numbers = Mapping[tuple[int, str], int]


def _lump_arms(motion: Motion, numbers: Numbers) -> Iterator[PointEffect]:
    """Yield the effects of masses with an offset from their point, which is the arm of their force."""
    for at, lump in lumps_of(motion.mechanism):
        if np.any(lump.offset) and motion.mechanism.links[at].beams:
            row = PointRow(shares={numbers[at, lump.point]: 1.0})
            arm = motion.direction[at] * lump.offset
            yield PointEffect(row, row, dot(lump_force(motion, at, lump), arm))


def lump_force(motion: Motion, at: int, lump: Lump) -> Complexes:
    """Return the inertia and weight of a lump [N], complex."""
    arm = motion.direction[at] * (motion.mechanism.links[at].points[lump.point] + lump.offset)
    felt = motion.acceleration[at] - motion.mechanism.gravity + motion.turning[at] * arm
    return -lump.mass * felt


def _rigid_links(bent: Deflection, numbers: Numbers) -> Iterator[PointEffect]:
    """Yield the effects of the rotation of links without beams, on which forces act at the ends of arms."""
    motion = bent.motion
    mechanism = motion.mechanism
    for at, link in enumerate(mechanism.links):
        if not at or link.beams:
            continue
        total: Any = np.zeros(motion.columns)
        for place, force in zip(motion.places, bent.forces.force, strict=True):
            if at in (place.joint.child, place.joint.parent):
                sign = 1.0 if place.joint.child == at else -1.0
                total = total + plain(dot(sign * force, place.arm(at)))
        for lump in link.lumps:
            arm = motion.direction[at] * (link.points[lump.point] + lump.offset)
            total = total + dot(lump_force(motion, at, lump), arm)
        for load in mechanism.loads:
            for name, point, force, _ in load.forces(motion) if hasattr(load, "forces") else ():
                if mechanism.index[name] == at:
                    total = total + dot(force, motion.direction[at] * link.points[point])
        row = PointRow(shares={numbers[at, next(iter(link.points))]: 1.0})
        yield PointEffect(row, row, total)


def _blocks(bent: Deflection, numbers: Numbers) -> Iterator[PointEffect]:
    """Block on a rotating link: the transverse force rotates with the line and moves with the block."""
    motion = bent.motion
    for number, (place, force) in enumerate(zip(motion.places, bent.forces.force, strict=True)):
        joint, owner = place.joint, place.joint.owner
        if joint.turns or not owner:
            continue
        slide, held = _slide(motion, number, numbers)
        turn = PointRow(shares={held: 1.0})
        across = dot(1j * np.broadcast_to(place.along, motion.columns), force * joint.sense)
        yield PointEffect(slide, turn, across)
        yield PointEffect(turn, slide, across)


def _slide(motion: Motion, number: int, numbers: Numbers) -> tuple[PointRow, int]:
    """Displacement of a block along the line of a moving link, relative to the link, and the link's chosen point."""
    place = motion.places[number]
    joint, owner = place.joint, place.joint.owner
    link = motion.mechanism.links[owner]
    point = under(number) if link.beams else next(iter(link.points))
    block, held = numbers[joint.block, joint.point(joint.block) or ""], numbers[owner, point]
    arm = 0.0 if link.beams else place.arm(owner) - motion.direction[owner] * link.points[point]
    along = np.broadcast_to(place.along, motion.columns)
    return PointRow({block: along, held: -along}, {held: -dot(along, 1j * arm)}), held


def sliding_rows(motion: Motion, chosen: Points) -> list[PointRow]:
    """Displacements along the coordinates of joints with friction, child from parent; see `friction_joints`."""
    numbers = {where: number for number, where in enumerate(chosen)}
    rows = []
    for number, _ in friction_joints(motion.mechanism):
        place = motion.places[number]
        joint = place.joint
        if joint.turns:
            ends = ((joint.child, 1.0), (joint.parent, -1.0))
            rows.append(PointRow(shares={numbers[at, joint.point(at) or ""]: share for at, share in ends if at}))
        elif joint.owner:
            rows.append(_slide(motion, number, numbers)[0].times(joint.sense))
        else:
            along = joint.sense * np.broadcast_to(place.along, motion.columns)
            rows.append(PointRow({numbers[joint.block, joint.point(joint.block) or ""]: along}))
    return rows


def _spring(motion: Motion, spring: Spring, numbers: Numbers) -> Iterator[PointEffect]:
    """Stiffness and damping along a spring, and tension / length normal to it."""
    index = motion.mechanism.index
    ends = (index[spring.link], spring.point), (index[spring.on], spring.anchor)
    vector = position_of(motion, *ends[0]) - position_of(motion, *ends[1])
    opening = velocity_of(motion, *ends[0]) - velocity_of(motion, *ends[1])
    reach = np.abs(vector)
    with np.errstate(invalid="ignore", divide="ignore"):
        unit = np.where(reach > 0, vector / reach, 1.0)
        rate = dot(unit, opening)
        tension = spring.preload + spring.stiffness * (reach - spring.length) + spring.damping * rate
        if not (np.any(spring.preload) or np.any(spring.length)):
            across = spring.stiffness + np.where(reach > 0, spring.damping * rate / reach, 0.0)
        else:
            across = tension / reach
    for direction, stiffness, damping in ((unit, spring.stiffness, spring.damping), (1j * unit, across, 0.0)):
        row = PointRow({numbers[ends[0]]: direction, numbers[ends[1]]: -direction})
        yield PointEffect(row, row, np.broadcast_to(stiffness, motion.columns), damping, elastic=direction is unit)


def _torsion_spring(motion: Motion, spring: TorsionSpring, numbers: Numbers) -> PointEffect:
    link, on = (numbers[motion.mechanism.index[name], spring.at] for name in (spring.link, spring.on))
    row = PointRow(shares={link: 1.0, on: -1.0})
    return PointEffect(row, row, np.broadcast_to(spring.stiffness, motion.columns), spring.damping, elastic=True)


def _turning_load(motion: Motion, load: PointLoad, numbers: Numbers) -> Iterator[PointEffect]:
    """Yield the effects of a force that rotates with the section at its point."""
    point = numbers[motion.mechanism.index[load.link], load.point]
    for _, _, force, _ in load.forces(motion):
        yield PointEffect(
            PointRow({point: 1j * np.broadcast_to(force, motion.columns)}),
            PointRow(shares={point: 1.0}),
            -np.ones(motion.columns),
        )
