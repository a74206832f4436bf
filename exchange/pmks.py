"""Import of mechanisms of PMKS+, from web links or saved files. Web links and files have the same text format."""

import cmath
from urllib.parse import parse_qs, urlsplit

from msgspec.structs import replace

from exchange.foreign_mechanism import (
    GROUND,
    Drive,
    ExchangeError,
    ForeignLink,
    ForeignLoad,
    ForeignMechanism,
    ForeignSlider,
    Names,
    Slot,
)
from exchange.pmks_code import (
    DRIVEN,
    FIXED,
    SEALED,
    SLIDES,
    TRACED,
    WELDED,
    PmksForce,
    PmksJoint,
    PmksPart,
    Saved,
    decoded,
    folded,
)

SOURCE = "PMKS+"
# units of mass [kg], inertia [kg m^2] and force [N] that PMKS+ uses together with each unit of length
MASS = {"m": 1.0, "cm": 1e-3, "in": 0.45359237}
INERTIA = {"m": 1.0, "cm": 1e-4, "in": 0.45359237 * 0.0254**2}
FORCE = {"m": 1.0, "cm": 1.0, "in": 4.4482216152605}
DEFAULT_MASS = 1.0  # default value of the mass and also of the inertia of a link in PMKS+, in the units of the file
MAX_OFFSET = 0.005  # a note names each pin that is moved into its slot by more than MAX_OFFSET * (length of the slot)
BODY_DOCUMENT = "pmks2:"  # files that were saved with the body editor of PMKS+ start with this text


def of_pmks(text: str, title: str) -> ForeignMechanism:
    """Return the mechanism in a web link or file of PMKS+ (version 1, version 2 or the current version).

    Raises
    ------
    ExchangeError
        If the text is damaged or comes from another program.
    """
    query = urlsplit(text.strip()).query if "?" in text else text.strip()
    if query.startswith(BODY_DOCUMENT):
        raise ExchangeError(f'files of PMKS+ that begin with "{BODY_DOCUMENT}" cannot be read: save it as a link')
    saved = _of_first(query) if "j=" in query else decoded(query)
    return _PmksReading(folded(saved), title).drawing()


def _of_first(query: str) -> Saved:
    """Read a mechanism in the format of version 1: joints and links as comma-separated values, without masses."""
    given = parse_qs(query, keep_blank_values=True)
    rows = {
        kind: [row.split(",") for row in given.get(kind, [""])[0].replace("\\n", "\n").split("\n") if row.strip()]
        for kind in "jl"
    }
    settings = given.get("s", [""])[0].split(",")
    kind = ""
    try:
        kind = "joint"
        joints = tuple(map(_first_joint, rows["j"]))
        kind = "link"
        parts = tuple(PmksPart(row[0], row[0], tuple(filter(None, row[5].split("|")))) for row in rows["l"])
        kind = "setting"
        turns = float(settings[0] or 20.0)
    except (ValueError, IndexError):
        raise ExchangeError(f"a {kind} of this link of PMKS+, version 1, cannot be read") from None
    known = {joint.key for joint in joints}
    if lost := next((key for part in parts for key in part.joints if key not in known), None):
        raise ExchangeError(f'a link of PMKS+ has a joint "{lost}" that is not in the file')
    unit = settings[3] if len(settings) > 3 and settings[3] in ("cm", "m", "in") else "cm"
    return Saved(unit, joints, parts, turns=-turns if settings[1:2] == ["true"] else turns)


def _first_joint(row: list[str]) -> PmksJoint:
    key, x, y, _, kind, fixed, angle, _, driven = row[:9]
    marks = SLIDES * (kind == "P") | FIXED * (fixed == "t") | DRIVEN * (driven == "t")
    return PmksJoint(key, key, complex(float(x), float(y)), float(angle), marks)


class _PmksReading:
    """Converter of a mechanism saved by PMKS+ to a `ForeignMechanism`."""

    def __init__(self, saved: Saved, title: str) -> None:
        self.saved, self.title = saved, title
        self.joints = {joint.key: joint for joint in saved.joints}
        self.notes: list[str] = []
        self.with_default_mass: list[str] = []  # names of links and sliding pins
        names, called = Names(), Names([GROUND])
        self.point = {joint.key: names(joint.key, joint.name) for joint in saved.joints}
        self.places = {self.point[joint.key]: joint.place for joint in saved.joints}
        self.names = names
        self.link_of: dict[str, str] = {}  # names of the links, by key of the link or of a part of a welded link
        self.links: dict[str, ForeignLink] = {}
        for part in saved.parts:
            if part.whole:
                self._add_link(part, called)
        self.slots: dict[str, Slot] = {}
        self.slides: dict[str, ForeignSlider] = {}
        sliding = [joint for joint in saved.joints if joint.has(SLIDES)]
        moved = {joint.key for joint in sliding}
        # slots that end at a sliding pin are added last, because the pin may be moved when the slot of the pin is added
        for joint in sorted(sliding, key=lambda joint: bool(moved & {*joint.slot})):
            self._add_slot(joint)

    def _add_link(self, part: PmksPart, called: Names) -> None:
        frame = all(self.joints[key].has(FIXED) and not self.joints[key].has(SLIDES) for key in part.joints)
        name = GROUND if frame else called(part.key, part.name)
        self.link_of |= dict.fromkeys((part.key, *part.parts), name)
        if not frame:
            self.links[name] = ForeignLink(
                tuple(dict.fromkeys(self.point[key] for key in part.joints)), *self._masses(part)
            )

    def _masses(self, part: PmksPart) -> tuple[float | None, complex | None, float | None]:
        """Return mass [kg], centre and inertia [kg m^2] of a link. Default values of PMKS+ count as unknown (None)."""
        unit = self.saved.unit
        if part.mass == part.inertia == DEFAULT_MASS:
            self.with_default_mass.append(self.link_of[part.key])
        if not part.mass or part.mass == part.inertia == DEFAULT_MASS:
            return None, None, None
        inertia = None if part.inertia is None else part.inertia * INERTIA[unit]
        return part.mass * MASS[unit], part.center, inertia

    def _add_slot(self, joint: PmksJoint) -> None:
        """Add the slot of a pin, or a slider if the link at the pin slides without rotation relative to the slot."""
        point = self.point[joint.key]
        on = self.link_of.get(joint.carrier, GROUND) if joint.carrier else GROUND
        riders = [name for name, body in self.links.items() if point in body.points and name != on]
        if not riders:
            self.notes.append(f'left out: the slider "{joint.name}" of PMKS+, because it has no link')
            return
        direction, travel = cmath.rect(1.0, joint.angle), (0.0, 0.0)
        if joint.carrier:
            start, end = (self.places[self.point[key]] for key in joint.slot)
            if start == end:
                raise ExchangeError(f'the slot of "{joint.name}" of PMKS+ has no length')
            direction = (end - start) / abs(end - start)
            across = ((joint.place - start) * direction.conjugate()).imag
            # Move the pin onto the line of the slot, because the positions in the file are rounded.
            self.places[point] -= 1j * across * direction
            if abs(across) > MAX_OFFSET * abs(end - start):
                self.notes.append(f'"{joint.name}" of PMKS+ is drawn outside its slot, and is moved into it here')
            low, high = sorted(((each - joint.place) * direction.conjugate()).real for each in (start, end))
            travel = min(low, 0.0), max(high, 0.0)
            ends = [self.point[key] for key in joint.slot]
            if on != GROUND and not {*ends} <= {*self.links[on].points}:
                raise ExchangeError(f'the slot of "{joint.name}" of PMKS+ has an end that is not on its link')
            if on != GROUND:
                self.links[on] = self.links[on].with_beam(*ends)
            if on != GROUND and not low <= 0.0 <= high:  # The pin is beyond the end of the beam along the slot.
                self.links[on] = replace(self.links[on], rigid=True)
                self.notes.append(f'"{joint.name}" of PMKS+ is drawn beyond the end of its slot, so {on} is rigid here')
        if joint.has(WELDED | SEALED):
            self.slides[f"slide_{point}"] = ForeignSlider(riders[0], on, point, direction, travel)
        else:
            self.slots[f"slot_{point}"] = Slot(point, riders[0], on, direction, travel)

    def _drive(self, joint: PmksJoint) -> Drive:
        """Return the drive at a joint.

        A drive at a sliding joint moves the slider or pin. A drive at a fixed joint turns the first link at this joint.
        A drive at any other joint turns the second link at this joint relative to the first one.
        """
        point, unit = self.point[joint.key], self.saved.unit
        if joint.has(SLIDES):
            name = next((each for each in (f"slide_{point}", f"slot_{point}") if each in self.slides | self.slots), "")
            if not name:
                raise ExchangeError(f'the driven slider "{joint.name}" of PMKS+ moves no link')
            return Drive({"slider": name}, f"{joint.speed or self.saved.slides:.12g} {unit}/s")
        links = [name for name, body in self.links.items() if point in body.points]
        speed = f"{joint.speed or self.saved.turns:.12g} rpm"
        if joint.has(FIXED) and links:
            return Drive({"link": links[0], "at": point}, speed)
        if len(links) < 2:
            raise ExchangeError(f'the driven joint "{joint.name}" of PMKS+ does not connect two links')
        return Drive({"link": links[1], "on": links[0], "at": point}, speed)

    def _loads(self) -> tuple[ForeignLoad, ...]:
        """Return the forces on links. If a force does not act at a point of its link, add this point to the link."""
        loads, unit = [], self.saved.unit
        for force in self.saved.forces:
            link = self.link_of.get(force.link, "")
            if link not in self.links or force.start == force.end:
                self.notes.append(
                    f'left out: the force "{force.name}" of PMKS+, because it is zero or on no moving link'
                )
                continue
            along = (force.end - force.start) / abs(force.end - force.start) * (1 if force.outward else -1)
            point = self._point_at(link, force)
            loads.append(ForeignLoad(link, point, force.size * FORCE[unit] * along, force.local))
        return tuple(loads)

    def _point_at(self, link: str, force: PmksForce) -> str:
        points = self.links[link].points
        known = next((point for point in points if self.places[point] == force.start), None)
        if known is not None:
            return known
        name = self.names(f"force {force.name}", force.name)
        self.places[name] = force.start
        body = self.links[link]
        self.links[link] = ForeignLink((*points, name), body.mass, body.center, body.inertia, body.rigid, body.braces)
        return name

    def drawing(self) -> ForeignMechanism:
        saved, loads = self.saved, self._loads()
        drives = tuple(self._drive(joint) for joint in saved.joints if joint.has(DRIVEN))
        masses = {
            self.point[joint.key]: joint.mass * MASS[saved.unit]
            for joint in saved.joints
            if joint.mass not in (0.0, DEFAULT_MASS) and joint.has(SLIDES)
        }
        self.with_default_mass += [
            self.point[joint.key] for joint in saved.joints if joint.mass == DEFAULT_MASS and joint.has(SLIDES)
        ]
        weighed = bool(masses) or any(body.mass for body in self.links.values())
        if not weighed and any(part.whole for part in saved.parts):
            self.notes.append("the file has only default masses: masses follow from the assumed section and material")
        if weighed and self.with_default_mass:
            names = ", ".join(self.with_default_mass)
            self.notes.append(
                f"left out: the default masses of {names}; the masses of links follow from their sections"
            )
        used = {point for body in self.links.values() for point in body.points}
        fixed = tuple(self.point[joint.key] for joint in saved.joints if joint.has(FIXED) and not joint.has(SLIDES))
        traced = (self.point[joint.key] for joint in saved.joints if joint.has(TRACED) and not joint.has(FIXED))
        places = {name: place for name, place in self.places.items() if name in used or name in fixed}
        return ForeignMechanism(
            self.title, SOURCE, saved.unit, places, fixed, self.links, self.slots,
            self.slides, drives, traced=next((point for point in traced if point in used), ""), masses=masses,
            loads=loads, gravity=saved.gravity, notes=tuple(self.notes),
        )  # fmt: skip
