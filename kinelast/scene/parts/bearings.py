"""Parts of joints: rolling and plain bearings, pins and eyes, and the clearance of joints."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Mapping
from functools import partial
from math import nan
from typing import TYPE_CHECKING, Annotated, Any, Literal

import numpy as np
from msgspec import Meta, field

from kinelast.scene.part import Assembly, Part
from kinelast.scene.parts.joint_kinds import BEARING, CLEARANCE, CLEARANCES, EYE, KEY, PIN, PLAIN, ROLLING, joints_with
from kinelast.scene.tables import Factor, StrictTable
from kinelast.values.error import fault, known_name, require_absent
from kinelast.values.figure import AVERAGE, LEAST, Figure, Kind, RangeCheck, averaged, each, items_of, least
from kinelast.values.numbers import real, require
from kinelast.values.quantities import Duration, LoadRating, PressureSpeed, Share, Size, SlidingSpeed, Stress
from kinelast.values.reading import MAX_MARKS, Reader, reading
from machine import joints as formulas
from machine.joints import JointHistory, JointParts
from rigid.arrays import Flags, Reals
from rigid.constants import per_row

if TYPE_CHECKING:
    from elastic import Largest
    from kinelast.figures.cycle import Cycle
    from kinelast.scene.data import Scene
    from kinelast.scene.format import SceneTable
    from kinelast.scene.limits import Output

ROLLER_EXPONENT = 10.0 / 3.0  # life exponent of roller bearings


class RollingTable(StrictTable, frozen=True, kw_only=True):
    """A rolling bearing with its required life and safety."""

    C: LoadRating  #: dynamic load rating
    C0: LoadRating | None = None  #: static load rating [unknown]
    type: Literal["ball", "roller"] = "ball"  #: life exponent 3 for `"ball"`, 10/3 for `"roller"`
    #: fraction of bearings that reach the calculated life
    reliability: Literal["90 %", "95 %", "96 %", "97 %", "98 %", "99 %"] = "90 %"
    condition: Factor | None = None  #: life factor a_ISO for lubrication and contamination [1]
    elements: Annotated[int, Meta(ge=3)] | None = None  #: number of balls or rollers [unknown]
    life: Duration | None = None  #: required life [no limit]
    safety: Factor | None = None  #: required static safety factor [no limit]
    #: minimum equivalent load / `C` against skidding: about 0.01 for balls, 0.02 for rollers [no limit]
    least_load: Share | None = None
    least_overlap: Factor | None = None  #: minimum swing angle / twice the angle between rolling elements [no limit]


class PlainTable(StrictTable, frozen=True, kw_only=True):
    """A plain bearing with the limits of its material."""

    diameter: Size | None = None  #: diameter of the pin or shaft
    #: for a slider, instead of `diameter`: length of the block, with `through` at its middle
    length: Size | None = None
    width: Size  #: width of the bearing, or of the block
    pressure: Stress | None = None  #: maximum pressure [no limit]
    speed: SlidingSpeed | None = None  #: maximum sliding speed [no limit]
    pressure_speed: PressureSpeed | None = None  #: maximum mean pressure x sliding speed [no limit]


class PinTable(StrictTable, frozen=True, kw_only=True):
    """A pin with its limits. It passes through an eye and two cheeks, or is overhung from one cheek."""

    diameter: Size  #: pin diameter
    eye: Size  #: thickness of the eye
    cheek: Size | None = None  #: thickness of each cheek
    gap: Size | None = None  #: gap between eye and cheek [0]
    overhung: bool = False  #: `true`: supported on one side only, without `cheek`
    yield_stress: Stress | None = field(default=None, name="yield")  #: yield stress
    shear: Stress | None = None  #: maximum shear stress [no limit]
    bending: Stress | None = None  #: maximum bending stress [no limit]
    safety: Factor | None = None  #: minimum `yield` / stress [no limit]


class EyeTable(StrictTable, frozen=True, kw_only=True):
    """The eye of a link with its limits."""

    diameter: Size  #: diameter of the hole
    width: Size  #: width of the plate
    thickness: Size  #: thickness of the plate
    edge: Size  #: distance from the centre of the hole to the end
    link: str | None = None  #: link whose fatigue strength the eye reduces as a notch [none]
    #: fatigue notch factor of the net section [from the dimensions]
    notch: Annotated[float, Meta(ge=1)] | None = None
    yield_stress: Stress | None = field(default=None, name="yield")  #: yield stress
    bearing: Stress | None = None  #: maximum bearing stress [no limit]
    net: Stress | None = None  #: maximum stress of the net section [no limit]
    tear_out: Stress | None = None  #: maximum tear-out shear stress [no limit]
    safety: Factor | None = None  #: minimum `yield` / stress [no limit]


class BearingTable(StrictTable, frozen=True, kw_only=True):
    """Parts of a pin or slider. With an empty table, the force, swing and speed of the pin are reported."""

    rolling: RollingTable | None = None  #: a rolling bearing [none]
    plain: PlainTable | None = None  #: a plain bearing; a slider can have no other part [none]
    pin: PinTable | None = None  #: a pin [none]
    eye: EyeTable | None = None  #: the eye of a link [none]
    #: diameter of the hole minus diameter of the pin [the effect of clearance is not reported]
    clearance: Size | None = None


def _built(assembly: Assembly) -> dict[str, JointParts]:
    scene, mechanism = assembly.table, assembly.mechanism
    tables: Mapping[str, BearingTable] = BEARINGS.tables(scene)
    shared = Counter(point for link in mechanism.links for point in link.points)
    pins = [point for point, count in shared.items() if count > 1 and point not in scene.welds]
    sliders = mechanism.slider_points
    for name, table in tables.items():
        known_name("bearings", name, name, [*pins, *sliders], "pin or slider")
        if name in sliders and name not in pins:
            problem = "belongs to a pin: a slider can only have a plain bearing"
            require_absent(f"bearings.{name}", table, ("rolling", "pin", "eye", "clearance"), problem)
            key, other = "length", "diameter"
        else:
            key, other = "diameter", "length"
        if table.plain is not None:
            where, kind = f"bearings.{name}.plain", "slider" if key == "length" else "pin"
            require_absent(where, table.plain, (other,), f"a plain bearing of a {kind} has no {other}: give {key}")
            if getattr(table.plain, key) is None:
                raise fault(where, key, f"the key is missing: a plain bearing of a {kind} needs it")
    return {name: _parts(scene, name, table) for name, table in tables.items()}


def _parts(scene: SceneTable, point: str, table: BearingTable) -> JointParts:
    where = f"bearings.{point}"
    rolling, plain, pin, eye = table.rolling, table.plain, table.pin, table.eye
    if rolling is not None and rolling.safety is not None and rolling.C0 is None:
        raise fault(f"{where}.rolling", "C0", "the key is missing: safety is C0 / load")
    if rolling is not None and rolling.least_overlap is not None and rolling.elements is None:
        raise fault(f"{where}.rolling", "elements", "the key is missing: give the number of balls or rollers")
    if pin is not None and pin.cheek is None and not pin.overhung:
        raise fault(f"{where}.pin", "cheek", "the key is missing: give the thickness of one cheek, or overhung = true")
    for name, part in (("pin", pin), ("eye", eye)):
        if part is not None and part.safety is not None and part.yield_stress is None:
            raise fault(f"{where}.{name}", "yield", "the key is missing: safety is yield / stress")
    if eye is not None:
        require(real(eye.width) > real(eye.diameter), f"{where}.eye", "width", "expected more than the diameter")
        if eye.link is not None:
            there = [link for link, own in scene.links.items() if point in own.points]
            known_name(f"{where}.eye", "link", eye.link, there, "link at the pin")
        require(2 * real(eye.edge) > real(eye.diameter), f"{where}.eye", "edge", "expected more than half the diameter")
    return JointParts(
        None if rolling is None else formulas.Rolling(
            real(rolling.C), _or(rolling.C0, nan), rolling.type, float(rolling.reliability.split()[0]) / 100,
            _or(rolling.condition, 1.0), _or(rolling.elements, nan),
        ),
        None if plain is None else _plain(plain),
        None if pin is None else formulas.Pin(
            real(pin.diameter), real(pin.eye), _or(pin.cheek, 0.0), _or(pin.gap, 0.0), pin.overhung,
            _or(pin.yield_stress, nan),
        ),
        None if eye is None else eye_of(eye),
        None if table.clearance is None else real(table.clearance),
    )  # fmt: skip


def eye_of(table: EyeTable) -> formulas.Eye:
    """Return the eye of a link from its table."""
    diameter, width, thickness, edge = (
        real(each) for each in (table.diameter, table.width, table.thickness, table.edge)
    )
    return formulas.Eye(diameter, width, thickness, edge, _or(table.yield_stress, nan))


def _plain(table: PlainTable) -> formulas.Plain | formulas.Guide:
    """Return a plain bearing from its table: with a diameter for a pin, or with a length for a slider."""
    if table.diameter is not None:
        return formulas.Plain(real(table.diameter), real(table.width))
    assert table.length is not None
    return formulas.Guide(real(table.length), real(table.width))


def _or(value: Any, otherwise: float) -> Any:
    """Return a number, or `otherwise` if it is missing."""
    return otherwise if value is None else real(value)


def lost_contact(cycle: Cycle, number: int) -> Flags:
    """Return whether a joint with clearance loses contact before the next position, shape (..., positions)."""
    return formulas.contact_losses(cycle.joint(number), cycle.scene.run.turn)


def _knocks(cycle: Cycle) -> list[Any]:
    return [
        formulas.knocks(lost_contact(cycle, number), cycle.scene.run.turn)
        for number in joints_with(cycle.scene, CLEARANCE)
    ]


def clearance_figures(output: Output | None) -> tuple[Figure, ...]:
    """Return the figures (results) on the displacement of the output due to clearance.

    Return none without an output.
    """
    if output is None:
        return ()

    def effect(number: int) -> Callable[[Cycle], Any]:
        return lambda cycle: [cycle.once(_effects, output)[number]] if joints_with(cycle.scene, CLEARANCE) else []

    return (
        Figure("clearance_worst", "displacement of the output by clearance, at worst", output.unit, CLEARANCES,
               each(effect(0)), rigid=True),
        Figure("clearance_pressed", "displacement of the output by clearance, as the forces press", output.unit,
               CLEARANCES, each(effect(1))),
    )  # fmt: skip


def _effects(cycle: Cycle, output: Output) -> tuple[Reals, Reals]:
    """Return two displacements of the output due to clearance: in the worst case, and under the actual joint forces.

    If several links share the output point, the result is the largest displacement of these links.
    """
    mechanism = cycle.scene.mechanism
    gaps: dict[int, Any] = {
        number: cycle.scene.bearings[name].clearance for number, name in joints_with(cycle.scene, CLEARANCE).items()
    }
    forces = {number: cycle.deflection.forces.force[number] for number in gaps}
    ends: list[tuple[int, Any]] = [(mechanism.index[output.link], None)]
    if output.point:
        links = enumerate(mechanism.links)
        ends = [(at, link.points[output.point]) for at, link in links if at and output.point in link.points]
    effects = [formulas.clearance_effects(cycle.motion, gaps, forces, *end) for end in ends]
    worst, pressed = (np.maximum.reduce(each) for each in zip(*effects, strict=True))
    return worst, pressed


SENSES = {1: "turns counter-clockwise", -1: "turns clockwise", 0: "swings"}


def _joint_row(reader: Reader, number: int) -> dict[str, Any]:
    """Return the row of a joint in the summary.

    The row contains the motion of the joint, the rotation of the joint force, the positions at which contact is lost,
    and the results for the machine parts of the joint.
    """
    scene, course = reader.scene, reader.cycle.joint(number)
    parent = reader.results.motion.structure.joints[number].parent
    figures = {}
    for figure in BEARINGS.figures:
        numbers = [*joints_with(scene, figure.of)]
        if number in numbers:
            item = numbers.index(number)
            peak, unit = reader.results.figures.peaks[figure.key][item], figure.units(scene)[item]
            figures[figure.key] = reader.largest(peak, unit)
    lost: list[int] = []
    if number in joints_with(scene, CLEARANCE):
        lost = np.flatnonzero(lost_contact(reader.cycle, number)).tolist()[:MAX_MARKS]
    return {
        "parent": scene.mechanism.links[parent].name,
        "sense": SENSES[int(course.sense)] if course.turns else "slides",
        "force_turns": {
            key: reading(course.force_turns(child), "1") for key, child in (("child", True), ("parent", False))
        },
        "contact_lost": [reader.at_position(at) for at in lost],
        "figures": figures,
    }


Reduction = Callable[[Callable[["Cycle"], list[Any]]], Callable[["Cycle"], "Largest"]]
Values = Callable[[Any, JointHistory], Any]
"""Function of a part of a joint and the force and motion of the joint. Returns one value per position or per run."""


def _search_joints(reduced: Reduction, part: Kind, values: Values) -> Callable[[Cycle], Largest]:
    """Return a function that finds a result for all joints that have the machine part `part`."""

    def found(cycle: Cycle) -> list[Any]:
        built = cycle.scene.parts[KEY]
        with np.errstate(divide="ignore", invalid="ignore"):
            return [
                values(getattr(built[name], part.name, None), cycle.joint(number))
                for number, name in joints_with(cycle.scene, part).items()
            ]

    return reduced(found)


def _over_minimum(scene: Scene, shares: Any) -> Any:
    """Return, for each rolling bearing, the equivalent load divided by the minimum load.

    `shares` contains the equivalent load divided by the load rating C.
    """
    kinds = [scene.parts[KEY][name].rolling.kind for name in items_of(scene, ROLLING)]
    return shares / per_row([formulas.MIN_LOADS[kind] for kind in kinds], np.ndim(shares) - 1, float)


def _life_exponents(scene: Scene) -> list[float]:
    """Return the life exponent of each rolling bearing."""
    return [scene.parts[KEY][name].rolling.exponent for name in items_of(scene, ROLLING)]


_one, _every, _least = partial(_search_joints, averaged), partial(_search_joints, each), partial(_search_joints, least)
LIVES = "bearing_life", "bearing_revolutions"
BEARINGS: Part[JointParts] = Part(
    KEY, "bearings, pins, eyes and clearances of joints", BearingTable, _built,
    (
        Figure("joint_mean_force", "cubic mean force in a joint over its angle", "N", BEARING,
               _one(BEARING, lambda _, course: course.mean_force()), AVERAGE),
        Figure("joint_swing", "angle of swing or rotation of a joint", "rad", BEARING,
               _one(BEARING, lambda _, course: course.swing), AVERAGE, rigid=True),
        Figure("joint_rate", "angular speed of a joint", "rad/s", BEARING,
               _every(BEARING, lambda _, course: course.rate), rigid=True),
        Figure("bearing_load", "equivalent load of a rolling bearing", "N", ROLLING,
               _one(ROLLING, formulas.Rolling.equivalent_load), AVERAGE),
        Figure("bearing_life", "life of a rolling bearing", "s", ROLLING,
               _one(ROLLING, formulas.Rolling.life), LEAST, whole=True, power=ROLLER_EXPONENT,
               exponents=_life_exponents, limit="rolling.life"),
        Figure("bearing_revolutions", "life of a rolling bearing in revolutions", "1", ROLLING,
               _one(ROLLING, formulas.Rolling.revolutions), LEAST, whole=True, power=ROLLER_EXPONENT,
               exponents=_life_exponents),
        Figure("bearing_static_safety", "static safety of a rolling bearing", "1", ROLLING,
               _one(ROLLING, formulas.Rolling.static_safety), LEAST, whole=True, limit="rolling.safety"),
        Figure("bearing_load_share", "equivalent load of a rolling bearing / dynamic rating", "1", ROLLING,
               _one(ROLLING, formulas.Rolling.load_share), LEAST, whole=True, limit="rolling.least_load"),
        Figure("bearing_overlap", "swing of a rolling bearing / twice the angle between elements", "1", ROLLING,
               _one(ROLLING, formulas.Rolling.overlap), LEAST, whole=True, rigid=True, limit="rolling.least_overlap"),
        Figure("bearing_pressure", "pressure in a plain bearing", "Pa", PLAIN,
               _every(PLAIN, lambda part, course: part.pressure(course)), limit="plain.pressure"),
        Figure("bearing_speed", "sliding speed in a plain bearing", "m/s", PLAIN,
               _every(PLAIN, lambda part, course: part.speed(course)), rigid=True, limit="plain.speed"),
        Figure("bearing_pv", "mean pressure times speed of a plain bearing", "W/m^2", PLAIN,
               _one(PLAIN, lambda part, course: part.pressure_times_speed(course)), AVERAGE,
               limit="plain.pressure_speed"),
        Figure("pin_shear", "shear stress of a pin", "Pa", PIN, _every(PIN, formulas.Pin.shear), limit="pin.shear"),
        Figure("pin_bending", "bending stress of a pin", "Pa", PIN,
               _every(PIN, formulas.Pin.bending), limit="pin.bending"),
        Figure("pin_safety", "yield stress / stress of a pin", "1", PIN,
               _least(PIN, formulas.Pin.safety), LEAST, limit="pin.safety"),
        Figure("eye_bearing", "bearing stress of an eye", "Pa", EYE,
               _every(EYE, formulas.Eye.bearing), limit="eye.bearing"),
        Figure("eye_net", "tension in the net section of an eye", "Pa", EYE,
               _every(EYE, formulas.Eye.net), limit="eye.net"),
        Figure("eye_tear_out", "tear-out shear stress of an eye", "Pa", EYE,
               _every(EYE, formulas.Eye.tear_out), limit="eye.tear_out"),
        Figure("eye_safety", "yield stress / stress of an eye", "1", EYE,
               _least(EYE, formulas.Eye.safety), LEAST, limit="eye.safety"),
        Figure("contact_losses", "number of contact losses in a joint with clearance", "1", CLEARANCE,
               averaged(_knocks), AVERAGE, power=0.0),
    ),
    checks=(
        RangeCheck(formulas.LOAD_RANGE, ROLLING, "bearing_load_share", LIVES),
        RangeCheck(formulas.STATIC_RANGE, ROLLING, "bearing_static_safety", LIVES),
        RangeCheck(formulas.OVERLAP_RANGE, ROLLING, "bearing_overlap", LIVES),
        RangeCheck(formulas.SLIP_RANGE, ROLLING, "bearing_load_share", LIVES, _over_minimum),
        RangeCheck(formulas.PIN_RANGE, PIN, "pin_safety", ("pin_safety", "pin_shear", "pin_bending")),
        RangeCheck(formulas.EYE_RANGE, EYE, "eye_safety", ("eye_safety", "eye_bearing", "eye_net", "eye_tear_out")),
    ),
    joint_row=_joint_row,
    of_output=clearance_figures,
    formulas="bearing formulas and catalogue ratings",
    on_axis=True,
    usual={
        "diameter": ("diameter", 1e-5, 10.0, "m", "10 mm"),
        "width": ("width", 1e-5, 10.0, "m", "12 mm"),
        "thickness": ("thickness", 1e-5, 10.0, "m", "8 mm"),
        "clearance": ("clearance", 0.0, 0.1, "m", "20 um"),
        "dynamic": ("load rating", 10.0, 1e9, "N", "19.5 kN"),
    },
)  # fmt: skip
