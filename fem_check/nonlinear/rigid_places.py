"""Positions of the rigid links at any time, by Newton's method for all joint constraints.

The unknowns are x, y and angle of each link. The closed forms of `rigid` are not used.
"""

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

from elastic import RIGID
from fem_check.nonlinear.couplings import coupling_state
from fem_check.nonlinear.nodes import Nodes, nodes_of
from fem_check.nonlinear.ties import Ties, ties_of
from rigid import Mechanism, Reals
from rigid.arrays import Columns, Complexes

DriveLaw = Callable[[Any], Sequence[Any]]
"""Function of time [s] that returns the coordinate, rate and acceleration of a drive."""
MAX_STRIDE = 0.05
"""Largest movement of a drive between two tracked positions [rad], or relative to the size of the mechanism."""
TOLERANCE = 1e-13
"""Largest change in the last step of Newton's method, relative to the size of the mechanism, or [rad]."""
MAX_GAP = 1e-9
"""Largest residual of a constraint that counts as satisfied, relative to the size of the mechanism, or [rad]."""
MAX_STEPS = 30
"""Maximum number of steps of Newton's method."""
SAMPLES = 2001
"""Number of instants at which the movement of the drives is measured."""


class DoesNotCloseError(ValueError):
    """Raised if the links cannot reach given drive coordinates, or Newton's method does not converge."""


def coordinates(laws: Sequence[DriveLaw], time: Columns) -> Reals:
    """Return the coordinates of all drives, shape (instants, drives)."""
    time = np.atleast_1d(np.asarray(time, float))
    values = [np.broadcast_to(np.asarray(law(time)[0], float), time.shape) for law in laws]
    return np.stack(values, axis=-1) if values else np.zeros((len(time), 0))


def drive_rates(laws: Sequence[DriveLaw], time: Reals) -> Reals:
    """Return the rates of all drives, shape (instants, drives)."""
    rates = [np.broadcast_to(np.asarray(law(time)[1], float), time.shape) for law in laws]
    return np.stack(rates, axis=-1) if rates else np.zeros((len(time), 0))


def drawn_places(mechanism: Mechanism, first: Reals) -> Reals:
    """Return approximate x, y and angle of each link, shape (links, 3).

    Links with at least two points in the drawing are placed as drawn. The other links are placed one after another,
    each at a point or angle in common with a link that is already placed. `first` are the initial coordinates of the
    drives, shape (drives,).
    """
    places: dict[int, tuple[complex, complex]] = {0: (0.0, 1.0)}
    drawing = {name: complex(place) for name, place in mechanism.drawing.items()}
    drawing |= {name: complex(place) for name, place in mechanism.links[0].points.items()}
    for number, link in enumerate(mechanism.links):
        seen = [(complex(local), drawing[name]) for name, local in link.points.items() if name in drawing]
        local, drawn = np.array(seen, complex).reshape(-1, 2).T
        if number and len(seen) > 1 and np.ptp(np.abs(local - local[0])) > 0:
            turn = np.vdot(local - local.mean(), drawn - drawn.mean())
            turn /= abs(turn)
            places[number] = drawn.mean() - turn * local.mean(), turn
    while len(places) < len(mechanism.links):
        _place_next(mechanism, places, drawing, first)
    rows = [places[number] for number in range(len(mechanism.links))]
    return np.array([[complex(z).real, complex(z).imag, np.angle(turn)] for z, turn in rows])


def _place_next(
    mechanism: Mechanism, places: dict[int, tuple[complex, complex]], drawing: dict[str, complex], first: Reals
) -> None:
    """Place one more link, preferably one with a known angle relative to a placed link."""
    index, links = mechanism.index, mechanism.links
    turns = [(index[each.on], index[each.link], complex(each.turn)) for each in mechanism.fixed_angles]
    for drive, value in zip(mechanism.drives, first, strict=True):
        if drive.turns:
            link, on = drive.links
            turns.append((index[on], index[link], complex(np.exp(1j * value))))
    turns += [(child, parent, 1 / turn) for parent, child, turn in turns]
    missing = [number for number in range(len(links)) if number not in places]
    known = (
        (child, places[parent][1] * turn) for parent, child, turn in turns if parent in places and child in missing
    )
    number, turn = next(known, (missing[0], 1.0 + 0j))
    drawn = dict(drawing)
    for other, (z, own) in places.items():
        drawn |= {name: z + own * complex(local) for name, local in links[other].points.items() if name not in drawn}
    spots = [(drawn[name], complex(local)) for name, local in links[number].points.items() if name in drawn]
    place, local = spots[0] if spots else (0.0, 0.0)
    places[number] = place - turn * local, turn


class RigidPlaces:
    """Positions of the links at given times, tracked from the drawing in small steps of the drives."""

    def __init__(self, mechanism: Mechanism, laws: Sequence[DriveLaw], start: float) -> None:
        self.mechanism, self.laws, self.start = mechanism, laws, start
        first = coordinates(laws, start)[0]
        self.drawn = drawn_places(mechanism, first)
        stiff = [RIGID] * len(mechanism.beams)
        self.nodes: Nodes = nodes_of(mechanism, stiff, 1, 0.0)
        self.ties: Ties = ties_of(mechanism, self.nodes, {}, self.drawn, first)
        reach = [
            abs(complex(p) - complex(o))
            for link in mechanism.links
            for p in link.points.values()
            for o in link.points.values()
        ]
        self.size = max([*reach, 1e-12])
        target = first + self.ties.winding
        current = self._closed(self.drawn[None], None)
        now = np.array([self._coordinate(current[0], k) for k in range(len(target))])
        for share in np.linspace(0.0, 1.0, self._strides(target - now) + 1)[1:]:
            current = self._closed(current, (now + share * (target - now))[None])
        self.begin = current[0]
        self.tracked: tuple[list[float], list[Reals]] = [start], [self.begin]

    def at(self, time: Any) -> Reals:
        """Return x, y and angle of each link at given times from the start on [s], shape (times, links, 3).

        Raises
        ------
        DoesNotCloseError
            If the joints do not close.
        """
        time = np.asarray(time, float)
        if not len(time):
            return np.empty((0, *self.begin.shape))
        self._follow(float(time.max()))
        instants, places = np.array(self.tracked[0]), np.array(self.tracked[1])
        after = np.clip(np.searchsorted(instants, time), 1, len(instants) - 1)
        share = (time - instants[after - 1]) / (instants[after] - instants[after - 1])
        near = places[after - 1] + share[:, None, None] * (places[after] - places[after - 1])
        return self._closed(near, coordinates(self.laws, time) + self.ties.winding, time)

    def require_period(self, places: Reals, period: float) -> None:
        """Raise DoesNotCloseError if the positions do not repeat after a period [s], apart from full turns."""
        moved = places[-1] - places[0]
        turned = moved[:, 2] - 2 * np.pi * np.round(moved[:, 2] / (2 * np.pi))
        if max(np.abs(moved[:, :2]).max() / self.size, np.abs(turned).max()) > 1e-6:
            raise DoesNotCloseError(
                f"the links do not return to their initial positions after {period:.6g} s, so this is not a period"
            )

    def _follow(self, end: float) -> None:
        """Extend the tracked positions to the time `end` [s]."""
        instants, places = self.tracked
        begin = instants[-1]
        if end <= begin and len(instants) > 1:
            return
        end = max(end, begin + 1e-9 * max(1.0, abs(begin)))
        fine = np.linspace(begin, end, SAMPLES)
        scale = np.array([1.0 if drive.turns else self.size for drive in self.mechanism.drives])
        moved = (np.abs(np.diff(coordinates(self.laws, fine), axis=0)) / scale).max(axis=1, initial=0.0)
        travel = np.concatenate([[0.0], np.cumsum(np.maximum(moved, 1e-12 / SAMPLES))])
        strides = max(1, int(np.ceil(travel[-1] / MAX_STRIDE)))
        for time in np.interp(np.linspace(0.0, travel[-1], strides + 1)[1:], travel, fine):
            here = places[-1]
            ahead = here + (here - places[-2]) if len(places) > 1 else here
            drive_coordinates = coordinates(self.laws, time)[0] + self.ties.winding
            places.append(self._closed(ahead[None], drive_coordinates[None], np.array([time]))[0])
            instants.append(float(time))

    def _strides(self, change: Reals) -> int:
        scale = np.array([1.0 if drive.turns else self.size for drive in self.mechanism.drives])
        return max(1, int(np.ceil(np.abs(change / scale).max(initial=0.0) / MAX_STRIDE)))

    def _coordinate(self, places: Reals, drive: int) -> float:
        ties = self.ties
        if drive in ties.driven:
            return float(places[self.nodes.link[ties.driven[drive]], 2])
        mover = ties.drive_couplings[drive]
        assert mover is not None
        return float(coupling_state((ties.couplings[mover],), places[self.nodes.link][None]).value[0, 0])

    def _closed(self, near: Reals, drive_coordinates: Reals | None, time: Reals | None = None) -> Reals:
        """Return the positions at which all joints close, by Newton's method from `near`, shape (instants, links, 3).

        `drive_coordinates` are the coordinates of the drives, shape (instants, drives), or None if the drives are free.
        `time` [s] is only used in the error message.
        """
        places = near.copy()
        unit = np.array([self.size, self.size, 1.0])
        for _ in range(MAX_STEPS):
            gaps, rows = self._equations(places, drive_coordinates)
            step = -(np.linalg.pinv(rows, rcond=1e-12) @ gaps[..., None])[..., 0].reshape(len(places), -1, 3)
            longest = np.abs(step).max(axis=(1, 2), initial=0.0)
            places[:, 1:] += step * unit * np.minimum(1.0, 0.5 / np.maximum(longest, 1e-300))[:, None, None]
            if longest.max(initial=0.0) < TOLERANCE:
                break
        gaps, _ = self._equations(places, drive_coordinates)
        open_ = ~(np.abs(gaps).max(axis=1, initial=0.0) < MAX_GAP)
        if open_.any():
            when = "as drawn" if time is None else f"at {time[open_][0]:.6g} s"
            raise DoesNotCloseError(f"the joints of the rigid links do not close {when}")
        return places

    def _equations(self, places: Reals, drive_coordinates: Reals | None) -> tuple[Reals, Reals]:
        """Return the residuals of the constraints, and the derivatives of the residuals, without units.

        The shapes are (instants, rows) and (instants, rows, 3 (links - 1)).
        """
        ties, link, count = self.ties, self.nodes.link, places.shape[1]
        state = coupling_state(tuple(ties.couplings), places[:, link])
        gaps: list[Any] = []
        rows: list[Reals] = []

        def add(parts: Sequence[tuple[int, int, Any]], gap: Any, scale: float) -> None:
            row = np.zeros((len(places), count, 3))
            for node, component, value in parts:
                row[:, link[node], component] += value * (self.size if component < 2 else 1.0)
            rows.append(row[:, 1:].reshape(len(places), -1) / scale)
            gaps.append(gap / scale)

        for node, fixed in ties.fixed.items():
            for component, value in enumerate((complex(fixed).real, complex(fixed).imag)):
                add([(node, component, 1.0)], places[:, link[node], component] - value, self.size)
        for first, second in ties.shared:
            for component in (0, 1):
                gap = places[:, link[second], component] - places[:, link[first], component]
                add([(second, component, 1.0), (first, component, -1.0)], gap, self.size)
        for drive, node in ties.driven.items():
            if drive_coordinates is not None:
                add([(node, 2, 1.0)], places[:, link[node], 2] - drive_coordinates[:, drive], 1.0)
        for constraint in ties.constraints:
            if constraint.drive is not None and drive_coordinates is None:
                continue
            gap = np.full(len(places), -constraint.target)
            if drive_coordinates is not None and constraint.drive is not None:
                gap -= drive_coordinates[:, constraint.drive]
            parts = []
            for number, factor in constraint.parts:
                coupling = ties.couplings[number]
                gap += factor * state.value[:, number]
                slope = factor * state.gradient[:, number]
                parts += [
                    (node, c, slope[:, 3 * k + c])
                    for k, node in enumerate((coupling.parent, coupling.child))
                    for c in range(3)
                ]
            add(parts, gap, 1.0 if ties.couplings[constraint.parts[0][0]].kind == 2 else self.size)
        empty = np.zeros((0, len(places)))
        table = np.array(rows).reshape(len(rows), len(places), 3 * (count - 1))
        return np.array(gaps or empty).reshape(len(gaps), len(places)).T, np.swapaxes(table, 0, 1)


def as_complex(values: Reals) -> Complexes:
    """Return x + i y, where x and y are the first two entries of the last axis."""
    return values[..., 0] + 1j * values[..., 1]
