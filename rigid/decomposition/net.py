"""Joints between the links, and search for sets of links that have as many constraints as degrees of freedom."""

from collections.abc import Iterable, Iterator, Sequence
from itertools import combinations

import numpy as np

from rigid.decomposition.connected import ConnectedSets
from rigid.decomposition.groups import LINK_CONSTRAINTS
from rigid.joints import Coupling, Joint, PinJoint, SliderJoint, WeldJoint
from rigid.parts import Gear, Link, MechanismError, PinDrive, Slider, SliderDrive, Weld

MAX_PARALLEL_SINE = 1e-9  # largest sine of the angle between two lines that count as parallel


class Net:
    """Links and the joints between them: pins, sliders and welds, with their drives and gears."""

    def __init__(
        self,
        links: tuple[Link, ...],
        drives: tuple[PinDrive | SliderDrive, ...],
        sliders: tuple[Slider, ...],
        gears: tuple[Gear, ...],
        welds: tuple[Weld, ...] = (),
    ) -> None:
        self.links, self.drives = links, drives
        self.index = index = {link.name: number for number, link in enumerate(links)}
        pins: dict[str, list[int]] = {}
        for number, link in enumerate(links):
            for point in link.points:
                pins.setdefault(point, []).append(number)
        self.pins = {point: ends for point, ends in pins.items() if len(ends) > 1}
        self.sliders = {slider.name: (slider, index[slider.on], index[slider.link]) for slider in sliders}
        self.welds = {(weld.point, frozenset((index[weld.on], index[weld.link]))): weld for weld in welds}
        self.neighbours: dict[int, set[int]] = {number: set() for number in range(len(links))}
        pairs = [pair for ends in self.pins.values() for pair in combinations(ends, 2)]
        for one, other in pairs + [(on, link) for _, on, link in self.sliders.values()]:
            self.neighbours[one].add(other)
            self.neighbours[other].add(one)
        self.driven: dict[tuple[str, frozenset[int]], int] = {}
        for number, drive in enumerate(drives):
            key = self._key(drive)
            if key in self.driven:
                raise MechanismError(f'two drives move the joint "{key[0]}"', kind="drives", joints=key[:1])
            self.driven[key] = number
        self.geared: dict[tuple[str, frozenset[int]], tuple[Gear, Joint]] = {}
        for gear in gears:
            key = self._key(gear.follower)
            self._require_grounded(gear)
            if key in self.driven or key in self.geared:
                message = f'the joint "{key[0]}" is moved twice, by a gear and by a drive or another gear'
                raise MechanismError(message, kind="drives", joints=key[:1])
            self.geared[key] = (gear, self._driver(gear.driver))

    def _require_grounded(self, gear: Gear) -> None:
        """Raise MechanismError if a gear uses a slider on a moving link.

        The motion of such a slider relative to the carrier of the gear is ambiguous.
        """
        for end in (gear.driver, gear.follower):
            if isinstance(end, SliderDrive) and end.slider in self.sliders and self.sliders[end.slider][1]:
                message = f'gear: slider "{end.slider}" runs on a moving link, but a rack must slide on the ground'
                raise MechanismError(message, kind="gear", joints=(end.slider,))

    def _driver(self, driver: PinDrive | SliderDrive) -> Joint:
        """Return the joint that drives a gear. Its coordinate is measured relative to its parent."""
        name, _ = self._key(driver)
        if isinstance(driver, PinDrive):
            return self.pin(name, self.index[driver.on], self.index[driver.link])
        _, on, link = self.sliders[name]
        return self.slide(name, on, link)

    def _mover(self, name: str, ends: frozenset[int]) -> tuple[int | None, Coupling | None, object]:
        """Return the drive index, the gear coupling, and the drive or follower at a joint; each may be None."""
        number = self.driven.get((name, ends))
        if number is not None:
            return number, None, self.drives[number]
        gear, driver = self.geared.get((name, ends), (None, None))
        if gear is None or driver is None:
            return None, None, None
        return None, Coupling(gear.ratio, driver, gear.pressure_angle), gear.follower

    def _key(self, drive: object) -> tuple[str, frozenset[int]]:
        """Return the name and the links of the joint of `drive` (a drive, or the driver or follower of a gear)."""
        if isinstance(drive, PinDrive):
            ends = frozenset((self.index[drive.link], self.index[drive.on]))
            if not ends <= set(self.pins.get(drive.at, ())) or len(ends) < 2:
                message = f'drive of "{drive.link}" on "{drive.on}": they share no pin "{drive.at}"'
                raise MechanismError(message, kind="drives", links=(drive.link, drive.on), joints=(drive.at,))
            if (drive.at, ends) in self.welds:
                message = f'drive of "{drive.link}" on "{drive.on}": they are welded at "{drive.at}"'
                raise MechanismError(message, kind="drives", links=(drive.link, drive.on), joints=(drive.at,))
            return drive.at, ends
        name = getattr(drive, "slider", "")
        if name not in self.sliders:
            raise MechanismError(f'drive of slider "{name}": there is no such slider', kind="drives", joints=(name,))
        _, on, link = self.sliders[name]
        return name, frozenset((on, link))

    def pin(self, point: str, parent: int, child: int) -> Joint:
        """Return the pin or weld of two links at a point."""
        links = self.links
        weld = self.welds.get((point, frozenset((parent, child))))
        if weld is not None:
            ends = links[parent].points[point], links[child].points[point]
            return WeldJoint(point, parent, child, *ends, 1 if self.index[weld.on] == parent else -1, weld=weld)
        drive, gear, mover = self._mover(point, frozenset((parent, child)))
        sense = -1 if isinstance(mover, PinDrive) and self.index[mover.link] == parent else 1
        ends = links[parent].points[point], links[child].points[point]
        return PinJoint(point, parent, child, *ends, sense, drive, gear)

    def turned(self, link: int) -> Joint:
        """Return a driven or geared pin between a link and the ground.

        If there is none, return a virtual pin whose coordinate is the angle of the link.
        """
        ends = frozenset((0, link))
        points = [point for point, pair in (*self.driven, *self.geared) if pair == ends and point in self.pins]
        return self.pin(points[0], 0, link) if points else PinJoint("", 0, link, 0.0, 0.0)

    def slide(self, name: str, parent: int, child: int) -> Joint:
        """Return the joint of a slider."""
        slider, on, link = self.sliders[name]
        drive, gear, _ = self._mover(name, frozenset((on, link)))
        at_link = self.links[link].points[slider.point]
        ends = (slider.origin, at_link) if parent == on else (at_link, slider.origin)
        return SliderJoint(name, parent, child, *ends, 1 if parent == on else -1, drive, gear, slider=slider)

    def joints(self, links: Sequence[int], known: set[int]) -> list[Joint]:
        """Return the joints that connect two of `links`, or one of `links` and one of `known`.

        A pin of n links is n - 1 joints.
        """
        joints: list[Joint] = []
        for point, ends in self.pins.items():
            inside = [end for end in ends if end in links]
            known_ends = [end for end in ends if end in known]
            if len(inside) + len(known_ends) < 2 or not inside:
                continue
            joints += self._star(point, inside, known_ends)
        for name, (_, on, link) in self.sliders.items():
            for parent, child in ((on, link), (link, on)):
                if child in links and (parent in known or (parent in links and parent == on)):
                    joints.append(self.slide(name, parent, child))
                    break
        return joints

    def _star(self, point: str, inside: list[int], known: list[int]) -> Iterator[Joint]:
        """Yield the joints of links at a common point.

        A link with a weld, drive or gear relative to another link at this point is joined to that link. All other links
        are joined to one common link.
        """
        hub = known[0] if known else inside[0]
        placed = list(known) if known else [hub]
        paired = self.welds.keys() | self.driven.keys() | self.geared.keys()
        waiting = [link for link in inside if link not in placed]
        while waiting:
            pair = next(
                (
                    (parent, child)
                    for child in waiting
                    for parent in placed
                    if (point, frozenset((parent, child))) in paired
                ),
                None,
            )
            parent, child = pair or (hub, waiting[0])
            yield self.pin(point, parent, child)
            placed.append(child)
            waiting.remove(child)

    def determined(self, known: set[int], unknown: set[int]) -> Iterator[tuple[int, ...]]:
        """Yield sets of unknown links that have as many constraints as degrees of freedom, the smallest sets first."""
        for links in self._connected(known, unknown):
            joints = self.joints(links, known)
            drives = sum(joint.moved for joint in joints)
            drivers = {end for joint in joints if joint.gear for end in joint.gear.ends}
            # links with gears that drive each other form a group if all their other joints are driven
            driven = drivers <= known or (drivers <= known | set(links) and len(joints) == len(links))
            if 2 * len(joints) + drives != 3 * len(links) or not driven or _unsolvable(joints, links):
                continue
            if not self.doubled(links, known):
                yield links

    def surplus(self, known: set[int], unknown: set[int]) -> Iterator[tuple[int, ...]]:
        """Yield overconstrained sets of unknown links, the smallest first.

        Such links can move only with special dimensions, for example parallel cranks.
        """
        for links in self._connected(known, unknown):
            joints, freedoms = self.joints(links, known), 3 * len(links)
            moved = sum(joint.moved for joint in joints)
            if 2 * len(joints) > freedoms and 2 * len(joints) + moved - self.doubled(links, known) >= freedoms:
                yield links

    def doubled(self, links: Sequence[int], known: set[int]) -> int:
        """Return the number of redundant constraints between pairs of links, such as a block in parallel guides.

        Known links count as one body, so that a rod beside two parallel rods has only one pair.
        """
        surplus, sets = 0, ConnectedSets((*links, *known))
        for link in known:
            sets.join(0, link)
        pairs = sorted(
            {
                (min(start, end), max(start, end))
                for start in links
                for end in self.neighbours[start] & sets.above.keys()
            }
        )
        for start, end in pairs:
            constraints, rank = self._between(start, end)
            if constraints > rank and sets.root(start) != sets.root(end):
                surplus += constraints - rank
                if rank == LINK_CONSTRAINTS:
                    sets.join(end, start)
        return surplus

    def _between(self, one: int, other: int) -> tuple[int, int]:
        """Return the number and the rank of the constraints between two links."""
        pair = {one, other}
        pins = sum(pair <= set(links) for links in self.pins.values())
        lines = [complex(np.ravel(slider.direction)[0]) for slider, *ends in self.sliders.values() if set(ends) == pair]
        parallel = not pins and all(abs((lines[0].conjugate() * line).imag) <= MAX_PARALLEL_SINE for line in lines)
        welds = sum(ends == pair for _, ends in self.welds)
        return 2 * (pins + len(lines)) + welds, 2 if parallel else LINK_CONSTRAINTS

    def _connected(self, known: set[int], unknown: set[int]) -> Iterator[tuple[int, ...]]:
        """Yield sets of unknown links that are connected to each other and to a known link, smaller sets first."""
        for size in range(1, len(unknown) + 1):
            links: tuple[int, ...] = ()
            for links in self._connected_sets(size, known, unknown):
                yield links
            if not links:
                return

    def _connected_sets(self, size: int, known: set[int], unknown: set[int]) -> Iterator[tuple[int, ...]]:
        """Yield the connected sets of a given size."""
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

    def names(self, links: Iterable[int]) -> tuple[str, ...]:
        """Return the names of links."""
        return tuple(self.links[link].name for link in sorted(links))

    def quoted(self, links: Iterable[int]) -> str:
        """Return the quoted names of links for a message."""
        return ", ".join(f'"{name}"' for name in self.names(links))


def _unsolvable(joints: Sequence[Joint], links: tuple[int, ...]) -> bool:
    """Return whether links cannot form a group.

    Two links with sliders only cannot form a group. Several links cannot if the known links overconstrain one of them.
    """
    if len(links) == 2 and not any(joint.turns for joint in joints):
        return True
    return any(
        sum(2 + joint.moved for joint in joints if {joint.parent, joint.child} - set(links) and joint.child == link) > 3
        for link in links
        if len(links) > 1
    )
