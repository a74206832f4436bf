"""Grid of time elements, with polynomials through the Radau points of each element."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from functools import cached_property, lru_cache
from typing import Any

import numpy as np
from msgspec import Struct
from numpy.polynomial import legendre

from rigid.arrays import Complexes, Integers, Numbers, Reals, distinct

STAGES = 8
MAX_CACHED_VALUES = 200_000  # maximum number of values per batch, so that they fit into the processor's cache
MIN_JUMP = 0.02  # smaller jumps are not searched for, but resolved by short elements; relative to the largest magnitude
# Each interval with a large change is halved repeatedly, and the half with the larger change is kept. The keys of this
# table are numbers of halvings. After a number of halvings, the change in the remaining interval must exceed the given
# fraction of the change in the original interval. Otherwise, the change is gradual and not a jump.
MIN_JUMP_SHARE = {2: 0.5, 6: 0.3}
SAME_TIME = 1e-12  # instants that differ by less than this are equal; relative to the duration
MAX_HALVINGS = 24  # number of halvings of an interval, which locate a jump to about 1e-9 of the duration


class Scheme(Struct, frozen=True, eq=False):
    """Collocation method on the interval [0, 1].

    Attributes
    ----------
    points
        Collocation points, shape (s,). The last point is 1.
    integral, double_integral
        Matrices that map values at the points to single and double integrals from 0 to each point, shape (s, s).
    first, second
        Matrices that map values at 0 and at the points to first and second derivatives at the points, shape (s, s + 1).
    """

    points: Reals
    integral: Reals
    double_integral: Reals
    first: Reals
    second: Reals


@lru_cache(maxsize=8)
def scheme(stages: int = STAGES) -> Scheme:
    """Return the Radau points (zeros of P_s - P_(s-1)) with matrices of integration and differentiation."""
    zeros = legendre.legroots([*[0.0] * (stages - 1), -1.0, 1.0])
    points = np.append((np.sort(zeros.real)[:-1] + 1) / 2, 1.0)
    series = np.eye(stages)
    integrals = np.array([legendre.legint(row, lbnd=-1) for row in series]) / 2
    integral = _values(points, integrals) @ np.linalg.inv(_values(points, series))
    nodes, series = np.append(0.0, points), np.eye(stages + 1)
    back = np.linalg.inv(_values(nodes, series))
    first, second = (
        _values(points, np.array([legendre.legder(row, order) for row in series])) * 2.0**order @ back
        for order in (1, 2)
    )
    return Scheme(points, integral, integral @ integral, first, second)


def _values(places: Any, series: Reals) -> Reals:
    """Evaluate Legendre series on [0, 1], shape (places, series). Each row of `series` contains coefficients."""
    return legendre.legvander(2 * np.asarray(places) - 1, series.shape[-1] - 1) @ series.T


class Grid(Struct, frozen=True, eq=False, dict=True):
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
        """Nodes: start of the grid and all points of the elements [s], shape (1 + elements * stages,)."""
        points = self.edges[:-1, None] + self.steps[:, None] * scheme(self.stages).points
        return np.append(self.edges[0], points.ravel())

    def cycled(self, times: Reals, closed: bool) -> Reals:
        """Map instants of a periodic process to the time interval of the grid.

        If the process does not jump between the end and the start of a period (`closed`), the start is mapped to the
        end. The reason is that the end is a point of the grid, but the start is not.
        """
        period = np.ptp(self.edges)
        within: Reals = self.edges[0] + np.mod(times - self.edges[0], period)
        return np.where(within - self.edges[0] <= SAME_TIME * period, self.edges[-1], within) if closed else within

    def with_start(self, values: Numbers) -> Numbers:
        """Convert values at the points, shape (points, ...), to values at the nodes by extrapolation to the start."""
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

    def rates_times(self, values: Numbers, amplitudes: tuple[Reals, Reals | None]) -> Numbers:
        """Return V' a + V'' b at all points, where V are matrices and primes are time derivatives.

        Parameters
        ----------
        values
            V at the nodes, shape (nodes, n, r).
        amplitudes
            a and b at the points, each of shape (points, r). If b is None, it is 0.

        Returns
        -------
        Shape (points, n).
        """
        method = scheme(self.stages)
        total = np.empty((len(amplitudes[0]), values.shape[1]), values.dtype)
        for part, (nodes, points) in self.parts(values[0].size):
            first_node = np.arange(len(part.steps))[:, None] * self.stages
            elements = values[nodes].swapaxes(1, 2)[first_node + np.arange(self.stages + 1)]
            weights: Any = 0.0  # factor of each node and amplitude in the sum at each point
            for order, (matrix, each) in enumerate(zip((method.first, method.second), amplitudes, strict=True), 1):
                if each is None:
                    continue
                there = each[points].reshape(len(part.steps), self.stages, 1, -1)
                weights = weights + matrix[:, :, None] * there / part.steps[:, None, None, None] ** order
            shape = len(part.steps), self.stages, -1
            own = np.ascontiguousarray(elements.reshape(len(part.steps), -1, values.shape[1])).view(float)
            total[points] = (weights.reshape(shape) @ own).view(values.dtype).reshape(-1, values.shape[1])
        return total

    def parts(self, size: int) -> Iterator[tuple[Grid, tuple[slice, slice]]]:
        """Yield batches of elements: the grid of the batch, and the slices of its nodes and points.

        The batches are so small that `size` numbers per node fit into the processor's cache.
        """
        count = max(1, MAX_CACHED_VALUES // (size * self.stages))
        for first in range(0, len(self.steps), count):
            edges = self.edges[first : first + count + 1]
            begin, end = first * self.stages, (first + len(edges) - 1) * self.stages
            yield Grid(edges, self.stages), (slice(begin, end + 1), slice(begin, end))

    def derivative(self, values: Numbers, order: int) -> Numbers:
        """Return a time derivative of values at the points, shape (points, ...), separately for each element.

        The polynomial of an element is determined only by its own points, without its start, which is a point of the
        element before. If that element is longer, its value there may be less accurate, and differentiation over a
        short element would amplify the error.
        """
        own = values.reshape(len(self.steps), self.stages, -1)
        found = (_derivative(self.stages, order) @ own) / self.steps[:, None, None] ** order
        return found.reshape(values.shape)

    def sampler(self, times: Reals) -> Callable[[Any], Any]:
        """Return a function that interpolates values at the points, shape (points, ...), to given instants.

        At the edge between two elements, the earlier element is used. The end of an element is one of its points, but
        its start is not.
        """
        just_before = times - SAME_TIME * np.ptp(self.edges)
        element = np.clip(np.searchsorted(self.edges, just_before) - 1, 0, len(self.steps) - 1)
        weights = interpolation(scheme(self.stages).points, (times - self.edges[element]) / self.steps[element])

        order = np.argsort(element, kind="stable")
        present = distinct(element)
        first = np.searchsorted(element[order], present)
        instants = np.split(order, first[1:])  # indices of instants, grouped by element to avoid copies of elements

        def sampled(values: Complexes) -> Complexes:
            elements = values.reshape(len(self.steps), self.stages, -1)
            found = np.empty((len(times), elements.shape[-1]), values.dtype)
            for number, rows in zip(present, instants, strict=True):
                found[rows] = weights[rows] @ elements[number]
            return found.reshape(len(times), *values.shape[1:])

        return sampled

    def tail(self, values: Numbers, greatest: float) -> Reals:
        """Estimate the part of values that each element does not resolve, relative to `greatest`, shape (elements,).

        The estimate is the size of the first two orders that are missing in the Legendre series. It is extrapolated:
        the size of the last two orders is multiplied by its ratio to the size of the two orders before, but at most by
        1.
        """
        elements = values.reshape(len(self.steps), self.stages, -1)
        if not greatest:
            return np.zeros(len(self.steps))
        orders = np.square(np.abs(_spectrum(self.stages) @ elements)).max(axis=-1)
        before, last = (np.sqrt(orders[:, part].sum(axis=1)) for part in (slice(-4, -2), slice(-2, None)))
        with np.errstate(invalid="ignore", divide="ignore"):
            fall = np.where(before > 0, np.minimum(last / before, 1.0), 1.0)
        return last * fall / greatest

    def smoothed(self, values: Numbers, cutoff: float) -> Numbers:
        """Remove fast components, i.e. high orders of the Legendre series of each element.

        Parameters
        ----------
        cutoff
            Cutoff frequency [rad/s]. In an element of duration h, order k has a second derivative of about
            (0.7 k^2/h)^2 times its value. Orders with 0.7 k^2/h above the cutoff are removed. The highest order is
            always removed.
        """
        elements = values.reshape(len(self.steps), self.stages, -1)
        highest = np.minimum(np.sqrt(cutoff * self.steps / 0.7), self.stages - 2).astype(int)
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
            True for a periodic solution. Otherwise y starts with the value of `values`, extrapolated to the start.
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
        """Divide each element into equal parts. Their number is in `parts`, shape (elements,)."""
        pieces = [
            start + step * np.arange(count) / count
            for start, step, count in zip(self.edges[:-1], self.steps, parts, strict=True)
        ]
        return Grid(np.append(np.concatenate(pieces), self.edges[-1]), self.stages)


def jumps(values_at: Callable[[Reals], Reals], times: Reals) -> Reals:
    """Return the instants just before jumps in values, shape (jumps,).

    At most one jump is found between two successive `times`.

    Parameters
    ----------
    values_at
        Function that returns the values at given instants, shape (instants, n).
    """
    values = values_at(times)
    scale = np.abs(values).max(axis=0, initial=0.0)
    scale[scale == 0.0] = 1.0

    def change(one: Reals, other: Reals) -> Reals:
        return np.abs((other - one) / scale).max(axis=-1, initial=0.0)

    low, high, before, after = times[:-1], times[1:], values[:-1], values[1:]
    first = change(before, after)
    for halved in range(MAX_HALVINGS + 1):
        kept = first > MIN_JUMP if not halved else change(before, after) > MIN_JUMP_SHARE.get(halved, 0.0) * first
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
    """Return the matrix that interpolates values at nodes on [0, 1] to other places, shape (places, nodes)."""
    return _values(places, np.eye(len(nodes))) @ _to_series(tuple(nodes.tolist()))


def slopes(nodes: Reals, places: Reals) -> Reals:
    """Return the matrix that maps values at nodes on [0, 1] to derivatives of their interpolation, (places, nodes)."""
    series = np.array([legendre.legder(row) for row in np.eye(len(nodes))])
    return 2.0 * _values(places, series) @ _to_series(tuple(nodes.tolist()))


@lru_cache(maxsize=32)
def _to_series(nodes: tuple[float, ...]) -> Reals:
    """Return the matrix that maps values at nodes on [0, 1] to Legendre coefficients, shape (nodes, nodes)."""
    return np.asarray(np.linalg.inv(_values(nodes, np.eye(len(nodes)))), float)


@lru_cache(maxsize=8)
def _spectrum(stages: int) -> Reals:
    """Return the matrix that maps values at the points of [0, 1] to Legendre coefficients, shape (stages, stages)."""
    return np.asarray(np.linalg.inv(_values(scheme(stages).points, np.eye(stages))), float)


@lru_cache(maxsize=8)
def _up_to(stages: int) -> Reals:
    """Return for each order k the matrix that removes orders above k from values, shape (orders, stages, stages)."""
    kept = np.tri(stages)[:, :, None] * _spectrum(stages)
    return _values(scheme(stages).points, np.eye(stages)) @ kept


@lru_cache(maxsize=8)
def _to_start(stages: int) -> Reals:
    """Return the matrix that extrapolates values at the points of [0, 1] to 0, shape (1, stages)."""
    return interpolation(scheme(stages).points, np.zeros(1))


@lru_cache(maxsize=8)
def _derivative(stages: int, order: int) -> Reals:
    """Return the matrix that maps values at the points of [0, 1] to derivatives at the same points."""
    series = np.array([legendre.legder(row, order) for row in np.eye(stages)])
    return 2.0**order * _values(scheme(stages).points, series) @ _spectrum(stages)
