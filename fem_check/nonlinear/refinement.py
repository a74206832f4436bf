"""Deflection with a required accuracy, by halving time steps and elements until convergence.

Each solution starts from the previous one. If Newton's method fails when it solves all time steps together, the motion
is integrated a few steps at a time. A periodic motion is integrated over several periods, until the initial vibration
has decayed enough for Newton's method to find the periodic solution.
"""

import math
from collections.abc import Callable, Mapping, Sequence
from functools import cached_property
from typing import Any

import numpy as np
from msgspec import Struct

from elastic import JointCompliance, Section, reference_deflection
from elastic.links import BeamRuns, members_of
from fem_check.nonlinear.collocation import CollocatedMotion, Collocation, InitialState, Progress
from fem_check.nonlinear.equilibrium import POINTS, slopes, start_of
from fem_check.nonlinear.rigid_places import DoesNotCloseError, DriveLaw, RigidPlaces, as_complex, coordinates
from fem_check.nonlinear.stepping import periods, slowest_vibration, stepped
from fem_check.nonlinear.system import System, system_of
from rigid import Mechanism, Reals

ELEMENTS = 2, 4, 8, 16
"""Numbers of elements per beam, from the coarsest to the finest mesh."""
MAX_STRIDE = 0.3
"""Mean movement of a drive per time step before refinement [rad], or relative to the size of the mechanism."""
MIN_STEPS, MAX_STEPS = 16, 1600
"""Smallest and largest number of time steps."""
MESH_ORDER = 3
"""Assumed order of convergence in the element length, for an error estimate at all nodes of the finer mesh."""
MIN_RATIO, MAX_RATIO = 4.0, 8.0
"""The error after halving the time steps is estimated from the ratio r of the last two changes, as change / (r - 1).

If r is below MIN_RATIO, the error estimate is the change itself. If r is above MAX_RATIO, MAX_RATIO is used.
"""
START_STEP = 1e-5
"""Time step of numerical differentiation at the start, relative to the duration of the run."""
MAX_REST_RATE = 1e-6
"""Largest rate of a drive that counts as at rest, relative to the largest rate of this drive in the run."""
STEP_SHARE = 1 / 3
"""Share of the tolerance that the error due to time steps may use. The rest is for the error due to elements."""
NEWTON_SHARE = 0.01
"""Tolerance of Newton's method, relative to the requested tolerance."""
STEPS_PER_WAVE = 10.0
"""Time steps per period of the slowest vibration, if Newton's method fails for all steps together."""
GUESS_TOLERANCE = 1e-4
"""Tolerance of Newton's method for motions that only serve as an initial guess."""
PERIODS = 1, 2, 4, 8, 16
"""A periodic solution is attempted after these numbers of integrated periods."""


class RefinedDeflection(Struct, frozen=True, eq=False):
    """Deflection at given times, with error estimates.

    Attributes
    ----------
    xi
        Values of x'/l of the nodes of each beam, shape (elements + 1,).
    chord
        Deflection from the chord of the deformed link [m], shape (beams, instants, elements + 1).
    moved
        u, w [m] and phi [rad] relative to the rigid positions, shape (3, beams, instants, elements + 1).
    steps
        Number of time steps.
    mesh
        Estimated error due to the elements. It is the largest over the beams, relative to a reference deflection of
        each beam (see `elastic.reference_deflection`).
    step
        Estimated error due to the time steps, defined in the same way.
    """

    xi: Reals
    chord: Reals
    moved: Reals
    steps: int
    mesh: float
    step: float

    @property
    def elements(self) -> int:
        """Number of elements per beam."""
        return len(self.xi) - 1

    @property
    def error(self) -> float:
        """Sum of the errors due to elements and time steps."""
        return self.mesh + self.step


def refined_deflection(
    mechanism: Mechanism,
    sections: Sequence[Section],
    laws: Sequence[DriveLaw],
    times: Reals,
    end: float,
    closed: bool,
    tolerance: float,
    joints: Mapping[str, JointCompliance] | None = None,
    damping: float | Sequence[float] | Reals = 0.0,
    joint_damping: float = 0.0,
    progress: Progress | None = None,
) -> RefinedDeflection:
    """Compute the deflection of a moving mechanism with large displacements to a tolerance.

    Parameters
    ----------
    times
        Requested times in ascending order [s]. The first is the start of the motion.
    end
        End of the period or of the run [s].
    closed
        True if the motion is periodic. If False, the motion has an initial state: static equilibrium if all drives
        start at rest, and otherwise the quasi-static deformation under the loads and the inertia of the rigid motion.
    tolerance
        Largest error, relative to the reference deflection of each beam. If it cannot be reached with the largest
        numbers of steps and elements, `mesh` and `step` show the achieved errors.
    sections
        One per beam, in the order of `Mechanism.beams`. A link is a rigid body if all rigidities of its beams are
        infinite.
    laws
        For each drive, a function of time [s] that returns coordinate, rate and acceleration. The rate is used only
        for the damping of a compliant joint with a drive.
    joints
        Compliance and misfit of joints, by name.
    damping
        beta of the Kelvin-Voigt law stress = E (strain + beta d strain/dt) [s], one value or one per beam.
    joint_damping
        beta of the compliant joints [s].
    progress
        Function that is called with the estimated share of completed work, from 0 to 1, and a message.

    Raises
    ------
    NotCheckedError
        If the check does not support a part of the mechanism, which the message names.
    DoesNotCloseError
        If joints do not close, the motion is not periodic, or the solution does not converge.
    """
    beams = mechanism, tuple(sections), tuple(laws), joints, damping, joint_damping
    return _Problem(*beams, times, end, closed, tolerance, progress).refined()


class _Solved(Struct, frozen=True, eq=False):
    """Solution for one mesh and one step size. `moved` and `chord` are those of `RefinedDeflection`."""

    system: System
    motion: CollocatedMotion
    moved: Reals
    chord: Reals

    @property
    def steps(self) -> int:
        """Number of time steps."""
        return len(self.motion.edges) - 1


class _Problem(Struct, frozen=True, eq=False, dict=True):
    """Arguments of `refined_deflection`, with the methods that solve for the deflection."""

    mechanism: Mechanism
    sections: tuple[Section, ...]
    laws: tuple[DriveLaw, ...]
    joints: Mapping[str, JointCompliance] | None
    damping: Any
    joint_damping: float
    times: Reals
    end: float
    closed: bool
    tolerance: float
    progress: Callable[[float, str], None] | None

    @cached_property
    def places(self) -> RigidPlaces:
        """Positions of the rigid links, shared by all meshes."""
        return RigidPlaces(self.mechanism, self.laws, float(self.times[0]))

    @cached_property
    def rigid(self) -> Reals:
        """x, y and angle of the rigid links at the requested times."""
        return self.places.at(self.times)

    def system(self, elements: int) -> System:
        """Create the equations of motion for a number of elements per beam."""
        given = self.mechanism, self.sections, self.laws, float(self.times[0]), elements, self.joints, self.damping
        return system_of(*given, rigid=self.places, joint_damping=self.joint_damping)

    def refined(self) -> RefinedDeflection:
        """Halve time steps and then elements until the tolerance is reached."""
        members = members_of(self.mechanism)
        here = self._solved_robustly(self.system(ELEMENTS[0]), self._first_steps(), None)
        step = mesh = changed = np.inf
        while step > STEP_SHARE * self.tolerance and 2 * here.steps <= MAX_STEPS:
            finer, before = self._solved_robustly(here.system, 2 * here.steps, here), changed
            changed = _change(here.chord, finer.chord, members) if finer.steps == 2 * here.steps else np.inf
            converges = changed > 0.0 and np.isfinite(before) and before / changed >= MIN_RATIO
            step, here = float(changed / (min(before / changed, MAX_RATIO) - 1 if converges else 1.0)), finer
            self._report(f"{here.steps} steps of {ELEMENTS[0]} elements: error {step:.1e}")
        for elements in ELEMENTS[1:]:
            finer = self._solved_robustly(self.system(elements), here.steps, here)
            mesh, here = _change(here.chord, finer.chord, members) / (2**MESH_ORDER - 1), finer
            self._report(f"{elements} elements: error {mesh:.1e}")
            if mesh <= (1 - STEP_SHARE) * self.tolerance:
                break
        xi = np.linspace(0, 1, here.chord.shape[-1])
        return RefinedDeflection(xi, here.chord, here.moved, here.steps, mesh, step)

    def _report(self, words: str) -> None:
        if self.progress:
            self.progress(0.5, words)

    def _first_steps(self) -> int:
        """Return the number of time steps with which drives move by about `MAX_STRIDE` in a step.

        The number is at least `MIN_STEPS` and at most a quarter of `MAX_STEPS`.
        """
        value = coordinates(self.laws, np.linspace(self.times[0], self.end, 2001))
        scale = np.array([1.0 if drive.turns else self.places.size for drive in self.mechanism.drives])
        travel = (np.abs(np.diff(value, axis=0)).sum(axis=0) / scale).max(initial=0.0)
        return int(np.clip(np.ceil(travel / MAX_STRIDE), MIN_STEPS, MAX_STEPS // 4))

    def _solved_robustly(self, system: System, steps: int, near: _Solved | None) -> _Solved:
        """Solve all steps together, or integrate in time if this fails.

        The initial guess is the solution `near` if given, and then the rigid positions.

        Integration may need more steps than requested.
        """
        for begin in (None,) if near is None else (near, None):
            try:
                return self._solved(system, steps, begin)
            except DoesNotCloseError:
                continue
        problem, enough = DoesNotCloseError("no motion found"), max(steps, self._resolving_steps(system))
        for count in (enough, 2 * enough):
            try:
                return self._solved(system, count, None) if count > steps else self._integrated(system, count)
            except DoesNotCloseError as error:
                problem = error
            try:
                return self._integrated(system, count)
            except DoesNotCloseError as error:
                problem = error
        raise problem

    def _resolving_steps(self, system: System) -> int:
        """Return the number of steps that resolves a vibration at the natural frequency at the start.

        The number of steps per period of this vibration is `STEPS_PER_WAVE`. The total is at most `MAX_STEPS`.
        """
        span = self.end - float(self.times[0])
        return int(min(MAX_STEPS, math.ceil(STEPS_PER_WAVE * span * slowest_vibration(system) / (2 * np.pi))))

    def _integrated(self, system: System, steps: int) -> _Solved:
        """Integrate a few steps at a time over the run, or over periods until the periodic solution converges."""
        equations, newton_tolerance = self._equations(system, steps), NEWTON_SHARE * self.tolerance
        if equations.start is not None:
            return self._answer(system, stepped(system, equations.edges, equations.start, newton_tolerance))
        begin, problem = self._start(system), DoesNotCloseError("no motion found")
        for number, motion in enumerate(periods(system, equations.edges, begin, GUESS_TOLERANCE, PERIODS[-1]), 1):
            if number in PERIODS:
                finer = Collocation(system, motion.edges, None)
                moved = motion.q.reshape(finer.rigid.shape) - finer.rigid
                try:
                    given = moved, motion.multipliers.reshape(len(moved), -1)
                    return self._answer(system, finer.solved(given, newton_tolerance, self.progress))
                except DoesNotCloseError as error:
                    problem = error
        raise problem

    def _equations(self, system: System, steps: int) -> Collocation:
        edges = np.linspace(self.times[0], self.end, steps + 1)
        return Collocation(system, edges, None if self.closed else self._start(system))

    def _solved(self, system: System, steps: int, near: _Solved | None) -> _Solved:
        equations, guess = self._equations(system, steps), None
        if near is not None:
            moved = near.motion.at(equations.time) - near.system.rigid_coordinates(self.places.at(equations.time))
            if near.system is not system and len(near.system.prescribed) != len(system.prescribed):
                moved = on_finer_mesh(near.system, system, moved, equations.rigid)
            guess = moved, near.motion.multipliers_at(equations.time)
        return self._answer(system, equations.solved(guess, NEWTON_SHARE * self.tolerance, self.progress))

    def _answer(self, system: System, motion: CollocatedMotion) -> _Solved:
        return _Solved(system, motion, *self._displacements(system, motion))

    def _start(self, system: System) -> InitialState:
        """Return the initial state: static or quasi-static for a run, rigid for a cycle.

        See `closed` in `refined_deflection`.
        """
        step = (self.end - float(self.times[0])) / 1000
        if self.closed:
            return start_of(system, step, "rigid")
        return start_of(system, step, "static" if self._starts_at_rest() else "quasi-static")

    def _starts_at_rest(self) -> bool:
        """Return whether all drives start at rest, by numerical differentiation of their coordinates."""
        start, instants = float(self.times[0]), np.linspace(self.times[0], self.end, 2001)
        step = START_STEP * (self.end - start)
        rates = (slopes(step) @ coordinates(self.laws, start + step * np.arange(POINTS)))[0]
        greatest = np.abs(np.diff(coordinates(self.laws, instants), axis=0)).max(axis=0) / (instants[1] - instants[0])
        return bool((np.abs(rates) <= MAX_REST_RATE * greatest).all())

    def _displacements(self, system: System, motion: CollocatedMotion) -> tuple[Reals, Reals]:
        """Return `moved` and `chord` of `RefinedDeflection`."""
        q, rigid = motion.at(self.times), system.rigid_coordinates(self.rigid)
        count = max((len(along) for along in system.nodes.along), default=0) or 2
        xi = np.linspace(0.0, 1.0, count)
        moved = np.stack([displacements(system, k, xi, q, rigid) for k in range(len(self.sections))], axis=1)
        return moved, members_of(system.mechanism).from_chord(moved[1], xi)


def _change(coarse: Reals, fine: Reals, members: BeamRuns) -> float:
    """Return the largest difference between two deflections, relative to the reference deflection of each beam."""
    base = reference_deflection(members.greatest(np.abs(fine).max(axis=(1, 2))))
    stride = (fine.shape[-1] - 1) // (coarse.shape[-1] - 1)
    apart = np.abs(fine[..., ::stride] - coarse).max(axis=(1, 2))
    return float((apart / np.where(base > 0, base, 1.0)).max(initial=0.0))


def displacements(system: System, k: int, xi: Reals, q: Reals, rigid: Reals) -> Reals:
    """Return u, w and phi of beam `k` relative to its rigid position, shape (3, positions, nodes).

    `q` and `rigid` are the coordinates of the deformed and of the rigid links, each of shape (positions, coordinates).
    `xi` are the values of x'/l of the nodes.
    """
    at, beam = system.mechanism.beams[k]
    link, along = system.mechanism.links[at], list(system.nodes.along[k])
    start, end = complex(link.points[beam.start]), complex(link.points[beam.end])
    axis = (end - start) / abs(end - start)
    if along:
        now, was = (values[:, system.of_node[along]] for values in (q, rigid))
        turned, first, moved = now[..., 2], was[..., 2], as_complex(now - was)
    else:
        node = system.nodes.at[at, beam.start][0]
        now, was = (values[:, system.of_node[[node]]] for values in (q, rigid))
        arm = start + xi * (end - start)
        turned, first = now[..., 2] + 0 * xi, was[..., 2]
        moved = as_complex(now - was) + arm * (np.exp(1j * now[..., 2]) - np.exp(1j * first))
    seen = np.conj(axis * np.exp(1j * first)) * moved
    return np.stack([seen.real, seen.imag, turned - first])


def on_finer_mesh(coarse: System, fine: System, moved: Reals, rigid: Reals) -> Reals:
    """Interpolate displacements to a mesh with twice the number of elements, by cubic Hermite polynomials.

    `moved` are the displacements in the coordinates of the coarse mesh, and `rigid` the coordinates of the rigid links
    on the fine mesh, each of shape (instants, coordinates).
    """
    refined = np.zeros_like(rigid)
    for link in range(len(fine.mechanism.links)):
        mine, other = (np.flatnonzero(system.nodes.link == link) for system in (fine, coarse))
        if len(mine) == len(other):
            refined[:, fine.of_node[mine]] = moved[:, coarse.of_node[other]]
    for k, (along, rough) in enumerate(zip(fine.nodes.along, coarse.nodes.along, strict=True)):
        if not along:
            continue
        at, beam = fine.mechanism.beams[k]
        points = fine.mechanism.links[at].points
        way = complex(points[beam.end]) - complex(points[beam.start])
        h = abs(way) / (len(rough) - 1)
        axis = way / abs(way) * np.exp(1j * rigid[:, fine.of_node[along[0], 2]])[:, None]
        own = moved[:, coarse.of_node[list(rough)]]
        z, phi = np.conj(axis) * (own[..., 0] + 1j * own[..., 1]), own[..., 2]
        way_of = np.diff(z, axis=1) + h
        grown = np.abs(way_of) / h * (1 + np.diff(phi, axis=1) ** 2 / 24)
        first, last = (h * (grown * np.exp(1j * turn) - 1) for turn in (phi[:, :-1], phi[:, 1:]))
        middle = (z[:, :-1] + z[:, 1:]) / 2 + (first - last) / 8
        slope = 1.5 * np.diff(z, axis=1) - (first + last) / 4
        new_z = np.empty((len(z), len(along)), complex)
        new_phi = np.empty(new_z.shape)
        new_z[:, ::2], new_z[:, 1::2] = z, middle
        new_phi[:, ::2], new_phi[:, 1::2] = phi, np.angle(h + slope)
        turned = axis * new_z
        numbers = fine.of_node[list(along)]
        refined[:, numbers] = np.stack([turned.real, turned.imag, new_phi], axis=-1)
    return refined
