"""Equation of motion of the leading joints as a right-hand side for an integrator."""

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
    """The evaluation limit is reached."""


class RightHandSide:
    """Right-hand side of the equation of motion; its only state is the last posture."""

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
        turned = self.own_coordinates(tracker.angle, offset=False)
        self._offset = {number: coordinates[number] - value for number, value in turned.items()}
        self.chart = PostureChart(tracker) if charted and len(drives) == 1 else None
        if lead.own:  # otherwise the motion is the same, and only drives have rotors
            tracker.seen = lambda coasting: lead.seen(coasting, self.own_coordinates(tracker.angle))
            tracker.rotors = lead.rotors

    def own_coordinates(self, angle: Reals, offset: bool = True) -> dict[int, float]:
        """Coordinates of the original drives with efforts, over any number of turns, or 0.0."""
        coordinates = {}
        for number in self.free:
            joint = self._joints[number]
            value = float(joint.sense * (angle[joint.child] - angle[joint.parent])[0]) if joint.turns else 0.0
            coordinates[number] = value + (self._offset[number] if offset and joint.turns else 0.0)
        return coordinates

    @property
    def own_drive(self) -> Reals:
        """Current coordinates of the original drives."""
        drive = self.tracker.drive.copy()
        near = self.own_coordinates(self.tracker.angle)
        for number, joint in self.lead.own.items():
            drive[number] = unwound(self.tracker, joint, near[number])[0]
        return drive

    def effort(
        self, seen: Motion, placed: Placed | None = None, twists: tuple[Complexes, Reals] | None = None
    ) -> Reals:
        """Efforts reduced to the leading joints, at the tracker's posture or a given one; 0 for drives with laws."""
        reduced = np.zeros(len(self.drives))
        rates = self.lead.rates(placed or self.tracker, *(twists or self.tracker.unit_twists)) if self.lead.own else {}
        for number in self.free:
            effort = float(np.ravel(effort_of(self.drives[number], seen))[0])
            if number in rates:
                reduced += effort * rates[number]
            else:
                reduced[number] += effort
        return reduced

    def __call__(self, time: float, state: Reals) -> Reals:
        """Rates and accelerations of the integrated coordinates; nan if the mechanism does not close."""
        half = len(self.free)
        drive, rate, rate2 = self.laws(time, state)
        self.evaluations += 1
        if self.evaluations > self.most:
            raise BudgetExceededError
        charted = self._by_chart(time, drive, rate)
        if charted is not None:
            return np.array([rate[0], charted])
        reached = self.tracker.step_to(drive)
        if reached and not self.tracker.narrow:
            inertia, balance, coasting = self.tracker.equation(time, rate)
            balance += self.effort(coasting)
        else:
            beside = self.tracker.equation_at_change_point(time, rate, drive, self.effort)
            if beside is not None:
                inertia, balance = beside
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
        """Acceleration of a single drive from the cached postures, or None."""
        here = None if self.chart is None else self.chart.at(float(drive[0]))
        if here is None:
            return None
        coasting = here.coasting(self.tracker, time, drive, rate)
        seen = coasting
        if self.lead.own:
            ahead = self.tracker.angle + here.omega * (drive[0] - self.tracker.drive[0])
            angle = here.angle + 2 * np.pi * np.round((ahead - here.angle) / (2 * np.pi))
            seen = self.lead.seen(coasting, self.own_coordinates(angle))
        balance = here.weight - here.bias * rate[0] ** 2
        for at, pull, couple in given_loads(seen):
            balance += float((dot(here.velocity[at], pull) + here.omega[at] * couple)[0])
        balance += float(self.effort(seen, coasting, (here.velocity, here.omega))[0])
        led, taken = self.lead.rotors(coasting, (here.velocity, here.omega))
        inertia = here.inertia + float(led[0, 0])
        return (balance - float(taken[0])) / inertia if inertia else np.nan

    def laws(self, time: float, state: Reals) -> tuple[Reals, Reals, Reals]:
        """Coordinates and rates of all drives, and accelerations prescribed by laws."""
        drive, rate, rate2 = np.zeros((3, len(self.drives)))
        half = len(self.free)
        drive[self.free], rate[self.free] = state[:half], state[half:]
        for number, law in enumerate(self.drives):
            if not isinstance(law, Effort):
                drive[number], rate[number], rate2[number] = (float(np.ravel(value)[0]) for value in law([time]))
        return drive, rate, rate2
