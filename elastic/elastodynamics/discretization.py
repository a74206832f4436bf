"""Discretization of a vibrating mechanism: model, elastic coordinates, and initial time elements."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np

from elastic.beams.compliance import designs_of
from elastic.beams.section import JointCompliance, Section
from elastic.elastodynamics.elastic_structure import ElasticStructure, elastic_structure
from elastic.elastodynamics.equations_of_motion import masses
from elastic.elastodynamics.exact_steps import has_dry_friction
from elastic.elastodynamics.reduced_vibration import Start
from elastic.elastodynamics.reduction import CycleModes, cycle_of, near_modes, reduced_basis
from elastic.elastodynamics.strains import Damping, given_forces
from elastic.elastodynamics.time_grid import Grid, jumps
from elastic.elastodynamics.vibration_settings import VIBRATION
from elastic.links.beam_trees import trees_of
from elastic.links.sliding_blocks import block_places
from elastic.solution import Deflection, deflection
from rigid import SINGULAR, LineLoad, Mechanism, MechanismError, Motion, PointLoad, Spring, TorsionSpring, with_rates
from rigid.arrays import Flags, Reals

MotionAt = Callable[[Any], Motion]

SMOOTH = (PointLoad, LineLoad, Spring, TorsionSpring)  # loads of these types have no jumps unless a law causes them


@dataclass(frozen=True, eq=False)
class Model:
    """Model of a vibrating mechanism, with its elastic coordinates and modes."""

    motion_at: MotionAt
    sections: Sequence[Section]
    joints: Mapping[str, JointCompliance]
    damping: Damping
    looked_at: Motion
    structure: ElasticStructure
    cycle: CycleModes | None
    inner: int


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
        raise ValueError(f"sections of {designs_of(tuple(sections))[0]} designs: expected one design")
    looked_at = checked(motion_at(start + duration * np.arange(VIBRATION.mode_positions) / VIBRATION.mode_positions))
    structure = elastic_structure(looked_at.mechanism, sections, joints, VIBRATION.inner)
    cycle = _modes(structure, looked_at, joints)
    if not isinstance(damping, Damping):
        beta = math.nan if damping is None else float(damping)
        damping = Damping(np.full(len(sections), beta), beta)
    damping = damping.settled(float(cycle.omega.min()) if cycle else math.inf)
    return Model(motion_at, sections, joints, damping, looked_at, structure, cycle, VIBRATION.inner)


def _modes(structure: ElasticStructure, motion: Motion, joints: Mapping[str, JointCompliance]) -> CycleModes | None:
    """Compute the modes of the elastic coordinates over positions of the cycle, or None if no link vibrates."""
    if not len(structure.stiffness):
        return None
    slow = with_rates(motion, 0.0)
    loaded = [unlocked(deflection(each, structure.sections, joints)) for each in (motion, slow)]
    cycle = cycle_of(structure, motion, loaded)
    return cycle if cycle.values[0] > 0 else None  # there is no vibration without mass


def checked(motion: Motion) -> Motion:
    """Return the motion unchanged if it has a single design and no singular position.

    Raises
    ------
    MechanismError
        If a position is singular or out of reach, or a block leaves its beam.
    ValueError
        If there are several designs.
    """
    if len(motion.columns) != 1:
        raise ValueError(f"columns of shape {motion.columns}: expected one design")
    bad = ~(motion.condition <= SINGULAR)
    if bad.any():
        raise MechanismError(
            f"the position at {motion.time[bad][0]:.6g} s is singular or out of reach: vibration needs all of the cycle"
        )
    links = trees_of(motion.mechanism)
    for number, (first, *_) in block_places(motion, links).items():
        off = ~np.isfinite(np.broadcast_to(first.xi, motion.columns))
        name = motion.structure.joints[number].name
        if off.any():
            raise MechanismError(f'the block of "{name}" leaves its beam at {motion.time[off][0]:.6g} s')
    return motion


def first_grid(model: Model, start: float, duration: float, breaks: Reals | None = None) -> Grid:
    """Return initial time elements of equal length, with additional edges at breaks and at jumps of the loads.

    Loads and accelerations are therefore smooth within each element.

    Parameters
    ----------
    breaks
        Instants just before discontinuities of drive laws or loads [s].
    """
    near, even = (
        VIBRATION.min_step * duration,
        Grid(start + duration * np.linspace(0.0, 1.0, VIBRATION.first_elements + 1)),
    )
    known = np.zeros(0) if breaks is None else breaks[breaks > start]
    if len(known):
        even = Grid(_with_breaks(even.edges, known, near))

    def forces(times: Reals) -> Reals:
        bent = deflection(model.motion_at(times), model.sections, model.joints)
        return given_forces(model.structure, bent)

    if model.cycle is None or len(model.structure.mechanism.beams) == 0 or _jumps_nowhere(model, even):
        return even
    jumped = jumps(forces, even.nodes)
    jumped = jumped[_apart(jumped, known, near)]
    edges = np.sort(np.append(even.edges, jumped))
    far = np.append(True, np.diff(edges) > near)
    return Grid(edges[far | np.isin(edges, known)]) if len(jumped) else even


def _with_breaks(edges: Reals, breaks: Reals, near: float) -> Reals:
    """Insert breaks into the edges of elements, replacing edges that are closer than `near` [s]."""
    kept = _apart(edges, breaks, near)
    kept[0], kept[-1] = True, edges[-1] - breaks.max() > VIBRATION.min_break_distance * np.ptp(edges)
    return np.sort(np.append(edges[kept], breaks))


def _apart(times: Reals, breaks: Reals, near: float) -> Flags:
    """Return for each instant whether it is farther than `near` from all breaks [s]."""
    return np.abs(times[:, None] - breaks).min(axis=1, initial=np.inf) > near


def _jumps_nowhere(model: Model, grid: Grid) -> bool:
    """Return whether the loads are certainly smooth: constant speed, no blocks on beams, and no load laws."""
    mechanism = model.structure.mechanism
    plain = all(isinstance(load, SMOOTH) and getattr(load, "law", None) is None for load in mechanism.loads)
    if not plain or mechanism.friction or mechanism.gears or trees_of(mechanism).rails:
        return False
    for motion in (model.looked_at, model.motion_at(grid.nodes)):
        if motion.drive_acceleration.any() or np.ptp(motion.drive_rate, axis=-1).any():
            return False
    return True


def first_discretization(model: Model, tolerance: float) -> Discretization:
    """Return the initial discretization."""
    assert model.cycle is not None
    return Discretization(model, near_modes(model.cycle), math.sqrt(tolerance), tolerance)


@dataclass(frozen=True, eq=False)
class Discretization:
    """Discretization of a solution: elastic coordinates, number of modes, and tolerance of the time elements.

    Attributes
    ----------
    model, modes, besides
        Elastic coordinates, number of modes, and smallest relative size of other shapes that the basis includes.
    resolved
        Tolerance of the time elements.
    start
        Function for the initial state, or None for a periodic solution.
    before, in_time, stalled
        Error before the last refinement, whether that refinement shortened the time elements, and whether the one
        before it failed to halve the error.
    closer
        See `reduced_basis`.
    """

    model: Model
    modes: int
    besides: float
    resolved: float
    start: Start | None = None
    before: float = math.inf
    in_time: bool = False
    stalled: bool = False
    closer: float = VIBRATION.load_accuracy

    @cached_property
    def basis(self) -> Reals:
        """Reduced basis, shape (n, r)."""
        assert self.model.cycle is not None
        return reduced_basis(self.model.cycle, self.modes, self.besides, self.closer)

    def per_coordinate_of(self, other: Discretization) -> Reals:
        """Return the coordinates closest in strain energy to unit coordinates of another discretization, (r, other)."""
        pushed = self.basis.T @ self.model.structure.stiffness
        return np.asarray(np.linalg.solve(pushed @ self.basis, pushed @ other.basis), float)

    @property
    def left_out(self) -> float:
        """Lowest natural frequency of a mode that the basis omits [rad/s]."""
        assert self.model.cycle is not None
        values = self.model.cycle.values[self.modes :]
        return 1.0 / math.sqrt(values[0]) if len(values) and values[0] > 0 else math.inf

    @property
    def fastest(self) -> float:
        """Frequency limit for the inertia of the residual response, above which the iteration would diverge [rad/s]."""
        return VIBRATION.max_frequency_ratio * self.left_out

    def wider(self) -> Discretization:
        """Return a discretization with twice as many modes, and shapes that represent the loads more accurately."""
        return replace(
            self, modes=min(2 * self.modes, len(self.model.structure.stiffness)), closer=VIBRATION.finer_load_accuracy
        )

    def complete(self, most: int) -> Discretization:
        """Return the discretization with all modes if there are at most `most`, or else this discretization."""
        count = len(self.model.structure.stiffness)
        return replace(self, modes=count) if count <= most else self

    def finer(self, error: float, most: float = math.inf) -> Discretization | None:
        """Return the next discretization, refined either in coordinates or in time.

        The last kind of refinement is repeated if it halved the error; otherwise the other kind is used. Return None if
        neither kind halved the error, or if more coordinates would exceed `most` amplitudes.
        """
        stalled = error > self.before / 2
        if stalled and self.stalled:
            return None
        in_time = self.in_time != stalled
        following = replace(self, before=error, in_time=in_time, stalled=stalled)
        if in_time:
            return replace(following, resolved=self.resolved / VIBRATION.finer_time)
        if 2 * self.modes > most:
            return None
        inner, known = self.model.inner + 2, self.model
        structure = elastic_structure(known.looked_at.mechanism, known.sections, known.joints, inner)
        if VIBRATION.mode_positions * len(structure.stiffness) * len(masses(structure)) > VIBRATION.max_mode_numbers:
            return None
        cycle = _modes(structure, known.looked_at, known.joints)
        model = replace(known, structure=structure, cycle=cycle, inner=inner)
        return replace(following, model=model, modes=min(2 * self.modes, len(structure.stiffness)))


def numbers_of(discretization: Discretization, grid: Grid) -> int:
    """Return the size of the mass accelerations for all amplitudes, by far the largest array of a discretization."""
    return numbers_per_amplitude(discretization, grid) * int(discretization.basis.shape[1])


def numbers_per_amplitude(discretization: Discretization, grid: Grid) -> int:
    """Return the size as in `numbers_of`, but for a single amplitude."""
    return 3 * len(grid.nodes) * len(masses(discretization.model.structure))


def halved(discretization: Discretization, grid: Grid) -> tuple[Discretization, Grid]:
    """Return a discretization with twice the modes, and a grid with half the element length."""
    return discretization.wider(), grid.divided(np.full(len(grid.steps), 2))


def worth_halving(mechanism: Mechanism, elements: int, bound: float, resolved: float) -> bool:
    """Return whether a bound on the discretization error exceeds `resolved` and halving the elements is affordable."""
    return bound > resolved and not has_dry_friction(mechanism) and elements <= VIBRATION.max_halved


def unlocked(bent: Deflection) -> Deflection:
    """Return the quasi-static deflection unchanged if friction does not lock the mechanism.

    Raises
    ------
    MechanismError
        If friction may lock the mechanism at a position.
    """
    locked = np.broadcast_to(bent.forces.locked, bent.motion.columns)
    if locked.any():
        raise MechanismError(f"friction may lock the mechanism at {bent.motion.time[locked][0]:.6g} s")
    return bent
