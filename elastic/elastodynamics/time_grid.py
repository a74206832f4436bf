"""Grid of time elements, with polynomials through the Radau points of each element."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import cached_property, lru_cache
from typing import Any

import numpy as np
from numpy.polynomial import legendre

from rigid.arrays import Complexes, Integers, Numbers, Reals

STAGES = 8
CACHED = 200_000  # number of values that are processed at once, so that they fit into the cache
JUMP = 0.02  # smallest detected jump, relative to the largest magnitude; short elements resolve smaller ones
LEFT = {2: 0.5, 6: 0.3}  # smallest share of a change that must remain in a jump, after these numbers of halvings
SAME_TIME = 1e-12  # instants with a smaller difference are equal; relative to the duration
HALVED = 24  # number of halvings, to about 1e-9 of the duration


@dataclass(frozen=True, eq=False)
class Scheme:
    """Collocation on [0, 1]: points, and matrices of integration and differentiation.

    Attributes
    ----------
    points
        Points, of which the last is 1, shape (s,).
    once, twice
        Matrices for single and double integrals from 0 to each point, from values at the points, shape (s, s).
    first, second
        Matrices for first and second derivatives at the points, from values at 0 and at the points, shape (s, s + 1).
    """

    points: Reals
    once: Reals
    twice: Reals
    first: Reals
    second: Reals


@lru_cache(maxsize=8)
def scheme(stages: int = STAGES) -> Scheme:
    """Return the Radau points (zeros of P_s - P_(s-1)) with matrices of integration and differentiation."""
    zeros = legendre.legroots([*[0.0] * (stages - 1), -1.0, 1.0])
    points = np.append((np.sort(zeros.real)[:-1] + 1) / 2, 1.0)
    series = np.eye(stages)
    integrals = np.array([legendre.legint(row, lbnd=-1) for row in series]) / 2
    once = _values(points, integrals) @ np.linalg.inv(_values(points, series))
    nodes, series = np.append(0.0, points), np.eye(stages + 1)
    back = np.linalg.inv(_values(nodes, series))
    first, second = (
        _values(points, np.array([legendre.legder(row, order) for row in series])) * 2.0**order @ back
        for order in (1, 2)
    )
    return Scheme(points, once, once @ once, first, second)


def _values(places: Any, series: Reals) -> Reals:
    """Evaluate Legendre series on [0, 1], one per row, shape (places, series)."""
    return legendre.legvander(2 * np.asarray(places) - 1, series.shape[-1] - 1) @ series.T


@dataclass(frozen=True, eq=False)
class Grid:
    """Time interval divided into elements.

    Attributes
    ----------
    edges
        Starts and ends of the elements [s], shape (elements + 1,).
    stages
        Number of points per element.
    """

    edges: Reals
    stages: int = STAGES

    @cached_property
    def steps(self) -> Reals:
        """Duration of every element [s], shape (elements,)."""
        return np.diff(self.edges)

    @property
    def first(self) -> Grid:
        """Grid of the first element."""
        return Grid(self.edges[:2], self.stages)

    @cached_property
    def nodes(self) -> Reals:
        """Start of the grid and all points [s], shape (1 + elements * stages,)."""
        points = self.edges[:-1, None] + self.steps[:, None] * scheme(self.stages).points
        return np.append(self.edges[0], points.ravel())

    def cycled(self, times: Reals, closed: bool) -> Reals:
        """Map instants of a periodic process to the grid.

        If the process is `closed`, i.e. without a jump between its end and its start, the start is mapped to the end,
        which is a point of the grid.
        """
        period = np.ptp(self.edges)
        within: Reals = self.edges[0] + np.mod(times - self.edges[0], period)
        return np.where(within - self.edges[0] <= SAME_TIME * period, self.edges[-1], within) if closed else within

    def at_nodes(self, values: Numbers) -> Numbers:
        """Prepend a value that is extrapolated to the start to values at the points, shape (points, ...)."""
        first = values[: self.stages].reshape(self.stages, -1)
        return np.concatenate(((_to_start(self.stages) @ first).reshape(1, *values.shape[1:]), values))

    def rates(self, values: Numbers) -> tuple[Numbers, Numbers]:
        """Return the first and second time derivatives at all points from values at the nodes.

        Parameters
        ----------
        values
            Shape (nodes, ...).
        """
        method = scheme(self.stages)
        count = len(self.steps)
        flat = values.reshape(len(values), -1)
        first_node = np.arange(count)[:, None] * self.stages
        elements = flat[first_node + np.arange(self.stages + 1)]
        per = 1.0 / self.steps[:, None, None]
        found = (method.first @ elements) * per, (method.second @ elements) * per**2
        one, two = (rate.reshape(-1, *values.shape[1:]) for rate in found)
        return one, two

    def rates_times(self, values: Numbers, amplitudes: tuple[Reals, Reals]) -> Numbers:
        """Return the sum of first and second time derivatives of values at the nodes, each times amplitudes.

        Parameters
        ----------
        values
            Shape (nodes, n, r).
        amplitudes
            Shape (points, r) each.

        Returns
        -------
        Shape (points, n).
        """
        method = scheme(self.stages)
        total = np.empty((len(amplitudes[0]), values.shape[1]), values.dtype)
        for part, (nodes, points) in self.parts(values[0].size):
            first_node = np.arange(len(part.steps))[:, None] * self.stages
            elements = values[nodes].swapaxes(1, 2)[first_node + np.arange(self.stages + 1)]
            weights: Any = 0.0  # weights of every node and kind in the sum at every point
            for order, (matrix, each) in enumerate(zip((method.first, method.second), amplitudes, strict=True), 1):
                there = each[points].reshape(len(part.steps), self.stages, 1, -1)
                weights = weights + matrix[:, :, None] * there / part.steps[:, None, None, None] ** order
            shape = len(part.steps), self.stages, -1
            own = np.ascontiguousarray(elements.reshape(len(part.steps), -1, values.shape[1])).view(float)
            total[points] = (weights.reshape(shape) @ own).view(values.dtype).reshape(-1, values.shape[1])
        return total

    def parts(self, size: int) -> Iterator[tuple[Grid, tuple[slice, slice]]]:
        """Yield groups of elements, with their nodes and points, so that `size` numbers per node fit into the cache."""
        count = max(1, CACHED // (size * self.stages))
        for first in range(0, len(self.steps), count):
            edges = self.edges[first : first + count + 1]
            begin, end = first * self.stages, (first + len(edges) - 1) * self.stages
            yield Grid(edges, self.stages), (slice(begin, end + 1), slice(begin, end))

    def derivative(self, values: Numbers, order: int) -> Numbers:
        """Return the time derivative of values at the points, shape (points, ...), element by element.

        Differences do not cross edges, because short elements would amplify the unresolved part of longer neighbours.
        """
        own = values.reshape(len(self.steps), self.stages, -1)
        found = (_derivative(self.stages, order) @ own) / self.steps[:, None, None] ** order
        return found.reshape(values.shape)

    def sampler(self, times: Reals) -> Callable[[Any], Any]:
        """Return a function that interpolates values at the points, shape (points, ...), to given instants.

        At an edge, the element that ends there is used, because its end is a point. At its start, values would be
        extrapolated.
        """
        near = times - SAME_TIME * np.ptp(self.edges)
        element = np.clip(np.searchsorted(self.edges, near) - 1, 0, len(self.steps) - 1)
        weights = interpolation(scheme(self.stages).points, (times - self.edges[element]) / self.steps[element])

        order = np.argsort(element, kind="stable")
        present, first = np.unique(element[order], return_index=True)
        instants = np.split(order, first[1:])  # grouped by element, to avoid copies of elements

        def sampled(values: Complexes) -> Complexes:
            elements = values.reshape(len(self.steps), self.stages, -1)
            found = np.empty((len(times), elements.shape[-1]), values.dtype)
            for number, rows in zip(present, instants, strict=True):
                found[rows] = weights[rows] @ elements[number]
            return found.reshape(len(times), *values.shape[1:])

        return sampled

    def tail(self, values: Numbers, greatest: float) -> Reals:
        """Estimate the unresolved part of values in every element, relative to `greatest`, shape (elements,).

        The estimate is the last two orders of the Legendre series, times their ratio to the previous two orders. This
        extrapolates to the next two orders.
        """
        elements = values.reshape(len(self.steps), self.stages, -1)
        if not greatest:
            return np.zeros(len(self.steps))
        orders = np.square(np.abs(_spectrum(self.stages) @ elements)).max(axis=-1)
        before, last = (np.sqrt(orders[:, part].sum(axis=1)) for part in (slice(-4, -2), slice(-2, None)))
        with np.errstate(invalid="ignore", divide="ignore"):
            fall = np.where(before > 0, np.minimum(last / before, 1.0), 1.0)
        return last * fall / greatest

    def smoothed(self, values: Numbers, fastest: float) -> Numbers:
        """Remove orders of the Legendre series of every element that change too fast.

        Parameters
        ----------
        fastest
            Largest angular frequency of second derivatives [rad/s]; order k has a mean of about (0.7 k^2/h)^2. The
            highest order is always removed.
        """
        elements = values.reshape(len(self.steps), self.stages, -1)
        highest = np.minimum(np.sqrt(fastest * self.steps / 0.7), self.stages - 2).astype(int)
        kept = _up_to(self.stages)[highest]
        return (kept @ elements).reshape(values.shape)

    def lagged(self, values: Numbers, lag: float, cyclic: bool) -> Numbers:
        """Solve y + lag dy/dt = values for y at all points except the start, shape (points, ...).

        Parameters
        ----------
        values
            Values at the same points.
        lag
            Time constant [s].
        cyclic
            True for a periodic solution; otherwise y starts with the value that is extrapolated to the start.
        """
        if not lag:
            return values
        method, elements = scheme(self.stages), values.reshape(len(self.steps), self.stages, -1)
        per = (lag / self.steps)[:, None, None]
        inverse = np.linalg.inv(np.eye(self.stages) + per * method.first[:, 1:])
        forced, decay = inverse @ elements, -per * (inverse @ method.first[:, :1])

        def starts(first: Numbers) -> list[Numbers]:
            reached = [first]
            for own, left in zip(forced[:, -1], decay[:, -1, 0], strict=True):
                reached.append(own + left * reached[-1])
            return reached

        first = (_to_start(self.stages) @ elements[0])[0]
        if cyclic:
            first = starts(np.zeros_like(first))[-1] / (1.0 - np.prod(decay[:, -1, 0]))
        return (forced + decay * np.array(starts(first)[:-1])[:, None]).reshape(values.shape)

    def divided(self, parts: Integers) -> Grid:
        """Divide every element into `parts` equal parts, shape (elements,)."""
        pieces = [
            start + step * np.arange(count) / count
            for start, step, count in zip(self.edges[:-1], self.steps, parts, strict=True)
        ]
        return Grid(np.append(np.concatenate(pieces), self.edges[-1]), self.stages)


def jumps(values_at: Callable[[Reals], Reals], times: Reals) -> Reals:
    """Find the instants just before jumps of values, at most one between two given times, shape (jumps,).

    Parameters
    ----------
    values_at
        Function from instants to values, shape (instants, n).
    """
    values = values_at(times)
    scale = np.abs(values).max(axis=0, initial=0.0)
    scale[scale == 0.0] = 1.0

    def change(one: Reals, other: Reals) -> Reals:
        return np.abs((other - one) / scale).max(axis=-1, initial=0.0)

    low, high, before, after = times[:-1], times[1:], values[:-1], values[1:]
    first = change(before, after)
    for halved in range(HALVED + 1):
        kept = first > JUMP if not halved else change(before, after) > LEFT.get(halved, 0.0) * first
        low, high, before, after, first = (each[kept] for each in (low, high, before, after, first))
        if not len(low):
            break
        middle = (low + high) / 2
        there = values_at(middle)
        left = change(before, there) > change(there, after)
        low, high = np.where(left, low, middle), np.where(left, middle, high)
        before, after = (np.where(side[:, None], there, each) for side, each in ((~left, before), (left, after)))
    return low


def interpolation(nodes: Reals, places: Reals) -> Reals:
    """Return the matrix that maps values at nodes on [0, 1] to values of their polynomial, shape (places, nodes)."""
    return _values(places, np.eye(len(nodes))) @ _to_series(tuple(nodes.tolist()))


def slopes(nodes: Reals, places: Reals) -> Reals:
    """Return the matrix that maps values at nodes on [0, 1] to derivatives of their polynomial, (places, nodes)."""
    series = np.array([legendre.legder(row) for row in np.eye(len(nodes))])
    return 2.0 * _values(places, series) @ _to_series(tuple(nodes.tolist()))


@lru_cache(maxsize=32)
def _to_series(nodes: tuple[float, ...]) -> Reals:
    """Return the matrix that maps values at nodes on [0, 1] to Legendre coefficients, shape (nodes, nodes)."""
    return np.asarray(np.linalg.inv(_values(nodes, np.eye(len(nodes)))), float)


@lru_cache(maxsize=8)
def _spectrum(stages: int) -> Reals:
    return np.asarray(np.linalg.inv(_values(scheme(stages).points, np.eye(stages))), float)


@lru_cache(maxsize=8)
def _up_to(stages: int) -> Reals:
    """Return for each order the matrix that truncates the Legendre series of values, (stages, stages, stages)."""
    kept = np.tri(stages)[:, :, None] * _spectrum(stages)
    return _values(scheme(stages).points, np.eye(stages)) @ kept


@lru_cache(maxsize=8)
def _to_start(stages: int) -> Reals:
    return interpolation(scheme(stages).points, np.zeros(1))


@lru_cache(maxsize=8)
def _derivative(stages: int, order: int) -> Reals:
    """Return the matrix that maps values at the points of [0, 1] to derivatives at these points."""
    series = np.array([legendre.legder(row, order) for row in np.eye(stages)])
    return 2.0**order * _values(scheme(stages).points, series) @ _spectrum(stages)
