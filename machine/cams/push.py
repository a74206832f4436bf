"""Contact between cam and follower: forces that replace drive efforts, and Hertz pressure."""

from collections.abc import Callable, Iterable, Iterator, Sequence
from functools import lru_cache
from typing import Any

import numpy as np
from msgspec import Struct
from msgspec.structs import replace

from machine.cams.flanks import Cam, CamFlank, cam_flank
from machine.ranges import Range
from rigid import Mechanism, Motion, with_rates
from rigid.arrays import Flags, Real, Reals
from rigid.kinematics import by_laws
from rigid.kinetostatics import link_loads
from rigid.plane import cross, dot

# the forces of n cams count as undetermined if |det L| <= MIN_DETERMINANT * (largest |element of L|)^n, where L is the
# matrix of the values of `_lever` for all pairs of a drive and a cam
MIN_DETERMINANT = 1e-12
HERTZ_RANGE = Range(
    "pressure of a cam", "pressure over yield stress", "Johnson, Contact Mechanics 1985, equation (6.4)", most=1.67,
    outside="the softer body yields below its surface: use a harder material or a wider contact",
)  # fmt: skip
"""Hertz pressure / yield stress for which the contact is elastic."""


class CamPush(Struct, frozen=True, eq=False):
    """Load on the followers of cams: contact forces replace the efforts of the drives that the cams move.

    The opposite forces act on the ground, which carries the camshafts.

    At a position with a zero lever, a contact force cannot replace the effort of a drive. The contact force is then 0,
    and the drive keeps its effort.

    Attributes
    ----------
    cams
        The cams with contact forces.
    laws
        Motion laws of all drives: functions of time that return coordinate, rate and acceleration. The contact normals
        are computed from the rates that these laws return, and are therefore also known for a mechanism at rest.
    ground
        Name of the ground, and name of one of its points.
    names
        Names of the cams.
    differ
        Zeros of shape (designs, 1) if the cams differ between designs, otherwise 0. The mechanism reads the number of
        designs from this shape.
    """

    cams: tuple[Cam, ...]
    laws: tuple[Callable[[Any], tuple[Reals, Reals, Reals]], ...]
    ground: tuple[str, str]
    names: tuple[str, ...] = ()
    differ: Real = 0.0

    @property
    def points(self) -> Iterable[tuple[str, str]]:
        """Points of application (link, point): the roller centre, or both ends of a face, and a ground point."""
        return [*((cam.follower, point) for cam in self.cams for point in cam.points), self.ground]

    def forces(self, motion: Motion) -> Iterator[tuple[str, str, Any, Any]]:
        """Yield link, point, force and moment of each contact force on a follower and on the ground, in ground axes.

        The two points of a face share the contact force.
        """
        flanks = self._flanks(motion)
        base = motion.mechanism.links[0].points[self.ground[1]]
        for cam, flank, force in zip(self.cams, flanks, self._pressing(motion, flanks), strict=True):
            push = force * flank.normal
            yield *self.ground, -push, -cross(cam.centre + _contact(flank) - base, push)
            if cam.face is None:
                yield cam.follower, cam.points[0], push, 0.0
                continue
            share = flank.along / np.abs(cam.face[1] - cam.face[0])
            for point, part in zip(cam.points, (1.0 - share, share), strict=True):
                yield cam.follower, point, np.where(force == 0.0, 0.0, part * push), 0.0

    def pressing(self, motion: Motion) -> Reals:
        """Return the contact forces on the followers [N], shape (cams, ..., positions)."""
        return self._pressing(motion, self._flanks(motion))

    def _flanks(self, motion: Motion) -> list[CamFlank]:
        _, rates, accelerations = by_laws(self.laws, motion.time)
        passed = with_rates(motion, rates, accelerations)
        return [cam_flank(passed, cam, outer=cam.flanks[0]) for cam in self.cams]

    def _pressing(self, motion: Motion, flanks: Sequence[CamFlank]) -> Reals:
        """Return the contact forces [N] that replace the efforts of the drives moved by cams, from virtual work."""
        mechanism = _without(motion.mechanism, self)
        loads = link_loads(replace(motion, mechanism=mechanism))
        units = [motion.units[cam.drive] for cam in self.cams]
        efforts = np.array([-_work(unit, *loads) for unit in units])
        levers = np.array(
            [[np.broadcast_to(_lever(unit, flank), motion.columns) for flank in flanks] for unit in units]
        )
        with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
            forces = efforts / levers[0] if len(self.cams) == 1 else _solved(levers, efforts)
        return np.where(np.isfinite(forces), forces, 0.0)


def _lever(unit: Motion, flank: CamFlank) -> Any:
    """Return the drive effort that replaces a contact force of 1 N."""
    cam = flank.cam
    velocity = unit.velocity[cam.link] + 1j * unit.angular_velocity[cam.link] * (
        _contact(flank) + cam.centre - unit.origin[cam.link]
    )
    return dot(flank.normal, velocity)


def _contact(flank: CamFlank) -> Any:
    """Return a point on the line of the contact force, relative to the camshaft: the roller centre or the contact."""
    return flank.follower if flank.cam.face is None else flank.contact


def _solved(levers: Reals, efforts: Reals) -> Reals:
    """Return the contact forces of several cams [N], shape (cams, ..., positions); 0 where they are undetermined."""
    matrices, sides = np.moveaxis(levers, (0, 1), (-2, -1)), np.moveaxis(efforts, 0, -1)[..., None]
    known: Any = np.isfinite(matrices).all(axis=(-2, -1)) & np.isfinite(sides[..., 0]).all(axis=-1)
    sizes = np.abs(matrices).max(axis=(-2, -1), initial=0.0) ** len(levers)
    unlike = np.abs(np.linalg.det(np.where(known[..., None, None], matrices, 0.0))) > MIN_DETERMINANT * sizes
    fine: Flags = np.asarray(known & unlike)[..., None, None]
    solved = np.linalg.solve(np.where(fine, matrices, np.eye(len(levers))), np.where(fine, sides, 0.0))
    return np.moveaxis(solved[..., 0], -1, 0)


def _work(unit: Motion, force: Sequence[Any], moment: Sequence[Any]) -> Any:
    """Return the virtual work of forces and moments at the link origins, shape (..., positions)."""
    whole: Any = np.zeros(unit.columns)
    for at, (pull, couple) in enumerate(zip(force, moment, strict=True)):
        if at:
            whole = whole + dot(np.asarray(pull), unit.velocity[at]) + np.asarray(couple) * unit.angular_velocity[at]
    return whole


@lru_cache(maxsize=8)
def _without(mechanism: Mechanism, push: CamPush) -> Mechanism:
    """Return the mechanism without the load `push`, the contact forces of cams."""
    return replace(mechanism, loads=tuple(load for load in mechanism.loads if load is not push))


def contact_modulus(first: Real, first_poisson: Real, second: Real, second_poisson: Real) -> Real:
    """Return the contact modulus E* of two materials [Pa]: 1/E* = (1 - nu_1^2)/E_1 + (1 - nu_2^2)/E_2."""
    return 1.0 / ((1.0 - first_poisson**2) / first + (1.0 - second_poisson**2) / second)


def line_pressure(force: Any, width: Any, curvature: Any, modulus: Any) -> Reals:
    """Return the largest pressure between two cylinders [Pa], in the shape of `force`; nan if `force` is tensile.

    Parameters
    ----------
    force
        Compressive force [N].
    width
        Length of the contact line [m].
    curvature
        Sum of the curvatures of both surfaces [1/m]. The curvature of a concave surface is negative.
    modulus
        Contact modulus E* [Pa], see `contact_modulus`.

    References
    ----------
    K. L. Johnson, Contact Mechanics, Cambridge University Press 1985, equation (4.45). Range: `HERTZ_RANGE`.

    Examples
    --------
    A cylinder lies on a plane of the same material with Poisson's ratio 0.3. Roark's Formulas give the coefficient
    0.591:

    >>> modulus = contact_modulus(1.0, 0.3, 1.0, 0.3)
    >>> round(float(line_pressure(1.0, 1.0, 2.0, modulus)), 3)
    0.591
    """
    with np.errstate(invalid="ignore", divide="ignore"):
        inside = np.asarray(force) / width * modulus * curvature / np.pi
        return np.where(inside >= 0.0, np.sqrt(np.maximum(inside, 0.0)), np.nan)
