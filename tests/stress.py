"""Mechanisms near singular positions, with their positions in any number of digits.

Close to a singular position, iterations in floats fail. These closed forms by mpmath start from the same floats as
the program.
"""

import mpmath
import numpy as np
from exact import WORKED, exact
from mechanisms import apex, bar
from mpmath import mpf

from elastic import PRIMARY, Section, deflection, sample
from rigid import Beam, Link, Lump, Mechanism, PinDrive, Slider, SliderDrive, motion

EPS = np.finfo(float).eps
GRAVITY = -9.81j
STEEL = Section(EA=1.26e7, EI=37.8)
STATIONS = np.linspace(0, 1, 5)


def number(value):
    """Convert a float or complex to mpmath without rounding."""
    value = complex(value)
    return mpmath.mpc(mpf(value.real), mpf(value.imag))


def triangle(first, second, long, short, side):
    """Return the intersection of circles about two points, left of the line between them if side is +1."""
    way = second - first
    square = way.real**2 + way.imag**2
    x = (square + long**2 - short**2) / (2 * square)
    y = mpmath.sqrt(mpmath.fabs(long**2 / square - x**2))
    return first + way * mpmath.mpc(x, side * y)


def coordinates(*links):
    """Return (x, y, angle) of links from their origins and angles."""
    rows = []
    for origin, angle in links:
        rows += [mpmath.re(origin), mpmath.im(origin), angle]
    return np.array([mpf(value) for value in rows], object)


class FourBar:
    """Crank, coupler and rocker on a base from 0 to `base`, drawn at the angle `start`."""

    def __init__(self, lengths, base, start, side=1, gravity=GRAVITY, masses=(0.47, 0.47, 0.47), origin=0.0):
        crank, coupler, rocker = lengths
        self.side = side
        ends = origin, origin + base
        A = ends[0] + crank * np.exp(1j * start)
        links = (
            Link("ground", {"O": ends[0], "D": ends[1]}),
            bar("crank", "O", "A", crank, masses[0]),
            bar("coupler", "A", "B", coupler, masses[1]),
            bar("rocker", "D", "B", rocker, masses[2]),
        )
        drawing = {"O": ends[0], "A": A, "B": apex(A, ends[1], coupler, rocker, side), "D": ends[1]}
        self.mechanism = Mechanism(links, (PinDrive("crank", "O"),), drawing, gravity=gravity)
        self.sections = [STEEL] * 3

    def at(self, drive, side=None):
        with mpmath.workdps(WORKED):
            points = [self.mechanism.links[k].points for k in range(4)]
            first, last = number(points[0]["O"]), number(points[0]["D"])
            crank, coupler, rocker = (mpf(float(points[k][name])) for k, name in ((1, "A"), (2, "B"), (3, "B")))
            angle = mpf(float(drive))
            A = first + crank * mpmath.expj(angle)
            B = triangle(A, last, coupler, rocker, self.side if side is None else side)
            return coordinates((first, angle), (A, mpmath.arg(B - A)), (last, mpmath.arg(B - last)))


class SliderCrank:
    """Crank about 0, rod, and block on the line y = `offset`; `pressed` makes the block the drive."""

    def __init__(self, crank, rod, offset, start, pressed=False):
        self.lengths, self.offset, self.pressed = (crank, rod), offset, pressed
        A = crank * np.exp(1j * start)
        B = A.real + np.sqrt(rod**2 - (A.imag - offset) ** 2) + 1j * offset
        links = (
            Link("ground", {"O": 0.0}),
            bar("crank", "O", "A", crank),
            bar("rod", "A", "B", rod, 0.4),
            Link("block", {"B": 0.0}, lumps=(Lump("B", 0.3, 0.01, 0.02j),)),
        )
        guide = Slider("guide", "block", "ground", "B", 1j * offset, 1.0)
        drive = SliderDrive("guide") if pressed else PinDrive("crank", "O")
        self.mechanism = Mechanism(links, (drive,), {"O": 0, "A": A, "B": B}, (guide,), gravity=GRAVITY)
        self.sections = [STEEL] * 2

    def at(self, drive, side=None):
        del side
        with mpmath.workdps(WORKED):
            crank, rod = (mpf(float(value)) for value in self.lengths)
            offset, given = mpf(float(self.offset)), mpf(float(drive))
            if self.pressed:
                B = mpmath.mpc(given, offset)
                A = triangle(mpmath.mpc(0), B, crank, rod, 1)
                angle = mpmath.arg(A)
            else:
                angle, A = given, crank * mpmath.expj(given)
                B = mpmath.mpc(A.real + mpmath.sqrt(rod**2 - (A.imag - offset) ** 2), offset)
            return coordinates((mpmath.mpc(0), angle), (A, mpmath.arg(B - A)), (B, 0))


class Inverted:
    """Crank about 0 with a block on its pin; the block slides on a guide that turns about `base`."""

    def __init__(self, crank, base, start):
        self.crank, self.base = crank, base
        A = crank * np.exp(1j * start)
        reach = 2 * (crank + base)
        along = (A - base) / abs(A - base)
        links = (
            Link("ground", {"O": 0.0, "D": base}),
            bar("crank", "O", "A", crank),
            bar("guide", "D", "E", reach, 0.4),
            Link("block", {"A": 0.0}, lumps=(Lump("A", 0.3, 0.01, 0.02j),)),
        )
        slide = Slider("slide", "block", "guide", "A", 0.0, 1.0)
        drawing = {"O": 0, "A": A, "D": base, "E": base + reach * along}
        self.mechanism = Mechanism(links, (PinDrive("crank", "O"),), drawing, (slide,), gravity=GRAVITY)
        self.sections = [STEEL] * 2

    def at(self, drive, side=None):
        del side
        with mpmath.workdps(WORKED):
            base, angle = mpf(float(self.base)), mpf(float(drive))
            A = mpf(float(self.crank)) * mpmath.expj(angle)
            turned = mpmath.arg(A - base)
            return coordinates((mpmath.mpc(0), angle), (mpmath.mpc(base), turned), (A, turned))


class TwoDyads:
    """Four-bar whose extended rocker drives a second dyad; `first` and `second` are the distances from full stretch."""

    def __init__(self, first, second, start=1.3):
        crank, base, coupler, over = 0.25, 0.33, 0.14, 1.4
        A = crank * np.exp(1j * start)
        rocker = abs(A - base) - coupler + first
        B = apex(A, base, coupler, rocker, 1)
        C = base + over * (B - base)
        F = C + 0.3 + 0.1j
        rod = 0.12
        swing = abs(F - C) - rod + second
        E = apex(C, F, rod, swing, 1)
        long = Link("rocker", {"D": 0.0, "B": rocker, "C": over * rocker}, (Beam("D", "B", 0.5), Beam("B", "C", 0.5)))
        links = (
            Link("ground", {"O": 0.0, "D": base, "F": F}),
            bar("crank", "O", "A", crank),
            bar("coupler", "A", "B", coupler),
            long,
            bar("rod", "C", "E", rod),
            bar("swing", "F", "E", swing),
        )
        drawing = {"O": 0, "D": base, "A": A, "B": B, "C": C, "F": F, "E": E}
        self.mechanism = Mechanism(links, (PinDrive("crank", "O"),), drawing, gravity=GRAVITY)
        self.sections = [STEEL] * 6

    def at(self, drive, side=None):
        del side
        with mpmath.workdps(WORKED):
            points = [link.points for link in self.mechanism.links]
            D, F = number(points[0]["D"]), number(points[0]["F"])
            crank, coupler, rocker, over, rod, swing = (
                mpf(float(points[k][name])) for k, name in ((1, "A"), (2, "B"), (3, "B"), (3, "C"), (4, "E"), (5, "E"))
            )
            angle = mpf(float(drive))
            A = crank * mpmath.expj(angle)
            B = triangle(A, D, coupler, rocker, 1)
            C = D + over / rocker * (B - D)
            E = triangle(C, F, rod, swing, 1)
            return coordinates(
                (mpmath.mpc(0), angle),
                (A, mpmath.arg(B - A)),
                (D, mpmath.arg(B - D)),
                (C, mpmath.arg(E - C)),
                (F, mpmath.arg(E - F)),
            )


def references(case, drive, rate, rate2, side=None):
    """Return fields at STATIONS, computed with 50 digits and rounded."""
    solved = exact(case.mechanism, case.sections, [drive], [rate], [rate2], at=case.at(drive, side))
    return {field: solved.sampled(field, STATIONS) for field in PRIMARY}


def scales(fields):
    """Return reference values of the errors: largest of N and V for forces, of u and w for displacements."""
    great = {field: np.abs(values).max() for field, values in fields.items()}
    force, size = max(great["N"], great["V"]), max(great["u"], great["w"])
    return great | {"N": force, "V": force, "u": size, "w": size}


def error(case, drive, rate=7.0, rate2=-3.0, way=(), side=None):
    """Return the largest field error in eps, and the condition numbers of fields and position.

    `way`: earlier positions of the mechanism; `side`: assembly at the position, if not as drawn.
    """
    course = motion(case.mechanism, [*way, drive], rate, rate2)
    solved = deflection(course, case.sections)
    expected = references(case, drive, rate, rate2, side)
    by = scales(expected)
    worst = max(np.abs(sample(solved, field, STATIONS)[:, -1] - expected[field]).max() / by[field] for field in PRIMARY)
    return worst / EPS, solved.condition[-1], course.condition[-1]
