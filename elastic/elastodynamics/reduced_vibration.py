"""Vibration in reduced coordinates, in given elements of time."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from elastic.elastodynamics.equations_of_motion import MotionTerms, Problem, problem
from elastic.elastodynamics.strains import rigidities, strain_rows
from elastic.elastodynamics.time_elements import Propagation, propagation
from elastic.elastodynamics.vibration_loads import ResidualResponse, resampled, vibration_loads
from elastic.links.added_loads import AddedLoads
from elastic.solution import Deflection, deflection
from rigid import Motion
from rigid.arrays import Complexes, Numbers, Reals
from rigid.kinetostatics import beam_directions

AXIAL = 0.005  # as closely as displacements are axial forces resolved in time
LITTLE = 0.01  # of the greatest moment over the greatest length, what an axial force counts at least

Start = Callable[[Propagation, Problem, Deflection], Any]


@dataclass(frozen=True, eq=False)
class Vibration:
    """The amplitudes at the points of a grid, their rates and accelerations, shape (points, r), with their problem.

    Attributes
    ----------
    quasi_static
        At the nodes of the grid.
    residual
        The displacements and forces beyond the coordinates; None where there are none.
    """

    quasi_static: Deflection
    problem: Problem
    propagation: Propagation
    history: tuple[Reals, Reals, Reals]
    cyclic: bool
    residual: ResidualResponse | None = None

    @property
    def motion(self) -> Motion:
        """At the nodes of the grid."""
        return self.quasi_static.motion

    @cached_property
    def loads(self) -> AddedLoads:
        """Of the vibration, at the points."""
        return vibration_loads(self.problem, self.motion, self.history, self.residual)

    @cached_property
    def deflection(self) -> Deflection:
        """Of the vibrating mechanism at the nodes."""
        plain = self.quasi_static
        return deflection(
            plain.motion, plain.sections, plain.joints, resampled(self.loads, self.problem.terms.grid.at_nodes)
        )

    @cached_property
    def multipliers(self) -> Complexes:
        """Floquet multipliers of a cycle, by which free vibrations grow in it; none of a run from a start."""
        return self.propagation.multipliers if self.cyclic else np.zeros(0, complex)

    def under(self, load: Reals, often: bool = False) -> tuple[Reals, Reals, Reals]:
        """The history that another load makes alone, shape (points, r); `often` where many loads are to come."""
        steps = self.propagation.loaded(load, often)
        start = steps.periodic_start() if self.cyclic else np.zeros(2 * load.shape[1])
        return steps.history(start)

    @cached_property
    def displacements(self) -> Numbers:
        """Of the beams' points in their own axes, complex, or without beams the amplitudes, shape (points, places)."""
        return self.places(self.history[0])

    @property
    def unresolved(self) -> Reals:
        """Unresolved part of the displacements, and of those by inertia alone, in every element, shape (elements,).

        Less closely of the axial forces, which ring faster than links bend and move these by next to nothing.
        """
        terms, (_, _, x2) = self.problem.terms, self.history
        forces = self.problem.equations.mass @ x2[..., None]
        bent: Any = np.linalg.solve(terms.elastic, forces if terms.elastic.ndim == 3 else forces[..., 0].T)
        moved = self.displacements
        by_inertia = self.places(bent[..., 0] if bent.ndim == 3 else bent.T)
        greatest = np.abs(moved).max()
        tails = [terms.grid.tail(values, greatest) for values in (moved, by_inertia)]
        unresolved: Reals = np.maximum.reduce([*tails, AXIAL * self.unresolved_axial])
        return unresolved

    @property
    def unresolved_axial(self) -> Reals:
        """Unresolved part of the axial forces in every element, relative to the largest one, shape (elements,)."""
        N, least = self.axial_forces
        return self.problem.terms.grid.tail(N, max(float(np.abs(N).max(initial=0.0)), least))

    @property
    def axial_forces(self) -> tuple[Reals, float]:
        """Forces by which the coordinates stretch beams [N], shape (points, places), and one that is little."""
        kinds = self.problem.terms.kinematics
        structure, basis = kinds.structure, kinds.basis
        count = structure.weights.size
        strains = strain_rows(structure, basis if basis.ndim == 2 else basis[1:])[..., : 2 * count, :]
        stiff = rigidities(structure)[: 2 * count] / np.tile(structure.weights.ravel(), 2)
        forces: Reals = stiff * (strains @ self.history[0][..., None])[..., 0]
        longest = structure.weights.sum(axis=-1).max(initial=0.0)
        bending = float(np.abs(forces[:, count:]).max(initial=0.0))
        return forces[:, :count], LITTLE * bending / longest if longest else 0.0

    def places(self, amounts: Reals) -> Numbers:
        """Displacements of given amounts of all kinds."""
        moved = self.problem.terms.kinematics.unit
        if not moved.beams.size:
            return amounts
        along = (moved.beams[1:] @ amounts[:, None, :, None])[..., 0]
        return (np.conj(beam_directions(self.motion)).T[1:, :, None] * along).reshape(len(amounts), -1)


def vibration(terms: MotionTerms, bent: Deflection, start: Start | None = None, speed: float = 1.0) -> Vibration:
    """Solve the equations of motion about the motion of a deflection at the nodes of a grid.

    Without a `start` for the state that comes back at the grid's end. The motion is passed at `speed` times the grid's
    time, in which the history is.
    """
    posed = problem(terms, bent, speed)
    steps = propagation(terms.grid, posed.equations)
    begin = start(steps, posed, bent) if start else steps.periodic_start()
    return Vibration(bent, posed, steps, steps.history(begin), start is None)
