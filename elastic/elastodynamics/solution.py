"""Vibration from a motion: refinement of coordinates and time elements to a tolerance."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np

from elastic.beams.compliance import designs_of
from elastic.beams.section import JointCompliance, Section
from elastic.elastodynamics.correction import corrected
from elastic.elastodynamics.elastic_structure import ElasticStructure, elastic_structure
from elastic.elastodynamics.equations_of_motion import kinematics, masses, motion_terms
from elastic.elastodynamics.exact_residual import loaded
from elastic.elastodynamics.exact_steps import exact_deflection, has_dry_friction, with_friction
from elastic.elastodynamics.point_effects import chosen_points
from elastic.elastodynamics.reduced_vibration import Start, Vibration, vibration
from elastic.elastodynamics.reduction import CycleModes, cycle_of, near_modes, reduced_basis
from elastic.elastodynamics.settled import Settled, Sliding
from elastic.elastodynamics.strains import Damping, given_forces
from elastic.elastodynamics.time_grid import Grid, jumps
from elastic.elastodynamics.vibration_loads import resampled
from elastic.elastodynamics.vibration_settings import VIBRATION
from elastic.links.added_loads import AddedLoads
from elastic.links.beam_trees import trees_of
from elastic.links.sliding_blocks import block_places
from elastic.solution import Deflection, deflection
from rigid import SINGULAR, LineLoad, Mechanism, MechanismError, Motion, PointLoad, Spring, TorsionSpring, with_rates
from rigid.arrays import Complexes, Flags, Integers, Numbers, Reals

MotionAt = Callable[[Any], Motion]

SMOOTH = (PointLoad, LineLoad, Spring, TorsionSpring)  # loads without jumps, unless a law changes them
TOLERANCE = 1e-4


@dataclass(frozen=True, eq=False)
class Elastodynamic:
    """Vibrating mechanism at some positions.

    Attributes
    ----------
    deflection
        All fields, joint forces and drive efforts of the vibrating mechanism; nan if not `stable`. N, V and M are
        elastic; damping adds beta times their rates.
    quasi_static
        Answer without vibration at the same positions.
    damping
        Damping used.
    lowest
        Lowest natural frequency over the cycle with held drives [rad/s]; inf if nothing vibrates.
    multipliers
        Floquet multipliers, complex, shape (2 coordinates,): growth of free vibrations per cycle; empty for a
        transient.
    coordinates, elements
        Number of amplitudes, and of time elements.
    time_error, reduction_error
        Errors by time elements and by coordinates, relative to the largest displacement.
    vibration
        Vibration in reduced coordinates; None if nothing vibrates.
    discretization
        Discretization used; None if nothing vibrates.
    exact
        Links with large displacement, if the deflection is theirs; None for small displacements.
    """

    deflection: Deflection
    quasi_static: Deflection
    damping: Damping
    lowest: float
    multipliers: Numbers
    coordinates: int
    elements: int
    time_error: float
    reduction_error: float
    vibration: Vibration | None = None
    discretization: Discretization | None = None
    exact: Settled | None = None

    def __repr__(self) -> str:
        return f"Elastodynamic({self.coordinates} coordinates, {self.elements} elements, growth {self.growth:.3g})"

    @property
    def edges(self) -> Reals:
        """Edges of the time elements [s]; empty if nothing vibrates."""
        return np.zeros(0) if self.vibration is None else self.vibration.problem.terms.grid.edges

    @cached_property
    def force_error(self) -> float:
        """Error of section and joint forces by the time elements, relative to the largest force of each kind.

        Forces depend on accelerations, so they are resolved worse than displacements.
        """
        if self.vibration is None:
            return 0.0
        exact = self.exact
        return force_error(self.vibration, (exact.displaced.force, exact.displaced.joints) if exact else None)

    @property
    def growth(self) -> float:
        """Growth of the least stable free vibration per cycle; below 1 it decays."""
        return float(np.abs(self.multipliers).max(initial=0.0))

    @property
    def stable(self) -> bool:
        """True if all free vibrations decay, so that a steady state exists."""
        return self.growth <= 1 + VIBRATION.max_neutral_growth


@dataclass(frozen=True, eq=False)
class Model:
    """Mechanism for vibration, with the positions at which its modes are computed."""

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
    """Set up elastic coordinates, modes and damping of a mechanism over a period of time."""
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
    """Modes of elastic coordinates over some positions of the cycle; None if nothing vibrates."""
    if not len(structure.stiffness):
        return None
    slow = with_rates(motion, 0.0)
    loaded = [unlocked(deflection(each, structure.sections, joints)) for each in (motion, slow)]
    cycle = cycle_of(structure, motion, loaded)
    return cycle if cycle.values[0] > 0 else None  # without mass nothing vibrates


def checked(motion: Motion) -> Motion:
    """Return a motion if it has one design and no singular position.

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
    for number, (first, *_) in zip(links.rails, block_places(motion, links), strict=True):
        off = ~np.isfinite(np.broadcast_to(first.xi, motion.columns))
        name = motion.structure.joints[number].name
        if off.any():
            raise MechanismError(f'the block of "{name}" leaves its beam at {motion.time[off][0]:.6g} s')
    return motion


def first_grid(model: Model, start: float, duration: float, breaks: Reals | None = None) -> Grid:
    """Initial time elements: even, with additional edges at breaks and jumps of the loads.

    So loads and accelerations are smooth within each element.

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
    """Insert breaks into element edges, in place of edges closer than `near` [s]."""
    kept = _apart(edges, breaks, near)
    kept[0], kept[-1] = True, edges[-1] - breaks.max() > VIBRATION.min_break_distance * np.ptp(edges)
    return np.sort(np.append(edges[kept], breaks))


def _apart(times: Reals, breaks: Reals, near: float) -> Flags:
    """True for each instant farther than `near` [s] from all breaks."""
    apart: Flags = np.abs(times[:, None] - breaks).min(axis=1, initial=np.inf) > near
    return apart


def _jumps_nowhere(model: Model, grid: Grid) -> bool:
    """True if loads are certainly smooth: constant speed, no blocks on beams, no laws of loads."""
    mechanism = model.structure.mechanism
    plain = all(isinstance(load, SMOOTH) and getattr(load, "law", None) is None for load in mechanism.loads)
    if not plain or mechanism.friction or mechanism.gears or trees_of(mechanism).rails:
        return False
    for motion in (model.looked_at, model.motion_at(grid.nodes)):
        if motion.drive_acceleration.any() or np.ptp(motion.drive_rate, axis=-1).any():
            return False
    return True


def settled(model: Model, motion: Motion, grid: Grid, tolerance: float, start: Start | None = None) -> Elastodynamic:
    """Refine time elements, then coordinates, until the answer at the positions of a motion has converged.

    Without a `start`, computes the steady state of a cycle as long as the grid.
    """
    plain = deflection(checked(motion), model.sections, model.joints)
    if model.cycle is None:
        none = np.zeros(0, complex)
        return Elastodynamic(plain, plain, model.damping, np.inf, none, 0, 0, 0.0, 0.0)
    lowest = float(model.cycle.omega.min())
    discretization = replace(first_discretization(model, tolerance), start=start)
    best: Any = None
    for _ in range(
        VIBRATION.max_refinements_with_friction if has_dry_friction(motion.mechanism) else VIBRATION.max_refinements
    ):
        solved, reduced, grid, in_elements = resolved_in_time(discretization, grid, tolerance)
        off = reduced + in_elements
        if best is None or off < best[0]:  # more coordinates may be worse if loads jump
            best = off, solved, reduced, grid, in_elements, discretization
        unstable = np.abs(solved.multipliers).max(initial=0.0) > 1 + VIBRATION.max_neutral_growth
        finer = (
            None
            if reduced <= tolerance or unstable or in_elements > discretization.resolved
            else discretization.finer(reduced, VIBRATION.max_numbers // numbers_per_amplitude(discretization, grid))
        )
        if finer is None or numbers_of(finer, grid) > VIBRATION.max_numbers:
            break
        discretization = finer
    _, solved, reduced, grid, in_elements, discretization = best
    loads = resampled(solved.loads, grid.sampler(grid.cycled(motion.time) if solved.cyclic else motion.time))
    bent = deflection(motion, model.sections, model.joints, loads)
    size = solved.history[0].shape[1]
    answer = Elastodynamic(
        bent,
        plain,
        model.damping,
        lowest,
        solved.multipliers,
        size,
        len(grid.steps),
        in_elements,
        reduced,
        solved,
        discretization,
    )
    return answer if answer.stable else unanswered(answer)


def deflection_at(answer: Elastodynamic, motion: Motion) -> Deflection:
    """Deflection of the vibrating mechanism at other positions of its motion."""
    plain = answer.quasi_static
    if answer.vibration is None:
        return deflection(motion, plain.sections, plain.joints)
    grid, time = answer.vibration.problem.terms.grid, motion.time
    sampler = grid.sampler(grid.cycled(time) if answer.vibration.cyclic else time)
    if answer.exact is not None:
        return exact_deflection(answer.exact.displaced, replace(plain, motion=motion), sampler)
    return deflection(motion, plain.sections, plain.joints, resampled(answer.vibration.loads, sampler))


def numbers_of(discretization: Discretization, grid: Grid) -> int:
    """Size of the mass accelerations per amplitude, by far the largest array of a discretization."""
    return numbers_per_amplitude(discretization, grid) * int(discretization.basis.shape[1])


def numbers_per_amplitude(discretization: Discretization, grid: Grid) -> int:
    """Size as in `numbers_of`, for a single amplitude."""
    return 3 * len(grid.nodes) * len(masses(discretization.model.structure))


def resolved_in_time(
    discretization: Discretization, grid: Grid, tolerance: float
) -> tuple[Vibration, float, Grid, float]:
    """Refine time elements to the tolerance; return the vibration, coordinate error, grid and time error."""
    resolved: Any = None
    rubs, loose = has_dry_friction(discretization.model.structure.mechanism), VIBRATION.first_friction_tolerance
    least, in_vain = math.inf, 0
    sliding: Sliding = ()
    while True:
        resolved = None  # frees memory for the finer one
        resolved = vibration_in(discretization, grid)
        if rubs:
            resolved, rubbed = with_friction(resolved, loose, discretization.fastest_inertia, sliding)
        error, finer = time_error(resolved, discretization.resolved)
        in_vain = in_vain + 1 if 0.5 * least <= error < VIBRATION.max_round_off else 0
        least = min(least, error)
        finer = finer if in_vain < VIBRATION.patience else None
        if finer is None and not rubs:
            return *corrected(resolved, tolerance), grid, error
        if (finer is None and loose <= tolerance) or (rubs and rubbed.open > VIBRATION.max_residual_ratio * loose):
            return resolved, rubbed.open, grid, error
        if rubs:
            loose = (
                max(tolerance, min(VIBRATION.first_friction_tolerance, VIBRATION.friction_share * error))
                if finer
                else tolerance
            )
            sliding = _sampled(rubbed.sliding, grid, finer or grid)
        grid = finer or grid


def vibration_in(discretization: Discretization, grid: Grid) -> Vibration:
    """Compute the vibration on a given time grid."""
    model, basis = discretization.model, discretization.basis
    motion = checked(model.motion_at(grid.nodes))
    bent = unlocked(deflection(motion, model.sections, model.joints))
    kinds = kinematics(model.structure, motion, basis, chosen_points(model.structure.mechanism))
    return bounded(vibration(motion_terms(kinds, grid, model.damping), bent, discretization.start))


def halved(discretization: Discretization, grid: Grid) -> tuple[Discretization, Grid]:
    """Finer discretization with half the element length and twice the modes."""
    return discretization.wider(), grid.divided(np.full(len(grid.steps), 2))


def worth_halving(mechanism: Mechanism, elements: int) -> bool:
    """True if a finer discretization of this size is worth its time."""
    return not has_dry_friction(mechanism) and elements <= VIBRATION.max_halved


def bounded(answer: Vibration) -> Vibration:
    """Return a vibration if it is finite.

    Raises
    ------
    MechanismError
        If it is unbounded, usually because a node is too close to a singular position.
    """
    lost = ~np.isfinite(answer.history[0]).all(axis=-1)
    if lost.any():
        time = answer.motion.time[1:][lost][0]
        raise MechanismError(f"it has no bound from {time:.6g} s on, as near a singular position")
    return answer


def _sampled(sliding: Sliding, known: Grid, grid: Grid) -> Sliding:
    """Rates of joints with friction at the points of another grid."""
    sampler = known.sampler(grid.nodes[1:])
    return tuple((number, sampler(rate), creep) for number, rate, creep in sliding)


def unlocked(bent: Deflection) -> Deflection:
    """Return a quasi-static answer if friction does not lock it.

    Raises
    ------
    MechanismError
        If friction may lock the mechanism at a position.
    """
    locked = np.broadcast_to(bent.forces.locked, bent.motion.columns)
    if locked.any():
        raise MechanismError(f"friction may lock the mechanism at {bent.motion.time[locked][0]:.6g} s")
    return bent


def time_error(resolved: Vibration, tolerance: float) -> tuple[float, Grid | None]:
    """Error by the time elements, relative to the largest displacement; a finer grid if it exceeds the tolerance.

    The shortest elements do not count: a step of the loads stays a step in any element.
    """
    grid = resolved.problem.terms.grid
    error = np.where(_counted(grid), VIBRATION.time_error_ratio * resolved.unresolved, 0.0)
    if error.max() <= tolerance or len(error) > VIBRATION.max_elements:
        return float(error.max()), None
    parts = np.clip(np.ceil((error / tolerance) ** (1 / VIBRATION.order)), 1, VIBRATION.max_parts).astype(int)
    return float(error.max()), grid.divided(_graded(grid.steps, parts))


def force_error(vibration: Vibration, forces: tuple[Complexes, Complexes] | None = None) -> float:
    """Error of section and joint forces by the time elements, relative to the largest force of each kind.

    `forces` at the nodes, shape (nodes, ...); default: those of the vibration.
    """
    grid = vibration.problem.terms.grid
    if forces is None:
        known = loaded(vibration, vibration.deflection)
        forces = known.force, known.joints
    kinds = [values[1:].reshape(len(values) - 1, -1) for values in forces]
    tails = [grid.tail(each, np.abs(each).max(initial=0.0)) for each in kinds if each.size]
    return VIBRATION.time_error_ratio * max(
        (float(tail[_counted(grid)].max(initial=0.0)) for tail in tails), default=0.0
    )


def _counted(grid: Grid) -> Flags:
    """Mark the elements that are long enough to be divided."""
    counted: Flags = grid.steps > VIBRATION.min_step * np.ptp(grid.edges)
    return counted


def _graded(steps: Reals, parts: Integers) -> Integers:
    """Increase the parts of elements that follow a much shorter divided element.

    Otherwise vibration excited in the short element would be damped in a coarse next one, and be discovered late.
    """
    graded, longest = parts.copy(), math.inf
    for number, step in enumerate(steps):
        graded[number] = max(parts[number], min(math.ceil(step / longest), VIBRATION.max_parts**2))
        longest = VIBRATION.max_step_ratio * (step / graded[number] if parts[number] > 1 else longest)
    return graded


def first_discretization(model: Model, tolerance: float) -> Discretization:
    """First discretization to try."""
    assert model.cycle is not None
    return Discretization(model, near_modes(model.cycle), math.sqrt(tolerance), tolerance)


@dataclass(frozen=True, eq=False)
class Discretization:
    """Discretization of an answer: elastic coordinates, modes, time tolerance.

    Attributes
    ----------
    model, modes, besides
        Elastic coordinates, number of their modes, and smallest share of other shapes in the basis.
    resolved
        Tolerance of time elements.
    start
        Initial state; None for a periodic solution.
    before, in_time, stalled
        Error before the last refinement; True if that was in time; True if it gained nothing.
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
        """Coordinates closest in strain energy to unit coordinates of another discretization, shape (r, other's r)."""
        pushed = self.basis.T @ self.model.structure.stiffness
        return np.asarray(np.linalg.solve(pushed @ self.basis, pushed @ other.basis), float)

    @property
    def left_out(self) -> float:
        """Lowest natural frequency of a mode without its own coordinate [rad/s]."""
        assert self.model.cycle is not None
        values = self.model.cycle.values[self.modes :]
        return 1.0 / math.sqrt(values[0]) if len(values) and values[0] > 0 else math.inf

    @property
    def fastest_inertia(self) -> float:
        """Frequency limit of inertia beyond the coordinates [rad/s]; above it the iteration would diverge."""
        return VIBRATION.max_frequency_ratio * self.left_out

    @property
    def fastest(self) -> float:
        """Frequency limit for inertia and damping; above it damping forces exceed elastic ones [rad/s]."""
        with np.errstate(divide="ignore"):
            return min(
                self.fastest_inertia,
                VIBRATION.max_frequency_ratio * float(1.0 / np.max(self.model.damping.beams, initial=0.0)),
            )

    def wider(self) -> Discretization:
        """Discretization with twice as many modes, and closer shapes of loads."""
        return replace(
            self, modes=min(2 * self.modes, len(self.model.structure.stiffness)), closer=VIBRATION.finer_load_accuracy
        )

    def complete(self, most: int) -> Discretization:
        """Discretization with all modes, if there are at most `most`."""
        count = len(self.model.structure.stiffness)
        return replace(self, modes=count) if count <= most else self

    def finer(self, error: float, most: float = math.inf) -> Discretization | None:
        """Next discretization: more coordinates, or shorter elements if these gain nothing; None if neither helps.

        Also None if it would exceed `most` amplitudes.
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


def unanswered(answer: Elastodynamic) -> Elastodynamic:
    """Replace the fields of an answer without steady state by nan."""
    nothing = AddedLoads(np.full((1, *answer.deflection.q.shape[1:]), np.nan, complex), (), (), *_still(answer))
    own = answer.quasi_static
    return replace(answer, deflection=deflection(own.motion, own.sections, own.joints, nothing))


def _still(found: Elastodynamic) -> tuple[Any, Any]:
    zeros = (0.0,) * len(found.deflection.motion.structure.joints)
    return zeros, zeros
