"""Computation of the positions of all links, group by group."""

from typing import Any

import numpy as np

from rigid.arrays import Flags, Integers, Reals
from rigid.closures.closure import Closure, closure
from rigid.decomposition.groups import Group, Structure
from rigid.drawing import Drawing
from rigid.mechanism import Mechanism
from rigid.positions.branch import TrackedBranch
from rigid.positions.drive_path import FINEST_STEP, PLACE_TOLERANCE, Path, path_through
from rigid.positions.dyad_places import place_dyad, place_dyad_with_slack
from rigid.positions.knots import knots_before
from rigid.positions.newton import correct, newton, require_closed, sine_of, tree_closure
from rigid.positions.partial_posture import PartialPosture
from rigid.positions.reached import branch_through
from rigid.postures import Posture, joint_place

# if the sine of a dyad exceeds this at closely spaced positions, the dyad passes no change point between them
MIN_CLEAR_SINE = 0.5
MAX_NEAR_STEP = 0.1  # positions are closely spaced if drives [rad or m] and sines change by at most this between them
# accuracy to which a limit of motion is located if positions close to it are requested, in strides (see `Path`)
NEAR_LIMIT_RESOLUTION = 2.0**-46
BOX_MARGIN = 1e-6  # a coordinate may exceed a bound b by BOX_MARGIN (1 + b) [rad or m], see `StepCertificate.box`
# near a change point, positions are interpolated between the knots that are this many knots before and after it
PASS_KNOTS = 2


def place(
    mechanism: Mechanism, structure: Structure, drive: Reals, near: Posture | None = None, lead: Reals | None = None
) -> tuple[PartialPosture, tuple[Closure, ...]]:
    """Compute the positions of all links, and the closure of each group.

    Parameters
    ----------
    drive
        Drive coordinates [rad or m], shape (drives, positions).
    near
        Posture close to each position, which selects the branch (see `motion`). By default, the branch is tracked from
        the drawing.
    lead
        Drive coordinates along the path from the drawing to the first position, shape (drives, n).
    """
    if near is None:
        placed = _tracked(mechanism, structure, path_through(mechanism, drive, lead), drive)
    else:
        links = len(mechanism.links)
        placed = PartialPosture(mechanism, drive, [0.0] * links, [1.0] * links, near=near)
        for group in structure.groups:
            _place_near(placed, group, near)
    closures = []
    sines = iter(placed.sine)
    for group in structure.groups:
        parts = (group.tree, group.cut, group.rings)
        tree, cut, rings = (tuple(joint_place(placed, joint) for joint in joints) for joints in parts)
        closures.append(closure(group, tree, cut, next(sines) if group.free else 1.0, rings))
    return placed, tuple(closures)


def _place_driven_group(placed: PartialPosture, group: Group) -> None:
    """Compute the positions of a group without free joints."""
    for joint in group.tree:
        placed.place_child(joint, placed.coordinate(joint))
    require_closed(placed, group)


def _place_near(placed: PartialPosture, group: Group, near: Posture) -> None:
    """Compute the positions of a group on the branch that is closest to a given posture."""
    if not group.free:
        _place_driven_group(placed, group)
    elif not group.closed_form:
        placed.sine.append(correct(placed, group, near))
    else:
        away = []
        drawing = Drawing(placed.mechanism)
        for flip in (-1.0, 1.0):
            sine = place_dyad(placed, group, drawing, flip)
            away.append(sum(np.abs(placed.direction[link] - near.direction[link]) for link in group.links))
        if np.any(opposite := away[0] < away[1]):
            sine = place_dyad(placed, group, drawing, np.where(opposite, -1.0, 1.0))
        placed.sine.append(sine)


def _as_drawn(mechanism: Mechanism, structure: Structure, drive: Reals) -> PartialPosture:
    """Compute the positions of all links in the assembly of the drawing, without tracking the branch.

    Dyads are solved in closed form. Other groups are solved by Newton's method from the drawn coordinates.
    """
    links, drawing = len(mechanism.links), Drawing(mechanism)
    placed = PartialPosture(mechanism, drive, [0.0] * links, [1.0] * links)
    for group in structure.groups:
        if not group.free:
            _place_driven_group(placed, group)
        elif group.closed_form:
            placed.sine.append(place_dyad_with_slack(placed, group, drawing, 1.0))
        else:
            shape = np.broadcast_shapes(placed.drive.shape[1:], placed.mechanism.designs)
            start = [np.full(shape, drawing.coordinate(group.tree[at])) for at in group.free]
            placed.sine.append(sine_of(tree_closure(placed, group, newton(placed, group, np.stack(start)))))
    return placed


def _closely_spaced(path: Path) -> bool:
    """Return whether the requested positions are closely spaced, and the drawn position is in or near their range."""
    if path.vertices is not None:
        return False
    low, high = path.span
    covered = low - MAX_NEAR_STEP <= path.begin <= high + MAX_NEAR_STEP or 0 < path.turn <= high - low + MAX_NEAR_STEP
    steps = path.requested[..., 1:] - path.requested[..., :-1]
    return bool(covered and np.abs(steps).max(initial=0.0) <= min(MAX_NEAR_STEP, path.stride))


def _far_from_change_points(sines: Any) -> bool:
    """Return whether no dyad can pass a change point between the positions.

    At a change point, two branches meet. See `MIN_CLEAR_SINE` and `MAX_NEAR_STEP`.
    """
    for sine in sines:
        size = np.abs(sine)
        if not size.min() >= MIN_CLEAR_SINE:
            return False
        if size.ndim and not np.abs(sine[..., 1:] - sine[..., :-1]).max(initial=0.0) <= MAX_NEAR_STEP:
            return False
    return True


def _tracked(mechanism: Mechanism, structure: Structure, path: Path, drive: Reals) -> PartialPosture:
    """Compute the positions of all links on the branch of the drawing, which is tracked if necessary."""
    drawn = path.vertices is None and all(abs(end - path.begin) <= PLACE_TOLERANCE for end in path.span)
    as_drawn = _as_drawn(mechanism, structure, drive) if drawn or structure.closed_form else None
    if as_drawn is not None and (
        drawn or not as_drawn.sine or (_closely_spaced(path) and _far_from_change_points(as_drawn.sine))
    ):
        return as_drawn
    forms = tuple(group.closed_form for group in structure.groups)
    for edge in (FINEST_STEP, NEAR_LIMIT_RESOLUTION):
        branch, places = branch_through(mechanism, structure, path, forms, edge)
        at = knots_before(branch.table, places, branch.rows)
        if as_drawn is not None and (branch.table["sign"] > 0).all():
            return _up_to_ends(as_drawn, branch, at)
        if all(branch.forms) or not _at_an_end(branch, places, at):
            break
    return _place_on_branch(branch, places, at, drive)


def _up_to_ends(as_drawn: PartialPosture, branch: TrackedBranch, at: Any) -> PartialPosture:
    """Set the positions of dyads to nan beyond the ends of the tracked branch.

    The dyads in `as_drawn` were placed in the assembly of the drawing.

    `at` contains the index of the knot before each position.
    """
    if np.isfinite(branch.table["sine"]).all():
        return as_drawn
    at = at if branch.designs else at[0]
    for number, group in enumerate(branch.structure.groups):
        if group.free:
            _end_dyad(as_drawn, branch, number, at, lambda values: values)
    return as_drawn


def _end_dyad(placed: PartialPosture, branch: TrackedBranch, number: int, at: Any, wide: Any) -> None:
    """Set a dyad to nan beyond the end of its tracked branch, even if the dyad could close there.

    A position may be in the same step as the end of the branch. It is then beyond the end if the dyad does not close
    there, or if its sine has the opposite sign to that at the last known knot.

    Parameters
    ----------
    at
        Index of the knot before each position.
    wide
        Function that reshapes an array with one value per position to the shape of the arrays in `placed`.
    """
    free = sum(bool(group.free) for group in branch.structure.groups[:number])
    sine = branch.table["sine"][:, number]
    here, there = wide(sine[at]), wide(sine[at + 1])
    ended = np.isnan(here) | np.isnan(there)
    if not ended.any():
        return
    before = np.where(np.isnan(here), there, here)
    unknown = np.isnan(before) | (ended & (placed.sine[free] * before < 0))
    for link in branch.structure.groups[number].links:
        placed.origin[link] = np.where(unknown, np.nan, placed.origin[link])
        placed.direction[link] = np.where(unknown, np.nan, placed.direction[link])
    placed.sine[free] = np.where(unknown, np.nan, placed.sine[free])


def _place_on_branch(branch: TrackedBranch, places: Any, at: Integers, drive: Reals) -> PartialPosture:
    """Compute the positions of all links at points `places` on a tracked branch.

    `at` contains the index of the knot before each point.
    """
    mechanism, structure = branch.mechanism, branch.structure
    at = at if branch.designs else at[0]
    places = places if branch.designs else np.ravel(places)
    shape = (*branch.designs[:1], drive.shape[-1]) if branch.designs else drive.shape[1:]

    def wide(values: Any) -> Any:
        return values.reshape(shape)

    table = branch.table
    low, high = table["place"][at], table["place"][at + 1]
    part = wide((places - low) / (high - low))
    links = len(mechanism.links)
    driver_angles = {}
    for k, key in enumerate(branch.drivers):
        low_angle, high_angle = (wide(table["driver_angles"][which, k]) for which in (at, at + 1))
        driver_angles[key] = low_angle + part * (high_angle - low_angle)
    placed = PartialPosture(mechanism, drive, [0.0] * links, [1.0] * links, driver_angles=driver_angles)
    for number, group in enumerate(structure.groups):
        if not group.free:
            _place_driven_group(placed, group)
            continue
        finite = np.isfinite(table["sine"][at, number] + table["sine"][at + 1, number])
        changing = ~table[f"certain{number}"][at] & finite & (high - low <= branch.width(number))
        if branch.forms[number]:
            signs = [wide(table["sign"][which, number]) for which in (at, at + 1)]
            sign = np.where(part < 0.5, *signs) if (table["sign"][:, number] < 0).any() else 1.0
            placed.sine.append(place_dyad_with_slack(placed, group, branch.drawing, sign))
            _end_dyad(placed, branch, number, at, wide)
        else:
            placed.sine.append(_between(placed, branch, number, at, part, wide))
        if changing.any():
            _place_at_change_point(placed, branch, number, at, places, wide, wide(changing))
    return placed


def _place_at_change_point(
    placed: PartialPosture, branch: TrackedBranch, number: int, at: Integers, places: Reals, wide: Any, where: Flags
) -> None:
    """Interpolate the positions of a group near a change point between knots before and after it.

    A position is replaced only if the equations could not be solved there, or if their solution is not close to the
    interpolation.
    """
    table, shape = branch.table, np.shape(placed.sine[-1])
    row = table["row"][at]
    ends = [np.clip(at + ahead, 0, len(table["row"]) - 1) for ahead in (-PASS_KNOTS, PASS_KNOTS + 1)]
    low, high = (np.where(table["row"][end] == row, end, at + k) for k, end in enumerate(ends))
    part = wide((places - table["place"][low]) / (table["place"][high] - table["place"][low]))
    for link in branch.structure.groups[number].links:
        (here, there), (before, after) = (
            [wide(table[name][which, link]) for which in (low, high)] for name in ("direction", "origin")
        )
        turned = here * np.exp(1j * part * np.angle(there * np.conj(here)))
        direction = np.broadcast_to(placed.direction[link], shape)
        failed = where & ~(np.abs(direction - turned) <= BOX_MARGIN)
        placed.direction[link] = np.where(failed, turned, direction)
        origin = np.broadcast_to(placed.origin[link], shape)
        placed.origin[link] = np.where(failed, before + part * (after - before), origin)
        placed.sine[-1] = np.where(failed, 0.0, placed.sine[-1])


def _at_an_end(branch: TrackedBranch, places: Reals, at: Integers) -> bool:
    """Return whether a requested position is so close to a limit of motion that the limit must be located better.

    The mechanism may reach such a position, although the limit seems to be before it at the current resolution.
    """
    place, unknown = branch.table["place"], np.isnan(branch.table["sine"]).any(axis=1)
    width = max(branch.width(number) for number, form in enumerate(branch.forms) if not form)
    near = [np.abs(places - place[one]) <= width for one in (at, at + 1)]
    return bool(((unknown[at + 1] & ~unknown[at] & near[0]) | (unknown[at] & ~unknown[at + 1] & near[1])).any())


def _between(placed: PartialPosture, branch: TrackedBranch, number: int, at: Integers, part: Reals, wide: Any) -> Reals:
    """Compute a group without closed-form solution between knots of its branch, and return its sine.

    Positions are nan if Newton's method leaves the certified box of the step.
    """
    group, table = branch.structure.groups[number], branch.table
    low, high = ({f"free{number}": table[f"free{number}"][which.ravel()]} for which in (at, at + 1))
    change = branch.changes(number, low, high)
    free = range(len(group.free))
    start = np.stack([wide(low[f"free{number}"][:, k]) + part * wide(change[:, k]) for k in free])
    columns = np.broadcast_shapes(start.shape[1:], placed.mechanism.designs)
    start = np.broadcast_to(_with_axes(start, len(columns)), (len(group.free), *columns))
    coordinates = newton(placed, group, start)
    box = table[f"box{number}"][at.ravel()]
    box = np.where(np.isfinite(box), box, np.abs(change) + branch.width(number))
    limit = _with_axes(np.stack([wide(box[:, k]) for k in free]), len(columns)) * (1 + BOX_MARGIN) + BOX_MARGIN
    with np.errstate(invalid="ignore"):
        off_branch = ~(np.abs(coordinates - start) <= limit).all(axis=0)
    coordinates = np.where(off_branch, np.nan, coordinates)
    return sine_of(tree_closure(placed, group, coordinates))


def _with_axes(values: Reals, count: int) -> Reals:
    """Insert axes of designs after the first axis, so that `count` axes follow it."""
    return values.reshape(len(values), *(1,) * (count + 1 - values.ndim), *values.shape[1:])
