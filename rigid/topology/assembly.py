"""Assembly of a mechanism near its drawing. It may have any number of drives and redundant constraints."""

from itertools import combinations

import numpy as np

from rigid.arrays import Complex, Reals
from rigid.drawing import Drawing
from rigid.joints import Joint
from rigid.mechanism import Mechanism
from rigid.parts import MechanismError
from rigid.plane import cross
from rigid.postures import Posture, joint_place
from rigid.topology.kinematic_pairs import pairs

MAX_GAP = 1e-9  # largest gap of a closed joint, relative to the mechanism's size
MAX_ROUNDED_GAP = 1e-3  # a smaller gap may be due to rounded dimensions, relative to the mechanism's size
MAX_STEPS = 40  # maximum number of damped least-squares steps


def assembled(mechanism: Mechanism) -> Posture:
    """Assemble a mechanism near its drawing, for the first design, and return its posture.

    The links are moved by damped least squares until the joints close. The damping is proportional to the remaining
    gap. Convergence is therefore also fast for a redundant mechanism, whose equations are singular at the solution.

    Raises
    ------
    MechanismError
        If the mechanism does not close near the drawing (the error names the open joint), or a link has no drawn point.
    """
    named = pairs(mechanism)
    joints = [pair.joint.of_first_design() for pair in named if pair.joint is not None]
    here = _drawn(mechanism)
    size = _size(here, joints)
    gap = _gaps(here, joints, size)
    damping = 1.0
    for _ in range(MAX_STEPS):
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
    if worst.size and worst.max() > MAX_GAP:
        pair = named[int(worst.argmax())]
        hint = ": if dimensions are rounded, give more digits" if worst.max() < MAX_ROUNDED_GAP else ""
        raise MechanismError(
            f'the mechanism does not close near its drawing: {pair.kind} "{pair.name}" of "{pair.start}" and '
            f'"{pair.end}" stays open by {worst.max() * size:.3g} m{hint}',
            kind="open",
            links=(pair.start, pair.end),
            joints=(pair.name,),
        )
    return here


def flat_triangles(here: Posture) -> tuple[tuple[str, str, str], ...]:
    """Return triples of links that are pinned to one another at three collinear points.

    Such links are in a singular position at all times. They occur if a bar with three joints is modelled as three
    links. Such a bar should be one link with three points.
    """
    links = here.mechanism.links
    holders: dict[str, list[int]] = {}
    for number, link in enumerate(links):
        for point in link.points:
            holders.setdefault(point, []).append(number)
    # shared[link][other]: name of a pin of a link and another link with a higher index
    shared: dict[int, dict[int, str]] = {number: {} for number in range(len(links))}
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
            if abs(cross(b - a, c - a)) <= MAX_GAP * max(abs(b - a), abs(c - a), abs(b - c)) ** 2:
                triangles.append((links[first].name, links[second].name, links[third].name))
    return tuple(triangles)


def _first(value: Complex) -> complex:
    return complex(np.ravel(value)[0])


def _drawn(mechanism: Mechanism) -> Posture:
    """Return the posture in which each link fits its drawn points best, for the first design."""
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
    """Return the reference length of gaps: the largest distance of a joint from the first joint [m]; 1 if zero."""
    places = [here.place(link, joint.at(link)) for joint in joints for link in (joint.owner, joint.block)]
    extent = max((abs(place - places[0]) for place in places), default=0.0)
    return float(extent) or 1.0


def _gaps(here: Posture, joints: list[Joint], size: float) -> Reals:
    """Return two gaps for each joint, followed by the rotation gaps of all welds, as one array.

    For a pin or weld, the two gaps are x / size and y / size. For a slider, the first gap is the angle [rad], and the
    second is (distance from the line) / size.
    """
    rows = np.array([joint.gap(here) for joint in joints], complex)
    slides = np.array([not joint.turns for joint in joints], bool)
    gaps = np.stack([np.where(slides, rows.real, rows.real / size), rows.imag / size], axis=-1).ravel()
    return np.append(gaps, [joint.rotation_gap(here) for joint in joints if not joint.freedoms])


def _gap_matrix(here: Posture, joints: list[Joint], size: float) -> Reals:
    """Return the Jacobian of the gaps with respect to (x / size, y / size, angle) of the moving links."""
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
    """Displace and rotate the moving links; `step` contains x / size, y / size and angle of each link."""
    x, y, angle = step.reshape(-1, 3).T
    origin, direction = here.origin.copy(), here.direction.copy()
    origin[1:] += size * (x + 1j * y)
    direction[1:] *= np.exp(1j * angle)
    return Posture(here.mechanism, origin, direction)
