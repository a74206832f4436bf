"""Joints of a scene: sliders, slots, welds and gears, with the compliance and friction of joints."""

from collections import Counter
from collections.abc import Iterable, Iterator, Mapping
from math import inf, pi
from typing import Any

from msgspec.structs import replace

from elastic import JointCompliance
from kinelast.scene.format import SceneTable
from kinelast.scene.links import LinkModel, Points, drawn_direction
from kinelast.scene.moved_joint import moved_joint
from kinelast.scene.tables import GearTable, JointTable, SliderTable, SlotTable, WeldTable
from kinelast.values.error import fault, known_name, known_point, likely
from kinelast.values.numbers import EXPECTED, direction_of, real, require_unit, vector
from kinelast.values.quantities import DampingConstant
from rigid import GROUND, PRESSURE_ANGLE, Friction, Gear, Link, Mechanism, Slider, Weld
from rigid.arrays import Complex


def build_sliders(scene: SceneTable, bodies: dict[str, LinkModel], places: Points) -> dict[str, Slider]:
    """Return all sliders and slots by name. Add a link for the block of each slot to `bodies`."""
    links = {name: body.link for name, body in bodies.items()}
    sliders = {name: _slider(name, table, links, places) for name, table in scene.sliders.items()}
    for name, slot in scene.slots.items():
        if name in sliders:
            raise fault(f"slots.{name}", "", "a slider has this name: choose another")
        # names in a file have no spaces, so the name of the block is unique
        block = Link(f"{name} block", {slot.point: 0j})
        sliders[name] = replace(_slider(name, slot, links, places), link=block.name)
        bodies[block.name] = LinkModel(block, (), True, hidden=True)
    return sliders


def _slider(name: str, table: SliderTable | SlotTable, links: Mapping[str, Link], places: Points) -> Slider:
    """Return the slider or slot that a table describes.

    The line along which it slides passes through the drawn point and is fixed in the link `on`. The block of a slot has
    its x axis along the line.
    """
    slides = isinstance(table, SliderTable)
    where, key = (f"sliders.{name}", "through") if slides else (f"slots.{name}", "point")
    point: str = getattr(table, key)
    for end in ("link", "on"):
        known_name(where, end, getattr(table, end), links)
    if slides and table.link == GROUND:
        raise fault(where, "link", "the ground cannot slide: give the moving link here, and ground under on")
    if table.link == table.on:
        raise fault(where, "on", f'the link "{table.link}" cannot slide on itself')
    link, owner = links[table.link], links[table.on]
    known_point(where, key, point, link.points, table.link)
    if point in owner.points:
        pinned = f'the point "{point}" is also a point of "{owner.name}", so that a pin joins both links there'
        raise fault(where, key, f'{pinned}: remove it from the points of "{owner.name}"')
    if point not in places:
        raise fault(where, key, f'the point "{point}" has no coordinates under [points]{likely(point, places)}')
    axes = drawn_direction(owner, places)
    if axes is None:
        raise fault(where, "on", f'draw two points of the link "{owner.name}": they locate the line in it')
    origin: Any = places[point]
    if owner.name != GROUND:
        anchor = next(point for point in owner.points if point in places)
        origin = (origin - places[anchor]) * axes.conjugate() + owner.points[anchor]
    drawn = drawn_direction(link, places) if slides else None
    turn: Any = 1 + 0j if drawn is None else drawn * axes.conjugate()
    return Slider(name, table.link, table.on, point, origin, direction_of(table.direction) * axes.conjugate(), turn)


UNITS = {(True, True): "rad/rad", (True, False): "m/rad", (False, True): "rad/m", (False, False): "rad/rad"}


def build_gears(scene: SceneTable, links: Mapping[str, Link], sliders: Mapping[str, Slider]) -> tuple[Gear, ...]:
    """Return all gears in the order of the file."""
    gears = []
    for number, table in enumerate(scene.gears, 1):
        where = f"gears[{number}]"
        driver = moved_joint(where, "driver.", table.driver, links, sliders)
        follower = moved_joint(where, "follower.", table.follower, links, sliders)
        require_unit(where, "ratio", table.ratio, UNITS[driver.turns, follower.turns])
        if not table.ratio:
            raise fault(where, "ratio", "expected a nonzero number")
        gears.append(Gear(driver, follower, float(table.ratio), _pressure_angle(where, table)))
    return tuple(gears)


def _pressure_angle(where: str, table: GearTable) -> float | None:
    """Return the pressure angle of the teeth [rad], or None if the gear has no teeth."""
    if not table.teeth:
        if table.pressure_angle is not None:
            raise fault(where, "pressure_angle", "belongs to teeth: remove it, or remove teeth = false")
        return None
    if table.pressure_angle is None:
        return PRESSURE_ANGLE
    angle = float(table.pressure_angle)
    if not 0 <= angle < pi / 2:
        expected = 'expected an angle from 0 to less than 90 deg, as in "20 deg"'
        raise fault(where, "pressure_angle", f"{expected}, got {angle:g} rad")
    return angle


FRICTION_KEYS = ("friction", "viscosity", "radius", "length")


def _tables_with(scene: SceneTable, mechanism: Mechanism, keys: Iterable[str]) -> Iterator[tuple[str, JointTable, int]]:
    """Yield the joints that have one of the `keys` in their table: name, table, number of joints of this name."""
    shared, sliders = Counter(point for link in mechanism.links for point in link.points), mechanism.slider_points
    names = [*(point for point, count in shared.items() if count > 1), *sliders]
    for name, table in scene.joints.items():
        if any(getattr(table, key) is not None for key in keys):
            known_name("joints", name, name, names, "joint")
            yield name, table, max(shared[name] - 1, 0) + (name in sliders)


def build_joints(scene: SceneTable, mechanism: Mechanism) -> dict[str, JointCompliance]:
    """Return the compliances of joints by the name of the point, slider or slot."""
    driven = [drive.joint for drive in mechanism.drives if drive.turns]
    joints = {}
    for name, table, count in _tables_with(scene, mechanism, ("compliance", "rotation", "gap", "turn")):
        where = f"joints.{name}"
        if count > 1:
            raise fault(where, "", f"{count} joints have this name: only a pin of two links can be compliant")
        for key in ("rotation", "turn"):
            if getattr(table, key) is not None and name not in (*mechanism.slider_points, *driven, *scene.welds):
                raise fault(where, key, "a pin without a drive carries no moment: remove the key")
        joints[name] = JointCompliance(
            real(table.compliance or 0.0),
            real(table.rotation or 0.0),
            0j if table.gap is None else vector(table.gap),
            real(table.turn or 0.0),
        )
    return joints


def build_friction(scene: SceneTable, mechanism: Mechanism) -> dict[str, Friction]:
    """Return the friction of joints by the name of the point, slider or slot."""
    friction = {}
    for name, table, count in _tables_with(scene, mechanism, FRICTION_KEYS):
        where = f"joints.{name}"
        if name in scene.welds:
            raise fault(where, "friction", "the links are welded here: no friction")
        if count > 1:
            raise fault(where, "friction", f"{count} joints have this name: only a pin of two links can have friction")
        friction[name] = _friction(where, table, name in mechanism.slider_points)
    return friction


def _friction(where: str, table: JointTable, slides: bool) -> Friction:
    """Return the friction of a pin or slider."""
    key, problem = ("radius", "belongs to a pin") if slides else ("length", "belongs to a slider")
    if getattr(table, key) is not None:
        raise fault(where, key, problem)
    if table.friction is None and table.viscosity is None:
        raise fault(where, "friction", "the key is missing: a number, as in 0.1, or viscosity")
    if table.friction and not slides and table.radius is None:
        raise fault(where, "radius", 'the key is missing: the friction of a pin needs its radius, as in "5 mm"')
    unit = DampingConstant.units[not slides]
    if table.viscosity is not None and table.viscosity.unit not in ("", unit):
        raise fault(where, "viscosity", f"expected {EXPECTED[unit]}, got one in {table.viscosity.unit}")
    sizes = real(table.friction or 0.0), real(table.radius or 0.0), real(table.length or inf)
    return Friction(*sizes, real(table.viscosity or 0.0))


def build_welds(scene: SceneTable, links: Mapping[str, Link], places: Points) -> tuple[Weld, ...]:
    """Return all welds in the order of the file."""
    return tuple(weld for point, table in scene.welds.items() for weld in _welds(point, table, links, places))


def _welds(point: str, table: WeldTable, links: Mapping[str, Link], places: Points) -> Iterator[Weld]:
    """Yield the welds at a point. Each weld connects one of the other links to the first link."""
    where = f"welds.{point}"
    known_name("welds", point, point, sorted({name for link in links.values() for name in link.points}), "point")
    names = table.links or [name for name, link in links.items() if point in link.points]
    for name in names:
        known_name(where, "links", name, links)
        known_point(where, "links", point, links[name].points, name)
    if len(names) < 2:
        raise fault(where, "", f'the link "{names[0]}" is the only link with this point: a weld needs two')
    for name in names:
        if names.count(name) > 1:
            raise fault(where, "links", f'the link "{name}" is listed {names.count(name)} times')
    on, *others = names
    for name in others:
        turn = _turn(where, links[name], places) * _turn(where, links[on], places).conjugate()
        yield Weld(point, name, on, turn)


def _turn(where: str, link: Link, places: Points) -> Complex:
    """Return the x axis of a link, in the drawing, as a unit vector. It is arbitrary if the link has only one point."""
    turn: Complex | None = 1 + 0j if len(link.points) == 1 else drawn_direction(link, places)
    if turn is None:
        raise fault(where, "links", f'draw two points of the link "{link.name}": they give its angle')
    return turn
