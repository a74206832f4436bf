"""Mechanisms solved by an independent method in any number of digits.

Each link has three coordinates, each joint two equations. Newton's method solves all positions at once; velocities
and accelerations use the same matrix. One linear system gives end displacements and end forces of all beams, with
joint forces as multipliers. There are no loops, dyads, trees or clamped beams, so no derivation is shared with the
program.
"""

import cmath
from dataclasses import dataclass

import mpmath
import numpy as np
from mpmath import mpf

from rigid import LineLoad, PinDrive, PointLoad

SOLVED = 50
WORKED = 110
NUDGE = 30


def cross(a, b):
    """Return the vector product of pairs (x, y); complex numbers are used for differentiation."""
    return a[0] * b[1] - a[1] * b[0]


@dataclass(eq=False)
class Equations:
    """Constraint equations of a mechanism over (x, y, angle) of its moving links.

    `lib` is cmath for floats, or mpmath for more digits.
    """

    mechanism: object
    lib: object

    def __post_init__(self):
        self.pins = []
        where = {}
        for at, link in enumerate(self.mechanism.links):
            for point in link.points:
                where.setdefault(point, []).append(at)
        for point, ends in where.items():
            self.pins += [(point, ends[0], other) for other in ends[1:]]

    def number(self, value):
        return mpf(float(value)) if self.lib is mpmath else float(value)

    def pair(self, value):
        value = complex(value)
        return self.number(value.real), self.number(value.imag)

    def turned(self, q, at, local):
        """Rotate a vector from a link's axes to the ground's."""
        x, y = self.pair(local)
        if at == 0:
            return x, y
        c, s = self.lib.cos(q[3 * at - 1]), self.lib.sin(q[3 * at - 1])
        return c * x - s * y, s * x + c * y

    def place(self, q, at, local):
        x, y = self.turned(q, at, local)
        return (x, y) if at == 0 else (q[3 * at - 3] + x, q[3 * at - 2] + y)

    def angle(self, q, at):
        return 0 if at == 0 else q[3 * at - 1]

    def slid(self, q, slider):
        """Return the direction of a slider's line, and the vector from its origin to the sliding point."""
        on, link = self.mechanism.index[slider.on], self.mechanism.index[slider.link]
        origin = self.place(q, on, slider.origin)
        tip = self.place(q, link, self.mechanism.links[link].points[slider.point])
        return self.turned(q, on, slider.direction), (tip[0] - origin[0], tip[1] - origin[1])

    def values(self, q, drive):
        """Return the residuals, zero if all joints are closed and all drives have their coordinates."""
        rows = []
        index = self.mechanism.index
        for point, one, other in self.pins:
            a, b = (self.place(q, at, self.mechanism.links[at].points[point]) for at in (one, other))
            rows += [b[0] - a[0], b[1] - a[1]]
        for slider in self.mechanism.sliders:
            along, way = self.slid(q, slider)
            x, y = self.pair(slider.turn)
            fixed = mpmath.atan2(y, x) if self.lib is mpmath else np.arctan2(y, x)
            rows += [self.angle(q, index[slider.link]) - self.angle(q, index[slider.on]) - fixed, cross(along, way)]
        for number, mover in enumerate(self.mechanism.drives):
            if isinstance(mover, PinDrive):
                rows.append(self.angle(q, index[mover.link]) - self.angle(q, index[mover.on]) - drive[number])
            else:
                slider = next(slider for slider in self.mechanism.sliders if slider.name == mover.slider)
                along, way = self.slid(q, slider)
                rows.append(along[0] * way[0] + along[1] * way[1] - drive[number])
        return np.array(rows, object)

    def matrix(self, q, drive):
        """Return the Jacobian, exact by a complex step below the last digit."""
        step = self.number(10.0**-(NUDGE)) if self.lib is cmath else mpf(10) ** -(2 * WORKED)
        columns = []
        for k in range(len(q)):
            nudged = list(q)
            nudged[k] = nudged[k] + (step * 1j if self.lib is cmath else mpmath.mpc(0, step))
            columns.append(
                [
                    mpmath.im(v) / step if self.lib is mpmath else complex(v).imag / step
                    for v in self.values(nudged, drive)
                ]
            )
        return np.array(columns, object).T

    def bending(self, q, rate, drive):
        """Return the second time derivative of the residuals at constant rates."""
        step = mpf(10) ** -NUDGE
        ahead, here, behind = (
            self.values([a + sign * step * b for a, b in zip(q, rate, strict=True)], drive) for sign in (1, 0, -1)
        )
        return (ahead - 2 * here + behind) / step**2


def solve(matrix, right):
    """Solve a linear system by Gaussian elimination with pivoting, for any number type."""
    table = np.concatenate([matrix, np.reshape(right, (len(matrix), -1))], axis=1).astype(object)
    n = len(table)
    for k in range(n):
        best = k + max(range(n - k), key=lambda i: abs(table[k + i, k]))
        table[[k, best]] = table[[best, k]]
        below = [i for i in range(k + 1, n) if table[i, k] != 0]
        live = np.flatnonzero(table[k] != 0)
        factors = table[below, k] / table[k, k]
        table[np.ix_(below, live)] -= np.outer(factors, table[k, live])
    result = np.zeros((n, table.shape[1] - n), object)
    for k in range(n - 1, -1, -1):
        result[k] = (table[k, n:] - table[k, k + 1 : n] @ result[k + 1 :]) / table[k, k]
    return result[:, 0] if np.ndim(right) == 1 else result


def drawn(mechanism):
    """Return coordinates of links and drives close to the drawing."""
    equations = Equations(mechanism, cmath)
    q = []
    angles = {0: 0.0}
    for at, link in enumerate(mechanism.links[1:], 1):
        seen = [point for point in link.points if point in mechanism.drawing]
        if len(seen) > 1:
            way = mechanism.drawing[seen[1]] - mechanism.drawing[seen[0]]
            angles[at] = float(np.angle(way / (link.points[seen[1]] - link.points[seen[0]])))
    for _ in mechanism.sliders:
        for slider in mechanism.sliders:
            on, link, fixed = mechanism.index[slider.on], mechanism.index[slider.link], float(np.angle(slider.turn))
            if on in angles:
                angles.setdefault(link, angles[on] + fixed)
            elif link in angles:
                angles[on] = angles[link] - fixed
    for at, link in enumerate(mechanism.links[1:], 1):
        spot = next(point for point in link.points if point in mechanism.drawing)
        origin = mechanism.drawing[spot] - np.exp(1j * angles.setdefault(at, 0.0)) * link.points[spot]
        q += [origin.real, origin.imag, angles[at]]
    drives = equations.values(q, [0.0] * len(mechanism.drives))[len(q) - len(mechanism.drives) :]
    return q, [complex(value).real for value in drives]


def positions(mechanism, drive, steps=60):
    """Return the coordinates for one setting of the drives, tracked from the drawing on the shortest path."""
    q, start = drawn(mechanism)
    target = [
        a + (b - a + np.pi) % (2 * np.pi) - np.pi if isinstance(mover, PinDrive) else b
        for a, b, mover in zip(start, drive, mechanism.drives, strict=True)
    ]
    coarse = Equations(mechanism, cmath)
    q = np.array(q, float)
    for part in np.linspace(0, 1, steps):
        here = [a + part * (b - a) for a, b in zip(start, target, strict=True)]
        for _ in range(30):
            value, matrix = coarse.values(q, here), coarse.matrix(q, here)
            step = np.linalg.solve(matrix.astype(float), np.real(value.astype(complex)))
            q = q - step
            if np.abs(step).max() < 1e-12:
                break
    fine = Equations(mechanism, mpmath)
    q = np.array([mpf(value) for value in q], object)
    # whole turns do not matter: the residual is periodic
    goal = [mpf(float(b)) for b in drive]
    turns = [round((b - a) / (2 * np.pi)) for a, b in zip(target, drive, strict=True)]
    for k, mover in enumerate(mechanism.drives):
        if isinstance(mover, PinDrive):
            goal[k] = goal[k] - 2 * mpmath.pi * turns[k]
    for _ in range(6):
        q = q - solve(fine.matrix(q, goal), fine.values(q, goal))
    return q, goal


@dataclass(eq=False)
class Exact:
    """All results at one position: mpmath numbers, beams in the program's order.

    `fields` maps a field to a list over beams of pieces: start xi, end xi, and coefficients in powers of the local
    coordinate. `pulls` are the joint forces on the second link of each pin, `ground` the force and moment on the
    ground.
    """

    q: np.ndarray
    rate: np.ndarray
    rate2: np.ndarray
    fields: dict
    pulls: list
    effort: list

    def sampled(self, field, stations):
        return np.array(
            [
                [float(self.at(field, beam, mpf(float(xi)))) for xi in stations]
                for beam in range(len(self.fields[field]))
            ]
        )

    def at(self, field, beam, xi):
        """Return a field at one station of a beam, from the piece at that station."""
        low, high, values = next(piece for piece in self.fields[field][beam] if piece[0] <= xi <= piece[1])
        part = (xi - low) / (high - low)
        return sum(value * part**k for k, value in enumerate(values))


def exact(mechanism, sections, drive, drive_rate, drive_rate2, at=None):
    """Return motion, forces and deflections at one position; `at` gives its coordinates if known exactly."""
    with mpmath.workdps(WORKED):
        q, goal = positions(mechanism, drive) if at is None else (at, [mpf(float(value)) for value in drive])
        equations = Equations(mechanism, mpmath)
        matrix = equations.matrix(q, goal)
        speed = np.array([mpf(0)] * len(q), object)
        speed[len(q) - len(goal) :] = [mpf(float(value)) for value in drive_rate]
        rate = solve(matrix, speed)
        push = -equations.bending(q, rate, goal)
        push[len(q) - len(goal) :] += np.array([mpf(float(value)) for value in drive_rate2], object)
        rate2 = solve(matrix, push)
    with mpmath.workdps(SOLVED):
        return _Structure(equations, sections, q, goal, rate, rate2).solved()


class _Structure:
    """The linear system of one position, with node displacements, start states of beams, and multipliers."""

    def __init__(self, equations, sections, q, goal, rate, rate2):
        self.equations, self.mechanism = equations, equations.mechanism
        self.sections, self.q, self.goal, self.rate, self.rate2 = sections, q, goal, rate, rate2
        self.nodes = {}
        for at, link in enumerate(self.mechanism.links[1:], 1):
            ends = [point for beam in link.beams for point in (beam.start, beam.end)]
            for point in dict.fromkeys(ends or [next(iter(link.points))]):
                self.nodes[at, point] = len(self.nodes)
        self.beams = self.mechanism.beams
        self.segments = [
            (number, mpf(0), mpf(1), at, beam.start, beam.end) for number, (at, beam) in enumerate(self.beams)
        ]
        for slider in self.mechanism.sliders:
            self.split(slider)
        joints = 2 * len(equations.pins) + 2 * len(self.mechanism.sliders) + len(goal)
        self.first = 3 * len(self.nodes)
        self.joint = self.first + 6 * len(self.segments)
        size = self.joint + joints
        self.table = np.full((size, size), mpf(0), object)
        self.right = np.full(size, mpf(0), object)

    def split(self, slider):
        """Add a node under a slider's block on a beam of the line's owner."""
        on, link = self.mechanism.index[slider.on], self.mechanism.index[slider.link]
        if on == 0 or not self.mechanism.links[on].beams:
            return
        tip = self.equations.place(self.q, link, self.mechanism.links[link].points[slider.point])
        for place, (number, low, high, at, start, end) in enumerate(self.segments):
            root = self.equations.place(self.q, at, self.mechanism.links[at].points[self.beams[number][1].start])
            axis, length = self.axis(number), self.length(number)
            off = tip[0] - root[0], tip[1] - root[1]
            xi = (axis[0] * off[0] + axis[1] * off[1]) / length
            if at == on and abs(cross(axis, off)) < mpf(10) ** -14 and low < xi < high:
                self.nodes[on, slider.name] = len(self.nodes)
                self.segments[place] = (number, low, xi, at, start, slider.name)
                self.segments.append((number, xi, high, at, slider.name, end))
                return
        raise AssertionError(f"{slider.name} is on no beam")

    def felt(self, at, local):
        """Return the acceleration of a link's point minus gravity."""
        x, y = self.equations.turned(self.q, at, local)
        ax, ay, spin = self.rate2[3 * at - 3 : 3 * at]
        w = self.rate[3 * at - 1]
        gx, gy = self.equations.pair(self.mechanism.gravity)
        return ax - spin * y - w * w * x - gx, ay + spin * x - w * w * y - gy

    def grip(self, at, point):
        """Return the node that moves a link's point, and the arm from it."""
        link = self.mechanism.links[at]
        if (at, point) in self.nodes:
            return self.nodes[at, point], (mpf(0), mpf(0))
        base = link.beams[0].start if link.beams else next(iter(link.points))
        return self.nodes[at, base], self.equations.turned(self.q, at, link.points[point] - link.points[base])

    def load(self, at, point, force, moment):
        """Add a force and a moment on a link's point."""
        node, arm = self.grip(at, point)
        for row, value in enumerate((*force, moment + cross(arm, force))):
            self.right[3 * node + row] -= value

    def solved(self):
        self.point_loads()
        states = [self.beam(place) for place in range(len(self.segments))]
        self.joints()
        x = solve(self.table, self.right)
        fields = {name: [[] for _ in self.beams] for name in ("u", "w", "phi", "N", "V", "M")}
        for place, state in enumerate(states):
            start = x[self.first + 6 * place : self.first + 6 * place + 6]
            number, low, high = self.segments[place][:3]
            for name, rows in state.items():
                values = [sum(a * b for a, b in zip(row, [*start, 1], strict=True)) for row in rows]
                fields[name][number].append((low, high, values))
        pulls = [x[self.joint + 2 * k : self.joint + 2 * k + 2] for k in range(len(self.equations.pins))]
        return Exact(self.q, self.rate, self.rate2, fields, pulls, list(x[len(x) - len(self.goal) :]))

    def point_loads(self):
        for at, link in enumerate(self.mechanism.links[1:], 1):
            for lump in link.lumps:
                mass, inertia = mpf(float(lump.mass)), mpf(float(lump.inertia))
                felt = self.felt(at, link.points[lump.point] + lump.offset)
                force = -mass * felt[0], -mass * felt[1]
                arm = self.equations.turned(self.q, at, lump.offset)
                self.load(at, lump.point, force, cross(arm, force) - inertia * self.rate2[3 * at - 1])
        for load in self.mechanism.loads:
            if isinstance(load, PointLoad):
                at = self.mechanism.index[load.link]
                force = self.equations.turned(self.q, at if load.turning else 0, load.force)
                self.load(at, load.point, force, mpf(float(load.moment)))

    def line_loads(self, number):
        """Return axial and transverse loads of a beam at its start, and their change to its end."""
        at, beam = self.beams[number]
        link = self.mechanism.links[at]
        start, end = link.points[beam.start], link.points[beam.end]
        axis = self.axis(number)
        mass = mpf(float(beam.mass_per_length))
        ends = []
        for local in (start, end):
            felt = self.felt(at, local)
            ends.append([-mass * felt[0], -mass * felt[1]])
        for load in self.mechanism.loads:
            if isinstance(load, LineLoad) and load.link == link.name and link.beams[load.beam] is beam:
                for k, value in enumerate((load.start, load.end)):
                    x, y = self.equations.pair(value)
                    if load.turning:
                        x, y = axis[0] * x - axis[1] * y, axis[1] * x + axis[0] * y
                    ends[k][0] += x
                    ends[k][1] += y
        own = [(axis[0] * x + axis[1] * y, axis[0] * y - axis[1] * x) for x, y in ends]
        return own[0], (own[1][0] - own[0][0], own[1][1] - own[0][1])

    def length(self, number):
        at, beam = self.beams[number]
        x, y = self.equations.pair(
            self.mechanism.links[at].points[beam.end] - self.mechanism.links[at].points[beam.start]
        )
        return mpmath.sqrt(x * x + y * y)

    def axis(self, number):
        at, beam = self.beams[number]
        link = self.mechanism.links[at]
        x, y = self.equations.turned(self.q, at, link.points[beam.end] - link.points[beam.start])
        return x / self.length(number), y / self.length(number)

    def beam(self, place):
        """Return the fields of a piece by its start state (u, w, phi, N, V, M, 1), and its equations at both ends."""
        number, low, high, at, start, end = self.segments[place]
        section = self.sections[number]
        L, (c, s) = self.length(number) * (high - low), self.axis(number)
        stretch, bend, shear = (
            1 / mpf(float(v)) if np.isfinite(v) else mpf(0) for v in (section.EA, section.EI, section.kGA)
        )
        (qx, qy), (gx, gy) = self.line_loads(number)
        qx, qy, gx, gy = qx + low * gx, qy + low * gy, (high - low) * gx, (high - low) * gy
        u, w, phi, N, V, M, known = np.eye(7, dtype=object)
        free = mpf(float(section.strain)) * L * known
        slid = [0 * w, -shear * L * V, -shear * L**2 * qy / 2 * known, -shear * L**2 * gy / 6 * known]
        bent = [w, L * phi, bend * L**2 * M / 2, bend * L**3 * V / 6]
        turned = bend * L**3 * qy / 6 * known
        fields = {
            "N": [N, -L * qx * known, -L * gx / 2 * known],
            "V": [V, L * qy * known, L * gy / 2 * known],
            "M": [M, L * V, L**2 * qy / 2 * known, L**2 * gy / 6 * known],
            "u": [u, stretch * L * N + free, -stretch * L**2 * qx / 2 * known, -stretch * L**2 * gx / 6 * known],
            "phi": [phi, bend * L * M, bend * L**2 * V / 2, turned, bend * L**3 * gy / 24 * known],
            "w": [*np.add(bent, slid), bend * L**4 * qy / 24 * known, bend * L**4 * gy / 120 * known],
        }
        first = self.first + 6 * place
        for far, (point, sign) in enumerate(((start, 1), (end, -1))):
            node = self.nodes[at, point]
            state = {name: sum(rows[1:], rows[0]) if far else rows[0] for name, rows in fields.items()}
            # the end of the piece moves with its node
            moved = (("u", (c, s, 0)), ("w", (-s, c, 0)), ("phi", (0, 0, 1)))
            for k, (name, weights) in enumerate(moved):
                row = first + 3 * far + k
                self.table[row, first : first + 6] += state[name][:6]
                self.right[row] -= state[name][6]
                self.table[row, 3 * node : 3 * node + 3] -= np.array(weights, object)
            # force on the node: beyond a cut N acts along the beam, -V across, with the moment M
            pulls = (c * state["N"] + s * state["V"], s * state["N"] - c * state["V"], state["M"])
            for k, pull in enumerate(pulls):
                self.table[3 * node + k, first : first + 6] += sign * pull[:6]
                self.right[3 * node + k] -= sign * pull[6]
        return fields

    def tie(self, row, at, point, arm, weights):
        """Add a link's point, with an arm, to a displacement equation, and its multiplier to equilibrium."""
        if at == 0:
            return
        node, reach = self.grip(at, point)
        reach = reach[0] + arm[0], reach[1] + arm[1]
        x, y, turn = weights
        whole = np.array((x, y, turn + reach[0] * y - reach[1] * x), object)
        self.table[row, 3 * node : 3 * node + 3] += whole
        self.table[3 * node : 3 * node + 3, row] += whole

    def joints(self):
        index, none, row = self.mechanism.index, (mpf(0), mpf(0)), self.joint
        for point, one, other in self.equations.pins:
            for weights in ((mpf(1), mpf(0), mpf(0)), (mpf(0), mpf(1), mpf(0))):
                self.tie(row, other, point, none, weights)
                self.tie(row, one, point, none, tuple(-v for v in weights))
                row += 1
        for slider in self.mechanism.sliders:
            along, _ = self.equations.slid(self.q, slider)
            for weights in ((mpf(0), mpf(0), mpf(1)), (-along[1], along[0], mpf(0))):
                self.tie_slider(row, slider, weights)
                row += 1
        for mover in self.mechanism.drives:
            if isinstance(mover, PinDrive):
                self.tie(row, index[mover.link], mover.at, none, (mpf(0), mpf(0), mpf(1)))
                self.tie(row, index[mover.on], mover.at, none, (mpf(0), mpf(0), mpf(-1)))
            else:
                slider = next(slider for slider in self.mechanism.sliders if slider.name == mover.slider)
                along, _ = self.equations.slid(self.q, slider)
                self.tie_slider(row, slider, (along[0], along[1], mpf(0)))
            row += 1

    def tie_slider(self, row, slider, weights):
        """Return the sliding point, and the point under it on the owner: a node of its beam, or a rigid arm."""
        on, link = self.mechanism.index[slider.on], self.mechanism.index[slider.link]
        self.tie(row, link, slider.point, (mpf(0), mpf(0)), weights)
        if (on, slider.name) in self.nodes:
            self.tie(row, on, slider.name, (mpf(0), mpf(0)), tuple(-v for v in weights))
        elif on:
            base = next(iter(self.mechanism.links[on].points))
            tip = self.equations.place(self.q, link, self.mechanism.links[link].points[slider.point])
            root = self.equations.place(self.q, on, self.mechanism.links[on].points[base])
            arm = tip[0] - root[0], tip[1] - root[1]
            _, reach = self.grip(on, base)
            arm = arm[0] - reach[0], arm[1] - reach[1]
            self.tie(row, on, base, arm, tuple(-v for v in weights))
