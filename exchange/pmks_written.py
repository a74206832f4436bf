"""Export of mechanisms to PMKS+."""

import cmath

from msgspec.structs import replace

from exchange.foreign_mechanism import GROUND, ExchangeError, ForeignLink, ForeignMechanism, ForeignSlider, Names, Slot
from exchange.pmks import FORCE, INERTIA, MASS, SOURCE
from exchange.pmks_code import DRIVEN, FIXED, SLIDES, TRACED, WELDED, PmksForce, PmksJoint, PmksPart, Saved, encoded

# maps the unit of the mechanism to the unit of the exported file, and to the factor for the conversion of lengths
WRITTEN = {"mm": ("cm", 0.1), "cm": ("cm", 1.0), "m": ("cm", 100.0), "in": ("in", 1.0)}
# possible keys of joints; the key of a link consists of the keys of its joints
KEYS = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz"
ON_LINE = 1e-6  # a point is on the line of a slot if its distance from the line is below ON_LINE * (drawing size)
SPARE = 0.1  # each end of a slot is SPARE * (size of the drawing) beyond the travel of the pin


def pmks_text(drawing: ForeignMechanism) -> str:
    """Return the mechanism in the current format of PMKS+: the query of a web link, or the text of a file.

    An oscillating drive is written with its mean speed, because a drive of PMKS+ reverses only at the limits of the
    mechanism. PMKS+ rounds lengths to 0.001 cm or in, directions to 0.001 rad, and speeds to 0.001 rpm.

    Raises
    ------
    ExchangeError
        If the mechanism has no drive, or if PMKS+ does not support a part that affects the motion.
    """
    return encoded(_Writing(drawing).saved())


class _Writing:
    """Converter of a mechanism to the contents of a file of PMKS+."""

    def __init__(self, drawing: ForeignMechanism) -> None:
        if drawing.gears:
            raise ExchangeError(f"{SOURCE} does not support gears")
        if not drawing.drives:
            raise ExchangeError(f"{SOURCE} needs a drive")
        self.drawing = drawing
        self.unit, self.scale = WRITTEN[drawing.unit]
        self.places = dict(drawing.points)
        self.members = {name: list(body.points) for name, body in drawing.links.items() if len(body.points) > 1}
        spans = [abs(one - other) for one in self.places.values() for other in self.places.values()]
        self.size = max(spans, default=1.0) or 1.0
        self.slots: dict[str, Slot | ForeignSlider] = {}  # slots and sliders, by name of the pin
        self.slot_ends: dict[str, tuple[str, str]] = {}
        for name, slot in drawing.slots.items():
            self._add_slot(name, slot)
        for name, slide in drawing.slides.items():
            self._add_slot(name, slide)
        self.used = [name for name in self.places if any(name in points for points in self.members.values())]
        if len(self.used) > len(KEYS):
            raise ExchangeError(f"{SOURCE} supports at most {len(KEYS)} joints, because it names them by a letter")
        self.key = dict(zip(self.used, KEYS, strict=False))
        self.link_key = {name: "".join(self.key[point] for point in points) for name, points in self.members.items()}
        self.drives = self._drives()

    def _add_slot(self, name: str, slot: Slot | ForeignSlider) -> None:
        """Store a slot or slider under the name of its pin.

        In PMKS+, a moving slot lies between two joints of a link. If the link does not have two points on the line of
        the slot, add two points to the link.
        """
        pin = slot.point if isinstance(slot, Slot) else self._own_pin(name, slot)
        if pin in self.slots:
            raise ExchangeError(f'{SOURCE} does not support a pin in two slots, such as "{pin}"')
        if not any(pin in points for points in self.members.values()):
            raise ExchangeError(f'{SOURCE} does not support fixed pins in moving slots, such as "{pin}"')
        self.slots[pin] = slot
        if slot.on == GROUND:
            return
        along, here = slot.direction / abs(slot.direction), self.places[pin]
        on_line = self._on_line(slot.on, here, along)
        if len(on_line) < 2:
            low, high = slot.travel
            on_line = [f"{name}_{number}" for number in (1, 2)]
            for end, way in zip(on_line, (low - SPARE * self.size, high + SPARE * self.size), strict=True):
                self.places[end] = here + way * along
            self.members[slot.on] += on_line
        self.slot_ends[pin] = on_line[0], on_line[-1]

    def _own_pin(self, name: str, slide: ForeignSlider) -> str:
        """Return a point on the line of a slider that belongs only to the slider's link; if there is none, add one."""
        if slide.link not in self.members:
            raise ExchangeError(f'{SOURCE} does not support blocks with a single point, such as "{slide.link}"')
        owned = [point for points in self.members.values() for point in points]
        on_line = self._on_line(slide.link, self.places[slide.through], slide.direction)
        pins = [point for point in on_line if owned.count(point) == 1]
        if pins:
            return slide.through if slide.through in pins else pins[0]
        pin = f"{name}_pin"
        self.places[pin] = self.places[slide.through] + SPARE * self.size * slide.direction / abs(slide.direction)
        self.members[slide.link].append(pin)
        return pin

    def _on_line(self, link: str, here: complex, direction: complex) -> list[str]:
        """Return the points of a link on the line through `here` along `direction`, sorted in this direction."""
        ways = {
            point: (self.places[point] - here) * direction.conjugate() / abs(direction) for point in self.members[link]
        }
        return sorted(
            (point for point, way in ways.items() if abs(way.imag) < ON_LINE * self.size),
            key=lambda point: ways[point].real,
        )

    def _drives(self) -> dict[str, tuple[float, tuple[str, ...]]]:
        """Return the speed and the links of every drive, by name of the pin.

        The tuple of links is empty for a driven slider.
        """
        pin_of = {id(slot): pin for pin, slot in self.slots.items()}
        pins = {name: pin_of[id(slot)] for name, slot in self.drawing.slots.items()}
        pins |= {name: pin_of[id(slide)] for name, slide in self.drawing.slides.items()}
        drives: dict[str, tuple[float, tuple[str, ...]]] = {}
        for drive in self.drawing.drives:
            joint = drive.joint
            if drive.speed is None and not drive.law:
                name = joint.get("slider") or joint.get("link")
                raise ExchangeError(
                    f'{SOURCE} supports only constant speeds and swings, but "{name}" is driven otherwise'
                )
            speed = drive.mean_speed
            if "slider" in joint:
                drives[pins[joint["slider"]]] = speed * self.scale, ()
                continue
            on, at = joint.get("on", GROUND), joint["at"]
            if at in self.slots:
                raise ExchangeError(f'{SOURCE} does not support rotating drives at sliding pins, such as "{at}"')
            drives[at] = speed, (joint["link"],) if on == GROUND else (on, joint["link"])
        return drives

    def saved(self) -> Saved:
        """Return the contents of the file. Driven links come first, because PMKS+ drives the first link at a joint."""
        drawing, called = self.drawing, Names()
        joints = tuple(self._joint(name, called) for name in self.used)
        order = [link for _, links in self.drives.values() for link in links]
        names = sorted(self.members, key=lambda name: order.index(name) if name in order else len(order))
        parts = tuple(self._part(name, called) for name in names)
        forces = tuple(
            PmksForce(
                self.link_key[load.link], f"F{number}", self.scale * drawing.points[load.point],
                self.scale * drawing.points[load.point] + load.force / (abs(load.force) or 1.0),
                abs(load.force) / FORCE[self.unit], load.turning, True,
            )
            for number, load in enumerate(drawing.loads, 1)
            if load.link in self.link_key
        )  # fmt: skip
        turns = next((speed for speed, links in self.drives.values() if links), 20.0)
        return Saved(self.unit, joints, parts, forces, turns, gravity=drawing.gravity)

    def _joint(self, name: str, called: Names) -> PmksJoint:
        drawing, slot = self.drawing, self.slots.get(name)
        marks = DRIVEN * (name in self.drives) | FIXED * (name in drawing.ground) | TRACED * (name == drawing.traced)
        speed = self.drives[name][0] if name in self.drives else 0.0
        joint = PmksJoint(self.key[name], called(name), self.scale * self.places[name], marks=marks, speed=speed)
        if slot is None:
            return joint
        marks = marks & ~FIXED | SLIDES | (WELDED if isinstance(slot, ForeignSlider) else 0)
        mass = drawing.masses.get(name, 0.0) / MASS[self.unit]
        if slot.on == GROUND:
            return replace(joint, angle=cmath.phase(slot.direction), marks=marks | FIXED, mass=mass)
        first, last = self.slot_ends[name]
        ends = self.key[first], self.key[last]
        return replace(joint, marks=marks, carrier=self.link_key[slot.on], slot=ends, mass=mass)

    def _part(self, name: str, called: Names) -> PmksPart:
        body: ForeignLink = self.drawing.links[name]
        points = self.members[name]
        middle = sum(self.places[point] for point in points) / len(points)
        center = self.scale * (middle if body.center is None else body.center)
        return PmksPart(
            self.link_key[name], called(f"link {name}", name), tuple(self.key[point] for point in points),
            (body.mass or 0.0) / MASS[self.unit], (body.inertia or 0.0) / INERTIA[self.unit], center,
        )  # fmt: skip
