"""Fatigue of links: strength, its factors, safety against the endurance limit, and life."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from importlib.util import find_spec
from math import nan
from typing import TYPE_CHECKING, Annotated, Any, Literal

import numpy as np
from msgspec import Meta, field
from msgspec.structs import replace

from elastic import Largest, Section
from kinelast.scene.part import ALONE, Assembly, Part
from kinelast.scene.parts.bearings import BEARINGS, eye_of
from kinelast.scene.tables import Factor, StrictTable
from kinelast.values.error import fault, known_name
from kinelast.values.figure import LEAST, Figure, Kind, RangeCheck
from kinelast.values.numbers import real, require
from kinelast.values.reading import Reader, reading
from machine import Range
from machine import life as formulas
from machine.joints import EDGE_RANGE, HOLE_RANGE
from machine.life import Fatigue, FatigueStrength, FatigueTask
from rigid.arrays import Real

if TYPE_CHECKING:
    from kinelast.figures.cycle import Cycle
    from kinelast.scene.data import Scene
    from kinelast.scene.format import MaterialTable, SceneTable
    from kinelast.scene.links import LinkModel
    from kinelast.scene.sections import SectionSource

KEY = "fatigue"
LIFE_POWER = 9.0  # life ~ load ** -9 below the knee of an S-N line with exponent 5 (2 k - 1 = 9)
Surface = Literal["polished", "ground", "machined", "hot-rolled", "as-forged"]


class LinkFatigueTable(StrictTable, frozen=True, kw_only=True):
    """Factors of the endurance limit of a link, and notch factors at its points."""

    surface: Surface | Factor | None = None  #: surface finish of steel, or the surface factor [1]
    size: Factor | None = None  #: size factor [from the section]
    #: fatigue notch factors at points, such as `{A = 1.8}` [1]
    notches: dict[str, Annotated[float, Meta(ge=1)]] = field(default_factory=dict)


class FatigueTable(LinkFatigueTable, frozen=True, kw_only=True):
    """Fatigue: criterion, reliability, factors of all links, and factors of individual links."""

    criterion: Literal["goodman", "gerber", "soderberg"] = "goodman"  #: mean stress criterion
    #: fraction of parts that reach the endurance limit
    reliability: Annotated[float, Meta(gt=0, lt=1)] = 0.5
    #: factors of single links, which override the general ones
    links: dict[str, LinkFatigueTable] = field(default_factory=dict)


def _built(assembly: Assembly) -> dict[str, FatigueTask]:
    return {name: _task(assembly, settings) for name, settings in FATIGUE.tables(assembly.table).items()}


def _task(assembly: Assembly, settings: FatigueTable) -> FatigueTask:
    """Return the strengths and notch factors of all beams."""
    table, beams, made_of, materials = assembly.table, assembly.beams, assembly.made_of, assembly.materials
    if find_spec("rainflow") is None:
        raise fault("fatigue", "", 'needs the package rainflow: pip install "rainflow"')
    elastic = [body.link.name for body, _ in beams]
    points = {point for body, _ in beams for point in body.link.points}
    for name, own in settings.links.items():
        known_name("fatigue.links", name, name, dict.fromkeys(elastic), "link with beams")
        for point in own.notches:
            known_name(f"fatigue.links.{name}.notches", point, point, table.links[name].points, "point of the link")
    for point in settings.notches:
        known_name("fatigue.notches", point, point, sorted(points), "point of a link with beams")
    rows = [_strength(settings, body, k, made, materials) for (body, k), made in zip(beams, made_of, strict=True)]
    notches = []
    for (body, k), made in zip(beams, made_of, strict=True):
        beam = body.link.beams[k]
        of_link = settings.links.get(body.link.name, LinkFatigueTable()).notches
        eyes = {
            point: _eye_notch(table, point, body, k, materials.get(made.material)) for point in (beam.start, beam.end)
        }
        given = {**settings.notches, **{point: notch for point, notch in eyes.items() if notch is not None}, **of_link}
        notches.append((given.get(beam.start, 1.0), given.get(beam.end, 1.0)))
    strengths, factors = ((*column,) for column in (zip(*rows, strict=True) if rows else ((), ())))
    return FatigueTask(strengths, settings.criterion, tuple(notches), factors)


def _eye_notch(
    table: SceneTable, point: str, body: LinkModel, number: int, material: MaterialTable | None
) -> Real | None:
    """Return the ratio of the stress at the hole of an eye to the stress at the end of the beam.

    Return None without an eye.
    """
    bearings = BEARINGS.tables(table)
    eye = bearings[point].eye if point in bearings else None
    if eye is None or eye.link != body.link.name:
        return None
    section = body.sections[number].section
    factor = eye.notch or eye_of(eye).stress_concentration
    if np.isnan(factor).all():  # nan for some designs only means that their life is unknown; the scene is valid
        form = f"the formula is valid for a {HOLE_RANGE.quantity} of {HOLE_RANGE.bounds}"
        form += f" and an {EDGE_RANGE.quantity} of {EDGE_RANGE.bounds}"
        raise fault(f"bearings.{point}.eye", "notch", f"the key is missing: {form}")
    if section.taper is not None or material is None:
        raise fault(f"bearings.{point}.eye", "link", "expected a beam of one section and a material")
    area: Real = section.EA / real(material.E)
    return np.maximum(factor * area / eye_of(eye).net_area, 1.0)


def _strength(
    settings: FatigueTable, body: LinkModel, number: int, made: SectionSource, materials: Mapping[str, MaterialTable]
) -> tuple[FatigueStrength, dict[str, Any]]:
    """Return the fatigue strength and the endurance factors of a beam; nan if it has no material."""
    if not made.material:
        return FatigueStrength(nan, nan, nan, nan, nan), {}
    stuff, where = materials[made.material], f"materials.{made.material}"
    given = settings.links.get(body.link.name, settings)
    for key in ("ultimate", "endurance"):
        if getattr(stuff, key) is None:
            raise fault(where, key, "the key is missing: [fatigue] needs it")
    if settings.criterion == "soderberg" and stuff.yield_stress is None:
        raise fault(where, "yield", "the key is missing: the Soderberg criterion needs it")
    surface = settings.surface if given.surface is None else given.surface
    size = settings.size if given.size is None else given.size
    ultimate = real(stuff.ultimate)
    if isinstance(surface, str):
        require(
            formulas.SURFACE_RANGE.holds(real(stuff.E) / 1e9), "fatigue", "surface", _outside(formulas.SURFACE_RANGE)
        )
    factors: dict[str, Any] = {"reliability": formulas.reliability_factor(settings.reliability)}
    factors["surface"] = formulas.surface_factor(surface, ultimate) if isinstance(surface, str) else surface or 1.0
    factors["size"] = _size_factor(body.sections[number].section, made) if size is None else size
    whole = factors["reliability"] * factors["surface"] * factors["size"]
    limit = nan if stuff.yield_stress is None else real(stuff.yield_stress)
    line = stuff.slope, stuff.knee, stuff.second_knee or nan, stuff.second_slope
    return FatigueStrength(ultimate, limit, real(stuff.endurance) * whole, *line), factors


def _size_factor(section: Section, made: SectionSource) -> Real:
    """Return the size factor for the larger end of a beam."""
    taper = section.taper
    deep, wide = (1.0, 1.0) if taper is None else (max(1.0, sum(taper.fibre)), max(1.0, sum(taper.width)))
    diameter = formulas.effective_diameter(2 * section.fibre * deep, section.width * wide, section.round)
    if np.isnan(diameter).any():
        raise fault("fatigue", "size", f'the section "{made.section}" has no dimensions: give the factor')
    require(formulas.SIZE_RANGE.holds(1e3 * diameter), "fatigue", "size", _outside(formulas.SIZE_RANGE))
    return formulas.size_factor(diameter)


def _outside(formula: Range) -> str:
    """Return the error message for a quantity outside the range of validity of a formula."""
    return f"{formula.words}: {formula.outside}"


def beam_fatigue(cycle: Cycle) -> Fatigue:
    """Fatigue of the beams of a scene with `[fatigue]`."""
    return cycle.once(_fatigue)


def _fatigue(cycle: Cycle) -> Fatigue:
    return formulas.fatigue(cycle.well_conditioned, cycle.scene.parts[KEY][ALONE])


def _for_fatigue(find: Callable[[Cycle], Largest]) -> Callable[[Cycle], Largest]:
    """Return a function that calls `find` or, for a scene without `[fatigue]`, returns no items."""

    def found(cycle: Cycle) -> Largest:
        none = np.zeros((0, *cycle.columns[:-1]))
        return find(cycle) if cycle.scene.parts[KEY] else Largest(none, np.zeros(none.shape, int))

    return found


def _life(cycle: Cycle) -> Largest:
    """Time until Miner's sum of each beam reaches 1 [s]."""
    cycles = _cycles(cycle)
    return replace(cycles, value=cycles.value * cycle.durations.sum(axis=-1))


def _cycles(cycle: Cycle) -> Largest:
    found = beam_fatigue(cycle).damage
    with np.errstate(divide="ignore"):
        return replace(found, value=1.0 / found.value)


def _slopes(scene: Scene) -> list[Any]:
    """Return the exponent of the S-N line of each beam."""
    return [np.ravel(strength.slope)[0] for strength in scene.parts[KEY][ALONE].strengths]


def _row(reader: Reader, _: str) -> dict[str, Any]:
    """Return the row of the summary: the criterion, and the safety and life of every beam with their locations."""
    task, peaks = reader.scene.parts[KEY][ALONE], reader.results.figures.peaks
    stress, links = beam_fatigue(reader.cycle), {}
    for beam, label in enumerate(reader.scene.labels):
        peak, life, strength = peaks["endurance"][beam], peaks["life"][beam], task.strengths[beam]
        links[label] = {
            "endurance": reader.largest(peak, "1"),
            "cycles": reader.largest(peaks["life_cycles"][beam], "1"),
            "life": reader.largest(life, "s"),
            "endless": bool(np.isposinf(life.value)),
            "amplitude": reading(stress.amplitude[beam], "Pa"),
            "mean": reading(stress.mean[beam], "Pa"),
            "along": reading(peak.xi * float(reader.results.deflection.length[beam, 0]), "m"),
            "fibre": "left" if peak.row == 0 else "right",
            "endurance_limit": reading(np.ravel(strength.limit)[0], "Pa"),
            "factors": {key: float(np.ravel(value)[0]) for key, value in task.factors[beam].items()},
        }
    return {"criterion": task.criterion, "links": links}


FATIGUED = Kind("fatigued beam", lambda scene: scene.labels if scene.parts[KEY] else (), "link")
FATIGUE: Part[FatigueTask] = Part(
    KEY, "endurance and life of the links [not computed]", FatigueTable, _built,
    (
        Figure("endurance", "safety factor against the endurance limit", "1", FATIGUED,
               _for_fatigue(lambda cycle: beam_fatigue(cycle).safety), LEAST, limit="endurance", whole=True),
        Figure("life_cycles", "number of runs until a link breaks", "1", FATIGUED, _for_fatigue(_cycles), LEAST,
               whole=True, power=LIFE_POWER, exponents=_slopes),
        Figure("life", "time until a link breaks", "s", FATIGUED, _for_fatigue(_life), LEAST, limit="life", whole=True,
               power=LIFE_POWER, exponents=_slopes),
    ),
    _row,
    section="life",
    formulas="the life formula and its strengths",
    checks=(
        RangeCheck(formulas.YIELD_RANGE, FATIGUED, "safety", ("endurance", "life", "life_cycles")),
        RangeCheck(formulas.CYCLES_RANGE, FATIGUED, "life_cycles", ("life", "life_cycles")),
    ),
    alone=True,
)  # fmt: skip
