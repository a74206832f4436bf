"""Changes in forces on points due to displacements: springs, dampers, forces that rotate with links, rigid arms.

Each effect has a cause and a response, which are components of displacement. The cause produces a restoring force along
the response. This force is a stiffness times the cause, plus a damping constant times the rate of the cause.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

import numpy as np
from msgspec import Struct, field
from msgspec.structs import replace

from elastic.elastodynamics.displacements import Displacements, Points, point_under_block
from elastic.links.beam_trees import trees_of
from elastic.solution import Deflection
from rigid import Lump, Mechanism, Motion, PointLoad, Spring, TorsionSpring, position_of, structure, velocity_of
from rigid.arrays import Columns, Complexes, Reals
from rigid.joints import Joint
from rigid.kinetostatics import friction_joints
from rigid.plane import dot
from rigid.plane import number as plain


class DisplacementComponent(Struct, frozen=True, eq=False):
    """Component of displacement: a linear combination of displacements and rotations of selected points.

    The value is the sum over the points of dot(direction, displacement) + factor * rotation.

    Attributes
    ----------
    directions
        Direction in ground axes, complex, shape (positions,), by index of the selected point.
    rotation_factors
        Factor by which the rotation is multiplied, shape (positions,) or scalar, by index of the selected point.
    """

    directions: Mapping[int, Complexes] = field(default_factory=dict)
    rotation_factors: Mapping[int, Columns] = field(default_factory=dict)

    def __call__(self, moved: Displacements) -> Reals:
        """Return the value of the component for each displacement field, shape (positions, c)."""
        total: Any = 0.0
        for point, direction in self.directions.items():
            total = total + dot(direction[:, None], moved.moves[:, point])
        for point, factor in self.rotation_factors.items():
            total = total + np.reshape(factor, (-1, 1)) * moved.turns[:, point]
        return total

    def times(self, factor: float) -> DisplacementComponent:
        """Return the component multiplied by a factor."""
        directions, factors = (
            {point: factor * value for point, value in part.items()}
            for part in (self.directions, self.rotation_factors)
        )
        return DisplacementComponent(directions, factors)

    def __getitem__(self, positions: Any) -> DisplacementComponent:
        """Select positions."""
        directions, factors = (
            {point: value[positions] if np.ndim(value) else value for point, value in part.items()}
            for part in (self.directions, self.rotation_factors)
        )
        return DisplacementComponent(directions, factors)


class PointEffect(Struct, frozen=True, eq=False):
    """Restoring force stiffness * cause + damping * d(cause)/dt along the component `response`.

    Attributes
    ----------
    response
        Component of displacement along which the force acts.
    cause
        Component of displacement that causes the force.
    stiffness
        Force per unit of the cause, shape (positions,).
    damping
        Force per unit of the rate of the cause.
    elastic
        True for the elastic stiffness of a spring, False for the geometric stiffness due to a force.
    is_friction
        True for viscous friction. Its force is not added to the loads, because the joint forces already include it (see
        `AddedLoads.sliding`).
    """

    response: DisplacementComponent
    cause: DisplacementComponent
    stiffness: Reals
    damping: Any = 0.0
    elastic: bool = False
    is_friction: bool = False

    def __getitem__(self, positions: Any) -> PointEffect:
        """Select positions."""
        return replace(
            self, response=self.response[positions], cause=self.cause[positions], stiffness=self.stiffness[positions]
        )

    def form(self, response: Displacements, cause: Displacements) -> Reals:
        """Return the stiffness matrix between two sets of fields, see `GeometricStiffness.stiffness`."""
        return (self.stiffness[:, None] * self.response(response))[..., None] * self.cause(cause)[:, None]

    def loads(self, amount: Reals) -> Iterator[tuple[int, Columns, Columns]]:
        """Yield the loads on points that are equivalent to a force `amount` along `response`.

        Each load consists of the index of the selected point, the force [N], complex, and the moment [N m].
        """
        for point, direction in self.response.directions.items():
            yield point, amount * direction, 0.0
        for point, factor in self.response.rotation_factors.items():
            yield point, 0.0, amount * factor


def chosen_points(mechanism: Mechanism) -> tuple[tuple[int, str], ...]:
    """Return the link index and the name of each point at which displacements are needed.

    These are the points with lumps, point loads, springs, pins with friction or toothed wheels, the blocks of sliders,
    the points of elastic links under these blocks, and the first point of each link without beams.
    """
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
    """Yield the points of blocks, of beams under blocks, of toothed wheels, and of pins with friction."""
    rails, rubbing = trees_of(mechanism).rails, {number for number, _ in friction_joints(mechanism)}
    for number, joint in enumerate(structure(mechanism).joints):
        pins: list[Joint] = [joint] if number in rubbing and joint.turns else []
        if not joint.turns:
            yield joint.block, joint.point(joint.block) or ""
            if number in rails:
                yield joint.owner, point_under_block(number)
        elif joint.gear is not None and joint.gear.driver.turns:
            pins = [joint, joint.gear.driver]
        for pin in pins:
            yield from ((at, pin.point(at) or "") for at in (pin.child, pin.parent) if at)


def lumps_of(mechanism: Mechanism) -> list[tuple[int, Lump]]:
    """Return each lump of a moving link, with the index of the link."""
    return [(at, lump) for at, link in enumerate(mechanism.links) if at for lump in link.lumps]


def point_effects(bent: Deflection, chosen: Points) -> list[PointEffect]:
    """Return all effects of displacements on forces, for the forces of a quasi-static deflection."""
    motion = bent.motion
    indices = {where: number for number, where in enumerate(chosen)}
    effects = [*_lump_arms(motion, indices), *_rigid_links(bent, indices), *_blocks(bent, indices)]
    zero = np.zeros(motion.columns)
    for (_, friction), component in zip(
        friction_joints(motion.mechanism), sliding_components(motion, chosen), strict=True
    ):
        if friction.viscosity:
            effects.append(PointEffect(component, component, zero, friction.viscosity, is_friction=True))
    for load in motion.mechanism.loads:
        if isinstance(load, Spring):
            effects += _spring(motion, load, indices)
        if isinstance(load, TorsionSpring):
            effects.append(_torsion_spring(motion, load, indices))
        if isinstance(load, PointLoad) and load.turning:
            effects += _turning_load(motion, load, indices)
    return effects


PointIndices = Mapping[tuple[int, str], int]


def _lump_arms(motion: Motion, indices: PointIndices) -> Iterator[PointEffect]:
    """Yield the effects of lumps with an offset: inertia force and weight act at the end of a rigid arm."""
    for at, lump in lumps_of(motion.mechanism):
        if np.any(lump.offset) and motion.mechanism.links[at].beams:
            component = DisplacementComponent(rotation_factors={indices[at, lump.point]: 1.0})
            arm = motion.direction[at] * lump.offset
            yield PointEffect(component, component, dot(lump_force(motion, at, lump), arm))


def lump_force(motion: Motion, at: int, lump: Lump) -> Complexes:
    """Return the sum of inertia force and weight of a lump in the rigid motion [N], complex."""
    arm = motion.direction[at] * (motion.mechanism.links[at].points[lump.point] + lump.offset)
    relative_acceleration = motion.acceleration[at] - motion.mechanism.gravity + motion.turning[at] * arm
    return -lump.mass * relative_acceleration


def _rigid_links(bent: Deflection, indices: PointIndices) -> Iterator[PointEffect]:
    """Yield the effects of the rotation of links without beams: forces act at the ends of rigid arms."""
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
        component = DisplacementComponent(rotation_factors={indices[at, next(iter(link.points))]: 1.0})
        yield PointEffect(component, component, total)


def _blocks(bent: Deflection, indices: PointIndices) -> Iterator[PointEffect]:
    """Yield the effects of the transverse forces between blocks and guiding links.

    Such a force rotates with the guiding link. The point of the guiding link at which it acts moves with the block.
    """
    motion = bent.motion
    for number, (place, force) in enumerate(zip(motion.places, bent.forces.force, strict=True)):
        joint, owner = place.joint, place.joint.owner
        if joint.turns or not owner:
            continue
        slide, guide = _slide(motion, number, indices)
        turn = DisplacementComponent(rotation_factors={guide: 1.0})
        across = dot(1j * np.broadcast_to(place.along, motion.columns), force * joint.sense)
        yield PointEffect(slide, turn, across)
        yield PointEffect(turn, slide, across)


def _slide(motion: Motion, number: int, indices: PointIndices) -> tuple[DisplacementComponent, int]:
    """Return the displacement of a block along the line of the slider, relative to the guiding link.

    The second result is the index of the selected point of the guiding link.
    """
    place = motion.places[number]
    joint, owner = place.joint, place.joint.owner
    link = motion.mechanism.links[owner]
    point = point_under_block(number) if link.beams else next(iter(link.points))
    block, guide = indices[joint.block, joint.point(joint.block) or ""], indices[owner, point]
    arm = 0.0 if link.beams else place.arm(owner) - motion.direction[owner] * link.points[point]
    along = np.broadcast_to(place.along, motion.columns)
    return DisplacementComponent({block: along, guide: -along}, {guide: -dot(along, 1j * arm)}), guide


def sliding_components(motion: Motion, chosen: Points) -> list[DisplacementComponent]:
    """Return for each joint with friction the change in its coordinate (child relative to parent)."""
    indices = {where: number for number, where in enumerate(chosen)}
    components = []
    for number, _ in friction_joints(motion.mechanism):
        place = motion.places[number]
        joint = place.joint
        if joint.turns:
            ends = ((joint.child, 1.0), (joint.parent, -1.0))
            components.append(
                DisplacementComponent(
                    rotation_factors={indices[at, joint.point(at) or ""]: share for at, share in ends if at}
                )
            )
        elif joint.owner:
            components.append(_slide(motion, number, indices)[0].times(joint.sense))
        else:
            along = joint.sense * np.broadcast_to(place.along, motion.columns)
            components.append(DisplacementComponent({indices[joint.block, joint.point(joint.block) or ""]: along}))
    return components


def _spring(motion: Motion, spring: Spring, indices: PointIndices) -> Iterator[PointEffect]:
    """Yield two effects of a spring: stiffness and damping along it, and the stiffness tension / length across it."""
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
        component = DisplacementComponent({indices[ends[0]]: direction, indices[ends[1]]: -direction})
        yield PointEffect(
            component, component, np.broadcast_to(stiffness, motion.columns), damping, elastic=direction is unit
        )


def _torsion_spring(motion: Motion, spring: TorsionSpring, indices: PointIndices) -> PointEffect:
    link, on = (indices[motion.mechanism.index[name], spring.at] for name in (spring.link, spring.on))
    component = DisplacementComponent(rotation_factors={link: 1.0, on: -1.0})
    return PointEffect(
        component, component, np.broadcast_to(spring.stiffness, motion.columns), spring.damping, elastic=True
    )


def _turning_load(motion: Motion, load: PointLoad, indices: PointIndices) -> Iterator[PointEffect]:
    """Yield the effects of a force that rotates with the section on which it acts."""
    point = indices[motion.mechanism.index[load.link], load.point]
    for _, _, force, _ in load.forces(motion):
        yield PointEffect(
            DisplacementComponent({point: 1j * np.broadcast_to(force, motion.columns)}),
            DisplacementComponent(rotation_factors={point: 1.0}),
            -np.ones(motion.columns),
        )
