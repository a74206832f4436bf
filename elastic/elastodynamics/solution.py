"""From a motion to its vibration: coordinates and elements of time refined until the answer has settled."""

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
from elastic.elastodynamics.exact_steps import exact_deflection, has_dry_friction, with_friction
from elastic.elastodynamics.point_effects import chosen_points
from elastic.elastodynamics.reduced_vibration import Start, Vibration, vibration
from elastic.elastodynamics.reduction import CLOSELY, LOADED, CycleModes, cycle_of, near_modes, reduced_basis
from elastic.elastodynamics.settled import Settled, Sliding
from elastic.elastodynamics.strains import Damping, given_forces
from elastic.elastodynamics.time_grid import Grid, jumps
from elastic.elastodynamics.vibration_loads import resampled
from elastic.links.added_loads import AddedLoads
from elastic.links.beam_trees import trees_of
from elastic.links.sliding_blocks import block_places
from elastic.solution import Deflection, deflection
from rigid import SINGULAR, LineLoad, Mechanism, MechanismError, Motion, PointLoad, Spring, TorsionSpring, with_rates
from rigid.arrays import Flags, Integers, Numbers, Reals

MotionAt = Callable[[Any], Motion]

SMOOTH = (PointLoad, LineLoad, Spring, TorsionSpring)  # loads that jump nowhere, where no law says how they change
TOLERANCE = 1e-4
ELEMENTS = 12  # of time, at first
INNER = 4
LOOKED_AT = 16  # positions whose modes are looked at
MOST_LOOKED_AT = 40_000_000  # displacements of masses per coordinate there, beyond which coordinates are not refined
MOST_ELEMENTS = 2048
MOST_HALVED = 256  # elements, beyond which twice as many take seconds, and shares tell what they leave open
ORDER = 5  # with which the error in time falls at worst, for the next guess
SHORTEST = 1e-4  # element, as a share of the whole stretch of time
EDGE = 1e-8  # least distance of a break from the end of the stretch, relative to its duration: else it is the end
MOST_PARTS = 4  # into which an element is divided at once
GROWS = 2.0  # times as long as one before it is an element at most that follows those that are divided
ROUNDS = 6
RUBBED = 2  # rounds with friction, of which more coordinates seldom are what its steps lack
MOST_NUMBERS = 16_000_000  # accelerations of masses per amplitude: half a GB with all that is made of them
FINER = 20.0  # times as fine as asked, where time holds back what finer coordinates gain
TWICE = 2.0  # what contracts for certain: steps are mixed, and take somewhat more
LOST = 10.0  # times what it should be settled to, beyond which finer elements of time settle nothing
COARSE = 1e-2  # share to which friction is settled at most, before elements of time are fine
NOISE = 1e-6  # error in time below which it may be round-off, which shorter elements do not make less
IN_VAIN = 6  # rounds of shorter elements that do not halve such an error, after which it is taken for that
AHEAD = 0.1  # of the error in time, to which friction is settled on a grid that is not the last
SAFE = 4.0  # times what elements leave open by their series the answer's error in time was at most
NEUTRAL = 1e-6  # growth over a cycle that round-off and the method's own error leave open


@dataclass(frozen=True, eq=False)
class Elastodynamic:
    """A vibrating mechanism at some positions.

    Attributes
    ----------
    deflection
        Of the vibrating mechanism: all fields, joint forces and drive efforts; nan where it is not `stable`. N, V and M
        are what the strains make; damping adds beta times their rates.
    quasi_static
        The answer without vibration at the same positions.
    damping
        That was taken.
    lowest
        Lowest natural frequency over the cycle, the drives held [rad/s]; infinite where nothing vibrates.
    multipliers
        Floquet's, complex, shape (2 coordinates,): by what free vibrations grow over a cycle; none of a transient.
    coordinates, elements
        How many amplitudes were let vibrate, and in how many elements of time.
    time_error, reduction_error
        How far the answer may be from settled in time, and in the coordinates, as shares of the largest displacement.
    vibration
        In the coordinates that were let vibrate; None where nothing does.
    discretization
        With which it was computed; None where nothing vibrates.
    exact
        Links displaced by any amount, where the deflection is theirs; None where it is that of small displacements.
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
        """Times at which the elements of time begin and end [s]; none where nothing vibrates."""
        return np.zeros(0) if self.vibration is None else self.vibration.problem.terms.grid.edges

    @property
    def axial_error(self) -> float:
        """Error by the elements of time in axial forces, as a share of the largest one."""
        beams = self.vibration is not None and self.vibration.problem.terms.kinematics.structure.weights.size
        return SAFE * float(self.vibration.unresolved_axial.max(initial=0.0)) if self.vibration and beams else 0.0

    @property
    def growth(self) -> float:
        """Of the least stable free vibration over a cycle: below 1 it dies out."""
        return float(np.abs(self.multipliers).max(initial=0.0))

    @property
    def stable(self) -> bool:
        """Whether all free vibrations die out, so that the steady state comes about."""
        return self.growth <= 1 + NEUTRAL


@dataclass(frozen=True, eq=False)
class Model:
    """A mechanism that is to vibrate, with the positions at which its modes are taken."""

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
    """Elastic coordinates, modes and damping of a mechanism over a stretch of time."""
    if designs_of(tuple(sections)):
        raise ValueError(f"sections of {designs_of(tuple(sections))[0]} designs: expected one design")
    looked_at = checked(motion_at(start + duration * np.arange(LOOKED_AT) / LOOKED_AT))
    structure = elastic_structure(looked_at.mechanism, sections, joints, INNER)
    cycle = _modes(structure, looked_at, joints)
    if not isinstance(damping, Damping):
        beta = math.nan if damping is None else float(damping)
        damping = Damping(np.full(len(sections), beta), beta)
    damping = damping.settled(float(cycle.omega.min()) if cycle else math.inf)
    return Model(motion_at, sections, joints, damping, looked_at, structure, cycle, INNER)


def _modes(structure: ElasticStructure, motion: Motion, joints: Mapping[str, JointCompliance]) -> CycleModes | None:
    """Modes of elastic coordinates over some positions of the cycle; None where nothing vibrates."""
    if not len(structure.stiffness):
        return None
    slow = with_rates(motion, 0.0)
    loaded = [unlocked(deflection(each, structure.sections, joints)) for each in (motion, slow)]
    cycle = cycle_of(structure, motion, loaded)
    return cycle if cycle.values[0] > 0 else None  # without mass nothing vibrates


def checked(motion: Motion) -> Motion:
    """A motion, checked to be of one design and nowhere singular.

    Raises
    ------
    MechanismError
        A position is singular or cannot be reached.
    ValueError
        There are several designs.
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
    """First elements of time: even ones, which begin anew at breaks and where loads jump.

    Within an element nothing jumps then, as the load of a machine that resists one way, or an acceleration by a law.

    Parameters
    ----------
    breaks
        Instants just before laws of drives or loads break off [s].
    """
    near, even = SHORTEST * duration, Grid(start + duration * np.linspace(0.0, 1.0, ELEMENTS + 1))
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
    """Edges of elements with breaks among them, in place of edges that are nearer to one than `near` [s]."""
    kept = _apart(edges, breaks, near)
    kept[0], kept[-1] = True, edges[-1] - breaks.max() > EDGE * np.ptp(edges)
    return np.sort(np.append(edges[kept], breaks))


def _apart(times: Reals, breaks: Reals, near: float) -> Flags:
    """Whether instants are farther than `near` [s] from all breaks."""
    apart: Flags = np.abs(times[:, None] - breaks).min(axis=1, initial=np.inf) > near
    return apart


def _jumps_nowhere(model: Model, grid: Grid) -> bool:
    """Whether loads change smoothly for sure: drives at constant speed, no block on a beam, and no load by a law."""
    mechanism = model.structure.mechanism
    plain = all(isinstance(load, SMOOTH) and getattr(load, "law", None) is None for load in mechanism.loads)
    if not plain or mechanism.friction or mechanism.gears or trees_of(mechanism).rails:
        return False
    for motion in (model.looked_at, model.motion_at(grid.nodes)):
        if motion.drive_acceleration.any() or np.ptp(motion.drive_rate, axis=-1).any():
            return False
    return True


def settled(model: Model, motion: Motion, grid: Grid, tolerance: float, start: Start | None = None) -> Elastodynamic:
    """Refine elements of time, then coordinates, until the answer at the positions of a motion has settled.

    Without a `start` it is the steady state of a cycle as long as the grid.
    """
    plain = deflection(checked(motion), model.sections, model.joints)
    if model.cycle is None:
        none = np.zeros(0, complex)
        return Elastodynamic(plain, plain, model.damping, np.inf, none, 0, 0, 0.0, 0.0)
    lowest = float(model.cycle.omega.min())
    discretization = replace(first_discretization(model, tolerance), start=start)
    best: Any = None
    for _ in range(RUBBED if has_dry_friction(motion.mechanism) else ROUNDS):
        solved, reduced, grid, in_elements = resolved_in_time(discretization, grid, tolerance)
        off = reduced + in_elements
        if best is None or off < best[0]:  # more coordinates may settle less, where loads jump
            best = off, solved, reduced, grid, in_elements, discretization
        unstable = np.abs(solved.multipliers).max(initial=0.0) > 1 + NEUTRAL
        finer = (
            None
            if reduced <= tolerance or unstable or in_elements > discretization.resolved
            else discretization.finer(reduced, MOST_NUMBERS // numbers_per_amplitude(discretization, grid))
        )
        if finer is None or numbers_of(finer, grid) > MOST_NUMBERS:
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
    """Deflection of the vibrating mechanism at other positions of its motion than it was asked for."""
    plain = answer.quasi_static
    if answer.vibration is None:
        return deflection(motion, plain.sections, plain.joints)
    grid, time = answer.vibration.problem.terms.grid, motion.time
    sampler = grid.sampler(grid.cycled(time) if answer.vibration.cyclic else time)
    if answer.exact is not None:
        return exact_deflection(answer.exact.displaced, replace(plain, motion=motion), sampler)
    return deflection(motion, plain.sections, plain.joints, resampled(answer.vibration.loads, sampler))


def numbers_of(discretization: Discretization, grid: Grid) -> int:
    """Numbers in the accelerations of the masses per amplitude, by far the largest array of a discretization."""
    return numbers_per_amplitude(discretization, grid) * int(discretization.basis.shape[1])


def numbers_per_amplitude(discretization: Discretization, grid: Grid) -> int:
    """The same of a single amplitude."""
    return 3 * len(grid.nodes) * len(masses(discretization.model.structure))


def resolved_in_time(
    discretization: Discretization, grid: Grid, tolerance: float
) -> tuple[Vibration, float, Grid, float]:
    """The vibration in elements of time as short as it takes, with its errors by coordinates and by elements."""
    resolved: Any = None
    rubs, loose = has_dry_friction(discretization.model.structure.mechanism), COARSE
    least, in_vain = math.inf, 0
    sliding: Sliding = ()
    while True:
        resolved = None  # it makes room for the finer one
        resolved = vibration_in(discretization, grid)
        if rubs:
            resolved, rubbed = with_friction(resolved, loose, discretization.fastest_inertia, sliding)
        error, finer = time_error(resolved, discretization.resolved)
        in_vain = in_vain + 1 if 0.5 * least <= error < NOISE else 0
        least = min(least, error)
        finer = finer if in_vain < IN_VAIN else None
        if finer is None and not rubs:
            return *corrected(resolved, tolerance), grid, error
        if (finer is None and loose <= tolerance) or (rubs and rubbed.open > LOST * loose):
            return resolved, rubbed.open, grid, error
        if rubs:
            loose = max(tolerance, min(COARSE, AHEAD * error)) if finer else tolerance
            sliding = _sampled(rubbed.sliding, grid, finer or grid)
        grid = finer or grid


def vibration_in(discretization: Discretization, grid: Grid) -> Vibration:
    """The vibration in given elements of time."""
    model, basis = discretization.model, discretization.basis
    motion = checked(model.motion_at(grid.nodes))
    bent = unlocked(deflection(motion, model.sections, model.joints))
    kinds = kinematics(model.structure, motion, basis, chosen_points(model.structure.mechanism))
    return bounded(vibration(motion_terms(kinds, grid, model.damping), bent, discretization.start))


def halved(discretization: Discretization, grid: Grid) -> tuple[Discretization, Grid]:
    """A finer discretization: elements of time half as long, and twice as many modes."""
    return discretization.wider(), grid.divided(np.full(len(grid.steps), 2))


def worth_halving(mechanism: Mechanism, elements: int) -> bool:
    """Whether a discretization of so many elements of time is worth the time that a finer one takes."""
    return not has_dry_friction(mechanism) and elements <= MOST_HALVED


def bounded(answer: Vibration) -> Vibration:
    """A vibration, checked to be finite.

    Raises
    ------
    MechanismError
        It grows beyond all numbers, mostly since a node came too near to a singular position for its loads to be known.
    """
    lost = ~np.isfinite(answer.history[0]).all(axis=-1)
    if lost.any():
        time = answer.motion.time[1:][lost][0]
        raise MechanismError(f"it has no bound from {time:.6g} s on, as near a singular position")
    return answer


def _sampled(sliding: Sliding, known: Grid, grid: Grid) -> Sliding:
    """Rates of the joints with friction at the points of another grid."""
    sampler = known.sampler(grid.nodes[1:])
    return tuple((number, sampler(rate), creep) for number, rate, creep in sliding)


def unlocked(bent: Deflection) -> Deflection:
    """A quasi-static answer, checked not to be locked by friction.

    Raises
    ------
    MechanismError
        Friction may lock the mechanism at a position.
    """
    locked = np.broadcast_to(bent.forces.locked, bent.motion.columns)
    if locked.any():
        raise MechanismError(f"friction may lock the mechanism at {bent.motion.time[locked][0]:.6g} s")
    return bent


def time_error(resolved: Vibration, tolerance: float) -> tuple[float, Grid | None]:
    """Error by the elements of time, as a share of the largest displacement; finer ones where that is too much.

    A step of the loads stays one however short its element: such elements do not count.
    """
    grid = resolved.problem.terms.grid
    error = np.where(grid.steps > SHORTEST * np.ptp(grid.edges), SAFE * resolved.unresolved, 0.0)
    if error.max() <= tolerance or len(error) > MOST_ELEMENTS:
        return float(error.max()), None
    parts = np.clip(np.ceil((error / tolerance) ** (1 / ORDER)), 1, MOST_PARTS).astype(int)
    return float(error.max()), grid.divided(_graded(grid.steps, parts))


def _graded(steps: Reals, parts: Integers) -> Integers:
    """Parts of elements, more where one follows a much shorter one that is divided.

    What rings there goes on into it, where it is damped for want of resolution, and would be seen only later.
    """
    graded, longest = parts.copy(), math.inf
    for number, step in enumerate(steps):
        graded[number] = max(parts[number], min(math.ceil(step / longest), MOST_PARTS**2))
        longest = GROWS * (step / graded[number] if parts[number] > 1 else longest)
    return graded


def first_discretization(model: Model, tolerance: float) -> Discretization:
    """Discretization that an answer is tried with first."""
    assert model.cycle is not None
    return Discretization(model, near_modes(model.cycle), math.sqrt(tolerance), tolerance)


@dataclass(frozen=True, eq=False)
class Discretization:
    """Discretization of an answer: elastic coordinates, their modes, and elements of time.

    Attributes
    ----------
    model, modes, besides
        Elastic coordinates, how many modes of them are let vibrate, and from what share of these other combinations.
    resolved
        What elements of time may leave open.
    start
        From which it vibrates; None for the state that comes back.
    before, in_time, stalled
        How far the answer was off before what was refined last; whether that was time; whether it gained nothing.
    closer
        As of `reduced_basis`.
    """

    model: Model
    modes: int
    besides: float
    resolved: float
    start: Start | None = None
    before: float = math.inf
    in_time: bool = False
    stalled: bool = False
    closer: float = LOADED

    @cached_property
    def basis(self) -> Reals:
        """Of the coordinates that are let vibrate, shape (n, r)."""
        assert self.model.cycle is not None
        return reduced_basis(self.model.cycle, self.modes, self.besides, self.closer)

    def per_coordinate_of(self, other: Discretization) -> Reals:
        """Amounts of its coordinates per unit of another one's, nearest in energy of strain, shape (r, other's r)."""
        pushed = self.basis.T @ self.model.structure.stiffness
        return np.asarray(np.linalg.solve(pushed @ self.basis, pushed @ other.basis), float)

    @property
    def left_out(self) -> float:
        """Lowest natural frequency of which the mode is not let vibrate by itself [rad/s]."""
        assert self.model.cycle is not None
        values = self.model.cycle.values[self.modes :]
        return 1.0 / math.sqrt(values[0]) if len(values) and values[0] > 0 else math.inf

    @property
    def fastest_inertia(self) -> float:
        """Angular frequency up to which inertia beside the coordinates is taken: faster, steps would grow [rad/s]."""
        return TWICE * self.left_out

    @property
    def fastest(self) -> float:
        """The same of inertia and of damping, beyond which the forces of rates exceed those of strains [rad/s]."""
        with np.errstate(divide="ignore"):
            return min(self.fastest_inertia, TWICE * float(1.0 / np.max(self.model.damping.beams, initial=0.0)))

    def wider(self) -> Discretization:
        """The same with twice as many modes of its elastic coordinates, and shapes of loads followed closely."""
        return replace(self, modes=min(2 * self.modes, len(self.model.structure.stiffness)), closer=CLOSELY)

    def complete(self, most: int) -> Discretization:
        """Return the same with all modes of its elastic coordinates, if these are `most` or fewer."""
        count = len(self.model.structure.stiffness)
        return replace(self, modes=count) if count <= most else self

    def finer(self, error: float, most: float = math.inf) -> Discretization | None:
        """More coordinates, or shorter elements where these gain nothing; None where neither does.

        None, too, where it would be more than `most` amplitudes.
        """
        stalled = error > self.before / 2
        if stalled and self.stalled:
            return None
        in_time = self.in_time != stalled
        following = replace(self, before=error, in_time=in_time, stalled=stalled)
        if in_time:
            return replace(following, resolved=self.resolved / FINER)
        if 2 * self.modes > most:
            return None
        inner, known = self.model.inner + 2, self.model
        structure = elastic_structure(known.looked_at.mechanism, known.sections, known.joints, inner)
        if LOOKED_AT * len(structure.stiffness) * len(masses(structure)) > MOST_LOOKED_AT:
            return None
        cycle = _modes(structure, known.looked_at, known.joints)
        model = replace(known, structure=structure, cycle=cycle, inner=inner)
        return replace(following, model=model, modes=min(2 * self.modes, len(structure.stiffness)))


def unanswered(answer: Elastodynamic) -> Elastodynamic:
    """With nan in place of fields that will not come about."""
    nothing = AddedLoads(np.full((1, *answer.deflection.q.shape[1:]), np.nan, complex), (), (), *_still(answer))
    own = answer.quasi_static
    return replace(answer, deflection=deflection(own.motion, own.sections, own.joints, nothing))


def _still(found: Elastodynamic) -> tuple[Any, Any]:
    zeros = (0.0,) * len(found.deflection.motion.structure.joints)
    return zeros, zeros
