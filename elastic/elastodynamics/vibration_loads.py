"""Loads that vibration adds to those of the rigid motion: along beams, at points and in compliant joints.

The deflection of the vibrating mechanism is the quasi-static deflection under the loads of the rigid motion and the
loads of the vibration. It therefore includes the static response of shapes that the reduced coordinates cannot
represent. Its displacements and section forces are consistent except for round-off.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import lru_cache
from typing import Any

import numpy as np
from msgspec import Struct
from msgspec.structs import astuple
from numpy.polynomial import legendre

from elastic.elastodynamics.displacements import UNDER_BLOCK, Displacements
from elastic.elastodynamics.elastic_structure import ElasticStructure, opening_direction
from elastic.elastodynamics.equations_of_motion import Problem, mass_displacements, masses
from elastic.elastodynamics.point_effects import lumps_of, sliding_components
from elastic.elastodynamics.strains import rigidities
from elastic.links.added_loads import AddedLoads, map_loads
from rigid import Motion
from rigid import structure as joints_of
from rigid.arrays import Columns, Complexes, Numbers, Reals
from rigid.kinetostatics import beam_directions, creep_rate, friction_joints
from rigid.plane import cross


@lru_cache(maxsize=32)
def to_powers(points: int) -> Reals:
    """Return the matrix that maps values at Gauss points to coefficients in powers of xi, shape (points, points)."""
    nodes, _ = legendre.leggauss(points)
    series = np.linalg.inv(legendre.legvander(nodes, points - 1))
    in_xi = np.zeros((points, points))
    for order in range(points):
        one = legendre.Legendre.basis(order, domain=[0.0, 1.0])
        in_xi[: order + 1, order] = one.convert(kind=np.polynomial.Polynomial, domain=[-1.0, 1.0]).coef
    return in_xi @ series


class ResidualResponse(Struct, frozen=True, eq=False):
    """Residual response: part of a deflection that the reduced coordinates cannot represent, at the nodes of a grid.

    Attributes
    ----------
    moved
        Displacements, as a single displacement field (c = 1).
    forces
        Forces conjugate to the strains (see `strain_forces`), shape (nodes, rows); 0 for compliant joints.
    """

    moved: Displacements
    forces: Reals

    def __sub__(self, other: ResidualResponse) -> ResidualResponse:
        return ResidualResponse(self.moved - other.moved, self.forces - other.forces)

    def __add__(self, other: ResidualResponse) -> ResidualResponse:
        return ResidualResponse(self.moved + other.moved, self.forces + other.forces)

    def filtered(self, problem: Problem, cyclic: bool, cutoff: float) -> ResidualResponse:
        """Return the response, delayed by damping and then low-pass filtered with a cutoff frequency [rad/s].

        See `Grid.lagged` and `Grid.smoothed`. The time constant of the delay is the largest beta of all beams.
        """
        grid, lag = problem.terms.grid, problem.speed * float(np.max(problem.terms.damping.beams, initial=0.0))

        def slow(values: Numbers) -> Numbers:
            return grid.with_start(grid.smoothed(grid.lagged(values[1:], lag, cyclic), cutoff))

        return ResidualResponse(Displacements(*map(slow, astuple(self.moved))), slow(self.forces))

    def viscous(self, problem: Problem) -> Reals:
        """Return the damping forces at the points: beta times the rates of `forces`, shape (points, rows)."""
        terms = problem.terms
        beta = problem.speed * terms.damping.per_row(terms.kinematics.structure)
        return beta * terms.grid.derivative(self.forces[1:], 1)


class GatheredLoads:
    """Collector of loads from which `AddedLoads` are built. The first axis of its arrays runs over the positions."""

    def __init__(self, structure: ElasticStructure, count: int) -> None:
        self.structure = structure
        beams, points = structure.weights.shape
        self.q = np.zeros((count, beams, points), complex)
        self.points: list[tuple[int, str, Any, Any]] = []
        self.blocks: list[tuple[int, Any, Any]] = []

    def along_beams(self, force: Complexes) -> None:
        """Add forces per unit length at Gauss points in beam axes [N/m], complex, shape (positions, beams, points)."""
        self.q += force @ to_powers(force.shape[-1]).T

    @staticmethod
    def positions_last(values: Numbers) -> Numbers:
        """Move the last axis (powers of xi) to the front, and the first axis (positions) to the end."""
        return np.moveaxis(values, (-1, 0), (0, -1))

    def at_ends(self, directions: Complexes, start: Numbers, end: Numbers, moments: bool = False) -> None:
        """Add forces in beam axes (complex) at both ends of the beams, each of shape (positions, beams).

        If `moments` is True, `start` and `end` are moments instead.
        """
        for k, (at, beam) in enumerate(self.structure.mechanism.beams):
            for name, value in ((beam.start, start[:, k]), (beam.end, end[:, k])):
                pair = (0.0, value) if moments else (directions[:, k] * value, 0.0)
                self.points.append((at, name, *pair))


def vibration_loads(
    problem: Problem, motion: Motion, history: tuple[Reals, Reals, Reals], residual: ResidualResponse | None = None
) -> AddedLoads:
    """Compute the loads that vibration adds at the points of a grid.

    Parameters
    ----------
    motion
        Rigid motion at the nodes of the grid.
    history
        Amplitudes, rates and accelerations of the coordinates, each of shape (points, r).
    """
    x, x1, _ = history
    terms, kinematics = problem.terms, problem.terms.kinematics
    structure = kinematics.structure
    directions = beam_directions(motion).T[1:]
    acceleration = terms.accelerations(history)
    slope = (kinematics.unit.slope[1:] @ x[:, None, :, None])[..., 0]
    if residual is not None:
        displacements = mass_displacements(structure, motion, kinematics.chosen, residual.moved)[1:, :, 0]
        acceleration = acceleration + terms.grid.derivative(displacements, 2)
        slope = slope + residual.moved.slope[1:, ..., 0]
    inertia = (-(problem.speed**2) * masses(structure)) * acceleration
    gathered = GatheredLoads(structure, len(x))
    moment = _add_beam_inertia(gathered, problem, motion, slope, inertia)
    viscous = strain_rates(problem, x, x1)
    if residual is not None:
        viscous = viscous + residual.viscous(problem)
    add_strain_rate_loads(gathered, directions, viscous, moment)
    add_lump_inertia(gathered, motion, inertia)
    _add_point_effects(gathered, problem, x, x1, residual)
    gaps, turns = openings(gathered, motion, viscous)
    return AddedLoads(
        gathered.positions_last(gathered.q),
        tuple(gathered.points),
        tuple(gathered.blocks),
        gaps,
        turns,
        sliding=sliding_rates(problem, motion, x, x1),
    )


def _add_beam_inertia(
    gathered: GatheredLoads, problem: Problem, motion: Motion, slope: Reals, inertia: Complexes
) -> Reals:
    """Add inertia forces along the beams, and return the moment per unit length [N], (positions, beams, points)."""
    structure, geometric, directions = gathered.structure, problem.geometric, beam_directions(motion).T[1:]
    shape = (len(inertia), *structure.weights.shape)
    size = structure.weights.size
    force: Complexes = inertia[:, :size].reshape(shape)
    if geometric.follower_loads is not None:
        force = force + 1j * geometric.follower_loads[1:] * slope
    gathered.along_beams(np.conj(directions)[..., None] * force / structure.weights)
    moment = -geometric.axial[1:] * slope
    if structure.rotary.any():
        moment = moment + inertia[:, size : 2 * size].real.reshape(shape)
    return moment / structure.weights


def strain_rates(problem: Problem, x: Reals, x1: Reals) -> Reals:
    """Return the damping forces: beta times the rates of the elastic forces, shape (positions, rows)."""
    terms, structure = problem.terms, problem.terms.kinematics.structure
    rates = (terms.strains @ x1[..., None])[..., 0]
    if np.ndim(terms.strain_rate):
        rates = rates + (terms.strain_rate @ x[..., None])[..., 0]
    return rates * (problem.speed * rigidities(structure) * terms.damping.per_row(structure))


def add_strain_rate_loads(gathered: GatheredLoads, directions: Complexes, viscous: Reals, moment: Reals) -> None:
    """Convert damping forces and moments per unit length to loads along the beams and at their ends, and add them."""
    structure = gathered.structure
    shape = (len(viscous), *structure.weights.shape)
    size = structure.weights.size
    series = to_powers(shape[-1]).T
    power = np.arange(1, shape[-1]) / structure.length[:, None]
    stretching, bending = (
        (viscous[:, k * size : (k + 1) * size].reshape(shape) / structure.weights) @ series for k in (0, 1)
    )
    across = moment @ series
    across[..., :-1] += bending[..., 1:] * power
    gathered.q[..., :-1] += stretching[..., 1:] * power - 1j * across[..., 1:] * power
    axial = 1j * across - stretching
    gathered.at_ends(directions, -axial[..., 0], axial.sum(-1))
    gathered.at_ends(directions, bending[..., 0], -bending.sum(-1), moments=True)


def add_lump_inertia(gathered: GatheredLoads, motion: Motion, inertia: Complexes) -> None:
    """Add the inertia forces and moments of the lumps."""
    lumps = lumps_of(gathered.structure.mechanism)
    first = inertia.shape[1] - 2 * len(lumps)
    for number, (at, lump) in enumerate(lumps):
        force, moment = inertia[:, first + 2 * number], inertia[:, first + 2 * number + 1].real
        arm = motion.direction[at][1:] * np.ravel(lump.offset)[0]
        gathered.points.append((at, lump.point, force, moment + cross(arm, force)))


def _add_point_effects(
    gathered: GatheredLoads, problem: Problem, x: Reals, x1: Reals, residual: ResidualResponse | None
) -> None:
    """Add the forces of all `PointEffect`s except friction."""
    if not problem.geometric.effects:
        return
    kinematics, grid = problem.terms.kinematics, problem.terms.grid
    moved = kinematics.unit[1:] @ x[..., None]
    for effect in problem.geometric.effects:
        at_points = effect[1:]
        cause = at_points.cause(moved)[:, 0]
        residual_cause = 0.0 if residual is None else effect.cause(residual.moved)[1:, 0]
        amount = at_points.stiffness * (cause + residual_cause)
        if effect.is_friction:
            continue
        if np.any(at_points.damping):
            cause = effect.cause(kinematics.unit)
            rate = (grid.rates(cause)[0] * x + cause[1:] * x1).sum(axis=-1)
            amount = amount + problem.speed * at_points.damping * rate
        for point, force, moment in at_points.loads(-amount):
            at, name = kinematics.chosen[point]
            if name.startswith(UNDER_BLOCK):
                gathered.blocks.append((int(name.removeprefix(UNDER_BLOCK)), force, moment))
            else:
                gathered.points.append((at, name, force, moment))


def sliding_rates(problem: Problem, motion: Motion, x: Reals, x1: Reals) -> tuple[tuple[int, Reals, float], ...]:
    """Return the sliding rates that vibration adds at joints with friction, see `AddedLoads.sliding`.

    The rates of the residual response are neglected, because it may jump when a joint begins to stick or slip.
    """
    grid, kinematics = problem.terms.grid, problem.terms.kinematics
    rates = []
    friction = friction_joints(motion.mechanism)
    for (number, _), component in zip(friction, sliding_components(motion, kinematics.chosen), strict=True):
        unit = component(kinematics.unit)
        rate = (grid.rates(unit)[0] * x + unit[1:] * x1).sum(axis=-1)
        rates.append((number, problem.speed * rate, creep_rate(motion, number)))
    return tuple(rates)


def openings(
    gathered: GatheredLoads, motion: Motion, viscous: Reals
) -> tuple[tuple[Columns, ...], tuple[Columns, ...]]:
    """Return free openings (gaps and rotations) that are equivalent to the damping forces of compliant joints."""
    structure = gathered.structure
    joints = joints_of(structure.mechanism).joints
    gaps: list[Columns] = [0.0] * len(joints)
    turns: list[Columns] = [0.0] * len(joints)
    first = len(structure.stiffness) - len(structure.joint_openings)
    for number, opening in enumerate(structure.joint_openings):
        closed = -viscous[:, 3 * structure.weights.size + number] / structure.stiffness[first + number, first + number]
        if opening.kind == "turn":
            turns[opening.joint] = turns[opening.joint] + closed
            continue
        direction = opening_direction(opening, motion)
        gaps[opening.joint] = gaps[opening.joint] + closed * np.broadcast_to(direction, motion.columns)[1:]
    return tuple(gaps), tuple(turns)


def resampled(loads: AddedLoads, sampled: Callable[[Any], Any]) -> AddedLoads:
    """Interpolate loads to other instants.

    `sampled` is a function that interpolates values at the points of a grid, shape (points, k).
    """
    columns = loads.q.shape[-1]
    pairs = [item[-2:] for item in (*loads.points, *loads.blocks, *loads.sliding, *loads.slides)] + list(
        zip(loads.gaps, loads.turns, strict=True)
    )
    along = [part for part in (loads.q, loads.strain, loads.section) if part is not None]
    first = sum(part[..., 0].size for part in along)
    values = np.empty((first + 2 * len(pairs), columns), complex)
    values[:first] = np.concatenate([part.reshape(-1, columns) for part in along])
    for row, value in enumerate((value for pair in pairs for value in pair), start=first):
        values[row] = value
    sampled_values = sampled(values.T).T
    pairs_left = iter(zip(sampled_values[first::2], sampled_values[first + 1 :: 2].real, strict=True))
    points = tuple((*item[:2], *next(pairs_left)) for item in loads.points)
    blocks = tuple((item[0], *next(pairs_left)) for item in loads.blocks)
    sliding = tuple((item[0], *next(pairs_left)) for item in loads.sliding)
    slides = tuple((item[0], *next(pairs_left)) for item in loads.slides)
    gaps, turns = zip(*pairs_left, strict=True)
    ends = np.cumsum([part[..., 0].size for part in along])
    q, *others = (
        rows.reshape(*part.shape[:-1], sampled_values.shape[-1])
        for part, rows in zip(along, np.split(sampled_values[:first], ends[:-1]), strict=True)
    )
    strain = None if loads.strain is None else others.pop(0)
    section = None if loads.section is None else others.pop(0)
    return AddedLoads(q, points, blocks, gaps, turns, strain, section, sliding, slides)


def of_several_speeds(loads: Sequence[AddedLoads]) -> AddedLoads:
    """Combine loads of several speeds. Columns of shape (positions,) become columns of shape (speeds, positions)."""
    count = loads[0].q.shape[-1]

    def side_by_side(*parts: Any) -> Numbers:
        return np.stack([np.broadcast_to(part, (*np.shape(part)[:-1], count)) for part in parts], axis=-2)

    return map_loads(side_by_side, *loads)
