"""Names and units of the drives, joints and points of a mechanism."""

from __future__ import annotations

from collections.abc import Iterator

from rigid import Mechanism, structure


def drive_names(mechanism: Mechanism) -> list[str]:
    """Names of the drives, numbered if several have the same."""
    names = [drive.name for drive in mechanism.drives]
    if len(set(names)) < len(names):
        return [f"{name}.{number}" for number, name in enumerate(names, 1)]
    return names


def drive_words(mechanism: Mechanism) -> list[tuple[str, str, str, str]]:
    """Per drive: its name, the word for its coordinate, and the units of coordinate and effort."""
    kinds = {True: ("angle", "rad", "N m"), False: ("slide", "m", "N")}
    return [(name, *kinds[drive.turns]) for name, drive in zip(drive_names(mechanism), mechanism.drives, strict=True)]


def joint_words(mechanism: Mechanism) -> list[tuple[str, str]]:
    """Per joint: its name and that of the link that bears the stated load; the parent bears the opposite."""
    return [(joint.name, mechanism.links[joint.child].name) for joint in structure(mechanism).joints]


def points_of(mechanism: Mechanism) -> Iterator[tuple[str, int]]:
    """Every named point that moves, once, with the number of a link that has it."""
    seen = set(mechanism.links[0].points)
    for number, link in enumerate(mechanism.links[1:], 1):
        for point in link.points:
            if point not in seen:
                seen.add(point)
                yield point, number
