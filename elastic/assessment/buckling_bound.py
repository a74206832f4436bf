"""Upper bound on the ratio of load to critical load (load ratio), for arrays of positions and designs.

The compression P of a span does work on the slope of the span. This slope is c + w': c is the rotation of the chord, w
is the deflection from the chord, and w' = dw/dx. Since w is zero at both ends of the chord of length L,

    P int (c + w')^2 dx = P L c^2 + P int w'^2 dx <= P L c^2 + (P/P_E + P/kGA) U,

where P_E is the Euler load of the pinned span, and U is twice the strain energy of the span. The sum of the strain
energies of all spans is at most the strain energy of the mechanism. Hence the load ratio is at most the sum of two
values: the maximum of P/P_E + P/kGA over the spans, and the largest eigenvalue of a small matrix. The element (i, j) of
this matrix is the rotation of chord i due to a couple P L on chord j. Forces that turn with their links add rows and
columns to the matrix. The Frobenius norm of the matrix is an upper bound on the eigenvalue.

In a mode with unit strain energy, the work of the forces of a link is at most W: the largest P/P_E + P/kGA of the link,
plus the diagonal elements of the matrix that belong to this link. The load ratio of a mode is the sum of the work over
all links. It is therefore at most (number of links with W > 0) * (largest work of a link). The load ratio of a link is
(load ratio of the mode) * (work of the link) / (largest work of a link). It is therefore at most (number of links with
W > 0) * (W of the link). The equations are in docs/theory.md.
"""

from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np
from msgspec import Struct
from msgspec.structs import replace

from elastic.assessment.columns import compressions, euler_loads, least_shear_rigidity
from elastic.elastodynamics.displacements import UNDER_BLOCK, Points
from elastic.elastodynamics.point_effects import DisplacementComponent, chosen_points, point_effects
from elastic.links import spans_of
from elastic.links.added_loads import AddedLoads
from elastic.links.compatibility import bent_links, compatible_forces, problem_of, under_blocks
from elastic.links.configuration import ElasticProblem
from elastic.links.free_body import NO_DISPLACEMENT, resultants, with_points
from elastic.links.sliding_blocks import block_loads
from elastic.solution import Deflection
from rigid import JointForces, LineLoad
from rigid.arrays import Columns, Reals
from rigid.closures import displacements, joint_forces, self_stresses
from rigid.constants import per_row
from rigid.plane import ZERO, dot

AppliedForce = tuple[int, str, Columns, Columns]
"""Link index, point name, force in ground axes [N], complex, and moment [N m]."""


class _ComponentRow(Struct, frozen=True, eq=False):
    """Row of the matrix: a component of displacement that adds (weight * component^2) to the work of a link's forces.

    `loads` are the loads whose work is 1 if the component is 1.
    """

    loads: tuple[AppliedForce, ...]
    weight: Reals
    link: int


def buckling_bound(deflection: Deflection) -> Reals:
    """Return an upper bound on the load ratio of each link, shape (links, ..., positions).

    The bound is nan at singular positions. If a line load turns with its beam, the bound is inf, because no finite
    bound is known for this case.
    """
    mechanism, columns = deflection.motion.mechanism, deflection.motion.columns
    work = np.zeros((len(mechanism.links), *columns))
    if any(isinstance(load, LineLoad) and load.turning for load in mechanism.loads):
        return np.full(work.shape, np.inf)
    largest, chords = _spans(deflection, work)
    turned, beyond = _turned_points(deflection, work)
    whole, rows = largest + beyond, [row for row in (*chords, *turned) if np.any(row.weight > 0.0)]
    if rows:
        matrix = _responses(deflection, rows)
        for at, row in enumerate(rows):
            work[row.link] += matrix[at, at]
        square: Reals = (matrix * matrix.swapaxes(0, 1)).sum(axis=(0, 1))
        whole = whole + np.sqrt(np.maximum(square, 0.0))
    return np.minimum(whole, (work > 0.0).sum(axis=0) * work)


def _spans(deflection: Deflection, work: Reals) -> tuple[Reals, list[_ComponentRow]]:
    """Return the largest P/P_E + P/kGA of all spans, and the rows of the matrix for the chords of the spans.

    The largest P/P_E + P/kGA of each link is added to the element of this link in `work`, shape (links, ...,
    positions).
    """
    motion = deflection.motion
    mechanism, ndim = motion.mechanism, len(motion.columns)
    pressed = compressions(deflection)
    stiff = per_row([least_shear_rigidity(section) for section in deflection.sections], ndim, float)
    with np.errstate(invalid="ignore"):
        ratio = pressed / euler_loads(deflection) + pressed / stiff
    for at in {at for at, _ in mechanism.beams}:
        work[at] += ratio[[owner == at for owner, _ in mechanism.beams]].max(axis=0)
    chords = []
    for span in spans_of(mechanism).runs:
        at, first = mechanism.beams[span.beams[0]]
        last = mechanism.beams[span.beams[-1]][1]
        begin = first.end if span.turned[0] else first.start
        end = last.start if span.turned[-1] else last.end
        points = mechanism.links[at].points
        chord = motion.direction[at] * (points[end] - points[begin])
        across = 1j * chord / np.abs(chord) ** 2
        weight = pressed[span.beams[0]] * np.abs(chord)
        chords.append(_ComponentRow(((at, end, across, 0.0), (at, begin, -across, 0.0)), weight, at))
    return work.max(axis=0, initial=0.0), chords


def _turned_points(deflection: Deflection, work: Reals) -> tuple[list[_ComponentRow], Reals]:
    """Return the rows of forces with the same component as response and cause, and a bound for all other forces.

    See `PointEffect` for response and cause. If these are two different components, the bound is k (sqrt(f_11 f_22) +
    |f_12|) / 2. Here, k is the sum of the magnitudes of the stiffnesses between both components, and f is the
    flexibility matrix of both components. This bound is also added to the `work` of the links to which the components
    belong.
    """
    chosen, rows = chosen_points(deflection.motion.mechanism), []
    pairs: dict[frozenset[int], Any] = {}
    effects = [
        effect for effect in point_effects(deflection, chosen) if not effect.elastic and np.any(effect.stiffness)
    ]
    for effect in effects:
        if effect.response is effect.cause:
            weight = np.maximum(-effect.stiffness, 0.0)
            rows.append(_ComponentRow(_loads_of(effect.response, chosen), weight, _link_of(effect.cause, chosen)))
        else:
            both = frozenset((id(effect.response), id(effect.cause)))
            before = pairs[both][1] if both in pairs else 0.0
            pairs[both] = (effect.response, effect.cause), before + np.abs(effect.stiffness)
    beyond = np.zeros(deflection.motion.columns)
    for both, stiffness in pairs.values():
        unit = np.ones(deflection.motion.columns)
        (own, across), (_, other) = _responses(
            deflection, [_ComponentRow(_loads_of(row, chosen), unit, _link_of(row, chosen)) for row in both]
        )
        bound = stiffness * (np.sqrt(np.maximum(own * other, 0.0)) + np.abs(across)) / 2
        beyond = beyond + bound
        for at in {_link_of(row, chosen) for row in both}:
            work[at] += bound
    return rows, beyond


def _link_of(row: DisplacementComponent, chosen: Points) -> int:
    """Return the index of the link to which the work on a component is assigned."""
    return chosen[next(iter((*row.rotation_factors, *row.directions)))][0]


def _loads_of(row: DisplacementComponent, chosen: Points) -> tuple[AppliedForce, ...]:
    """Return the loads that do work of 1 if a component is 1; loads on points of the ground are left out."""
    forces = [(*chosen[point], way, 0.0) for point, way in row.directions.items()]
    moments = [(*chosen[point], 0.0, share) for point, share in row.rotation_factors.items()]
    return tuple(load for load in (*forces, *moments) if load[0])


def _responses(deflection: Deflection, rows: Sequence[_ComponentRow]) -> Reals:
    """Return the component of each row (first axis) due to the weighted loads of each row (second axis).

    The loads are multiplied by the weight of their row. The shape is (rows, rows, ..., positions).
    """
    motion, sections = deflection.motion, deflection.sections
    problem = problem_of(motion, sections, deflection.joints).unloaded
    states = self_stresses(motion.closures, deflection.forces.flank)
    responses = np.empty((len(rows), len(rows), *motion.columns))
    for number, row in enumerate(rows):
        loads = tuple((at, point, row.weight * force, row.weight * moment) for at, point, force, moment in row.loads)
        moved = _displaced(problem, loads, deflection.forces.flank, states)
        for other, response in enumerate(rows):
            work = (
                dot(force, move) + moment * turn
                for (*_, force, moment), (move, turn) in zip(response.loads, map(moved, response.loads), strict=True)
            )
            responses[other, number] = sum(work, start=np.zeros(motion.columns))
    return responses


def _displaced(
    problem: ElasticProblem,
    loads: tuple[AppliedForce, ...],
    flank: Mapping[int, Columns],
    states: Sequence[JointForces],
) -> Callable[[AppliedForce], tuple[Columns, Columns]]:
    """Return a function that returns, for a load, the displacement and rotation of its point under `loads` alone."""
    motion, trees = problem.motion, problem.configuration.trees
    no_gaps, zeros = (0.0,) * len(motion.places), [ZERO] * len(motion.mechanism.links)
    points = tuple(load for load in loads if not load[1].startswith(UNDER_BLOCK))
    blocks = tuple((_number(load), *load[2:]) for load in loads if load[1].startswith(UNDER_BLOCK))
    added = AddedLoads(problem.loads.q, points, blocks, no_gaps, no_gaps)
    problem = replace(problem, loads=replace(problem.loads, nodes=with_points({}, trees, points)), added=added)
    pull, twist = zeros[:], zeros[:]
    for at, force, moment in resultants(added, motion, problem.configuration):
        pull[at], twist[at] = pull[at] + force, twist[at] + moment
    forces = joint_forces(motion.closures, pull, twist, flank=flank)
    if states:
        forces = compatible_forces(problem, forces, bent_links(problem, forces)[1], states)
    response, gaps = bent_links(problem, forces)
    shifts, turning, _ = displacements(motion.closures, gaps.displacement, gaps.rotation, zeros, flank)
    rails = dict(zip(trees.rails, block_loads(motion, problem.configuration, forces, added), strict=True))

    def moved(load: AppliedForce) -> tuple[Columns, Columns]:
        at, point, *_ = load
        angle = np.imag(turning[at])
        if point.startswith(UNDER_BLOCK):
            bent, arm = under_blocks(problem, response, rails[_number(load)]), motion.places[_number(load)].arm(at)
        else:
            bent = response.nodes.get((at, point), NO_DISPLACEMENT)
            arm = motion.direction[at] * motion.mechanism.links[at].points[point]
        return shifts[at] + 1j * angle * arm + bent[0], angle + bent[1]

    return moved


def _number(load: AppliedForce) -> int:
    """Return the index of the slider joint with the block that applies a load."""
    return int(load[1].removeprefix(UNDER_BLOCK))
