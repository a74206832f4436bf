"""Registry of all figures (results such as the largest deflection). Reports, designs, speeds and limits use it."""

from collections.abc import Callable
from functools import lru_cache, reduce
from typing import Any

import numpy as np
from msgspec.structs import replace

from elastic import FIELDS, Largest, displacement_of, largest_row
from elastic.assessment import angle_error, safety_factor
from kinelast.figures.cycle import EXTREME_FIELDS, AlongBeams, Cycle
from kinelast.figures.measures import measures_of, picked
from kinelast.figures.output import (
    advantage_of,
    residual_of,
    settling_of,
    stroke_of,
    swing_of,
    time_ratio_of,
    travel_of,
)
from kinelast.scene.data import Scene
from kinelast.scene.drive_values import DRIVE_FIGURES
from kinelast.scene.limits import FigureBound, Output
from kinelast.scene.parts import PARTS
from kinelast.scene.parts.joint_kinds import PLAIN, ROLLING
from kinelast.values.error import SceneError, fault, likely
from kinelast.values.figure import (
    BEAM,
    FIXED,
    FRICTION,
    JOINT,
    LEAST,
    LINK,
    MOST,
    OUTPUT_ERROR,
    POINT,
    RUBBING,
    SCENE,
    STOPPING,
    Figure,
    Limit,
    each,
    fixed,
    items_of,
    sole,
    whole,
)
from rigid import transmission_angles
from rigid.arrays import Complexes, Real, Reals
from rigid.constants import mass_moments
from rigid.kinetostatics import friction_joints, friction_power

NAMES = {"w": "deflection", "mises": "stress"}  # keys of figures by key of the field, if they differ
HARMONICS = 6  # number of multiples of the largest drive speed that are compared with the lowest natural frequency


def _safety(cycle: Cycle) -> Largest:
    stress, sections = cycle.along("mises"), cycle.deflection.sections
    sizes = stress.value, np.abs(stress.value) + stress.gain
    value, least = (safety_factor(sections, size[..., None])[..., 0] for size in sizes)
    return replace(stress, value=value, gain=np.where(stress.gain > 0.0, value - least, 0.0))


def _angle_errors(cycle: Cycle) -> Largest:
    """Return, for every moving link, the largest angle error at any of its points."""
    links = cycle.scene.mechanism.links[1:]
    errors = [angle_error(cycle.deflection, link.name, point) for link in links for point in link.points]
    every = cycle.largest(cycle.rows(errors))
    ends = np.cumsum([len(link.points) for link in links])
    rows = [slice(end - len(link.points), end) for link, end in zip(links, ends, strict=True)]
    gain = np.broadcast_to(every.gain, np.shape(every.value))
    best = [largest_row(Largest(every.value[each], every.position[each], gain=gain[each])) for each in rows]
    parts = ("value", "position", "row", "gain")
    return Largest(**{part: np.array([getattr(one, part) for one in best]) for part in parts})


def _mass(cycle: Cycle) -> Real:
    total: Any = sum(np.real(mass_moments(link)[0]) for link in cycle.scene.mechanism.links[1:])
    return np.ravel(total) if cycle.columns[:-1] else total


def _condition(cycle: Cycle) -> Largest:
    """Return the largest condition number of all positions with figures, including ill-conditioned ones."""
    condition = np.where(cycle.lost, -1.0, cycle.condition)
    at = condition.argmax(axis=-1)
    most = np.take_along_axis(condition, at[..., None], -1)[..., 0]
    return sole(Largest(np.where(most < 0.0, np.nan, most), np.where(most < 0.0, -1, at)))


def _transmission(cycle: Cycle) -> Largest:
    """Return the smallest transmission angle of all dyads; nan if there are no dyads."""
    angles = [one.angle for one in transmission_angles(cycle.motion)]
    if not angles:
        return fixed(lambda _: np.nan)(cycle)
    return sole(cycle.least(np.broadcast_to(reduce(np.minimum, angles), cycle.columns)))


def _fastest(cycle: Cycle) -> Reals:
    """Return the largest speed of any rotating drive [rad/s], shape (..., 1); 0 if no drive rotates."""
    pairs = zip(cycle.motion.mechanism.drives, cycle.motion.drive_rate, strict=True)
    rates = [np.abs(np.broadcast_to(rate, cycle.columns)) for drive, rate in pairs if drive.turns]
    return np.max([np.nanmax(rate, axis=-1, keepdims=True) for rate in rates], axis=0) if rates else np.zeros(1)


def _over_speed(cycle: Cycle) -> Reals:
    with np.errstate(divide="ignore"):
        return np.asarray(cycle.lowest_frequency / _fastest(cycle))


def _resonance(cycle: Cycle) -> Reals:
    lowest, fastest = cycle.lowest_frequency, _fastest(cycle)
    return np.asarray(np.min([abs(1 - number * fastest / lowest) for number in range(1, HARMONICS + 1)], axis=0))


def _rubbing_units(scene: Scene) -> list[str]:
    return ["N" if name in scene.mechanism.slider_points else "N m" for name in items_of(scene, RUBBING)]


def _feedback(cycle: Cycle) -> Reals:
    forces = cycle.deflection.forces
    return np.where(forces.locked, np.nan, np.broadcast_to(forces.feedback, cycle.columns))


def _rubbing(values: Callable[[Cycle], Any]) -> Callable[[Cycle], Largest]:
    """Return a function that finds a figure of the friction. It has no items if the scene has no friction."""
    return each(lambda cycle: [values(cycle)] if friction_joints(cycle.scene.mechanism) else [])


IN_ROW = ("w", "chord", "mises")  # keys of fields whose largest values are in the row of a design
LIMITS = {"w": "deflection", "chord": "chord"}  # key of the limit under [limits], by field key
OF_FIELDS = tuple(
    Figure(NAMES.get(key, key), FIELDS[key].name, FIELDS[key].unit, BEAM, AlongBeams(key), fields=(key,),
           listed=key in IN_ROW, limit=LIMITS.get(key, ""))
    for key in (*IN_ROW, *(key for key in EXTREME_FIELDS if key not in IN_ROW))
)  # fmt: skip
ALONG_BEAMS: tuple[Figure, ...] = (
    *OF_FIELDS,
    Figure("safety", "yield stress over the largest stress", "1", BEAM, _safety, LEAST, ("mises",), listed=True,
           limit="safety"),
    Figure("buckling", "load over the critical load", "1", BEAM, lambda cycle: cycle.buckling_ratio, limit="buckling",
           follows=next(figure for figure in OF_FIELDS if figure.key == "N")),
)  # fmt: skip
DISPLACEMENT = Figure("displacement", "displacement of a point", "m", POINT,
                      each(lambda cycle: [np.abs(one.displacement) for one in cycle.deviations.values()]))  # fmt: skip
ANGLE_ERROR = Figure("angle_error", "error of a link's angle", "rad", LINK, _angle_errors)
OF_THE_MACHINE: tuple[Figure, ...] = (
    DISPLACEMENT,
    Figure("along_path", "displacement along the path", "m", POINT,
           each(lambda cycle: [one.along for one in cycle.deviations.values()])),
    Figure("off_path", "displacement off the path", "m", POINT,
           each(lambda cycle: [one.normal for one in cycle.deviations.values()])),
    ANGLE_ERROR,
    *DRIVE_FIGURES,
    *(figure for part in PARTS for figure in part.figures),
    Figure("joint_force", "force in a joint", "N", JOINT,
           each(lambda cycle: [np.abs(force) for force, _ in cycle.deflection.forces.in_joints]), listed=True),
    Figure("friction_effort", "effort of friction in a joint", _rubbing_units, RUBBING,
           each(lambda cycle: [*cycle.deflection.forces.friction.values()])),
    Figure("friction_power", "power that friction takes", "W", FRICTION,
           _rubbing(lambda cycle: friction_power(cycle.motion, cycle.deflection.forces))),
    Figure("friction_feedback", "loop gain of friction", "1", FRICTION, _rubbing(_feedback),
           everywhere=True, here=True),
    Figure("shaking_force", "force on the ground", "N", SCENE,
           whole(lambda cycle: np.abs(cycle.deflection.forces.ground_force)), listed=True),
    Figure("shaking_moment", "moment on the ground", "N m", SCENE,
           whole(lambda cycle: cycle.deflection.forces.ground_moment), listed=True),
    Figure("mass", "mass of the moving links", "kg", SCENE, fixed(_mass), FIXED, listed=True, rigid=True, exact=True),
    Figure("condition", "condition number", "1", SCENE, _condition, everywhere=True, listed=True,
           rigid=True, here=True),
    Figure("transmission_angle", "transmission angle", "rad", SCENE, _transmission, LEAST, everywhere=True, listed=True,
           rigid=True),
    Figure("reach", "share of the positions that are reached", "1", SCENE,
           fixed(lambda cycle: cycle.reached.mean(axis=-1)), FIXED, asked=True, listed=True, rigid=True),
    Figure("frequency", "lowest natural frequency", "rad/s", SCENE,
           lambda cycle: sole(cycle.least(cycle.lowest_frequency)), LEAST, asked=True),
    Figure("frequency_ratio", "lowest natural frequency over the speed of the fastest drive", "1", SCENE,
           lambda cycle: sole(cycle.least(_over_speed(cycle))), LEAST, asked=True),
    Figure("resonance_distance", "distance of the lowest natural frequency from harmonics of the drive", "1", SCENE,
           lambda cycle: sole(cycle.least(_resonance(cycle))), LEAST, asked=True),
)  # fmt: skip


def output_figures(output: Output | None) -> tuple[Figure, ...]:
    """Return the figures of an output: the error of the output, and the figures of the output's motion."""
    if output is None:
        return ()
    if output.point:

        def moved(cycle: Cycle) -> Complexes:
            return displacement_of(cycle.deflection, output.link, output.point)

        return (
            Figure(OUTPUT_ERROR, "error of the output", "m", SCENE, whole(moved), listed=True, limit="output"),
            Figure("output_stroke", "stroke of the output", "m", SCENE, fixed(lambda cycle: stroke_of(cycle, output)),
                   FIXED, asked=True, rigid=True),
            *_motion_figures(output),
        )  # fmt: skip

    def swing(cycle: Cycle) -> tuple[Largest, Largest]:
        return cycle.once(swing_of, output.link)

    return (
        Figure(OUTPUT_ERROR, "error of the output", "rad", SCENE,
               lambda cycle: picked(cycle.of(ANGLE_ERROR), [cycle.scene.mechanism.index[output.link] - 1]),
               listed=True, limit="output"),
        Figure("output_least", "least angle of the output", "rad", SCENE, lambda cycle: sole(swing(cycle)[0]), LEAST,
               asked=True, rigid=True),
        Figure("output_most", "greatest angle of the output", "rad", SCENE, lambda cycle: sole(swing(cycle)[1]), MOST,
               asked=True, rigid=True),
        Figure("output_travel", "travel of the output", "rad", SCENE, fixed(lambda cycle: travel_of(*swing(cycle))),
               FIXED, asked=True, rigid=True),
        *_motion_figures(output),
    )  # fmt: skip


def _motion_figures(output: Output) -> tuple[Figure, ...]:
    """Return the figures of the motion of an output that exist for both kinds of output, points and angles."""

    def unit(scene: Scene) -> list[str]:
        turns = scene.mechanism.drives[0].turns if scene.mechanism.drives else True
        return [
            {(True, True): "1/m", (True, False): "1", (False, True): "1", (False, False): "m"}[
                turns, bool(output.point)
            ]
        ]

    return (
        Figure("output_time_ratio", "time ratio of the output", "1", SCENE,
               fixed(lambda cycle: time_ratio_of(cycle, output)), FIXED, asked=True, rigid=True),
        Figure("output_advantage", "mechanical advantage of the output over the drive", unit, SCENE,
               lambda cycle: sole(cycle.least(advantage_of(cycle, output))), LEAST, asked=True, rigid=True),
        Figure("residual", "residual amplitude of the output after the stop", output.unit, STOPPING,
               _stopping(lambda cycle: sole(residual_of(cycle, output))), limit="residual",
               remains_of=DISPLACEMENT if output.point else ANGLE_ERROR),
        Figure("settling", "settling time of the output after the stop", "s", STOPPING,
               _stopping(fixed(lambda cycle: settling_of(cycle, output))), limit="settling", whole=True),
    )  # fmt: skip


def _stopping(find: Callable[[Cycle], Largest]) -> Callable[[Cycle], Largest]:
    """Return a function that finds a figure of the motion after a stop. It has no items if the drives do not stop."""
    return lambda cycle: find(cycle) if cycle.scene.course.stops else each(lambda _: [])(cycle)


def limits_of(scene: Scene) -> tuple[Limit, ...]:
    """Return all limits of a scene: limits with their own key, and limits given under the name of a figure.

    Raises
    ------
    SceneError
        A limited figure does not exist, or a bound has the wrong unit. If there are several errors, the attribute
        `others` contains all but the first.
    """
    return scene.once(_limits_of)


def _limits_of(scene: Scene) -> tuple[Limit, ...]:
    named, wrong = [], []
    for bound in scene.bounds:
        try:
            named += _limits_by_name(scene, bound)
        except SceneError as error:
            wrong.append(error.of_file(scene.path))
    if wrong:
        wrong[0].others = tuple(wrong[1:])
        raise wrong[0]
    return (*scene.limits, *named)


def _limits_by_name(scene: Scene, bound: FigureBound) -> list[Limit]:
    key, _, item = bound.name.partition(".")
    figures = figures_of(scene.output)
    figure = next((each for each in figures if each.key == key), None)
    measure = None if figure is None else measures_of(scene, [figure]).get(bound.name)
    if figure is not None and measure is not None:
        return [Limit(figure.key, value, least, item, measure.unit, figure.of, named=True)
                for value, least in bound.within(measure.unit, figure.over)]  # fmt: skip
    what = f'there is no figure "{bound.name}"'
    if figure is None and scene.output is None and key in OF_OUTPUTS:
        problem = f'{what}: name the output of the machine under [run], as in output = "B"'
    elif figure is not None and not items_of(scene, figure.of):
        of = figure.of.noun if figure.of in (ROLLING, PLAIN) else figure.of
        problem = f"{what}, as nothing in the scene is of the kind: {of}"
    else:
        problem = what + likely(bound.name, measures_of(scene, figures))
    raise fault(bound.table, f'"{bound.name}"', problem)


@lru_cache(maxsize=64)
def figures_of(output: Output | None) -> tuple[Figure, ...]:
    """Return all figures, including the figures of the given output."""
    of_parts = (figure for part in PARTS for figure in part.of_output(output))
    return (*ALONG_BEAMS, *output_figures(output), *OF_THE_MACHINE, *of_parts)


OF_OUTPUTS = {each.key for output in (Output("", "P"), Output("")) for each in figures_of(output)} - {
    each.key for each in figures_of(None)
}
"""Keys of the figures that require an output."""
