"""Equation of motion as right-hand side of an ODE integrator.

The unknowns are the coordinates of the leading joints and their rates. Leading joints are the joints whose coordinates
are integrated, see `rigid.dynamics.leading`.
"""

from collections.abc import Mapping

import numpy as np

from rigid.arrays import Complexes, Reals
from rigid.decomposition.order import structure
from rigid.dynamics.chart import PostureChart
from rigid.dynamics.integrated_motion import Effort, MotionLaw, effort_of
from rigid.dynamics.leading import Lead, unwound
from rigid.dynamics.tracking import Tracker
from rigid.joints import Placed
from rigid.kinematics import Motion
from rigid.kinetostatics.loads import given_loads
from rigid.plane import dot


class BudgetExceededError(Exception):
    """Raised if the maximum number of evaluations of the equation of motion is exceeded."""


class RightHandSide:
    """Equation of motion, solved for the rates and accelerations of the leading (integrated) joints.

    A call has no side effects except on `tracker` (the current posture), the cache of postures and the number of
    evaluations.
    """

    def __init__(
        self,
        lead: Lead,
        tracker: Tracker,
        drives: tuple[Effort | MotionLaw, ...],
        free: list[int],
        most: float,
        coordinates: Mapping[int, float],
        done: int = 0,
        charted: bool = True,
    ) -> None:
        self.lead, self.tracker, self.drives, self.free = lead, tracker, drives, free
        self.evaluations, self.most = done, most
        self._led = np.ix_(free, free)
        joints = structure(lead.mechanism).joints
        self._joints = {number: next(joint for joint in joints if joint.drive == number) for number in free}
        self.unit = np.array([1.0 if tracker.turns(number) else tracker.size for number in free])
        turned = self.original_coordinates(tracker.angle, offset=False)
        self._offset = {number: coordinates[number] - value for number, value in turned.items()}
        self.chart = PostureChart(tracker) if charted and len(drives) == 1 else None
        if lead.replaced:
            tracker.original_motion = lambda coasting: lead.original_motion(
                coasting, self.original_coordinates(tracker.angle)
            )
            tracker.rotors = lead.rotors

    def original_coordinates(self, angle: Reals, offset: bool = True) -> dict[int, float]:
        """Return the angle of each original drive with an effort instead of a law [rad], by drive index (slider: 0.0).

        `angle` contains the angles of the links, shape (links, 1). With `offset`, the returned angles count full turns
        as the drive coordinates do. Without `offset`, they may differ from the drive coordinates by full turns.
        """
        coordinates = {}
        for number in self.free:
            joint = self._joints[number]
            value = float(joint.sense * (angle[joint.child] - angle[joint.parent])[0]) if joint.turns else 0.0
            coordinates[number] = value + (self._offset[number] if offset and joint.turns else 0.0)
        return coordinates

    @property
    def original_drive(self) -> Reals:
        """Coordinates of the original drives at the current posture.

        The original drives are those of the mechanism, even if other joints are integrated in place of them.
        """
        drive = self.tracker.drive.copy()
        near = self.original_coordinates(self.tracker.angle)
        for number, joint in self.lead.replaced.items():
            drive[number] = unwound(self.tracker, joint, near[number])[0]
        return drive

    def effort(
        self, original: Motion, placed: Placed | None = None, twists: tuple[Complexes, Reals] | None = None
    ) -> Reals:
        """Return the given efforts of the drives, reduced to the leading joints, shape (drives,).

        `original` is the motion of the original mechanism, for which the efforts are evaluated. `placed` is the
        posture. `twists` contains the velocities and angular velocities of the links per unit rate of each leading
        joint. By default, `placed` and `twists` are those of the tracker. The efforts of drives with motion laws are 0.
        """
        reduced = np.zeros(len(self.drives))
        rates: dict[int, Reals] = {}
        if self.lead.replaced:
            rates = self.lead.rates(placed or self.tracker, *(twists or self.tracker.unit_twists))
        for number in self.free:
            effort = float(np.ravel(effort_of(self.drives[number], original))[0])
            if number in rates:
                reduced += effort * rates[number]
            else:
                reduced[number] += effort
        return reduced

    def __call__(self, time: float, state: Reals) -> Reals:
        """Return the rates and accelerations of the integrated coordinates.

        They are nan if the joints cannot be closed, and the accelerations are nan if the inertia matrix is singular.
        """
        half = len(self.free)
        drive, rate, rate2 = self.laws(time, state)
        self.evaluations += 1
        if self.evaluations > self.most:
            raise BudgetExceededError
        charted = self._by_chart(time, drive, rate)
        if charted is not None:
            return np.array([rate[0], charted])
        reached = self.tracker.step_to(drive)
        if reached and not self.tracker.near_singular:
            inertia, balance, coasting = self.tracker.equation(time, rate)
            balance += self.effort(coasting)
        else:
            interpolated = self.tracker.equation_at_change_point(time, rate, drive, self.effort)
            if interpolated is not None:
                inertia, balance = interpolated
            elif reached:
                inertia, balance, coasting = self.tracker.equation(time, rate)
                balance += self.effort(coasting)
            else:
                return np.full(2 * half, np.nan)
        balance = balance - inertia @ rate2
        try:
            acceleration = np.linalg.solve(inertia[self._led], balance[self.free])
        except np.linalg.LinAlgError:
            acceleration = np.full(half, np.nan)
        return np.concatenate([rate[self.free], acceleration])

    def _by_chart(self, time: float, drive: Reals, rate: Reals) -> float | None:
        """Return the acceleration of a single leading joint, computed from a posture of the cache.

        Return None if the cache has no posture at the drive coordinate.
        """
        here = None if self.chart is None else self.chart.at(float(drive[0]))
        if here is None:
            return None
        coasting = here.coasting(self.tracker, time, drive, rate)
        original = coasting
        if self.lead.replaced:
            ahead = self.tracker.angle + here.omega * (drive[0] - self.tracker.drive[0])
            angle = here.angle + 2 * np.pi * np.round((ahead - here.angle) / (2 * np.pi))
            original = self.lead.original_motion(coasting, self.original_coordinates(angle))
        balance = here.weight - here.bias * rate[0] ** 2
        for at, pull, couple in given_loads(original):
            balance += float((dot(here.velocity[at], pull) + here.omega[at] * couple)[0])
        balance += float(self.effort(original, coasting, (here.velocity, here.omega))[0])
        led, led_bias = self.lead.rotors(coasting, (here.velocity, here.omega))
        inertia = here.inertia + float(led[0, 0])
        return (balance - float(led_bias[0])) / inertia if inertia else np.nan

    def laws(self, time: float, state: Reals) -> tuple[Reals, Reals, Reals]:
        """Return coordinates, rates and prescribed accelerations of all drives.

        The prescribed acceleration of a drive with an effort is 0.
        """
        drive, rate, rate2 = np.zeros((3, len(self.drives)))
        half = len(self.free)
        drive[self.free], rate[self.free] = state[:half], state[half:]
        for number, law in enumerate(self.drives):
            if not isinstance(law, Effort):
                drive[number], rate[number], rate2[number] = (float(np.ravel(value)[0]) for value in law([time]))
        return drive, rate, rate2
