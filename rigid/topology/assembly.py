"""A mechanism put together near its drawing, with any drives or none, even where it is redundant."""

from __future__ import annotations

from itertools import combinations

import numpy as np

from rigid.arrays import Complex, Reals
from rigid.drawing import Drawing
from rigid.joint_places import joint_place
from rigid.joints import Joint
from rigid.mechanism import Mechanism
from rigid.parts import MechanismError
from rigid.plane import cross
from rigid.postures import Posture
from rigid.topology.kinematic_pairs import pairs

CLOSED = 1e-9  # opening over the mechanism's size below which a joint is closed
LITTLE = 1e-3  # opening over the size that rounded dimensions may leave
STEPS = 40  # of damped least squares


def assembled(mechanism: Mechanism) -> Posture:
    """Posture of a mechanism put together near its drawing, with any drives or none; of designs, the first.

    The links keep their shapes and are moved until the joints close, by damped least squares: the damping goes with the
    opening that is left, so that a redundant mechanism, whose equations are singular when it closes, converges as fast.

    Raises
    ------
    MechanismError
        It does not close near the drawing; names the joint that stays open. A link of which no point is drawn.
    """
    named = pairs(mechanism)
    joints = [pair.joint.of_first_design() for pair in named if pair.joint is not None]
    here = _drawn(mechanism)
    size = _size(here, joints)
    gap = _gaps(here, joints, size)
    damping = 1.0
    for _ in range(STEPS):
        opening = float(np.linalg.norm(gap))
        if opening < 1e-15 or damping > 1e12:
            break
        left, values, right = np.linalg.svd(_gap_matrix(here, joints, size), full_matrices=False)
        step = -right.T @ (values / (values**2 + damping * opening) * (left.T @ gap))
        there = _moved(here, step, size)
        gap_there = _gaps(there, joints, size)
        if np.linalg.norm(gap_there) < opening:
            here, gap, damping = there, gap_there, damping / 4
        else:
            damping *= 8
    welds = [row for row, joint in enumerate(joints) if not joint.freedoms]
    worst = np.abs(gap[: 2 * len(joints)]).reshape(-1, 2).max(axis=1)
    worst[welds] = np.maximum(worst[welds], np.abs(gap[2 * len(joints) :]))
    if worst.size and worst.max() > CLOSED:
        pair = named[int(worst.argmax())]
        little = ": if dimensions are rounded, give more digits" if worst.max() < LITTLE else ""
        raise MechanismError(
            f'the mechanism does not close near its drawing: {pair.kind} "{pair.name}" of "{pair.start}" and '
            f'"{pair.end}" stays open by {worst.max() * size:.3g} m{little}',
            kind="open",
            links=(pair.start, pair.end),
            joints=(pair.name,),
        )
    return here


def flat_triangles(here: Posture) -> tuple[tuple[str, str, str], ...]:
    """Three links each, pinned to one another at three points in one line: singular in every position.

    A bar with three joints drawn as three bars is one; it should be one link with three points.
    """
    links = here.mechanism.links
    holders: dict[str, list[int]] = {}
    for number, link in enumerate(links):
        for point in link.points:
            holders.setdefault(point, []).append(number)
    shared: dict[int, dict[int, str]] = {number: {} for number in range(len(links))}  # a pin with each later link
    for number, link in enumerate(links):
        for point in link.points:
            for other in holders[point]:
                if other > number:
                    shared[number].setdefault(other, point)
    triangles = []
    for first, pinned in shared.items():
        for second, third in combinations(sorted(pinned), 2):
            pins = pinned[second], pinned[third], shared[second].get(third, "")
            if not pins[2] or len({*pins}) < 3:
                continue
            carriers = (links[first].name, links[first].name, links[second].name)
            a, b, c = (_first(here.point(link, point)) for link, point in zip(carriers, pins, strict=True))
            if abs(cross(b - a, c - a)) <= CLOSED * max(abs(b - a), abs(c - a), abs(b - c)) ** 2:
                triangles.append((links[first].name, links[second].name, links[third].name))
    return tuple(triangles)


def _first(value: Complex) -> complex:
    return complex(np.ravel(value)[0])


def _drawn(mechanism: Mechanism) -> Posture:
    """Every link laid on its drawn points; those of one design, with scalar lengths."""
    drawing = Drawing(mechanism)
    origin = np.zeros(len(mechanism.links), complex)
    direction = np.ones(len(mechanism.links), complex)
    for number, link in enumerate(mechanism.links[1:], 1):
        drawn = [point for point in link.points if point in mechanism.drawing]
        if not drawn:
            raise MechanismError(f'link "{link.name}": none of its points is drawn', links=(link.name,))
        direction[number] = drawing.direction(number)
        origin[number] = np.mean(
            [drawing.at(point) - direction[number] * _first(link.points[point]) for point in drawn]
        )
    return Posture(mechanism, origin, direction)


def _size(here: Posture, joints: list[Joint]) -> float:
    """Size that openings are measured by: the greatest extent of the joints [m], 1 where there is none."""
    places = [here.place(link, joint.at(link)) for joint in joints for link in (joint.owner, joint.block)]
    extent = max((abs(place - places[0]) for place in places), default=0.0)
    return float(extent) or 1.0


def _gaps(here: Posture, joints: list[Joint], size: float) -> Reals:
    """How far every joint is open, lengths over the size: (x, y) of a pin, (angle, across) of a slider.

    Then the rotations of the welds.
    """
    rows = np.array([joint.gap(here) for joint in joints], complex)
    slides = np.array([not joint.turns for joint in joints], bool)
    gaps = np.stack([np.where(slides, rows.real, rows.real / size), rows.imag / size], axis=-1).ravel()
    return np.append(gaps, [joint.rotation_gap(here) for joint in joints if not joint.freedoms])


def _gap_matrix(here: Posture, joints: list[Joint], size: float) -> Reals:
    """Derivative of the gaps by (x, y, angle) of every moving link, lengths over the size."""
    matrix = np.zeros((2 * len(joints), 3 * len(here.origin)))
    for row, joint in enumerate(joints):
        place = joint_place(here, joint)
        ends = ((joint.parent, place.arm_parent, -1.0), (joint.child, place.arm_child, 1.0))
        for number, arm, sign in ends:
            motions = ((1.0 + 0j, 0.0), (1j, 0.0), (1j * arm / size, 1.0))
            effects = [complex(sign * place.row(shift, turned)) for shift, turned in motions]
            matrix[2 * row : 2 * row + 2, 3 * number : 3 * number + 3] += np.array(
                [[effect.real for effect in effects], [effect.imag for effect in effects]]
            )
    welds = [joint for joint in joints if not joint.freedoms]
    turned = np.zeros((len(welds), 3 * len(here.origin)))
    for row, joint in enumerate(welds):
        turned[row, [3 * joint.child + 2, 3 * joint.parent + 2]] = 1.0, -1.0
    return np.concatenate([matrix, turned])[:, 3:]


def _moved(here: Posture, step: Reals, size: float) -> Posture:
    """Every moving link displaced and turned."""
    x, y, angle = step.reshape(-1, 3).T
    origin, direction = here.origin.copy(), here.direction.copy()
    origin[1:] += size * (x + 1j * y)
    direction[1:] *= np.exp(1j * angle)
    return Posture(here.mechanism, origin, direction)
