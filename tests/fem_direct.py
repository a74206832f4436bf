"""One position of a mechanism as one constrained finite element matrix: no superposition, no clamped beams, no scaling.

Plain scikit-fem in metres and newtons, beam by beam, with every joint as rows of a constraint matrix.
"""

from __future__ import annotations

import numpy as np
from skfem import Basis, BilinearForm, ElementLineHermite, ElementLineP2, LinearForm, MeshLine
from skfem.helpers import dd, ddot, dot, grad

from rigid import LineLoad, PinDrive, PointLoad


@BilinearForm
def bending(w, v, _):
    return ddot(dd(w), dd(v))


@BilinearForm
def stretching(u, v, _):
    return dot(grad(u), grad(v))


@LinearForm
def pushed(v, given):
    return given.q * v


class Direct:
    """Solved at one position; `found` holds the dofs beam by beam, Hermite before Lagrange, then of links without."""

    def __init__(self, motion, sections, position, elements):
        self.motion, self.mechanism, self.position = motion, motion.mechanism, position
        self.sections, self.elements = sections, elements
        self.size, self.place, self.parts, self.first = 0, {}, [], {}
        for number, (at, beam) in enumerate(self.mechanism.beams):
            self.first.setdefault(at, number)
            self._add_beam(at, beam)
        for at, link in enumerate(self.mechanism.links):
            if at and not link.beams:
                self.place[at] = np.arange(self.size, self.size + 3)
                self.size += 3
        self._assemble()
        self._solve()

    def _add_beam(self, at, beam):
        points = self.mechanism.links[at].points
        way = points[beam.end] - points[beam.start]
        mesh = MeshLine(np.linspace(0.0, abs(way), self.elements + 1))
        across, along = Basis(mesh, ElementLineHermite(), intorder=8), Basis(mesh, ElementLineP2(), intorder=8)
        self.parts.append((at, beam, across, along, self.size))
        self.size += across.N + along.N

    def axis(self, at, beam):
        points = self.mechanism.links[at].points
        way = points[beam.end] - points[beam.start]
        return complex(self.motion.direction[at, self.position]) * way / abs(way)

    def felt(self, at, local):
        """Gravity less the acceleration of a point."""
        motion, p = self.motion, self.position
        arm = complex(motion.direction[at, p]) * local
        spin, spin2 = motion.angular_velocity[at, p], motion.angular_acceleration[at, p]
        return self.mechanism.gravity - complex(motion.acceleration[at, p]) - (1j * spin2 - spin**2) * arm

    def load_on(self, number, at, beam, x):
        """Load per length in the beam's axes."""
        points = self.mechanism.links[at].points
        axis, way = self.axis(at, beam), points[beam.end] - points[beam.start]
        q = beam.mass_per_length * self.felt(at, points[beam.start] + way / abs(way) * x) / axis
        for load in self.mechanism.loads:
            if isinstance(load, LineLoad) and (self.mechanism.index[load.link], load.beam) == (
                at,
                number - self.first[at],
            ):
                value = load.start + (load.end - load.start) * x / abs(way)
                q = q + (value if load.turning else value / axis)
        return q

    def _assemble(self):
        self.matrix, self.right = np.zeros((self.size, self.size)), np.zeros(self.size)
        for number, (at, beam, across, along, start) in enumerate(self.parts):
            middle, end = start + across.N, start + across.N + along.N
            section = self.sections[number]
            self.matrix[start:middle, start:middle] = section.EI * bending.assemble(across).toarray()
            self.matrix[middle:end, middle:end] = section.EA * stretching.assemble(along).toarray()
            for basis, part, rows in ((across, np.imag, slice(start, middle)), (along, np.real, slice(middle, end))):
                q = part(self.load_on(number, at, beam, np.asarray(basis.global_coordinates())[0]))
                self.right[rows] = pushed.assemble(basis, q=q)
        for at, link in enumerate(self.mechanism.links):
            for lump in link.lumps if at else ():
                force = lump.mass * self.felt(at, link.points[lump.point] + lump.offset)
                arm = complex(self.motion.direction[at, self.position]) * lump.offset
                moment = (arm.conjugate() * force).imag - lump.inertia * self.motion.angular_acceleration[
                    at, self.position
                ]
                self.push(at, lump.point, force, moment)
        for load in self.mechanism.loads:
            if isinstance(load, PointLoad):
                at = self.mechanism.index[load.link]
                turned = complex(self.motion.direction[at, self.position]) if load.turning else 1.0
                self.push(at, load.point, load.force * turned, load.moment)

    def push(self, at, point, force, moment):
        self.right += np.array([force.real, force.imag, moment]) @ self.moves(at, point)

    def ends(self, at, point):
        """Rows of (dx, dy, rotation) of every beam end at a link's point."""
        for owner, beam, across, along, start in self.parts:
            for node, name in ((0, beam.start), (-1, beam.end)):
                if owner == at and name == point:
                    axis, rows = self.axis(at, beam), np.zeros((3, self.size))
                    w, phi = start + across.nodal_dofs[:, node]
                    u = start + across.N + along.nodal_dofs[0, node]
                    rows[0, u], rows[1, u] = axis.real, axis.imag
                    rows[0, w], rows[1, w] = -axis.imag, axis.real
                    rows[2, phi] = 1.0
                    yield rows

    def moves(self, at, point):
        """(dx, dy, rotation) of a link's point, given by name or by its arm from the link's origin."""
        if not at:
            return np.zeros((3, self.size))
        if not isinstance(point, str):
            return self.carried(at, point)
        found = next(self.ends(at, point), None)
        return self.carried(at, self.arm(at, point)) if found is None else found

    def arm(self, at, point):
        return complex(self.motion.direction[at, self.position]) * self.mechanism.links[at].points[point]

    def carried(self, at, arm):
        """A point that is no beam's end: on the root of its link."""
        if at in self.place:
            rows = np.zeros((3, self.size))
            rows[[0, 1, 2], self.place[at]] = 1.0
        else:
            root = self.parts[self.first[at]][1].start
            rows, arm = next(self.ends(at, root)).copy(), arm - self.arm(at, root)
        rows[0] -= arm.imag * rows[2]
        rows[1] += arm.real * rows[2]
        return rows

    def _conditions(self):
        mechanism, motion, p = self.mechanism, self.motion, self.position
        for at, link in enumerate(mechanism.links):
            for point in link.points:
                first, *others = [*self.ends(at, point)] or [None]
                yield from (other - first for other in others)
        for point in {name for link in mechanism.links for name in link.points}:
            first, *others = [at for at, link in enumerate(mechanism.links) if point in link.points]
            yield from ((self.moves(at, point) - self.moves(first, point))[:2] for at in others)
        guides = {}
        for slider in mechanism.sliders:
            link, owner = mechanism.index[slider.link], mechanism.index[slider.on]
            place = complex(motion.origin[link, p]) + self.arm(link, slider.point) - complex(motion.origin[owner, p])
            opened = self.moves(link, slider.point) - self.moves(owner, place)
            along = complex(motion.direction[owner, p]) * slider.direction
            guides[slider.name] = along.real * opened[:1] + along.imag * opened[1:2]
            yield along.real * opened[1:2] - along.imag * opened[:1]
            yield opened[2:]
        for drive in mechanism.drives:
            if isinstance(drive, PinDrive):
                one, other = (mechanism.index[name] for name in (drive.link, drive.on))
                yield (self.moves(one, drive.at) - self.moves(other, drive.at))[2:]
            else:
                yield guides[drive.slider]

    def _solve(self):
        rows = np.concatenate([*self._conditions()])
        weight = self.matrix.max()
        zero = np.zeros((len(rows), len(rows)))
        whole = np.block([[self.matrix, weight * rows.T], [weight * rows, zero]])
        self.found = np.linalg.solve(whole, np.concatenate((self.right, np.zeros(len(rows)))))[: self.size]

    def nodes(self, number):
        """u, w, phi of a beam at its nodes."""
        _, _, across, along, start = self.parts[number]
        own = self.found[start:]
        return own[across.N + along.nodal_dofs[0]], own[across.nodal_dofs[0]], own[across.nodal_dofs[1]]

    def between(self, number, exact_u, exact_w):
        """Root of the integrals of (u - exact)^2 and (w - exact)^2 over a beam."""
        _, _, across, along, start = self.parts[number]
        own, errors = self.found[start:], []
        for basis, values, exact in (
            (along, own[across.N : across.N + along.N], exact_u),
            (across, own[: across.N], exact_w),
        ):
            field, x = basis.interpolate(values), np.asarray(basis.global_coordinates())[0]
            errors.append(float(np.sqrt((((np.asarray(field) - exact(x)) ** 2) * basis.dx).sum())))
        return errors
