"""Natural frequencies of a mechanism with locked drives by plain scikit-fem, one position at a time.

Each beam has its own mesh, with a node at each block; joints are rows of a constraint matrix. The references are
`tests/test_vibration.py` with closed forms, and `elastic.vibration` with polynomials along whole beams.
"""

import numpy as np
from fem_direct import Part, multiplied, stretching
from scipy.linalg import eigh, null_space

from fem_check.linear.solution import solved_frame
from rigid import SINGULAR

Powers = np.polynomial.polynomial.polyval


def natural_frequencies(motion, sections, elements=8, count=3, positions=None, joints=None):
    """Return the lowest natural frequencies [rad/s], shape (count, positions).

    They are nan at singular positions and with a block beyond its beam, and infinite without possible vibration.
    """
    solved = solved_frame(motion, sections, 1, joints or {})
    rows = [row for tie in solved.constraints for row in tie.rows]
    chosen = range(motion.columns[-1]) if positions is None else positions
    return np.transpose([_Place(solved.frame, sections, elements, p).frequencies(rows, count) for p in chosen])


class _VibratingPart(Part):
    """Beam with mass; an infinite rigidity excludes that deformation by constraints."""

    def rigidity(self, name):
        finite = np.isfinite(getattr(self.section, name))
        return super().rigidity(name) if finite else np.zeros(self.along.dx.shape)

    def mass(self):
        xi = np.asarray(self.along.global_coordinates())[0] / self.length
        line = self.beam.mass_per_length * Powers(xi, self.beam.mass_taper)
        turning = self.beam.rotary_inertia * Powers(xi, self.beam.rotary_taper)
        matrix = np.zeros((self.size, self.size))
        w, u = slice(0, self.across.N), slice(self.along_first, self.size)
        matrix[u, u] = multiplied.assemble(self.along, rigidity=line).toarray()
        matrix[w, w] = multiplied.assemble(self.across, rigidity=line).toarray()
        if self.shears:
            phi = slice(self.across.N, self.along_first)
            matrix[phi, phi] = multiplied.assemble(self.turned, rigidity=turning).toarray()
        else:
            matrix[w, w] += stretching.assemble(self.across, rigidity=turning).toarray()
        return matrix

    def undeformed(self):
        """Yield the constraints of infinite rigidities."""
        unit, (_, w, phi) = np.eye(self.size), self.nodal()
        if np.isinf(self.section.EA):
            yield from unit[self.along_first + 1 :] - unit[self.along_first]
        if np.isinf(self.section.EI):
            for x, own_w, own_phi in zip(self.length * self.stations[1:], w[1:], phi[1:], strict=True):
                yield unit[own_w] - unit[w[0]] - x * unit[phi[0]]
                yield unit[own_phi] - unit[phi[0]]


class _Place:
    """All bodies at one position."""

    def __init__(self, frame, sections, elements, position):
        self.frame, self.position = frame, position
        mechanism = frame.motion.mechanism
        self.parts, self.size = [], 0
        self.known = self.at(frame.motion.condition) <= SINGULAR and np.isfinite(self.spot_stations()).all()
        if not self.known:
            return
        for k, (body, (at, beam)) in enumerate(zip(frame.bodies, mechanism.beams, strict=False)):
            stations = np.linspace(0.0, 1.0, elements + 1)
            for number, xi in frame.spots[len(sections) :]:
                if number == k:
                    near = np.abs(stations - self.at(xi))[1:-1].argmin() + 1
                    stations[near if 0.0 < self.at(xi) < 1.0 else 0 if self.at(xi) == 0.0 else -1] = self.at(xi)
            self.parts.append(_VibratingPart(at, beam, abs(body.way), stations, sections[k], self.size))
            self.size += self.parts[-1].size
        self.first = [part.start for part in self.parts]
        self.first += [self.size + 3 * k for k in range(len(frame.bodies) - len(self.parts))]
        self.size += 3 * (len(frame.bodies) - len(self.parts))

    def at(self, value):
        return np.broadcast_to(value, self.frame.motion.columns)[self.position]

    def spot_stations(self):
        return np.array([self.at(xi) for _, xi in self.frame.spots])

    def moves(self, place, offset=0.0):
        """Return rows of (dx, dy, rotation), in the ground's axes, of a place or a point `offset` from it."""
        rows = np.zeros((3, self.size))
        if place is None:
            return rows
        if place.body < len(self.parts):
            part, way = self.parts[place.body], self.frame.bodies[place.body].way
            axis = self.at(self.frame.motion.direction[part.at]) * way / abs(way)
            xi = 0.0 if place.spot is None else self.at(self.frame.spots[place.spot][1])
            u, w, phi = (part.start + dofs[np.abs(part.stations - xi).argmin()] for dofs in part.nodal())
            rows[:2, u], rows[:2, w], rows[2, phi] = (axis.real, axis.imag), (-axis.imag, axis.real), 1.0
        else:
            rows[:, self.first[place.body] : self.first[place.body] + 3] = np.eye(3)
        arm = self.at(place.arm) + offset
        return rows + np.outer((-arm.imag, arm.real, 0.0), rows[2])

    def matrices(self):
        """Return stiffness and mass of all bodies."""
        stiffness, mass = np.zeros((2, self.size, self.size))
        for part in self.parts:
            own = slice(part.start, part.start + part.size)
            stiffness[own, own], mass[own, own] = part.stiffness(), part.mass()
        for at, link in enumerate(self.frame.motion.mechanism.links):
            for lump in link.lumps if at else ():
                offset = self.at(self.frame.motion.direction[at]) * lump.offset
                rows = self.moves(self.frame.place(at, lump.point), offset)
                mass += rows.T @ np.diag((lump.mass, lump.mass, lump.inertia)) @ rows
        return stiffness, mass

    def frequencies(self, constraints, count):
        """Return the lowest natural frequencies [rad/s]."""
        if not self.known:
            return np.full(count, np.nan)
        (stiffness, mass), held = self.matrices(), [np.zeros(self.size)]
        for part in self.parts:
            held += [np.pad(row, (part.start, self.size - part.start - part.size)) for row in part.undeformed()]
        for row in constraints:
            parts = [(self.moves(place), self.at(force), self.at(moment)) for place, force, moment in row.parts]
            moved = sum(force.real * x + force.imag * y + moment * turn for (x, y, turn), force, moment in parts)
            if row.compliance:
                stiffness += np.outer(moved, moved) / row.compliance
            else:
                held.append(moved)
        free = null_space(held, rcond=1e-9)
        omega = np.full(count, np.inf)
        if free.shape[1]:
            K, M = free.T @ stiffness @ free, free.T @ mass @ free
            scale = np.diagonal(K) ** -0.5
            slow = eigh(M * np.outer(scale, scale), K * np.outer(scale, scale), eigvals_only=True)[::-1][:count]
            moving = slow > 1e-13 * slow[0]
            omega[: len(slow)][moving] = slow[moving] ** -0.5
        return omega
