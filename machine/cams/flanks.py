"""Cam geometry, contact force and torque from the motion of the follower.

A cam rotates with its shaft at constant speed about a fixed centre. The follower is any link with a roller or a flat
face. The profile is the envelope of all follower positions in cam axes. Tangents and curvatures are computed from exact
velocities and accelerations, without numerical differentiation.
"""

from functools import cached_property
from typing import Any

import numpy as np
from msgspec import Struct

from rigid import Motion, acceleration_of, position_of, velocity_of
from rigid.arrays import Complex, Complexes, Flags, Real, Reals
from rigid.plane import ROUND_OFF, cross, dot

INNER, OUTER, BOTH = "inner", "outer", "both"
UNKNOWN = float("nan")
MAX_DISTANCES = 2_000_000  # largest number of distances computed at a time, chosen to limit memory use


class Cam(Struct, frozen=True, eq=False):
    """A cam and its follower.

    Attributes
    ----------
    link, drive
        Index of the link that follows the cam, and index of the drive coordinate that the cam moves.
    centre
        Centre of the camshaft in ground axes (complex) [m].
    speed
        Speed of the camshaft, positive counter-clockwise [rad/s].
    follower, points
        Name of the follower's link, and names of the roller centre or of the two points of the face.
    roller, radius
        Centre of the roller in link axes (complex) [m], or None for a flat face; radius of the roller [m], 0 for a
        knife edge.
    face
        Two points of the flat face in link axes (complex) [m], or None for a roller.
    flank
        `INNER` if the profile lies between the shaft and the follower, `OUTER` if the profile is a ring around the path
        of the roller, `BOTH` if the cam is a groove.
    width
        Contact width [m]; nan if unknown.
    modulus
        Contact modulus E* of the two materials [Pa], see `contact_modulus`; nan if unknown.
    yield_stress
        Smaller of the yield stresses of the two materials [Pa]; nan if unknown.
    """

    link: int
    drive: int
    centre: Complex
    speed: Real
    follower: str = ""
    points: tuple[str, ...] = ()
    roller: Complex | None = None
    radius: Real = 0.0
    face: tuple[Complex, Complex] | None = None
    flank: str = INNER
    width: Real = UNKNOWN
    modulus: Real = UNKNOWN
    yield_stress: Real = UNKNOWN

    @property
    def designs(self) -> tuple[int, ...]:
        """Shape to which all values except `yield_stress` broadcast: () or (designs, 1)."""
        numbers = (self.centre, self.speed, self.roller, self.radius, *(self.face or ()), self.width, self.modulus)
        return np.broadcast_shapes(*(np.shape(each) for each in numbers))

    @property
    def flanks(self) -> tuple[bool, ...]:
        """One flag for each flank of the cam: True for an outer flank, False for an inner flank."""
        return {INNER: (False,), OUTER: (True,), BOTH: (False, True)}[self.flank]


class CamFlank(Struct, frozen=True, eq=False, dict=True):
    """One flank of a cam over a motion. Vectors are complex numbers in ground axes, with shape (..., positions).

    Attributes
    ----------
    cam
        The cam.
    turn
        Unit vector of the cam's x axis. The cam axes have their origin at the shaft. At time 0, they are parallel to
        the ground axes.
    follower
        Vector from the shaft to the roller centre, or to the first point of the face [m].
    contact
        Vector from the shaft to the contact [m].
    normal
        Unit normal at the contact, pointing from the cam to the follower.
    influence
        Displacement of the roller centre, or of the face at the contact, per unit of the drive coordinate.
    pitch_curvature
        Curvature of the roller centre's path in cam axes [1/m], positive where this flank of the cam is convex; nan
        for a face.
    radius
        Radius of curvature of the cam [m], negative if concave or `undercut`.
    undercut
        True at positions where the profile would turn back on itself.
    along
        Position of the contact along a face: distance from the first point of the face [m]; nan for a roller.
    """

    cam: Cam
    turn: Complexes
    follower: Complexes
    contact: Complexes
    normal: Complexes
    influence: Complexes
    pitch_curvature: Reals
    radius: Reals
    undercut: Flags
    along: Reals

    @property
    def pitch(self) -> Complexes:
        """Path of the roller centre, or of the first point of the face, in cam axes [m]."""
        return np.asarray(self.follower * np.conj(self.turn))

    @property
    def profile(self) -> Complexes:
        """Profile in cam axes [m], one point per position."""
        return np.asarray(self.contact * np.conj(self.turn))

    @cached_property
    def lever(self) -> Reals:
        """Normal component of `influence`. It equals (torque or force of the drive) / (contact force)."""
        return np.asarray(dot(self.normal, self.influence))

    @property
    def pressure_angle(self) -> Reals:
        """Angle from -pi/2 to pi/2 between the normal and the direction in which the follower moves [rad].

        The direction comes from `influence`, because the velocity is zero in a dwell. The angle is nan if `influence`
        is zero.
        """
        across, ahead = cross(self.influence, self.normal), self.lever
        across = np.where(np.abs(across) <= ROUND_OFF * np.abs(self.influence), 0.0, across)
        angle = np.arctan2(across * np.where(ahead < 0.0, -1.0, 1.0), np.abs(ahead))
        return np.where(np.abs(self.influence) > 0.0, angle, np.nan)

    @property
    def convex_radius(self) -> Reals:
        """Radius of curvature [m] where the cam is convex, negative if undercut; infinite where the cam is concave."""
        if self.cam.roller is None:
            return self.radius
        return np.where(self.pitch_curvature > 0.0, 1.0 / self.pitch_curvature - self.cam.radius, np.inf)

    @property
    def hollow_radius(self) -> Reals:
        """Radius of curvature [m] where the cam is concave; infinite where the cam is convex or undercut."""
        return np.where((self.radius < 0.0) & ~self.undercut, -self.radius, np.inf)

    def force(self, effort: Any) -> Reals:
        """Return the normal contact force [N] equivalent to the torque or force `effort` of a drive.

        The force is negative if the cam would have to pull the follower. The force is computed from virtual work, and
        is therefore also defined at rest.
        """
        with np.errstate(divide="ignore", invalid="ignore"):
            return np.asarray(effort / self.lever)

    def torque(self, force: Any) -> Reals:
        """Return the torque [N m] of the shaft on the cam that balances a contact force, positive counter-clockwise."""
        with np.errstate(invalid="ignore"):  # no warning for an infinite force with a zero lever arm
            return np.asarray(force * cross(self.contact, self.normal))

    @property
    def relative_curvature(self) -> Reals:
        """Sum of the curvatures of cam and follower [1/m]; nan for a knife edge or an undercut cam."""
        with np.errstate(divide="ignore", invalid="ignore"):
            if self.cam.roller is None:
                sum_ = 1.0 / self.radius
            else:
                radius = np.where(np.equal(self.cam.radius, 0.0), np.nan, self.cam.radius)
                sum_ = 1.0 / (radius * (1.0 - radius * self.pitch_curvature))
        return np.where(self.undercut, np.nan, sum_)

    def preload(self, effort: Any) -> Reals:
        """Return the smallest torque or force [N m or N] with which a spring at the drive maintains contact."""
        return np.asarray(np.maximum(-np.asarray(effort) * np.sign(self.lever), 0.0))

    @property
    def face_margin(self) -> Reals:
        """Distance from the contact to the nearer end of the face [m], negative if off the face; nan for a roller."""
        if self.cam.face is None:
            return self.along
        start, end = self.cam.face
        return np.asarray(np.minimum(self.along, np.abs(end - start) - self.along))


def cam_flank(motion: Motion, cam: Cam, pace: Any = 1.0, outer: bool = False) -> CamFlank:
    """Return a flank of a cam over a motion.

    Parameters
    ----------
    pace
        (Speed of the cam in this motion) / (nominal speed `Cam.speed`). The ratio may differ between designs.
    outer
        True if the flank is that of a ring, or the outer flank of a groove.
    """
    speed = cam.speed * pace
    turn = np.exp(1j * speed * motion.time)
    with np.errstate(divide="ignore", invalid="ignore"):
        if cam.face is None:
            return _of_roller(motion, cam, speed, turn, outer)
        return _of_face(motion, cam, speed, turn)


def _of_roller(motion: Motion, cam: Cam, speed: Any, turn: Any, outer: bool) -> CamFlank:
    assert cam.roller is not None
    point = cam.link, cam.roller
    arm, moved = position_of(motion, *point) - cam.centre, velocity_of(motion, *point)
    # velocity and acceleration of the roller centre relative to the cam
    relative = moved - 1j * speed * arm
    relative_rate = acceleration_of(motion, *point) - 2j * speed * moved - speed**2 * arm
    side = np.sign(speed) * (-1.0 if outer else 1.0)
    size = np.abs(relative)
    normal = 1j * side * relative / size
    curvature = -side * cross(relative, relative_rate) / size**3
    undercut = curvature * cam.radius >= 1.0
    radius = 1.0 / curvature - cam.radius
    influence = velocity_of(motion.units[cam.drive], *point)
    none = np.full(np.shape(curvature), np.nan)
    return CamFlank(cam, turn, arm, arm - cam.radius * normal, normal, influence, curvature, radius, undercut, none)


def _of_face(motion: Motion, cam: Cam, speed: Any, turn: Any) -> CamFlank:
    """Return the contact of a flat face. The velocity of the contact relative to the cam is along the face.

    The face passes through P along the unit vector e, with the normal n = i e. Let u be the velocity of P relative to
    the cam and D the angular velocity of the face relative to the cam. The contact is then at the distance s = -n.u/D
    from P. If n points away from the cam, the radius of curvature of the cam is -v/D. Here, v is the velocity of the
    contact relative to the cam, in the direction of e.
    """
    assert cam.face is not None
    start, end = cam.face
    first = cam.link, start
    arm, moved = position_of(motion, *first) - cam.centre, velocity_of(motion, *first)
    along = motion.direction[cam.link] * ((end - start) / np.abs(end - start))
    across = 1j * along
    spin, spun = motion.angular_velocity[cam.link], motion.angular_acceleration[cam.link]
    relative, rate = moved - 1j * speed * arm, spin - speed
    normal_rate = dot(across, acceleration_of(motion, *first) - 1j * speed * moved) - spin * dot(along, relative)
    place = -dot(across, relative) / rate
    drift = -(normal_rate + place * spun) / rate
    side = np.where(dot(across, arm) < 0.0, -1.0, 1.0)
    radius = -side * (dot(along, relative) + drift) / rate
    contact = arm + place * along
    unit = motion.units[cam.drive]
    influence = velocity_of(unit, *first) + 1j * unit.angular_velocity[cam.link] * place * along
    none = np.full(np.shape(radius), np.nan)
    return CamFlank(cam, turn, arm, contact, side * across, influence, none, radius, radius < 0.0, place)


def cut_depth(flank: CamFlank) -> Reals:
    """Return the depth to which the follower cuts into each point of the profile [m]: the maximum over all positions.

    The result has the shape (positions,), because the profile has one point per position. The depth is zero if the
    follower cuts into no point of the profile at any computed position. The flank must be for a single design, over one
    turn of the cam.
    """
    profile, cam, centres = np.ravel(flank.profile), flank.cam, np.ravel(flank.pitch)
    lines = np.ravel(flank.normal * np.conj(flank.turn))
    depth, step = np.zeros(profile.shape), max(1, MAX_DISTANCES // max(1, len(centres)))
    for at in range(0, len(profile), step):
        some = profile[at : at + step, None]
        if cam.face is None:
            reach = np.abs(some - centres)
            inside = float(np.ravel(cam.radius)[0]) - reach.min(axis=1)
        else:
            inside = dot(lines, some - centres).max(axis=1)
        depth[at : at + step] = np.maximum(inside, 0.0)
    return depth
