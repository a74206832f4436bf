"""Where every link is: read off a motion, or assembled from the drawing even where the mechanism is redundant."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import combinations
from typing import Any

import numpy as np

from rigid.mechanism import Complexes, Mechanism, MechanismError, Reals, Slider
from rigid.motion import Motion
from rigid.plane import cross
from rigid.positions.drawing import Drawing
from rigid.topology.pairs import Pair, pairs

CLOSED = 1e-9
LITTLE = 1e-3
STEPS = 40


@dataclass(frozen=True, eq=False)
class Posture:
    """Where the links of a mechanism are.

    Attributes
    ----------
    origin
        Of every link's axes [m], complex, shape (links, ...), links in the order of the mechanism.
    direction
        Unit vector of every link's x' axis, complex, shape (links, ...).
    """

    mechanism: Mechanism
    origin: Complexes
    direction: Complexes

    def point(self, link: str, point: str) -> Complexes:
        """Place of a link's point [m], shape (...)."""
        number = self.mechanism.index[link]
        return np.asarray(self.origin[number] + self.direction[number] * self.mechanism.links[number].points[point])


def posture(motion: Motion) -> Posture:
    """The postures of a motion: columns are its positions."""
    return Posture(motion.mechanism, motion.origin, motion.direction)


def assembled(mechanism: Mechanism) -> Posture:
    """The mechanism put together near its drawing, whatever its drives; of designs, the first.

    The links keep their shapes and are moved until the joints close, by damped least squares: the damping goes with the
    opening that is left, so that a redundant mechanism, whose equations are singular when it closes, converges as fast.

    Raises
    ------
    MechanismError
        It does not close near the drawing; names the joint that stays open. A link of which no point is drawn.
    """
    joints = pairs(mechanism)
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
    worst = np.abs(gap).reshape(-1, 2).max(axis=1)
    if worst.size and worst.max() > CLOSED:
        pair = joints[int(worst.argmax())]
        little = ": if dimensions are rounded, give more digits" if worst.max() < LITTLE else ""
        raise MechanismError(
            f'the mechanism does not close near its drawing: {pair.kind} "{pair.name}" of "{pair.start}" and '
            f'"{pair.end}" stays open by {worst.max() * size:.3g} m{little}'
        )
    return here


def flat_triangles(here: Posture) -> tuple[tuple[str, str, str], ...]:
    """Three links each, pinned to one another at three points in one line: singular in every position.

    A bar with three joints drawn as three bars is one; it should be one link with three points.
    """
    shared: dict[frozenset[str], list[str]] = {}
    for one, other in combinations(here.mechanism.links, 2):
        shared[frozenset((one.name, other.name))] = [point for point in one.points if point in other.points]
    found = []
    for trio in combinations((link.name for link in here.mechanism.links), 3):
        ends = [shared[frozenset(pair)] for pair in combinations(trio, 2)]
        if not all(ends) or len({points[0] for points in ends}) < 3:
            continue
        carriers = (trio[0], trio[0], trio[1])
        a, b, c = (_first(here.point(link, points[0])) for link, points in zip(carriers, ends, strict=True))
        if abs(cross(b - a, c - a)) <= CLOSED * max(abs(b - a), abs(c - a), abs(b - c)) ** 2:
            found.append(trio)
    return tuple(found)


def slide_line(here: Posture, slider: Slider) -> Complexes:
    """Unit vector of a slider's line in the ground's axes, shape (...)."""
    return np.asarray(here.direction[here.mechanism.index[slider.on]] * slider.direction)


def _first(value: Any) -> complex:
    return complex(np.ravel(value)[0])


def _drawn(mechanism: Mechanism) -> Posture:
    """Every link laid on its drawn points; those of one design, with scalar lengths."""
    drawing = Drawing(mechanism)
    origin = np.zeros(len(mechanism.links), complex)
    direction = np.ones(len(mechanism.links), complex)
    for number, link in enumerate(mechanism.links[1:], 1):
        drawn = [point for point in link.points if point in mechanism.drawing]
        if not drawn:
            raise MechanismError(f'link "{link.name}": none of its points is drawn')
        direction[number] = drawing.direction(number)
        origin[number] = np.mean(
            [drawing.at(point) - direction[number] * _first(link.points[point]) for point in drawn]
        )
    return Posture(mechanism, origin, direction)


def _ends(here: Posture, pair: Pair) -> Iterator[tuple[int, complex]]:
    """Start and end link's number and where on it the pair is."""
    index, links = here.mechanism.index, here.mechanism.links
    for side, name in enumerate((pair.start, pair.end)):
        number = index[name]
        slider = pair.detail if isinstance(pair.detail, Slider) else None
        point = pair.name if slider is None else slider.point
        own = links[number].points[point] if slider is None or side else slider.origin
        yield number, complex(here.origin[number] + here.direction[number] * _first(own))


def _size(here: Posture, joints: tuple[Pair, ...]) -> float:
    """Greatest extent of the joints [m], 1 where there is none: what openings are measured by."""
    places = [place for pair in joints for _, place in _ends(here, pair)]
    extent = max((abs(place - places[0]) for place in places), default=0.0)
    return extent or 1.0


def _gaps(here: Posture, joints: tuple[Pair, ...], size: float) -> Reals:
    """How far every pair is open, over the size: (x, y) of a pin, (across, angle) of a slider."""
    rows: list[complex] = []
    for pair in joints:
        (start, base), (end, tip) = _ends(here, pair)
        opening = (tip - base) / size
        if isinstance(pair.detail, Slider):
            turned = here.direction[end] * np.conj(here.direction[start] * _first(pair.detail.turn))
            along = here.direction[start] * _first(pair.detail.direction)
            opening = complex(cross(along, opening), np.angle(turned))
        rows.append(opening)
    return np.array(rows, complex).view(float)


def _gap_matrix(here: Posture, joints: tuple[Pair, ...], size: float) -> Reals:
    """Derivative of the gaps by (x, y, angle) of every moving link, displacements over the size."""
    matrix = np.zeros((2 * len(joints), 3 * len(here.origin)))
    for row, pair in enumerate(joints):
        (start, base), (end, tip) = _ends(here, pair)
        along = 1.0 if not isinstance(pair.detail, Slider) else _first(slide_line(here, pair.detail))
        for number, place, sign in ((start, base, -1.0), (end, tip, 1.0)):
            if isinstance(pair.detail, Slider):
                # The line turns with its owner: both ends see the opening from the block's place.
                arm = (tip - here.origin[number]) / size
                lines = [[float(cross(along, way)) for way in (1.0, 1j, 1j * arm)], [0.0, 0.0, 1.0]]
            else:
                arm = (place - here.origin[number]) / size
                lines = [[1.0, 0.0, -arm.imag], [0.0, 1.0, arm.real]]
            matrix[2 * row : 2 * row + 2, 3 * number : 3 * number + 3] += sign * np.array(lines)
    return matrix[:, 3:]


def _moved(here: Posture, step: Reals, size: float) -> Posture:
    """Every moving link displaced and turned."""
    x, y, angle = step.reshape(-1, 3).T
    origin, direction = here.origin.copy(), here.direction.copy()
    origin[1:] += size * (x + 1j * y)
    direction[1:] *= np.exp(1j * angle)
    return Posture(here.mechanism, origin, direction)
