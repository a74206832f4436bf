"""One position of a mechanism as one constrained finite element matrix, without superposition or scaling.

Plain scikit-fem in metres and newtons; joints are rows of a constraint matrix. Beams with shear have separate
deflection and rotation, of degree four and three. The block of a slider is a node of its beam.
"""

import numpy as np
from skfem import Basis, BilinearForm, ElementLineHermite, ElementLineP2, ElementLinePp, LinearForm, MeshLine
from skfem.helpers import dd, ddot, dot, grad

from rigid import LineLoad, PinDrive, PointLoad, position_of


@BilinearForm
def bending(w, v, given):
    return given.rigidity * ddot(dd(w), dd(v))


@BilinearForm
def stretching(u, v, given):
    return given.rigidity * dot(grad(u), grad(v))


@BilinearForm
def multiplied(u, v, given):
    return given.rigidity * u * v


@BilinearForm
def sloping(u, v, given):
    return given.rigidity * grad(u)[0] * v


@LinearForm
def pushed(v, given):
    return given.q * v


def orders(errors):
    """Return orders of convergence for doubled numbers of elements."""
    return np.log2(np.array(errors[:-1]) / np.array(errors[1:]))


class Direct:
    """Solution at one position; `found` has the dofs of all beams, then of links without beams."""

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
        stations = np.unique([*np.linspace(0.0, 1.0, self.elements + 1), *self.blocks(at, beam)])
        part = Part(at, beam, abs(way), stations, self.sections[len(self.parts)], self.size)
        self.parts.append(part)
        self.size += part.size

    def blocks(self, at, beam):
        """Yield the stations of slider blocks on a beam."""
        points, p = self.mechanism.links[at].points, self.position
        for slider in self.mechanism.sliders:
            if self.mechanism.index[slider.on] == at:
                place = complex(position_of(self.motion, slider.link, slider.point)[p] - self.motion.origin[at, p])
                local = place / complex(self.motion.direction[at, p]) - points[beam.start]
                yield (local / (points[beam.end] - points[beam.start])).real

    def axis(self, at, beam):
        points = self.mechanism.links[at].points
        way = points[beam.end] - points[beam.start]
        return complex(self.motion.direction[at, self.position]) * way / abs(way)

    def felt(self, at, local):
        """Return gravity minus the acceleration of a point."""
        motion, p = self.motion, self.position
        arm = complex(motion.direction[at, p]) * local
        spin, spin2 = motion.angular_velocity[at, p], motion.angular_acceleration[at, p]
        return self.mechanism.gravity - complex(motion.acceleration[at, p]) - (1j * spin2 - spin**2) * arm

    def load_on(self, number, at, beam, x):
        """Return the load per length in the beam's axes."""
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
        for number, part in enumerate(self.parts):
            rows = slice(part.start, part.start + part.size)
            self.matrix[rows, rows] = part.stiffness()
            for basis, share, first in ((part.across, np.imag, 0), (part.along, np.real, part.along_first)):
                q = share(self.load_on(number, part.at, part.beam, np.asarray(basis.global_coordinates())[0]))
                self.right[part.start + first : part.start + first + basis.N] = pushed.assemble(basis, q=q)
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
        """Yield rows of (dx, dy, rotation) for each beam end at a point of a link."""
        for part in self.parts:
            for xi, name in ((0.0, part.beam.start), (1.0, part.beam.end)):
                if part.at == at and name == point:
                    yield self.rows_of(part, xi)

    def rows_of(self, part, xi):
        """Return rows of (dx, dy, rotation) for a node of a beam."""
        axis, rows = self.axis(part.at, part.beam), np.zeros((3, self.size))
        u, w, phi = (part.start + dofs[np.argmin(np.abs(part.stations - xi))] for dofs in part.nodal())
        rows[0, u], rows[1, u] = axis.real, axis.imag
        rows[0, w], rows[1, w] = -axis.imag, axis.real
        rows[2, phi] = 1.0
        return rows

    def moves(self, at, point):
        """Return rows of (dx, dy, rotation) of a link's point, given by name or by its arm from the origin."""
        if not at:
            return np.zeros((3, self.size))
        if not isinstance(point, str):
            return self.carried(at, point)
        found = next(self.ends(at, point), None)
        return self.carried(at, self.arm(at, point)) if found is None else found

    def arm(self, at, point):
        return complex(self.motion.direction[at, self.position]) * self.mechanism.links[at].points[point]

    def carried(self, at, arm):
        """Return the rows of a point without a beam end, which moves with the root of the link."""
        if at in self.place:
            rows = np.zeros((3, self.size))
            rows[[0, 1, 2], self.place[at]] = 1.0
        else:
            root = self.parts[self.first[at]].beam.start
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
            under = next((part for part in self.parts if part.at == owner), None)
            if under is None:
                under = self.moves(owner, place)
            else:
                (xi,) = self.blocks(owner, under.beam)
                under = self.rows_of(under, xi)
            opened = self.moves(link, slider.point) - under
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
        """Return u, w and phi of a beam at its equally spaced nodes."""
        part = self.parts[number]
        equal = np.linspace(0.0, 1.0, self.elements + 1)
        kept = np.array([np.argmin(np.abs(part.stations - xi)) for xi in equal])
        return tuple(self.found[part.start :][dofs[kept]] for dofs in part.nodal())

    def between(self, number, exact_u, exact_w):
        """Return the L2 errors of u and w over a beam without shear."""
        part = self.parts[number]
        own, errors = self.found[part.start :], []
        for basis, first, exact in ((part.along, part.along_first, exact_u), (part.across, 0, exact_w)):
            field, x = basis.interpolate(own[first : first + basis.N]), np.asarray(basis.global_coordinates())[0]
            errors.append(float(np.sqrt((((np.asarray(field) - exact(x)) ** 2) * basis.dx).sum())))
        return errors


class Part:
    """Elements of a beam: deflection (with slopes), then rotation if it has shear, then axial displacement."""

    def __init__(self, at, beam, length, stations, section, start):
        self.at, self.beam, self.length, self.stations = at, beam, length, stations
        self.section, self.start = section, start
        mesh = MeshLine(length * stations)
        self.shears = bool(np.isfinite(section.kGA))
        self.across = Basis(mesh, ElementLinePp(4) if self.shears else ElementLineHermite(), intorder=10)
        self.turned = self.across.with_element(ElementLinePp(3)) if self.shears else None
        self.along = Basis(mesh, ElementLineP2(), intorder=10)
        self.along_first = self.across.N + (self.turned.N if self.shears else 0)
        self.size = self.along_first + self.along.N

    def nodal(self):
        """Return the numbers of the dofs u, w and phi at the nodes."""
        along = self.along_first + self.along.nodal_dofs[0]
        if self.shears:
            return along, self.across.nodal_dofs[0], self.across.N + self.turned.nodal_dofs[0]
        return along, *self.across.nodal_dofs

    def rigidity(self, name):
        taper = getattr(self.section.taper, name) if self.section.taper else (1.0,)
        xi = np.asarray(self.along.global_coordinates())[0] / self.length
        return getattr(self.section, name) * np.polynomial.polynomial.polyval(xi, taper)

    def stiffness(self):
        matrix = np.zeros((self.size, self.size))
        w, u = slice(0, self.across.N), slice(self.along_first, self.size)
        matrix[u, u] = stretching.assemble(self.along, rigidity=self.rigidity("EA")).toarray()
        if not self.shears:
            matrix[w, w] = bending.assemble(self.across, rigidity=self.rigidity("EI")).toarray()
            return matrix
        phi, kGA = slice(self.across.N, self.along_first), self.rigidity("kGA")
        matrix[w, w] = stretching.assemble(self.across, rigidity=kGA).toarray()
        matrix[phi, w] = -sloping.assemble(self.across, self.turned, rigidity=kGA).toarray()
        matrix[w, phi] = matrix[phi, w].T
        matrix[phi, phi] = stretching.assemble(self.turned, rigidity=self.rigidity("EI")).toarray()
        matrix[phi, phi] += multiplied.assemble(self.turned, rigidity=kGA).toarray()
        return matrix
