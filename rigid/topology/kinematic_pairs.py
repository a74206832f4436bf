"""Kinematic pairs of a mechanism, and its mobility by counting links and pairs."""

from collections.abc import Iterable, Iterator
from typing import Literal

from msgspec import Struct

from rigid.drawing import Drawing
from rigid.joints import Joint, PinJoint, SliderJoint, WeldJoint
from rigid.mechanism import Mechanism
from rigid.parts import Gear, MechanismError, PinDrive, Slider, SliderDrive
from rigid.teeth import pitch_reach

Kind = Literal["pin", "slider", "weld", "rolling", "slipping"]


class Contact(Struct, frozen=True):
    """A contact between two links, such as two gears, or a cam and its follower.

    Attributes
    ----------
    one, other
        Names of the links.
    at
        Contact point in ground axes at the considered position [m].
    normal
        Common normal of the links for a contact with slip along the tangent (two freedoms). None for rolling without
        slip (one freedom).
    """

    name: str
    one: str
    other: str
    at: complex
    normal: complex | None = None


class Pair(Struct, frozen=True):
    """A joint or contact between two links.

    The freedoms of a pair are motions of the end link relative to the start link. For pins, welds and sliders, `joint`
    is given. For other pairs, `contact` is given. `drive` is the index of the drive of the joint, or None.
    """

    name: str
    kind: Kind
    start: str
    end: str
    joint: Joint | None = None
    contact: Contact | None = None
    drive: int | None = None

    @property
    def freedoms(self) -> int:
        """Number of freedoms: two for a slipping contact, zero for a weld, and one for all other pairs."""
        return {"slipping": 2, "weld": 0}.get(self.kind, 1)


def gear_contacts(mechanism: Mechanism) -> tuple[Contact, ...]:
    """Return the tooth contacts of all gears in the drawing.

    The teeth transmit a force along the tangent of the pitch circles, and slip perpendicular to it.

    Raises
    ------
    MechanismError
        If a gear has no contact point (for example if its ratio is 1), or a point is not drawn.
    """
    return tuple(_gear_contact(mechanism, number, gear) for number, gear in enumerate(mechanism.gears, 1))


def _gear_contact(mechanism: Mechanism, number: int, gear: Gear) -> Contact:
    drawing = Drawing(mechanism)
    ends = gear.driver, gear.follower
    wheels = [end for end in ends if isinstance(end, PinDrive)]
    racks = [slider for end in ends for slider in mechanism.sliders if slider.name == getattr(end, "slider", None)]
    first, second = (end.link if isinstance(end, PinDrive) else racks[0].link for end in ends)
    centers = [drawing.at(wheel.at) for wheel in wheels]
    if len(wheels) == 2 and gear.ratio != 1:
        at, normal = centers[1] + pitch_reach(centers[0] - centers[1], gear.ratio), 1j * (centers[1] - centers[0])
        if normal != 0:
            return Contact(f"gear {number}", first, second, at, normal)
    elif len(wheels) == 1:
        radius = gear.ratio if isinstance(gear.follower, SliderDrive) else 1 / gear.ratio
        normal = complex(racks[0].direction)
        return Contact(f"gear {number}", first, second, centers[0] - 1j * radius * normal, normal)
    raise MechanismError(
        f"gear {number}: its wheels have no contact point in the plane, so the graph cannot include it"
    )


def pairs(mechanism: Mechanism, contacts: Iterable[Contact] = ()) -> tuple[Pair, ...]:
    """Return all pairs of a mechanism, including `contacts` of gears or cams.

    A pin of n links counts as n - 1 pairs. Two links with a weld or a drive between them always form one of these
    pairs.

    Raises
    ------
    MechanismError
        If a slider or contact has an unknown link.
    """
    all_pairs = list(_pins(mechanism))
    slid = {drive.slider: number for number, drive in enumerate(mechanism.drives) if isinstance(drive, SliderDrive)}
    all_pairs += [
        Pair(slider.name, "slider", slider.on, slider.link, _slider(mechanism, slider), None, slid.get(slider.name))
        for slider in mechanism.sliders
    ]
    for contact in contacts:
        kind: Kind = "rolling" if contact.normal is None else "slipping"
        all_pairs.append(Pair(contact.name, kind, contact.one, contact.other, None, contact))
    for pair in all_pairs:
        for link in (pair.start, pair.end):
            if link not in mechanism.index:
                raise MechanismError(f'{pair.kind} "{pair.name}": there is no link "{link}"')
    return tuple(all_pairs)


def _pins(mechanism: Mechanism) -> Iterator[Pair]:
    carried: dict[str, list[str]] = {}
    for link in mechanism.links:
        for point in link.points:
            carried.setdefault(point, []).append(link.name)
    for point, links in carried.items():
        together = {link: {link} for link in links}
        drives = {
            (drive.on, drive.link): number
            for number, drive in enumerate(mechanism.drives)
            if isinstance(drive, PinDrive) and drive.at == point and {drive.on, drive.link} <= set(links)
        }
        welds = {(weld.on, weld.link): weld for weld in mechanism.welds if weld.point == point}
        for start, end in (*welds, *drives, *((links[0], link) for link in links[1:])):
            if together[start] is together[end]:
                continue
            first, second = mechanism.index[start], mechanism.index[end]
            places = mechanism.links[first].points[point], mechanism.links[second].points[point]
            if (start, end) in welds:
                yield Pair(point, "weld", start, end, WeldJoint(point, first, second, *places, weld=welds[start, end]))
            else:
                joint = PinJoint(point, first, second, *places)
                yield Pair(point, "pin", start, end, joint, None, drives.get((start, end)))
            joined = together[start] | together[end]
            together.update(dict.fromkeys(joined, joined))


def _slider(mechanism: Mechanism, slider: Slider) -> Joint:
    on, link = mechanism.index[slider.on], mechanism.index[slider.link]
    at_link = mechanism.links[link].points[slider.point]
    return SliderJoint(slider.name, on, link, slider.origin, at_link, slider=slider)


def kutzbach(links: int, one_freedom: int, two_freedom: int = 0, welds: int = 0) -> int:
    """Return the mobility of a planar mechanism by counting: 3 (n - 1) - 2 j1 - j2 - 3 j0.

    The result is wrong for mechanisms that move only because of special dimensions. For two rolling gears, the result
    is 0, although the gears turn. `mobility` takes the dimensions into account.

    Parameters
    ----------
    links
        Number of links n, including the fixed link.
    one_freedom, two_freedom
        Number j1 of pairs with one freedom (pin, slider, rolling), and number j2 of pairs with two freedoms (slipping,
        for example cams).
    welds
        Number of welds j0.

    Examples
    --------
    A four-bar, two rolling gears, and two slipping gears:

    >>> kutzbach(4, 4), kutzbach(3, 3), kutzbach(3, 2, 1)
    (1, 0, 1)
    """
    return 3 * (links - 1) - 2 * one_freedom - two_freedom - 3 * welds


def mobility_count(mechanism: Mechanism, contacts: Iterable[Contact] = ()) -> int:
    """Return the mobility of a mechanism by counting (see `kutzbach`)."""
    joints = pairs(mechanism, contacts)
    none, one, two = (sum(pair.freedoms == freedoms for pair in joints) for freedoms in (0, 1, 2))
    return kutzbach(len(mechanism.links), one, two, none)
