"""Output of a machine: the point or angle that the scene names, or one that the program chooses."""

from collections.abc import Mapping
from typing import Any

import numpy as np
from msgspec.structs import replace

from elastic import Deflection, Largest, cycle_maxima, displacement_of, largest
from elastic.assessment import angle_error, offset_at_rest, rest_from, settling_time
from kinelast.figures.cycle import Cycle
from kinelast.scene.data import Scene, require_tables, scene_deflection
from kinelast.scene.limits import Output
from kinelast.values.error import SceneError
from kinelast.values.figure import NOISE, OUTPUT_ERROR, points_of
from rigid import GROUND, MechanismError, Motion, position_of, velocity_of, with_rates
from rigid.analysis import Coordinate, LimitPosition, LinkAngle, PointCoordinate, limits
from rigid.arrays import Complexes, Flags, Numbers, Reals, of_designs
from rigid.plane import dot

INSTANTS = 72  # number of positions of the run that are used to choose the output
SAME = 1e-6  # relative difference below which displacements are considered equal
REST = 1e-9  # smaller velocities are rests, relative to the largest velocity; they are due to round-off


def output_of(scene: Scene, bent: Deflection | None = None, any_instants: bool = False) -> Output | None:
    """Return the output that a scene names. If it names none, return one chosen from its structure, or None.

    There are three kinds of candidates, in order of priority: traced points, i.e. points of a single link; points that
    slide on the ground and are not driven; angles of links that are pinned to the ground and are not driven. Of the
    first kind that has displacements, the candidate with the largest quasi-static displacement is chosen. If the scene
    limits the output, only candidates with the unit of this limit count. Reports, designs and speeds choose the same
    output, because all use the same `INSTANTS` positions.

    Parameters
    ----------
    bent
        Quasi-static deflection of the scene, if known. It is used if there is only one candidate.
    any_instants
        Whether `bent` is also used if there are several candidates.
    """
    if scene.output is not None:
        return scene.output
    unit = next((limit.unit for limit in scene.limits if limit.figure == OUTPUT_ERROR), "")
    points = [] if unit == "rad" else [_traced(scene), slid(scene)]
    links = [] if unit == "m" else _turning(scene)
    if bent is None or not (any_instants or sum(map(len, (*points, links))) == 1):
        bent = _deflection(scene)
    if bent is None:
        return None
    owners = dict(points_of(scene.mechanism))
    noise: float | None = None
    for names in points:
        moved = {name: _size(displacement_of(bent, owners[name], name)) for name in names}
        noise = _noise(bent) if noise is None and names else noise
        if name := _name_of_largest({name: size for name, size in moved.items() if size > (noise or 0.0)}):
            return Output(scene.mechanism.links[owners[name]].name, name, guessed=True)
    name = _name_of_largest({link: _angle(scene, bent, link) for link in links})
    return Output(name, guessed=True) if name else None


def _deflection(scene: Scene) -> Deflection | None:
    """Return the deflection at the positions that can be reached, or None if none can be reached."""
    times = scene.course.times(INSTANTS)
    try:
        moved = scene.course.at(times)
    except SceneError:
        times = scene.course.reached(times)
        if not len(times):
            return None
        moved = scene.course.at(times)
    require_tables(scene, moved)
    return scene_deflection(scene, moved)


def _size(values: Any) -> float:
    """Return the largest magnitude of values over the positions, or zero if all are unknown."""
    return float(np.nan_to_num(largest(np.atleast_1d(np.abs(values))).value))


def _noise(bent: Deflection) -> float:
    """Return the round-off error in displacements [m]."""
    along = cycle_maxima(bent, ("u", "w")).values() if bent.sections else ()
    return NOISE * max((float(np.nanmax(each.value, initial=0.0)) for each in along), default=0.0)


def _angle(scene: Scene, bent: Deflection, link: str) -> float:
    points = scene.mechanism.links[scene.mechanism.index[link]].points
    return max(_size(angle_error(bent, link, point)) for point in points)


def _name_of_largest(sizes: Mapping[str, float]) -> str:
    """Return the name with the largest size, or the first of several with equal sizes; "" if all sizes are zero."""
    most = max(sizes.values(), default=0.0)
    return next((name for name, size in sizes.items() if size and size >= (1 - SAME) * most), "")


def _traced(scene: Scene) -> list[str]:
    """Return the moving points that belong to only one link and are not at a slider."""
    mechanism = scene.mechanism
    carried = [point for link in mechanism.links for point in link.points]
    at_sliders = mechanism.slider_points.values()
    return [name for name, _ in points_of(mechanism) if carried.count(name) == 1 and name not in at_sliders]


def slid(scene: Scene) -> list[str]:
    """Return the moving points that slide on the ground and are not driven."""
    mechanism = scene.mechanism
    driven, moving = {drive.name for drive in mechanism.drives if not drive.turns}, dict(points_of(mechanism))
    free = (slider for slider in mechanism.sliders if slider.on == GROUND and slider.name not in driven)
    return [slider.point for slider in free if slider.point in moving]


def _turning(scene: Scene) -> list[str]:
    """Return the links that are pinned to the ground and are not driven by a rotating drive."""
    driven = {drive.name for drive in scene.mechanism.drives if drive.turns}
    ground, *links = scene.mechanism.links
    pins = ground.points.keys() - scene.mechanism.welded_points
    return [link.name for link in links if pins & link.points.keys() and link.name not in driven]


def turns_of(cycle: Cycle, output: Output) -> list[LimitPosition]:
    """Return the positions at which an output reverses. The list is empty if the machine has several drives."""
    motion = cycle.motion
    if len(motion.mechanism.drives) != 1 or len(motion.columns) != 1 or not np.isfinite(motion.origin).all():
        return []
    coordinate: Coordinate = LinkAngle(output.link)
    if output.point:
        coordinate = PointCoordinate(output.link, output.point, complex(path_direction(motion, output)[0]))
    try:
        return limits(motion, coordinate)
    except MechanismError:
        return []


def _velocity(motion: Motion, output: Output) -> Numbers:
    """Return the velocity of a point as a complex number [m/s], or the angular velocity of a link [rad/s]."""
    at = motion.mechanism.index[output.link]
    return velocity_of(motion, at, output.point) if output.point else motion.angular_velocity[at]


def path_direction(motion: Motion, output: Output) -> Complexes:
    """Return a unit vector in the direction in which the path of a point extends most, shape (..., 1)."""
    places = position_of(motion, motion.mechanism.index[output.link], output.point)
    apart = np.where(np.isfinite(places), places, np.nan)
    apart = apart - _known_mean(apart)
    return np.exp(0.5j * np.angle(np.nansum(apart**2, axis=-1, keepdims=True)))


def stroke_of(cycle: Cycle, output: Output) -> Reals:
    """Return the stroke of a point [m]: the extent of its path along `path_direction`.

    Between positions, the path is interpolated by parabolas.
    """
    motion = cycle.motion
    way = path_direction(motion, output)
    along = dot(way, position_of(motion, motion.mechanism.index[output.link], output.point))
    lowest, highest = between_ends(cycle, np.broadcast_to(along, cycle.columns))
    return travel_of(lowest, highest)


def between_ends(cycle: Cycle, values: Any) -> tuple[Largest, Largest]:
    """Return the smallest and greatest values over a run, interpolated by parabolas between positions."""
    known = np.where(np.isfinite(values), values, _known_mean(values))
    lowest = _top(-known, bool(cycle.scene.run.turn))
    return replace(lowest, value=-lowest.value), _top(known, bool(cycle.scene.run.turn))


def _known_mean(values: Any) -> Numbers:
    """Return the mean of the known values over the positions, shape (..., 1); nan if none is known."""
    count = np.count_nonzero(~np.isnan(values), axis=-1, keepdims=True)
    with np.errstate(invalid="ignore"):
        return np.asarray(np.nansum(values, axis=-1, keepdims=True) / count)


def time_ratio_of(cycle: Cycle, output: Output) -> Reals:
    """Return the ratio of the durations of the slow stroke and the quick stroke in a cycle, or nan without a cycle.

    Rests, such as dwells of the drive, belong to neither stroke.
    """
    rate = _velocity(cycle.motion, output)
    if output.point:
        rate = dot(path_direction(cycle.motion, output), rate)
    here = np.broadcast_to(rate, cycle.columns)
    if not cycle.scene.run.turn:
        return np.full(cycle.columns[:-1], np.nan)
    fastest = np.nanmax(np.abs(here), axis=-1, keepdims=True, initial=0.0)
    here = np.where(np.abs(here) <= REST * fastest, 0.0, here)
    after = np.roll(here, -1, axis=-1)
    with np.errstate(invalid="ignore", divide="ignore"):
        crossing = np.abs(here) / (np.abs(here) + np.abs(after))
        reverses, total = here * after < 0, here + after
        ahead = np.where(reverses, np.where(here > 0, crossing, 1 - crossing), total > 0).sum(axis=-1)
        back = np.where(reverses, np.where(here > 0, 1 - crossing, crossing), total < 0).sum(axis=-1)
        return np.where((ahead > 0) & (back > 0), np.maximum(ahead, back) / np.minimum(ahead, back), np.nan)


def advantage_of(cycle: Cycle, output: Output) -> Reals:
    """Return the mechanical advantage: drive speed divided by output speed, shape (..., positions).

    It is infinite at positions at which the output is at rest, and nan if there are several drives.
    """
    if len(cycle.scene.mechanism.drives) != 1:
        return np.full(cycle.columns, np.nan)
    with np.errstate(divide="ignore"):
        ratio = 1.0 / np.abs(_velocity(cycle.motion.units[0], output))
    return np.broadcast_to(ratio, cycle.columns)


SETTLED = 0.02  # default settling tolerance, relative to the greatest distance from the static position after the stop


def ringing_of(cycle: Cycle, output: Output) -> tuple[Reals, Flags]:
    """Return the distance of an output from its static position, and whether the drives rest, shape (..., positions).

    The static position has the same drive coordinates, but all drive speeds are zero. While the drives rest, it
    includes the mean displacement about which the output oscillates at the end (see `offset_at_rest`).
    """
    still, bent = scene_deflection(cycle.scene, with_rates(cycle.motion, 0.0)), cycle.deflection
    if output.point:
        places: Any = [(displacement_of(each, output.link, output.point),) for each in (bent, still)]
    else:
        mechanism = cycle.scene.mechanism
        points = mechanism.links[mechanism.index[output.link]].points
        places = [tuple(angle_error(each, output.link, point) for point in points) for each in (bent, still)]
    rests = rest_from(np.array([np.broadcast_to(rate, cycle.columns) for rate in cycle.motion.drive_rate]))
    apart = [np.broadcast_to(one - other, cycle.columns) for one, other in zip(*places, strict=True)]
    if len(cycle.columns) == 1:
        apart = [each - rests * offset_at_rest(cycle.motion.time, each, rests) for each in apart]
    return np.nan_to_num(np.max(np.abs(apart), axis=0)), rests


def rest_after_stop(cycle: Cycle, output: Output) -> float:
    """Return the time from the stop of the drives to the last position [s]; 0 if they do not rest there."""
    time, rests = cycle.motion.time, cycle.once(ringing_of, output)[1]
    return float(time[-1] - time[rests].min(initial=time[-1]))


def residual_of(cycle: Cycle, output: Output) -> Largest:
    """Return the greatest distance of an output from its static position while the drives rest.

    It is nan if the drives never rest.
    """
    apart, rests = cycle.once(ringing_of, output)
    found = largest(np.where(rests, apart, 0.0))
    return replace(found, value=np.where(rests.any(axis=-1), found.value, np.nan))


def settling_of(cycle: Cycle, output: Output) -> Reals:
    """Return the time [s] from the stop of the drives until the output stays near its static position."""
    apart, rests = cycle.once(ringing_of, output)
    most, given = np.where(rests, apart, 0.0).max(axis=-1), cycle.scene.settled
    within = np.maximum(SETTLED * most, NOISE * apart.max(axis=-1))
    if given is not None:
        within = np.broadcast_to(of_designs(given), np.shape(most))
    return settling_time(cycle.motion.time, apart, rests, within)


def swing_of(cycle: Cycle, link: str) -> tuple[Largest, Largest]:
    """Return the smallest and greatest angle of a link [rad], interpolated by parabolas between positions."""
    way = np.broadcast_to(cycle.motion.direction[cycle.scene.mechanism.index[link]], cycle.columns)
    turned = np.unwrap(np.angle(np.where(np.isfinite(way), way, 1.0)), axis=-1)
    closed = cycle.scene.run.turn and abs(turned[..., -1:] - turned[..., :1]).max(initial=0.0) < np.pi
    lowest = _top(-turned, closed)
    return replace(lowest, value=-lowest.value), _top(turned, closed)


def travel_of(lowest: Largest, highest: Largest) -> Reals:
    """Return the difference between the greatest and the smallest value."""
    return highest.value - lowest.value


def _top(values: Any, closed: bool) -> Largest:
    """Return the peak of the parabola through the greatest value and its neighbours, and the position of this value."""
    count = values.shape[-1]
    at = values.argmax(axis=-1)
    sides = [(at + step) % count if closed else np.clip(at + step, 0, count - 1) for step in (-1, 0, 1)]
    before, here, after = (np.take_along_axis(values, side[..., None], -1)[..., 0] for side in sides)
    bend = 2 * here - before - after
    inside = (bend > 0) & (closed | ((at > 0) & (at < count - 1)))
    rise = np.where(inside, (after - before) ** 2 / (8 * np.where(inside, bend, 1.0)), 0.0)
    return Largest(here + rise, at)
