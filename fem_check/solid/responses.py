"""Responses of a link to unit loads: once for every link, for all its positions."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from typing import Any

import numpy as np

from fem_check.solid.body import SolidLink
from fem_check.solid.outline import Outline, Powers
from rigid import Reals
from rigid.arrays import Complexes


@dataclass(frozen=True, eq=False)
class Responses:
    """Displacements of a body under its unit loads, but for a motion as a whole.

    The unit loads in their order: an acceleration along x and along y less gravity [m/s^2], one that grows with x along
    x and y (-w^2 and eps) [1/s^2]; on every point a force along x, along y and a moment; on every strip a force per
    length along and across it that falls from its start, and one that grows to its end [N/m], and a free strain.

    Attributes
    ----------
    body
        The mesh.
    values
        Of all dofs, shape (loads, dofs).
    points
        Mean over the region of the pin at every point, complex, shape (loads, points).
    """

    body: SolidLink
    values: Reals
    points: Complexes

    @property
    def nodes(self) -> Complexes:
        """Displacements of the corners of the elements, complex, shape (loads, corners)."""
        x, y = self.body.basis.nodal_dofs[:2]
        return self.values[:, x] + 1j * self.values[:, y]

    def on_axis(self, strip: int) -> Complexes:
        """Displacements along a strip's axis, at its ends those of the pins, complex, shape (loads, stations)."""
        own = self.body.outline.strips[strip]
        found = self.nodes[:, self.body.grid.axis[strip]]
        found[:, 0], found[:, -1] = self.points[:, own.start], self.points[:, own.end]
        return found


@lru_cache(maxsize=64)
def responses(outline: Outline, carrying: tuple[int, ...], poisson: float, across: int) -> Responses:
    """Responses of a link to its unit loads.

    Parameters
    ----------
    outline
        The link.
    carrying
        Points at which it is held: every unit load is balanced there, which loads in balance do not feel. Two of them
        share it as two supports do; a single one takes a moment.
    poisson
        Poisson's ratio.
    across
        Elements over the depth.
    """
    body = SolidLink(outline, poisson, across)
    pins = [body.pin(point) for point in range(len(outline.points))]
    loads = np.concatenate((_distributed(body), *pins, *(_of_strip(body, k) for k in range(len(outline.strips)))))
    values = body.displaced(_balanced(body, loads, _supports(outline, pins, carrying)))
    means = np.array([[values @ pin[0] + 1j * (values @ pin[1])] for pin in pins])[:, 0]
    return Responses(body, values, means.T)


def _distributed(body: SolidLink) -> Reals:
    """Inertia of unit accelerations, -m' a, shape (4, dofs)."""
    mass = body.along(lambda strip, xi: Powers(xi, strip.mass)) * body.spread
    return np.array([body.under(-mass * felt) for felt in (1.0, 1j, body.places, 1j * body.places)])


def _of_strip(body: SolidLink, k: int) -> Reals:
    """Unit loads along and across a strip, at its start and its end, and its free strain, shape (5, dofs)."""
    way = body.outline.way(body.outline.strips[k])
    axis = way / abs(way)
    own = body.spread * (body.grid.strip == k)[:, None] * axis
    loads = [body.under(own * part) for part in (1 - body.xi, 1j * (1 - body.xi), body.xi, 1j * body.xi)]
    return np.array((*loads, body.strained(k)))


def _supports(outline: Outline, pins: list[Any], carrying: tuple[int, ...]) -> Reals:
    """Loads that balance: a force at the first point, and one across at the farthest, or a moment, shape (3, dofs)."""
    first = carrying[0] if carrying else 0
    arms = [outline.points[point] - outline.points[first] for point in carrying]
    far = max(range(len(arms)), key=lambda k: abs(arms[k]), default=0)
    if not arms or arms[far] == 0:
        return np.array(pins[first])
    across = 1j * arms[far] / abs(arms[far])
    return np.array((*pins[first][:2], across.real * pins[carrying[far]][0] + across.imag * pins[carrying[far]][1]))


def _balanced(body: SolidLink, loads: Reals, supports: Reals) -> Reals:
    """Loads with the reactions of their supports, without resultant."""
    carried = np.linalg.solve(supports @ body.rigid.T, (loads @ body.rigid.T).T)
    return loads - carried.T @ supports
