"""Natural frequencies of the mechanism as a structure: at every position, its drives held."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from elastic.frame import frame
from elastic.section import JointCompliance, Section
from elastic.vibrating_link import RANK, VibratingLink, one_of, vibrating_link
from rigid import SINGULAR, Motion, Reals

SETTLED = 1e-3
MASSLESS = 1e-13
REFINEMENTS = (1, 3, 5, 7, 9, 12)


@dataclass(frozen=True, eq=False)
class Frequencies:
    """Lowest natural frequencies at some of the positions of a motion.

    Attributes
    ----------
    omega
        [rad/s], rising, shape (modes, ..., positions); nan at singular positions, infinite where nothing can vibrate.
    position
        Numbers of the positions.
    change
        By how much of themselves the last refinement changed the frequencies, at most.
    """

    omega: Reals
    position: Any
    change: float

    @property
    def lowest(self) -> float:
        """Over all positions [rad/s]; nan where all are singular."""
        known = self.omega[0][~np.isnan(self.omega[0])]
        return float(known.min()) if known.size else float("nan")


def natural_frequencies(
    motion: Motion,
    sections: Sequence[Section],
    modes: int = 3,
    positions: int = 24,
    joints: Mapping[str, JointCompliance] | None = None,
) -> Frequencies:
    """Lowest natural frequencies of small vibrations about the moving rigid links.

    Every beam is refined until the frequencies have settled to 0.1 %. The drives hold; gravity, axial forces and the
    motion's own accelerations stiffen or soften nothing.

    Parameters
    ----------
    sections
        One per beam, in the order of `Mechanism.beams`.
    modes
        How many frequencies.
    positions
        At how many positions, evenly picked from the motion's.
    joints
        By name, the joints that give way.

    Examples
    --------
    A cantilever of 1 m with EI = 1 N m^2 and 1 kg/m: 1.8751^2 rad/s.

    >>> from elastic import Section
    >>> from rigid import Beam, Link, Mechanism, PinDrive, motion
    >>> arm = Link("arm", {"O": 0, "A": 1.0}, (Beam("O", "A", 1.0),))
    >>> held = Mechanism((Link("ground", {"O": 0}), arm), (PinDrive("arm", "O"),), {"O": 0, "A": 1})
    >>> round(natural_frequencies(motion(held, [0.0]), [Section(1e6, 1.0)]).lowest, 4)
    3.516
    """
    count = motion.columns[-1]
    chosen = np.unique(np.linspace(0, count - 1, min(positions, count)).round().astype(int))
    designs = motion.columns[0] if len(motion.columns) > 1 else 1
    found = [_of_design(motion, sections, modes, chosen, joints or {}, design) for design in range(designs)]
    omega = np.stack([values for values, _ in found], axis=1)
    return Frequencies(omega if len(motion.columns) > 1 else omega[:, 0], chosen, max(change for _, change in found))


def _of_design(
    motion: Motion,
    sections: Sequence[Section],
    modes: int,
    chosen: Any,
    joints: Mapping[str, JointCompliance],
    design: int,
) -> tuple[Any, float]:
    """Frequencies of one design, shape (modes, positions), and how much the last refinement changed them."""
    condition = np.atleast_2d(motion.condition)[design, chosen]
    good = np.flatnonzero(condition <= SINGULAR)
    omega = np.full((modes, len(chosen)), np.nan)
    if not len(good):
        return omega, 0.0
    before, change = np.full((modes, len(good)), np.inf), np.inf
    for inner in REFINEMENTS:
        structure = _Structure(motion, sections, joints, chosen[good], design, inner)
        now = structure.frequencies(modes)
        moving = np.isfinite(now)
        if np.isfinite(before[moving]).all():
            change = float(np.max(before[moving] / now[moving] - 1, initial=0.0))
        before = now
        if change < SETTLED:
            break
    omega[:, good] = before
    return omega, change


class _Structure:
    """All links of one design at some positions, their coordinates side by side, and what their joints ask of them."""

    def __init__(
        self,
        motion: Motion,
        sections: Sequence[Section],
        joints: Mapping[str, JointCompliance],
        positions: Any,
        design: int,
        inner: int,
    ) -> None:
        self.motion, self.design, self.positions = motion, design, positions
        mechanism = motion.mechanism
        self.rails = frame(mechanism).rails
        points = [one_of(place, design) for link in mechanism.links for place in link.points.values()]
        ways = np.abs([one_of(p, design) - points[0] for p in points])
        self.scale = float(ways.max()) or 1.0
        self.links: dict[int, VibratingLink] = {}
        self.first: dict[int, int] = {}
        self.beam_of: dict[int, int] = {}
        size, beam = 0, 0
        for at, link in enumerate(mechanism.links[1:], 1):
            own = list(sections[beam : beam + len(link.beams)])
            self.links[at] = vibrating_link(link, own, self.scale, inner, design)
            self.first[at], self.beam_of[at] = size, beam
            size, beam = size + len(self.links[at].mass), beam + len(link.beams)
        self.stiffness, self.mass = np.zeros((size, size)), np.zeros((size, size))
        for at, own_link in self.links.items():
            part = slice(self.first[at], self.first[at] + len(own_link.mass))
            self.stiffness[part, part], self.mass[part, part] = own_link.stiffness, own_link.mass
        self.held: list[Any] = []
        self.springs = np.zeros((len(positions), size, size))
        places = [place for closed in motion.closures for place in closed.joints]
        for number, place in enumerate(places):
            self._join(number, place, joints.get(place.joint.name, JointCompliance()))

    def _at(self, value: Any) -> Any:
        """A quantity of the motion at the positions of this design."""
        array = np.broadcast_to(value, self.motion.columns)
        return (array[self.design] if array.ndim > 1 else array)[self.positions]

    def _moved(self, number: int, at: int, point: str | None, arm: Any) -> tuple[Any, Any]:
        """Displacement, complex, in the ground's axes and rotation of a joint's place on a link, per coordinate."""
        size = len(self.mass)
        shift, turned = np.zeros((len(self.positions), size), complex), np.zeros((len(self.positions), size))
        if at:
            link, direction = self.links[at], self._at(self.motion.direction[at])
            local = self._at(arm) / direction / self.scale
            if point is not None:
                own, turn = link.point(point)
            elif link.beams:
                beam = self.rails[number] - self.beam_of[at]
                unit, length = link.beams[beam][0], self._length(at, beam)
                start = self.motion.mechanism.links[at].beams[beam].start
                begin = complex(one_of(self.motion.mechanism.links[at].points[start], self.design)) / self.scale
                own, turn = link.station(beam, (np.conj(unit) * (local - begin)).real / length)
            else:
                own, turn = link.spot(local)
            part = slice(self.first[at], self.first[at] + len(link.mass))
            shift[:, part], turned[:, part] = direction[:, None] * own, turn
        return shift, turned

    def _length(self, at: int, beam: int) -> float:
        own = self.motion.mechanism.links[at]
        ends = (complex(one_of(own.points[name], self.design)) for name in (own.beams[beam].start, own.beams[beam].end))
        start, end = ends
        return abs(end - start) / self.scale

    def _join(self, number: int, place: Any, soft: JointCompliance) -> None:
        """The conditions of a joint; what gives way becomes a spring."""
        joint = place.joint
        at_child = self._moved(number, joint.child, joint.child_point, place.arm_child)
        at_parent = self._moved(number, joint.parent, joint.parent_point, place.arm_parent)
        shift, turned = at_child[0] - at_parent[0], at_child[1] - at_parent[1]
        rows = [shift.real, shift.imag]
        if place.along is not None and joint.drive is None:
            rows = [(np.conj(self._at(place.along))[:, None] * shift).imag]
        self._hold(rows, soft.translation)
        if place.along is not None or joint.drive is not None:
            self._hold([turned], soft.rotation * self.scale**2)

    def _hold(self, rows: list[Any], compliance: float) -> None:
        for row in rows:
            if compliance:
                self.springs += row[:, :, None] * row[:, None, :] / compliance
            else:
                self.held.append(row)

    def frequencies(self, modes: int) -> Any:
        """[rad/s], shape (modes, positions)."""
        omega = np.full((modes, len(self.positions)), np.inf)
        rows = np.array(self.held).reshape(len(self.held), len(self.positions), len(self.mass)).swapaxes(0, 1)
        _, values, basis = np.linalg.svd(rows)
        ranks = (values > RANK * values.max(axis=-1, initial=0.0, keepdims=True)).sum(axis=-1)
        for rank in np.unique(ranks):
            of_rank = np.flatnonzero(ranks == rank)
            free = basis[of_rank, rank:]
            if free.shape[1]:
                stiffness = free @ (self.stiffness + self.springs[of_rank]) @ free.swapaxes(-1, -2)
                mass = free @ self.mass @ free.swapaxes(-1, -2)
                omega[:, of_rank] = _lowest(stiffness, mass, modes)
        return omega


def _lowest(stiffness: Any, mass: Any, modes: int) -> Any:
    """Lowest frequencies of stacked structures: by the largest mass per stiffness, so that none needs to have mass."""
    scale = 1.0 / np.sqrt(np.diagonal(stiffness, axis1=-2, axis2=-1))
    factor = np.linalg.inv(np.linalg.cholesky(stiffness * scale[:, :, None] * scale[:, None, :]))
    factor = factor * scale[:, None, :]
    per_stiffness = np.linalg.eigvalsh(factor @ mass @ factor.swapaxes(-1, -2))[:, ::-1].T[:modes]
    moving = per_stiffness > MASSLESS * np.maximum(per_stiffness[:1], 0.0)
    omega = np.full((modes, len(stiffness)), np.inf)
    omega[: len(per_stiffness)] = np.where(moving, 1.0 / np.sqrt(np.where(moving, per_stiffness, 1.0)), np.inf)
    return omega
