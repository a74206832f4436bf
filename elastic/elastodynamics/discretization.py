"""Discretization of a vibrating mechanism: model, elastic coordinates, and initial time elements."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from functools import cached_property
from typing import Any

import numpy as np
from msgspec import Struct
from msgspec.structs import replace

from elastic.beams.compliance import designs_of
from elastic.beams.section import JointCompliance, Section
from elastic.elastodynamics.elastic_structure import ElasticStructure, elastic_structure
from elastic.elastodynamics.equations_of_motion import masses
from elastic.elastodynamics.exact_steps import has_dry_friction
from elastic.elastodynamics.reduced_vibration import Start
from elastic.elastodynamics.reduction import CycleModes, cycle_of, initial_mode_count, reduced_basis
from elastic.elastodynamics.strains import Damping, strain_forces
from elastic.elastodynamics.time_grid import Grid, jumps
from elastic.elastodynamics.vibration_settings import VIBRATION
from elastic.links.beam_trees import trees_of
from elastic.links.sliding_blocks import block_places
from elastic.solution import Deflection, deflection
from rigid import LineLoad, Mechanism, MechanismError, Motion, PointLoad, Spring, TorsionSpring, with_rates
from rigid.arrays import Flags, Reals

MotionAt = Callable[[Any], Motion]

SMOOTH = (PointLoad, LineLoad, Spring, TorsionSpring)  # types of loads that jump only if their law jumps


class Model(Struct, frozen=True, eq=False):
    """Model of a vibrating mechanism, with its elastic coordinates and modes.

    Attributes
    ----------
    motion_at
        Function that returns the motion of the rigid links at given instants.
    mode_motion
        Motion of the rigid links at the positions at which modes are computed.
    cycle
        Modes at these positions, or None if no link vibrates.
    """

    motion_at: MotionAt
    sections: Sequence[Section]
    joints: Mapping[str, JointCompliance]
    damping: Damping
    mode_motion: Motion
    structure: ElasticStructure
    cycle: CycleModes | None
    polynomials_per_beam: int


def vibrating_model(
    motion_at: MotionAt,
    start: float,
    duration: float,
    sections: Sequence[Section],
    joints: Mapping[str, JointCompliance],
    damping: Damping | float | None,
) -> Model:
    """Set up the elastic coordinates, modes and damping of a mechanism for an interval of time."""
    if designs_of(tuple(sections)):
        raise ValueError(f"the sections have {designs_of(tuple(sections))[0]} designs: expected one")
    mode_motion = checked(motion_at(start + duration * np.arange(VIBRATION.mode_positions) / VIBRATION.mode_positions))
    structure = elastic_structure(mode_motion.mechanism, sections, joints, VIBRATION.polynomials_per_beam)
    cycle = _modes(structure, mode_motion, joints)
    if not isinstance(damping, Damping):
        beta = math.nan if damping is None else float(damping)
        damping = Damping(np.full(len(sections), beta), beta)
    damping = damping.with_default_beta(float(cycle.omega.min()) if cycle else math.inf)
    return Model(motion_at, sections, joints, damping, mode_motion, structure, cycle, VIBRATION.polynomials_per_beam)


def _modes(structure: ElasticStructure, motion: Motion, joints: Mapping[str, JointCompliance]) -> CycleModes | None:
    """Compute the modes at positions of the cycle, or return None if no link vibrates."""
    if not len(structure.stiffness):
        return None
    at_rest = with_rates(motion, 0.0)
    loaded = [require_unlocked(deflection(each, structure.sections, joints)) for each in (motion, at_rest)]
    cycle = cycle_of(structure, motion, loaded)
    return cycle if cycle.values[0] > 0 else None  # without mass there is no vibration


def checked(motion: Motion) -> Motion:
    """Raise an error if the motion cannot be used for vibration; otherwise return it unchanged.

    Raises
    ------
    MechanismError
        If a position is singular or out of reach, or a block leaves its beam.
    ValueError
        If there are several designs.
    """
    if len(motion.columns) != 1:
        raise ValueError(f"the motion has several designs (shape {motion.columns}): expected one")
    if motion.singular.any():
        raise MechanismError(f"the position at {motion.time[motion.singular][0]:.6g} s is singular or out of reach")
    links = trees_of(motion.mechanism)
    for number, (first, *_) in block_places(motion, links).items():
        off = ~np.isfinite(np.broadcast_to(first.xi, motion.columns))
        name = motion.structure.joints[number].name
        if off.any():
            raise MechanismError(f'the block of "{name}" leaves its beam at {motion.time[off][0]:.6g} s')
    return motion


def first_grid(model: Model, start: float, duration: float, breaks: Reals | None = None) -> Grid:
    """Return initial time elements: evenly spaced edges, and further edges at breaks and at jumps in the loads.

    The loads are therefore smooth within each element, except for jumps that are too small for `jumps`.

    Parameters
    ----------
    breaks
        Instants just before discontinuities of drive laws or loads [s].
    """
    min_distance = VIBRATION.min_step * duration
    even = Grid(start + duration * np.linspace(0.0, 1.0, VIBRATION.first_elements + 1))
    known = np.zeros(0) if breaks is None else breaks[breaks > start]
    if len(known):
        even = Grid(_with_breaks(even.edges, known, min_distance))

    def forces(times: Reals) -> Reals:
        bent = deflection(model.motion_at(times), model.sections, model.joints)
        return strain_forces(model.structure, bent)

    if model.cycle is None or len(model.structure.mechanism.beams) == 0 or _certainly_smooth(model, even):
        return even
    jumped = jumps(forces, even.nodes)
    jumped = jumped[_is_far_from_breaks(jumped, known, min_distance)]
    edges = np.sort(np.append(even.edges, jumped))
    far = np.append(True, np.diff(edges) > min_distance)
    return Grid(edges[far | np.isin(edges, known)]) if len(jumped) else even


def _with_breaks(edges: Reals, breaks: Reals, min_distance: float) -> Reals:
    """Add breaks to the edges of elements, and remove inner edges that are within `min_distance` [s] of a break.

    The first edge is kept. The last edge is kept unless the last break is within `VIBRATION.min_break_distance` of it.
    """
    kept = _is_far_from_breaks(edges, breaks, min_distance)
    kept[0], kept[-1] = True, edges[-1] - breaks.max() > VIBRATION.min_break_distance * np.ptp(edges)
    return np.sort(np.append(edges[kept], breaks))


def _is_far_from_breaks(times: Reals, breaks: Reals, min_distance: float) -> Flags:
    """Return for each instant whether it is farther than `min_distance` [s] from every break."""
    return np.abs(times[:, None] - breaks).min(axis=1, initial=np.inf) > min_distance


def _certainly_smooth(model: Model, grid: Grid) -> bool:
    """Return whether the loads cannot jump, so that no search for jumps is necessary.

    Drive rates must be constant, and each load must be of a type in `SMOOTH` and must not have a law (a prescribed
    dependence on time or position). The mechanism must not have friction, gears, or blocks on elastic links.
    """
    mechanism = model.structure.mechanism
    plain = all(isinstance(load, SMOOTH) and getattr(load, "law", None) is None for load in mechanism.loads)
    if not plain or mechanism.friction or mechanism.gears or trees_of(mechanism).rails:
        return False
    for motion in (model.mode_motion, model.motion_at(grid.nodes)):
        if motion.drive_acceleration.any() or np.ptp(motion.drive_rate, axis=-1).any():
            return False
    return True


def first_discretization(model: Model, tolerance: float) -> Discretization:
    """Return the initial discretization."""
    assert model.cycle is not None
    return Discretization(model, initial_mode_count(model.cycle), math.sqrt(tolerance), tolerance)


class Discretization(Struct, frozen=True, eq=False, dict=True):
    """Discretization of a vibration: elastic coordinates, number of modes, and tolerance of the time elements.

    Attributes
    ----------
    model
        Elastic coordinates and their modes.
    modes, min_shape_size, load_accuracy
        Parameters of `reduced_basis`.
    time_tolerance
        Tolerance of the time elements, relative to the largest displacement.
    start
        Function that returns the initial state, or None for a periodic solution.
    previous_error
        Error before the last refinement; infinite if there was no refinement yet.
    refined_in_time
        True if the last refinement reduced `time_tolerance`. False if it added coordinates.
    stalled
        True if the refinement before the last one did not halve the error.
    """

    model: Model
    modes: int
    min_shape_size: float
    time_tolerance: float
    start: Start | None = None
    previous_error: float = math.inf
    refined_in_time: bool = False
    stalled: bool = False
    load_accuracy: float = VIBRATION.load_accuracy

    @cached_property
    def basis(self) -> Reals:
        """Reduced basis, shape (n, r)."""
        assert self.model.cycle is not None
        return reduced_basis(self.model.cycle, self.modes, self.min_shape_size, self.load_accuracy)

    def per_coordinate_of(self, other: Discretization) -> Reals:
        """Return the matrix that converts amplitudes in another discretization to amplitudes in this one.

        The shape is (r, r of the other discretization). The converted amplitudes represent the deformation
        approximately: the strain energy of the difference from the original deformation is as small as possible.
        """
        pushed = self.basis.T @ self.model.structure.stiffness
        return np.asarray(np.linalg.solve(pushed @ self.basis, pushed @ other.basis), float)

    @property
    def first_omitted_frequency(self) -> float:
        """Lowest natural frequency of the modes that the basis omits [rad/s]; infinite if it contains all modes."""
        assert self.model.cycle is not None
        values = self.model.cycle.values[self.modes :]
        return 1.0 / math.sqrt(values[0]) if len(values) and values[0] > 0 else math.inf

    @property
    def cutoff(self) -> float:
        """Cutoff frequency of the low-pass filter for the residual response [rad/s].

        Higher frequencies are removed because they would make the iteration diverge.
        """
        return VIBRATION.max_frequency_ratio * self.first_omitted_frequency

    def wider(self) -> Discretization:
        """Return a discretization with twice as many modes, and with more accurate bending under the loads."""
        return replace(
            self,
            modes=min(2 * self.modes, len(self.model.structure.stiffness)),
            load_accuracy=VIBRATION.finer_load_accuracy,
        )

    def complete(self, max_modes: int) -> Discretization:
        """Return a discretization with all modes if there are at most `max_modes`. Otherwise return this one."""
        count = len(self.model.structure.stiffness)
        return replace(self, modes=count) if count <= max_modes else self

    def finer(self, error: float, max_modes: float = math.inf) -> Discretization | None:
        """Return the next discretization, which is refined either in coordinates or in time, or None.

        If the last refinement halved the error to `error`, the same kind of refinement is used again. Otherwise the
        other kind is used. If neither of the last two refinements halved the error, the result is None. It is also None
        if the coordinates should be refined, but their number would exceed `max_modes`, or the arrays of the modes
        would exceed `VIBRATION.max_mode_entries`.
        """
        stalled = error > self.previous_error / 2
        if stalled and self.stalled:
            return None
        refined_in_time = self.refined_in_time != stalled
        following = replace(self, previous_error=error, refined_in_time=refined_in_time, stalled=stalled)
        if refined_in_time:
            return replace(following, time_tolerance=self.time_tolerance / VIBRATION.finer_time)
        if 2 * self.modes > max_modes:
            return None
        polynomials_per_beam, known = self.model.polynomials_per_beam + 2, self.model
        structure = elastic_structure(known.mode_motion.mechanism, known.sections, known.joints, polynomials_per_beam)
        if VIBRATION.mode_positions * len(structure.stiffness) * len(masses(structure)) > VIBRATION.max_mode_entries:
            return None
        cycle = _modes(structure, known.mode_motion, known.joints)
        model = replace(known, structure=structure, cycle=cycle, polynomials_per_beam=polynomials_per_beam)
        return replace(following, model=model, modes=min(2 * self.modes, len(structure.stiffness)))


def array_size(discretization: Discretization, grid: Grid) -> int:
    """Return the total number of entries of the largest arrays.

    These are the displacements of the masses, and their first and second time derivatives.
    """
    return array_size_per_amplitude(discretization, grid) * int(discretization.basis.shape[1])


def array_size_per_amplitude(discretization: Discretization, grid: Grid) -> int:
    """Return `array_size` divided by the number of coordinates."""
    return 3 * len(grid.nodes) * len(masses(discretization.model.structure))


def halved(discretization: Discretization, grid: Grid) -> tuple[Discretization, Grid]:
    """Return a discretization with twice as many modes, and a grid with elements of half the length."""
    return discretization.wider(), grid.divided(np.full(len(grid.steps), 2))


def worth_halving(mechanism: Mechanism, elements: int, coordinates: int, bound: float, resolved: float) -> bool:
    """Return whether the discretization error should be measured by a second solution with elements of half the length.

    This is the case if the error bound `bound` exceeds `resolved`, there is no Coulomb friction, and the second
    solution does not take long.
    """
    quick = elements <= VIBRATION.max_halved or elements * coordinates**3 <= VIBRATION.max_halved_work
    return bound > resolved and quick and not has_dry_friction(mechanism)


def require_unlocked(bent: Deflection) -> Deflection:
    """Raise an error if friction may lock the mechanism; otherwise return the quasi-static deflection unchanged.

    Raises
    ------
    MechanismError
        If friction may lock the mechanism at a position.
    """
    locked = np.broadcast_to(bent.forces.locked, bent.motion.columns)
    if locked.any():
        raise MechanismError(f"friction may lock the mechanism at {bent.motion.time[locked][0]:.6g} s")
    return bent
