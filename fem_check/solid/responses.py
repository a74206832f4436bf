"""Responses of a link to unit loads, which are used for all positions."""

from dataclasses import dataclass
from functools import lru_cache
from typing import Any

import numpy as np

from fem_check.solid.body import SolidLink
from fem_check.solid.outline import Powers, SolidOutline
from rigid import Reals
from rigid.arrays import Complexes


@dataclass(frozen=True, eq=False)
class Responses:
    """Displacements of a body under unit loads, up to a rigid motion.

    The unit loads are, in this order:

    - uniform acceleration minus gravity along x and y [m/s^2],
    - radial and tangential acceleration proportional to the position (-w^2 and eps) [1/s^2],
    - at each point, a force along x, a force along y, and a moment,
    - on each strip, an axial and a transverse force per length that decrease linearly from the start to zero, the same
    forces increasing from zero to the end [N/m], and a free strain.

    Attributes
    ----------
    body
        The mesh.
    values
        Displacements of all dofs, shape (loads, dofs).
    points
        Mean displacement of the pin region at each point, complex, shape (loads, points).
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
        """Return the displacements along the axis of a strip, shape (loads, stations).

        At the ends of the axis, they are the mean displacements of the pins.
        """
        own = self.body.outline.strips[strip]
        found = self.nodes[:, self.body.grid.axis[strip]]
        found[:, 0], found[:, -1] = self.points[:, own.start], self.points[:, own.end]
        return found


@lru_cache(maxsize=64)
def responses(outline: SolidOutline, carrying: tuple[int, ...], poisson: float, across: int) -> Responses:
    """Compute the responses of a link to the unit loads.

    Parameters
    ----------
    outline
        Outline of the link.
    carrying
        Points at which reactions balance each unit load. Combinations of loads that are in equilibrium do not depend on
        them. Two points act as two supports; a single one also takes a moment.
    poisson
        Poisson's ratio.
    across
        Number of elements across the depth.
    """
    body = SolidLink(outline, poisson, across)
    pins = [body.pin(point) for point in range(len(outline.points))]
    loads = np.concatenate((_distributed(body), *pins, *(_of_strip(body, k) for k in range(len(outline.strips)))))
    values = body.displaced(_balanced(body, loads, _supports(outline, pins, carrying)))
    means = np.array([[values @ pin[0] + 1j * (values @ pin[1])] for pin in pins])[:, 0]
    return Responses(body, values, means.T)


def _distributed(body: SolidLink) -> Reals:
    """Return the inertia loads -m' a of unit accelerations, shape (4, dofs)."""
    mass = body.along(lambda strip, xi: Powers(xi, strip.mass)) * body.spread
    return np.array([body.under(-mass * felt) for felt in (1.0, 1j, body.places, 1j * body.places)])


def _of_strip(body: SolidLink, k: int) -> Reals:
    """Return the loads of the axial and transverse unit loads of a strip and of its free strain, shape (5, dofs)."""
    way = body.outline.way(body.outline.strips[k])
    axis = way / abs(way)
    own = body.spread * (body.grid.strip == k)[:, None] * axis
    loads = [body.under(own * part) for part in (1 - body.xi, 1j * (1 - body.xi), body.xi, 1j * body.xi)]
    return np.array((*loads, body.strained(k)))


def _supports(outline: SolidOutline, pins: list[Any], carrying: tuple[int, ...]) -> Reals:
    """Return the load vectors of unit reactions, shape (3, dofs).

    These are two forces at the first point, and a transverse force at a second point or a moment at the first one.
    """
    first = carrying[0] if carrying else 0
    arms = [outline.points[point] - outline.points[first] for point in carrying]
    far = max(range(len(arms)), key=lambda k: abs(arms[k]), default=0)
    if not arms or arms[far] == 0:
        return np.array(pins[first])
    across = 1j * arms[far] / abs(arms[far])
    return np.array((*pins[first][:2], across.real * pins[carrying[far]][0] + across.imag * pins[carrying[far]][1]))


def _balanced(body: SolidLink, loads: Reals, supports: Reals) -> Reals:
    """Add the reactions of the supports that balance each load."""
    carried = np.linalg.solve(supports @ body.rigid.T, (loads @ body.rigid.T).T)
    return loads - carried.T @ supports
