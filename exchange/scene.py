"""Conversion of an imported mechanism to the text of a scene file, with a comment on every assumption."""

from collections.abc import Iterable, Mapping
from itertools import pairwise
from math import isfinite, sqrt
from typing import Any

from msgspec.structs import replace

from exchange.foreign_mechanism import (
    GROUND,
    Drive,
    ExchangeError,
    ForeignGear,
    ForeignLink,
    ForeignLoad,
    ForeignMechanism,
    Names,
)

SLENDERNESS = 20  # length of the longest beam divided by the depth of the assumed section
MATERIAL, DENSITY = "S235", 7850.0  # assumed material, and its density [kg/m^3]
# a link becomes rigid if length / depth < MIN_SLENDERNESS for a bar with the length and mass of the link
MIN_SLENDERNESS = 4
BLOCK = "100 g"  # assumed mass of a link with a single point
METRES = {"m": 1.0, "cm": 0.01, "mm": 0.001, "in": 0.0254}  # length of each unit [m]
MAX_OFFSET, MAX_EXCESS = (
    # a link counts as uniform bars if (offset of its centre of mass) / (total length of the bars) is at most this
    0.02,
    0.05,  # a link counts as uniform bars if (difference of its inertia) / (inertia of the bars) is at most this
)
POSITIONS = 180  # number of positions per run in the scene file


def scene_text(drawing: ForeignMechanism) -> str:
    """Return the text of a scene file with the mechanism and a comment on every assumption.

    Raises
    ------
    ExchangeError
        If there is no moving link, or if the position of a point is not finite.
    """
    import tomlkit

    if not drawing.links:
        raise ExchangeError("the file has no moving link")
    if not all(isfinite(place.real) and isfinite(place.imag) for place in drawing.points.values()):
        raise ExchangeError("a point of the file has no finite position")
    if not drawing.ground:  # the ground of a scene file needs a point, but an imported ground with slots may have none
        origin = Names(drawing.points)("origin")
        place = next(iter(drawing.points.values()))
        drawing = replace(drawing, points={origin: place, **drawing.points}, ground=(origin,))
    document = tomlkit.document()
    for note in drawing.notes:
        document.add(tomlkit.comment(note))
    document["title"] = drawing.title
    document["source"] = drawing.source
    if drawing.unit != "m":
        document["units"] = drawing.unit
    links = {name: _Link(drawing, name, body) for name, body in drawing.links.items()}
    document["sections"] = tomlkit.table(is_super_table=True)
    document["sections"]["bar"] = _section(drawing, _longest(drawing) / SLENDERNESS, "of the longest link")
    for link in links.values():
        if link.depth:
            document["sections"][link.section] = _section(drawing, link.depth, f"for the file's {link.mass:g} kg")
    document["points"] = {name: _place(place) for name, place in drawing.points.items()}
    document["links"] = tomlkit.table(is_super_table=True)
    document["links"][GROUND] = {"points": list(drawing.ground)}
    for link in links.values():
        document["links"][link.name] = link.table()
    _add_joints(document, drawing)
    run: dict[str, Any] = {"positions": POSITIONS}
    if drawing.gravity:
        run["gravity"] = [0.0, -9.81]
    if drawing.traced:
        run["output"] = drawing.traced
    document["run"] = run
    return tomlkit.dumps(document).rstrip("\n") + "\n"


def elastic(drawing: ForeignMechanism) -> ForeignMechanism:
    """Return the mechanism without the mass data that would make links rigid, so that these links can bend.

    The centre of mass and the inertia of each such link are left out. If a bar with the mass of the link would be too
    thick, the mass is also left out. A note names the link and the data that are left out. A link with the attribute
    `rigid` stays rigid.
    """
    links, notes = dict(drawing.links), list(drawing.notes)
    for name, body in drawing.links.items():
        link = _Link(drawing, name, body)
        if not link.rigid:
            continue
        links[name] = replace(body, mass=None if link.stout else body.mass, center=None, inertia=None)
        mass = (
            "has the mass of the assumed section" if link.stout else f"is a uniform bar of the file's {body.mass:g} kg"
        )
        left_out = f"mass ({body.mass:g} kg), centre" if link.stout else "centre of mass"
        notes.append(f"{name} {mass}; the file's {left_out} and inertia are left out")
    return replace(drawing, links=links, notes=tuple(notes))


class _Link:
    """Link of the scene file.

    The link either has beams with the assumed section, or has beams with the mass from the file, or is rigid.
    """

    def __init__(self, drawing: ForeignMechanism, name: str, body: ForeignLink) -> None:
        self.drawing, self.name, self.body, self.points = drawing, name, body, drawing.points
        self.scale = METRES[drawing.unit]
        self.mass = body.mass or 0.0
        self.spans = [(drawing.points[a], drawing.points[b]) for a, b in (*pairwise(body.points), *body.braces)]
        self.length = sum(abs(b - a) for a, b in self.spans)
        bar = sqrt(2 * self.mass / (DENSITY * self.length * self.scale)) / self.scale if self.length else 0.0
        self.stout = bar * MIN_SLENDERNESS > self.length
        self.rigid = bool(self.mass) and len(body.points) > 1 and (self.stout or not self._is_uniform())
        self.depth = 0.0 if self.rigid or body.rigid else float(f"{bar:.6g}")
        self.section = f"bar_{name}" if self.depth else "bar"

    def uniform(self) -> tuple[complex, float]:
        """Return centre [unit of the drawing] and moment of inertia [kg m^2] of uniform bars with the link's mass."""
        pieces = [((a + b) / 2, abs(b - a) / (self.length or 1.0)) for a, b in self.spans] or [
            (self.points[self.body.points[0]], 1.0)
        ]
        center = sum(middle * share for middle, share in pieces)
        squares = sum(share * ((share * self.length) ** 2 / 12 + abs(middle - center) ** 2) for middle, share in pieces)
        return center, self.mass * squares * self.scale**2

    def _is_uniform(self) -> bool:
        center, inertia = self.uniform()
        offset = 0.0 if self.body.center is None else abs(self.body.center - center)
        excess = 0.0 if self.body.inertia is None else abs(self.body.inertia - inertia)
        return offset <= MAX_OFFSET * self.length and excess <= MAX_EXCESS * inertia

    def table(self) -> Any:
        body, points = self.body, {"points": list(self.body.points)}
        if len(body.points) == 1 and self.mass:
            return _table({**points, "mass": f"{self.mass:.12g} kg"})
        if len(body.points) == 1:
            return _table({**points, "mass": BLOCK}, mass="assumed: put in yours")
        beams = {"beams": [list(pair) for pair in (*pairwise(body.points), *body.braces)]} if body.braces else {}
        rigid = {"rigid": True} if body.rigid or self.rigid else {}
        made_of = {"section": self.section, "material": MATERIAL}
        return _table(
            {**points, **beams, **rigid, **made_of, **(self._inertia() if self.rigid else {})},
            material="assumed: --list materials",
            mass="from the file, as center and inertia; --import with --elastic writes links that bend",
        )

    def _inertia(self) -> dict[str, Any]:
        """Return mass, centre (in link axes) and inertia from the file.

        Uniform bars give the values that the file does not contain.
        """
        center, inertia = self.uniform()
        given = self.body.center if self.body.center is not None else center
        own = (given - self.points[self.body.points[0]]) * _own_axis(self.drawing, self.body).conjugate()
        if self.body.inertia is not None:
            inertia = self.body.inertia
        return {"mass": f"{self.mass:.12g} kg", "center": _place(own), "inertia": f"{inertia:.12g} kg m^2"}


def _own_axis(drawing: ForeignMechanism, body: ForeignLink) -> complex:
    """Return the direction of the x' axis of a link: from its first to its second point."""
    along = drawing.points[body.points[1]] - drawing.points[body.points[0]]
    return along / (abs(along) or 1.0)


def _longest(drawing: ForeignMechanism) -> float:
    """Return the length of the longest beam of the drawing."""
    spans = [
        abs(drawing.points[a] - drawing.points[b]) for body in drawing.links.values() for a, b in pairwise(body.points)
    ]
    return max(spans, default=0.0) or 1.0


def _section(drawing: ForeignMechanism, depth: float, why: str) -> Any:
    """Return the table of a rectangular section. The width is half of the depth.

    `why` is the reason for the depth, which the table contains as a comment. If `why` starts with "of", the depth is
    rounded to one digit.
    """
    depth = float(f"{depth:.1g}") if why.startswith("of") else depth
    sizes = {"depth": f"{depth:.6g} {drawing.unit}", "width": f"{depth / 2:.6g} {drawing.unit}"}
    reasons = {"depth": why, "width": "half the depth"}
    remarks = {key: f"assumed, {reason}: put in yours" for key, reason in reasons.items()}
    return _table({"shape": "rectangle", **sizes}, **remarks)


def _table(entries: Mapping[str, Any], **remarks: str) -> Any:
    """Return a TOML table. `remarks` contains the comment after each entry, by key."""
    import tomlkit

    table = tomlkit.table()
    table.update(entries)
    for key in remarks.keys() & entries.keys():
        table[key].comment(remarks[key])
    return table


def _add_list(document: Any, kind: str, tables: Iterable[Mapping[str, Any]]) -> None:
    """Add a list of tables to the document, if the list is not empty."""
    import tomlkit

    entries = tomlkit.aot()
    for entry in tables:
        entries.append(_table(entry))
    if entries:
        document[kind] = entries


def _place(place: complex) -> list[float]:
    return [round(place.real, 9) + 0.0, round(place.imag, 9) + 0.0]


def _add_joints(document: Any, drawing: ForeignMechanism) -> None:
    import tomlkit

    tables: dict[str, dict[str, dict[str, Any]]] = {
        "slots": {
            name: {"point": slot.point, "link": slot.link, "on": slot.on, "direction": _direction(slot.direction)}
            for name, slot in drawing.slots.items()
        },
        "sliders": {
            name: {"link": each.link, "on": each.on, "through": each.through, "direction": _direction(each.direction)}
            for name, each in drawing.slides.items()
        },
    }
    for kind, of_kind in tables.items():
        if of_kind:
            document[kind] = tomlkit.table(is_super_table=True)
            for name, keys in of_kind.items():
                document[kind][name] = {key: value for key, value in keys.items() if (key, value) != ("on", GROUND)}
    _add_list(document, "drives", map(_drive, drawing.drives))
    _add_list(document, "gears", map(_gear, drawing.gears))
    if drawing.masses:
        document["masses"] = {point: f"{mass:.12g} kg" for point, mass in drawing.masses.items()}
    _add_list(document, "loads", (_load(drawing, load) for load in drawing.loads))


def _drive(drive: Drive) -> dict[str, Any]:
    start = {"start": drive.start} if drive.start else {}
    law = {"law": [dict(segment) for segment in drive.law], "repeat": True}
    return {**drive.joint, **start, **(law if drive.speed is None else {"speed": drive.speed})}


def _gear(gear: ForeignGear) -> dict[str, Any]:
    ends = {"driver": dict(gear.driver), "follower": dict(gear.follower)}
    return {**ends, "ratio": gear.ratio, **({} if gear.teeth else {"teeth": False})}


def _load(drawing: ForeignMechanism, load: ForeignLoad) -> dict[str, Any]:
    axes, force = {}, load.force
    if load.turning:  # the scene file gives a force that rotates with its link in the axes of the link
        axes = {"axes": "turning"}
        force *= _own_axis(drawing, drawing.links[load.link]).conjugate()
    parts = [f"{part:.12g} N" for part in (force.real, force.imag)]
    return {"link": load.link, "point": load.point, **axes, "force": parts}


def _direction(direction: complex) -> list[float]:
    return _place(direction / (abs(direction) or 1.0))
