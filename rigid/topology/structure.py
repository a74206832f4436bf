"""From a mechanism to the order in which it is solved: joints, a tree of them, groups.

A group is a smallest set of links whose place follows from links placed before it: a driven link, a dyad, or any
larger Assur group. Within a group the *tree* joints hang every link on one placed before it and leave each a freedom or
none (a driven joint); the *cut* joints close the loops and fix those freedoms.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from itertools import combinations

from rigid.mechanism import Complex, Gear, Mechanism, MechanismError, PinDrive, Slider, SliderDrive
from rigid.names import counted

PARALLEL = 1e-9  # sine of the angle between lines that are parallel


@dataclass(frozen=True, eq=False)
class Tie:
    """A gear as its follower sees it: the ratio, and the driving joint as one of two links placed before."""

    ratio: float
    driver: Joint

    @property
    def ends(self) -> tuple[int, int]:
        """The links of the driving joint."""
        return self.driver.parent, self.driver.child


@dataclass(frozen=True, eq=False)
class Joint:
    """A pin or a slider between two links, as used in the solution.

    Parameters
    ----------
    name
        The point's or the slider's name.
    parent, child
        Numbers of the links; the parent's place is found first.
    at_parent, at_child
        The joint's point in the axes of either [m]. For a slider that of the line's owner is the line's origin.
    slider
        None for a pin.
    sense
        +1 where the child is the driven or sliding link, -1 where it is the one driven or slid upon.
    drive
        Number of the drive that moves it, or None.
    gear
        What ties its coordinate to that of another joint, or None.
    """

    name: str
    parent: int
    child: int
    at_parent: Complex
    at_child: Complex
    slider: Slider | None = None
    sense: int = 1
    drive: int | None = None
    gear: Tie | None = None

    def at(self, link: int) -> Complex:
        """Its point in the axes of one of its links."""
        return self.at_child if self.child == link else self.at_parent

    @property
    def moved(self) -> bool:
        """Whether a drive or a gear prescribes its coordinate."""
        return self.drive is not None or self.gear is not None

    @property
    def parent_point(self) -> str | None:
        """Name of the parent's point at the joint; None for a slider's line, which passes its owner's points."""
        return self.name if self.slider is None else (None if self.sense > 0 else self.slider.point)

    @property
    def child_point(self) -> str | None:
        """Name of the child's point at the joint; None for a slider's line."""
        return self.name if self.slider is None else (self.slider.point if self.sense > 0 else None)


@dataclass(frozen=True, eq=False)
class Group:
    """Links that are placed together.

    `tree[k]` carries `links[k]`; `free` the numbers of the tree joints that no drive moves. `carried` lists per free
    joint the links that it carries, each with the numbers of the tree joints from its own back to that one. `cut`
    closes the loops.
    """

    links: tuple[int, ...]
    tree: tuple[Joint, ...]
    cut: tuple[Joint, ...]
    free: tuple[int, ...]
    carried: tuple[tuple[tuple[int, tuple[int, ...]], ...], ...]


@dataclass(frozen=True, eq=False)
class Structure:
    """The groups in the order of solution, and all joints (tree joints, then cut joints, group by group)."""

    groups: tuple[Group, ...]
    joints: tuple[Joint, ...]


def structure(mechanism: Mechanism) -> Structure:
    """Groups of a mechanism in the order of solution.

    Raises
    ------
    MechanismError
        Too few or too many drives or joints; a drive at a joint that is none.
    """
    net = _Net(mechanism)
    known, groups = {0}, []
    unknown = set(range(1, len(mechanism.links)))
    while unknown:
        found = next(net.determined(known, unknown), None) or next(net.surplus(known, unknown), None)
        if found is None:
            raise MechanismError(net.undetermined(known, unknown))
        group = net.group(found, known)
        groups.append(group)
        known |= set(found)
        unknown -= set(found)
    joints = tuple(joint for group in groups for joint in group.tree + group.cut)
    for group in groups:
        if 2 * len(group.cut) > len(group.free):
            net.refuse_unfit(group)
    net.refuse_surplus(joints)
    return Structure(tuple(groups), joints)


class _Net:
    """Who is joined to whom: pins by point, sliders, drives."""

    def __init__(self, mechanism: Mechanism) -> None:
        self.mechanism = mechanism
        self.pins: dict[str, list[int]] = {}
        for number, link in enumerate(mechanism.links):
            for point in link.points:
                self.pins.setdefault(point, []).append(number)
        self.pins = {point: links for point, links in self.pins.items() if len(links) > 1}
        index = mechanism.index
        self.sliders = {slider.name: (slider, index[slider.on], index[slider.link]) for slider in mechanism.sliders}
        self.neighbours: dict[int, set[int]] = {number: set() for number in range(len(mechanism.links))}
        pairs = [pair for links in self.pins.values() for pair in combinations(links, 2)]
        for one, other in pairs + [(on, link) for _, on, link in self.sliders.values()]:
            self.neighbours[one].add(other)
            self.neighbours[other].add(one)
        self.drives: dict[tuple[str, frozenset[int]], int] = {}
        for number, drive in enumerate(mechanism.drives):
            key = self._driven(drive)
            if key in self.drives:
                raise MechanismError(f'two drives move the joint "{key[0]}"')
            self.drives[key] = number
        self.ties: dict[tuple[str, frozenset[int]], tuple[Gear, Joint]] = {}
        for gear in mechanism.gears:
            key = self._driven(gear.follower)
            self._require_grounded(gear)
            if key in self.drives or key in self.ties:
                raise MechanismError(f'the joint "{key[0]}" is moved twice, by a gear and otherwise')
            self.ties[key] = (gear, self._led(gear.driver))

    def _require_grounded(self, gear: Gear) -> None:
        """Raise where a gear is tied to a slider on a moving link, whose slide its links' places alone do not tell."""
        for end in (gear.driver, gear.follower):
            if isinstance(end, SliderDrive) and end.slider in self.sliders and self.sliders[end.slider][1]:
                raise MechanismError(f'gear: slider "{end.slider}" runs on a moving link, a rack on the ground')

    def _led(self, driver: PinDrive | SliderDrive) -> Joint:
        """The joint that drives a gear, from the link it names on to the one that moves."""
        name, _ = self._driven(driver)
        if isinstance(driver, PinDrive):
            return self.pin(name, self.mechanism.index[driver.on], self.mechanism.index[driver.link])
        _, on, link = self.sliders[name]
        return self.slide(name, on, link)

    def _mover(self, name: str, ends: frozenset[int]) -> tuple[int | None, Tie | None, object]:
        """What moves a joint: number of a drive, or tie of a gear; and where that names its links."""
        number = self.drives.get((name, ends))
        if number is not None:
            return number, None, self.mechanism.drives[number]
        gear, driver = self.ties.get((name, ends), (None, None))
        if gear is None or driver is None:
            return None, None, None
        return None, Tie(gear.ratio, driver), gear.follower

    def _driven(self, drive: object) -> tuple[str, frozenset[int]]:
        if isinstance(drive, PinDrive):
            ends = frozenset((self.mechanism.index[drive.link], self.mechanism.index[drive.on]))
            if not ends <= set(self.pins.get(drive.at, ())) or len(ends) < 2:
                raise MechanismError(f'drive of "{drive.link}" on "{drive.on}": they share no pin "{drive.at}"')
            return drive.at, ends
        name = getattr(drive, "slider", "")
        if name not in self.sliders:
            raise MechanismError(f'drive of slider "{name}": there is no such slider')
        _, on, link = self.sliders[name]
        return name, frozenset((on, link))

    def pin(self, point: str, parent: int, child: int) -> Joint:
        links = self.mechanism.links
        drive, gear, mover = self._mover(point, frozenset((parent, child)))
        sense = -1 if isinstance(mover, PinDrive) and self.mechanism.index[mover.link] == parent else 1
        ends = links[parent].points[point], links[child].points[point]
        return Joint(point, parent, child, *ends, None, sense, drive, gear)

    def slide(self, name: str, parent: int, child: int) -> Joint:
        slider, on, link = self.sliders[name]
        drive, gear, _ = self._mover(name, frozenset((on, link)))
        at_link = self.mechanism.links[link].points[slider.point]
        ends = (slider.origin, at_link) if parent == on else (at_link, slider.origin)
        return Joint(name, parent, child, *ends, slider, 1 if parent == on else -1, drive, gear)

    def joints(self, links: Sequence[int], known: set[int]) -> list[Joint]:
        """Joints of `links` among themselves and to `known`: every loop closed once, a driven pair kept a pair."""
        joints: list[Joint] = []
        for point, ends in self.pins.items():
            inside = [end for end in ends if end in links]
            held = [end for end in ends if end in known]
            if len(inside) + len(held) < 2 or not inside:
                continue
            joints += self._star(point, inside, held)
        for name, (_, on, link) in self.sliders.items():
            for parent, child in ((on, link), (link, on)):
                if child in links and (parent in known or (parent in links and parent == on)):
                    joints.append(self.slide(name, parent, child))
                    break
        return joints

    def _star(self, point: str, inside: list[int], held: list[int]) -> Iterator[Joint]:
        """Pins of the links `inside` on one point: each to a link that is driven there with it, else to the hub."""
        hub = held[0] if held else inside[0]
        placed = list(held) if held else [hub]
        waiting = [link for link in inside if link not in placed]
        while waiting:
            pair = next(
                (
                    (parent, child)
                    for child in waiting
                    for parent in placed
                    if (point, frozenset((parent, child))) in self.drives.keys() | self.ties.keys()
                ),
                None,
            )
            parent, child = pair or (hub, waiting[0])
            yield self.pin(point, parent, child)
            placed.append(child)
            waiting.remove(child)

    def determined(self, known: set[int], unknown: set[int]) -> Iterator[tuple[int, ...]]:
        """Smallest sets of unknown links with as many conditions as freedoms."""
        for size in range(1, len(unknown) + 1):
            for links in self._connected(size, known, unknown):
                joints = self.joints(links, known)
                drives = sum(joint.moved for joint in joints)
                led = {end for joint in joints if joint.gear for end in joint.gear.ends}
                if 2 * len(joints) + drives != 3 * size or not led <= known or _hopeless(joints, links):
                    continue
                if not self.doubled(links, known):
                    yield links

    def surplus(self, known: set[int], unknown: set[int]) -> Iterator[tuple[int, ...]]:
        """Smallest sets of unknown links with more conditions than freedoms, which move all the same if they fit."""
        for size in range(1, len(unknown) + 1):
            for links in self._connected(size, known, unknown):
                joints = self.joints(links, known)
                if 2 * len(joints) > 3 * size and 2 * len(joints) - self.doubled(links, known) >= 3 * size:
                    yield links

    def doubled(self, links: Sequence[int], known: set[int]) -> int:
        """Conditions that hold two links to one another a second time: twin rods, a block in two parallel guides."""
        kin = {link: link for link in (*links, *known)}

        def eldest(link: int) -> int:
            while kin[link] != link:
                link = kin[link]
            return link

        found = 0
        pairs = sorted(
            {(min(one, other), max(one, other)) for one in links for other in self.neighbours[one] & set(kin)}
        )
        for one, other in pairs:
            held, needed = self._held(one, other)
            if eldest(one) != eldest(other):
                if held > needed:
                    found += held - needed
                    kin[eldest(one)] = eldest(other) if needed == 3 else eldest(one)
        return found

    def _held(self, one: int, other: int) -> tuple[int, int]:
        """Conditions between two links, and how many of them it takes."""
        pair = {one, other}
        pins = sum(pair <= set(links) for links in self.pins.values())
        lines = [first_of(slider.direction) for slider, on, link in self.sliders.values() if {on, link} == pair]
        parallel = not pins and all(abs((lines[0].conjugate() * line).imag) <= PARALLEL for line in lines)
        return 2 * (pins + len(lines)), 2 if parallel else 3

    def _connected(self, size: int, known: set[int], unknown: set[int]) -> Iterator[tuple[int, ...]]:
        """Connected sets of unknown links of one size that touch a known one, each once."""
        starts = sorted(link for link in unknown if self.neighbours[link] & known)
        seen: set[frozenset[int]] = set()
        stack = [frozenset((link,)) for link in reversed(starts)]
        while stack:
            links = stack.pop()
            if links in seen:
                continue
            seen.add(links)
            if len(links) == size:
                yield tuple(sorted(links))
                continue
            around = set().union(*(self.neighbours[link] for link in links)) & unknown - links
            stack += [links | {link} for link in sorted(around, reverse=True)]

    def group(self, links: tuple[int, ...], known: set[int]) -> Group:
        """Tree and cut joints of a determined set: driven joints into the tree first, then nearest to the known."""
        joints = self.joints(links, known)
        root = {link: link for link in links}

        def top(link: int) -> int:
            link = -1 if link in known else link
            while link != -1 and root[link] != link:
                link = root[link]
            return link

        tree, cut = [], []
        for joint in sorted(joints, key=lambda joint: (not joint.moved, joint.parent not in known)):
            low, high = sorted((top(joint.parent), top(joint.child)))
            if low == high:
                cut.append(joint)
                continue
            tree.append(joint)
            root[high] = low
        if any(joint.moved for joint in cut):
            raise MechanismError(f"the drives of {self.names(links)} fight one another: too many drives in one loop")
        return _hung(links, tree, cut, known, self)

    def turned(self, joint: Joint) -> Joint:
        """The same joint with parent and child exchanged."""
        make = self.pin if joint.slider is None else self.slide
        return make(joint.name, joint.child, joint.parent)

    def names(self, links: Iterable[int]) -> str:
        return ", ".join(f'"{self.mechanism.links[link].name}"' for link in sorted(links))

    def undetermined(self, known: set[int], unknown: set[int]) -> str:
        """Why no further group is found."""
        joints = self.joints(sorted(unknown), known)
        drives = sum(joint.moved for joint in joints)
        freedoms = 3 * len(unknown) - 2 * len(joints) - drives
        who = self.names(unknown)
        if freedoms > 0:
            return f"links {who} are left with {counted(freedoms, 'freedom')}: add a drive or a joint for each"
        if freedoms < 0:
            return f"links {who} are held {counted(-freedoms, 'time')} too often: remove a drive or a joint for each"
        return f"links {who} hold one another in some places twice and in others not at all: check their joints"

    def refuse_unfit(self, group: Group) -> None:
        """Raise where what holds a group beyond its freedoms does not fit, or is a drive."""
        from rigid.topology.planar_chain import mechanism_mobility

        drives = len(self.mechanism.drives)
        try:
            ways = int(mechanism_mobility(self.mechanism).mobility)
        except MechanismError as unfit:
            surplus = 2 * len(group.cut) - len(group.free)
            raise MechanismError(
                f"links {self.names(group.links)} are held {counted(surplus, 'time')} too often, "
                f"and the surplus does not fit ({unfit}): remove a joint"
            ) from unfit
        if drives and ways == 0:
            who = self.names(range(1, len(self.mechanism.links)))
            raise MechanismError(f"links {who} are locked: no drive can move them, remove a link or a joint")
        if drives > ways:
            many = f"{drives} of a mechanism that moves in {counted(ways, 'way')}"
            raise MechanismError(f"too many drives: {many}: remove one")

    def refuse_surplus(self, joints: Sequence[Joint]) -> None:
        """Raise where a joint or drive of the mechanism is not among those that place it."""
        for point, links in self.pins.items():
            used = sum(joint.name == point and joint.slider is None for joint in joints)
            if used < len(links) - 1:
                raise MechanismError(f'overconstrained: the pin "{point}" of {self.names(links)} joins placed links')
        surplus = set(self.sliders) - {joint.name for joint in joints if joint.slider}
        if surplus:
            raise MechanismError(f'overconstrained: the slider "{sorted(surplus)[0]}" joins placed links')
        idle = set(range(len(self.drives))) - {joint.drive for joint in joints}
        if idle:
            name = next(key[0] for key, number in self.drives.items() if number in idle)
            raise MechanismError(f'too many drives: the one at "{name}" has no freedom left to move')


def first_of(value: Complex) -> complex:
    """A quantity of the first of the designs."""
    return value if isinstance(value, (int, float, complex)) else complex(value.flat[0])


def _hopeless(joints: Sequence[Joint], links: tuple[int, ...]) -> bool:
    """Two links with nothing but sliders, or one that is held too often by itself."""
    if len(links) == 2 and all(joint.slider for joint in joints):
        return True
    return any(
        sum(2 + joint.moved for joint in joints if {joint.parent, joint.child} - set(links) and joint.child == link) > 3
        for link in links
        if len(links) > 1
    )


def _hung(links: tuple[int, ...], tree: list[Joint], cut: list[Joint], known: set[int], net: _Net) -> Group:
    """Direct the tree away from the known links and list what every free joint carries."""
    placed: dict[int, tuple[int, ...]] = dict.fromkeys(known, ())
    hung: list[Joint] = []
    free: list[int] = []
    while tree:
        joint = next(joint for joint in tree if joint.parent in placed or joint.child in placed)
        tree.remove(joint)
        if joint.parent not in placed:
            joint = net.turned(joint)
        if not joint.moved:
            free.append(len(hung))
        placed[joint.child] = (len(hung), *placed[joint.parent])
        hung.append(joint)
    order = tuple(joint.child for joint in hung)
    carried = tuple(
        tuple((link, placed[link][: placed[link].index(k) + 1]) for link in order if k in placed[link]) for k in free
    )
    return Group(order, tuple(hung), tuple(cut), tuple(free), carried)
