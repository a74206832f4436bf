"""Responses of a link to unit loads.

At each position of the mechanism, the response of the link is a combination of these responses.
"""

from functools import lru_cache
from typing import Any

import numpy as np
from msgspec import Struct

from fem_check.solid.body import SolidLink
from fem_check.solid.outline import Powers, SolidOutline
from rigid import Reals
from rigid.arrays import Complexes


class Responses(Struct, frozen=True, eq=False):
    """Displacements of a body under unit loads, up to a rigid motion.

    The unit loads are, in this order:

    - inertia in a uniform acceleration (minus gravity) of 1 m/s^2 along x, and along y,
    - inertia in the radial acceleration -w^2 r and in the tangential acceleration eps r of a link that rotates about
    its origin, each with the factor -w^2 or eps of 1/s^2,
    - at each point: a force along x, a force along y, and a moment,
    - on each strip: an axial and a transverse force per length [N/m] that decrease linearly from 1 at the start to 0 at
    the end, the same forces increasing from 0 at the start to 1 at the end, and a free strain of 1.

    Attributes
    ----------
    body
        Finite element model of the link.
    values
        Displacements of all dofs, shape (loads, dofs).
    points
        Mean displacement of the disk at each point (complex), see `SolidLink.pin`, shape (loads, points).
    """

    body: SolidLink
    values: Reals
    points: Complexes

    @property
    def nodes(self) -> Complexes:
        """Displacements of the corners of the elements (complex), shape (loads, corners)."""
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
        Indices of the points at which reactions balance each unit load. If there are several, two of them are supports.
        A single point is also a support against rotation. The response to a combination of loads in equilibrium does
        not depend on the supports.
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
    """Return the load vectors of the four inertia loads in `Responses`, shape (4, dofs)."""
    mass = body.along(lambda strip, xi: Powers(xi, strip.mass)) * body.spread
    return np.array([body.load_vector(-mass * felt) for felt in (1.0, 1j, body.places, 1j * body.places)])


def _of_strip(body: SolidLink, k: int) -> Reals:
    """Return the load vectors of the unit loads on a strip, in the order of `Responses`, shape (5, dofs)."""
    way = body.outline.way(body.outline.strips[k])
    axis = way / abs(way)
    own = body.spread * (body.grid.strip == k)[:, None] * axis
    loads = [body.load_vector(own * part) for part in (1 - body.xi, 1j * (1 - body.xi), body.xi, 1j * body.xi)]
    return np.array((*loads, body.free_strain_load(k)))


def _supports(outline: SolidOutline, pins: list[Any], carrying: tuple[int, ...]) -> Reals:
    """Return the load vectors of unit reactions at the supports, shape (3, dofs).

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
    """Return the loads plus the reactions of the supports that balance them, shape (loads, dofs)."""
    carried = np.linalg.solve(supports @ body.rigid_motions.T, (loads @ body.rigid_motions.T).T)
    return loads - carried.T @ supports
