"""Tracking of the posture of a mechanism as its drives move, by Newton's method for the constraints of all joints.

A posture consists of the positions and angles of all links.
"""

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any

import numpy as np

from rigid.arrays import Complexes, Reals
from rigid.constants import mass_constants
from rigid.dynamics.constraints import (
    Constraints,
    centripetal,
    constraint_matrix,
    constraint_table,
    constraints_at,
    independent_rows,
    unwound_angles,
)
from rigid.kinematics import Motion, motion
from rigid.kinetostatics.loads import given_loads
from rigid.mechanism import Mechanism
from rigid.parts import MechanismError
from rigid.plane import cross, dot
from rigid.postures import Posture

MAX_STEPS = 25  # maximum number of Newton steps
TOLERANCE = 1e-15  # tolerance of Newton's method: of positions relative to the mechanism size, and of angles in rad
MAX_STEP = 0.25  # largest predicted movement in one step, relative to the mechanism size or in rad
MAX_PIECES = 1024  # maximum number of steps into which one change in the drive coordinates is divided
MAX_ERROR_RATIO = 0.05  # factorise the matrix again if an iteration leaves more than this fraction of the error
# a redundant constraint counts as closed if its residual is below this, relative to the mechanism size or in rad
MAX_GAP = 1e-10
TINY = np.finfo(float).tiny
# A movement counts as smooth if it agrees with a prediction from the mean of the rates at its start and end. This is
# the largest difference, relative to the movement.
MAX_DEVIATION = 0.25
# a posture counts as near singular if its reciprocal condition number, relative to that at the start, is below this
MIN_CONDITION = 0.05
# distances from a change point at which the equation of motion is evaluated: drive angle [rad], or slide relative to
# the mechanism size
OFFSETS = 0.05 * np.array([-2, -5 / 3, -4 / 3, -1, 1, 4 / 3, 5 / 3, 2])


class Tracker:
    """A mechanism in its current posture. The posture changes in small steps of the drive coordinates.

    Attributes
    ----------
    drive
        Current drive coordinates, shape (drives,).
    origin, direction
        Origins [m] and unit vectors of all links (complex), shape (links, 1).
    size
        Reference length [m]: largest distance of a joint from the first joint at the start.
    original_motion
        Function that converts a motion of this mechanism to a motion of the mechanism with the original drives, for
        which loads and efforts are evaluated. The drives differ if other joints are integrated in place of the drives.
    rotors
        Function that returns the reduced inertia of the rotors of replaced drives, and the efforts that accelerate
        these rotors, see `Lead.rotors`.
    """

    def __init__(self, mechanism: Mechanism, drive: Reals, near: Posture | None = None) -> None:
        from scipy.linalg import lapack

        self._lapack = lapack
        self.mechanism = mechanism
        self._table = constraint_table(mechanism, 1)
        self._links = len(mechanism.links)
        first = motion(mechanism, drive[:, None], near=near)
        if first.columns != (1,):
            raise MechanismError("forward dynamics needs a single design: give scalar lengths")
        if not np.isfinite(first.condition).all():
            problem = "at the start, the mechanism cannot be assembled or is in a singular position"
            raise MechanismError(problem, kind="singular", positions=(0,))
        here = constraints_at(self._table, first.origin, first.direction)
        places = first.origin[self._table.block] + here.tip
        self.size = float(np.abs(places - places[0]).max()) or 1.0
        self.original_motion: Callable[[Motion], Motion] = lambda motion: motion
        self.rotors: Callable[[Motion, tuple[Complexes, Reals]], tuple[Any, Any]] = lambda *_: (0.0, 0.0)
        self._weights = np.tile([1 / self.size, 1 / self.size, 1.0], self._links - 1)
        slides, count = self._table.slides.ravel(), self._table.count
        joints = np.stack([slides[:count], np.zeros(count, bool)], axis=-1).ravel()
        moved = ~slides[self._table.moved[: len(self._table.shares)]]
        self._rotors = np.diag([float(drive.inertia) for drive in mechanism.drives])
        self._row_weights = np.where(np.concatenate([joints, moved]), 1.0, 1 / self.size)
        self._begin = (drive.copy(), first.origin, unwound_angles(self._table, np.angle(first.direction), drive))
        self._rows = independent_rows(self._table, constraint_matrix(here)[0])
        self._units = np.zeros((len(self._rows), len(drive)))
        driven = 2 * self._table.count + np.arange(len(drive))
        self._units[np.searchsorted(self._rows, driven)] = np.eye(len(drive))
        self.direction: Any = first.direction
        self._here: Constraints = here
        self._factors: Any = None
        self._influence: Any = None
        self._min_rcond = self._rcond = self._sign = 0.0
        self._gear_phase = np.zeros(len(self._table.shares) - len(drive))
        self.restart()
        self._gear_phase = self._residual(drive)[2 * self._table.count + len(drive) :]
        self._sign = self._factor(here)
        self._min_rcond = MIN_CONDITION * self._rcond
        self.mark()

    def turns(self, number: int) -> bool:
        """Return whether a drive is at a pin (otherwise, it is at a slider)."""
        return not self._table.slides[self._table.moved[number]].any()

    @property
    def angle(self) -> Reals:
        """Angles of all links [rad], over any number of turns, shape (links, 1)."""
        return self._angle

    @property
    def unit_twists(self) -> tuple[Complexes, Reals]:
        """Velocities (complex) and angular velocities per unit rate of each drive, each of shape (links, drives)."""
        return self._twists(self._influence)

    @property
    def unit_coasting(self) -> tuple[Complexes, Reals]:
        """Accelerations (complex) and angular accelerations at constant unit drive rate, each of shape (links, 1)."""
        velocity, omega = self._twists(self._influence)
        return self._twists(self._solve(-centripetal(self._here, velocity, omega)[0, self._rows]))

    @property
    def near_singular(self) -> bool:
        """Whether the posture is so close to singular that the rates are inaccurate."""
        return self._rcond < self._min_rcond

    @property
    def steepness(self) -> float:
        """Largest rate of a link's position or angle, relative to the drive rate.

        Lengths are divided by `size`.
        """
        units = [1.0 if self.turns(number) else self.size for number in range(self._influence.shape[1])]
        return float(np.abs(self._weights[:, None] * self._influence * units).max(initial=0.0))

    def restart(self) -> None:
        """Return to the posture at the start."""
        self.drive, self.origin, self._angle = self._begin
        self._place()
        self._sign = self._factor(self._here)
        self.mark()

    def step_to(self, drive: Reals) -> bool:
        """Move to nearby drive coordinates and return True.

        If this fails, return to the posture that `mark` stored, and return False.
        """
        if self._advance(drive):
            return True
        # near a singular position the prediction is unreliable, so retry from the stored posture
        self._state = self._mark
        if self._advance(drive):
            return True
        self._state = self._mark
        return False

    def mark(self) -> None:
        """Store the current posture unless it is near singular. `step_to` returns to the stored posture if it fails."""
        if not self.near_singular:
            self._mark = self._state

    @contextmanager
    def returning(self) -> Iterator[None]:
        """Restore the current posture at the end of a `with` block."""
        state, mark = self._state, self._mark
        try:
            yield
        finally:
            self._state, self._mark = state, mark

    @property
    def _state(self) -> tuple[Any, ...]:
        here = self.drive, self.origin, self._angle, self.direction, self._here
        return *here, self._factors, self._influence, self._sign, self._rcond

    @_state.setter
    def _state(self, state: tuple[Any, ...]) -> None:
        self.drive, self.origin, self._angle, self.direction, self._here = state[:5]
        self._factors, self._influence, self._sign, self._rcond = state[5:]

    def _advance(self, drive: Reals) -> bool:
        begin, change = self.drive, drive - self.drive
        origin, angle, ahead = self.origin, self._angle, self._influence @ change
        with np.errstate(all="ignore"):
            far = float(np.abs(self._weights * (self._influence @ change)).max(initial=0.0))
            if not far < MAX_STEP * MAX_PIECES:
                return False
            pieces = int(far / MAX_STEP) + 1
            if not all(self._approach(begin + change * ((piece + 1) / pieces)) for piece in range(pieces)):
                return False
            sign = self._factor(self._here)
            if sign == self._sign:
                return True
            # the determinant changes sign at a change point; a jump to another branch is not smooth
            passed = np.stack([(self.origin - origin)[1:, 0].real, (self.origin - origin)[1:, 0].imag], 1)
            passed = np.concatenate([passed, (self._angle - angle)[1:]], axis=1).ravel()
            off = self._weights * (passed - 0.5 * (ahead + self._influence @ change))
            smooth = float(np.abs(off).max()) <= MAX_DEVIATION * float(np.abs(self._weights * passed).max())
            self._sign = sign
            return smooth and sign != 0.0

    def equation_at_change_point(
        self, time: float, rate: Reals, drive: Reals, effort: Callable[[Motion], Reals]
    ) -> tuple[Reals, Reals] | None:
        """Return the terms of the equation of motion at a change point, interpolated from both sides.

        A change point is a singular posture at which two branches meet. The motion through it is smooth, but the rates
        that are computed there are only round-off. The terms are therefore computed at `OFFSETS` before and after the
        change point, and interpolated by a polynomial. The terms are the reduced inertia, and the sum of loads, efforts
        and inertial efforts at constant rates.

        Return None if the posture at an offset cannot be reached. Also return None if the posture at `drive` is not
        much closer to singular than the postures at the first and the last offset.
        """
        here = self._state
        unit = np.array([1.0 if self.turns(number) else self.size for number in range(len(drive))])
        along = rate / max(float(np.abs(rate / unit).max()), TINY)
        equations, rcond, rconds = [], self._rcond, []
        for ahead in OFFSETS:
            if not self.step_to(drive + ahead * along):
                self._state = here
                return None
            inertia, balance, coasting = self.equation(time, rate)
            equations.append(np.concatenate([inertia.ravel(), balance + effort(coasting)]))
            rconds.append(self._rcond)
        self._state = here
        if rcond > 0.5 * min(rconds[0], rconds[-1]):
            return None
        weights = [np.prod([b / (b - a) for b in OFFSETS if b != a]) for a in OFFSETS]
        value = np.einsum("k,kn->n", weights, np.array(equations))
        count = len(drive)
        return value[: count**2].reshape(count, count), value[count**2 :]

    def equation(self, time: float, rate: Reals) -> tuple[Reals, Reals, Motion]:
        """Return the terms of the equation of motion at the current posture, and the motion at constant drive rates.

        Returns
        -------
        Reduced inertia, shape (drives, drives). Reduced loads and weight minus the efforts that the inertia requires at
        constant drive rates, shape (drives,). Motion at constant drive rates, in coordinates of the original drives.
        """
        velocity, omega = self._twists(self._influence @ rate)
        missing = -centripetal(self._here, velocity, omega)[0, self._rows]
        acceleration, eps = self._twists(self._solve(missing))
        turning: Complexes = np.asarray(1j * eps - omega**2)
        coasting = Motion(
            self.mechanism,
            np.array([time]),
            self.drive[:, None],
            rate[:, None],
            np.zeros((len(rate), 1)),
            self.origin,
            self.direction,
            velocity,
            acceleration,
            omega,
            turning,
            (),
        )
        mass, first, second = mass_constants(self.mechanism, 1)
        arm = self.direction * first
        v, w = self._twists(self._influence)
        momentum = mass * v + 1j * w * arm
        moment = cross(arm, v) + second * w
        inertia = np.real(np.conj(v).T @ momentum) + w.T @ moment
        inertia += self._rotors
        relative = acceleration - self.mechanism.gravity
        force = -(mass * relative + turning * arm)
        couple = -(cross(arm, relative) + second * turning.imag)
        original = self.original_motion(coasting)
        for at, pull, turn in given_loads(original):
            force[at] += pull
            couple[at] += turn
        led, led_bias = self.rotors(coasting, (v, w))
        return inertia + led, (dot(v, force) + w * couple).sum(axis=0) - led_bias, original

    def _approach(self, drive: Reals) -> bool:
        """Move to nearby drive coordinates by Newton's method, reusing the factorised matrix if possible."""
        ahead = self._influence @ (drive - self.drive)
        self._shift(ahead)
        # with the matrix of the previous posture, each iteration multiplies the error by about the size of `ahead`
        slowness = float(np.abs(self._weights * ahead).max())
        before = 0.0
        for _ in range(MAX_STEPS):
            open_by = self._residual(drive)
            step = self._solve(-open_by[self._rows])
            self._shift(step)
            length = float(np.abs(self._weights * step).max())
            slowness = min(length / before, 1.0) if before else slowness
            if not length < 1.0:
                return False
            if length * slowness < TOLERANCE:
                self.drive = drive
                surplus = len(open_by) > len(self._rows)
                return not surplus or bool(np.abs(self._row_weights * self._residual(drive)).max() < MAX_GAP)
            before = length
            if slowness > MAX_ERROR_RATIO:
                self._factor(self._here)
        return False

    def _shift(self, step: Reals) -> None:
        """Displace and rotate the moving links. `step` contains x, y and angle of each link in turn."""
        self.origin = self.origin.copy()
        self._angle = self._angle.copy()
        self.origin[1:, 0] += step[0::3] + 1j * step[1::3]
        self._angle[1:, 0] += step[2::3]
        self._place()

    def _place(self) -> None:
        self.direction = np.exp(1j * self._angle)
        self._here = constraints_at(self._table, self.origin, self.direction)

    def _residual(self, drive: Reals) -> Reals:
        """Return the residuals of the constraints, in the order of the rows of `constraint_matrix`."""
        table, opening = self._table, self._here.opening[:, 0]
        turned = (self._angle[table.block] - self._angle[table.owner] - table.turn)[:, 0]
        slides, count = table.slides[:, 0], table.count
        rows = np.empty(2 * count + len(table.shares))
        rows[0 : 2 * count : 2] = np.where(slides, turned, opening.real)[:count]
        rows[1 : 2 * count : 2] = opening.imag[:count]
        moved = np.where(slides, opening.real, turned)[table.moved]
        rows[2 * count :] = table.shares @ moved - np.concatenate([drive, self._gear_phase])
        return rows

    def _factor(self, here: Constraints) -> float:
        """Factorise the constraint matrix, and return the sign of its determinant (0 if singular)."""
        matrix = constraint_matrix(here)[0, self._rows]
        upper, pivots, singular = self._lapack.dgetrf(matrix)
        self._factors = upper, pivots
        self._rcond = float(self._lapack.dgecon(upper, np.abs(matrix).sum(axis=0).max())[0])
        diagonal = np.diagonal(upper)
        if singular or not np.isfinite(diagonal).all():
            return 0.0
        self._influence = self._solve(self._units)
        swaps = np.count_nonzero(pivots != np.arange(len(pivots)))
        return float((-1.0) ** (swaps + np.count_nonzero(diagonal < 0)))

    def _solve(self, rows: Reals) -> Reals:
        return self._lapack.dgetrs(*self._factors, rows)[0]

    def _twists(self, rates: Reals) -> tuple[Complexes, Reals]:
        """Convert rates of x, y and angle of the moving links to velocities and angular velocities of all links.

        `rates` has the shape (3 (links - 1), n) or (3 (links - 1),). The results have the shape (links, n) or (links,
        1).
        """
        columns = rates.reshape(len(rates), -1)
        velocity = np.zeros((self._links, columns.shape[1]), complex)
        velocity[1:] = columns[0::3] + 1j * columns[1::3]
        omega = np.zeros(velocity.shape)
        omega[1:] = columns[2::3]
        return velocity, omega
