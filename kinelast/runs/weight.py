"""Memory and disk that a request takes, told before it starts; too large a request is refused, with advice."""

from __future__ import annotations

import shutil
from pathlib import Path

from elastic import FIELDS, PRIMARY
from kinelast.figures.cycle import EXTREME_FIELDS
from kinelast.figures.many_beams import too_many_beams
from kinelast.scene.data import Scene
from kinelast.tasks.request import Request, RequestError
from rigid import structure

HEAVY = 2e8  # [bytes] from which it is told
NUMBER = 8  # bytes of a number, and about
DIGITS = 20  # of one in a table
MOST_MESHES = 20_000
SHARE = 0.8  # of what is free that may be taken
COPIES = 5  # of its arrays that the check has at once


def require_room(scene: Scene, request: Request, positions: int, checked: int, out: Path) -> str:
    """The message on a heavy request; empty of others.

    Parameters
    ----------
    positions, checked
        Of the run, and of those that the check looks at.

    Raises
    ------
    RequestError
        There is not enough room for it on the disk or in memory, or it asks for too many files.
    """
    beams = len(scene.mechanism.beams)
    if request.mesh and positions > MOST_MESHES:
        raise RequestError(f"--mesh writes a file for every position: ask for {MOST_MESHES} --positions at most")
    disk = positions * DIGITS * _columns(scene)
    if request.fields:
        disk += 2 * positions * request.stations * sum(field.main for field in FIELDS.values()) * beams * NUMBER
    elements = request.elements or 0
    memory = checked * elements * len(PRIMARY) * max(beams, 1) * NUMBER * COPIES
    for need, free, where, less in (
        (disk, _free_disk(out), "on the disk", "--positions or --stations"),
        (memory, _free_memory(), "of memory", "--positions or elements to --check"),
    ):
        if need > SHARE * free:
            told = f"takes about {_words(need)} {where}, where {_words(free)} are free"
            raise RequestError(f"what is asked for {told}: ask for fewer {less}")
    sentences = [many] if (many := too_many_beams(scene.mechanism)) else []
    if max(disk, memory) >= HEAVY:
        of_memory = f" and {_words(memory)} of memory" if memory else ""
        sentences.append(f"{positions} positions take about {_words(disk)} on the disk{of_memory}")
    return f"{scene.name}: {'; '.join(sentences)}" if sentences else ""


def _columns(scene: Scene) -> int:
    """About how many columns positions.csv has."""
    mechanism = scene.mechanism
    points = sum(len(link.points) for link in mechanism.links[1:])
    of_beams = (len(EXTREME_FIELDS) + 1) * len(mechanism.beams)
    return 6 + 2 * len(mechanism.drives) + of_beams + 3 * points + 3 * len(structure(mechanism).joints)


def _free_disk(out: Path) -> float:
    there = next((place for place in (out, *out.absolute().parents) if place.exists()), Path("/"))
    return float(shutil.disk_usage(there).free)


def _free_memory() -> float:
    """Memory that is free, where the system tells it."""
    try:
        lines = Path("/proc/meminfo").read_text(encoding="ascii").splitlines()
        return next(1024.0 * int(line.split()[1]) for line in lines if line.startswith("MemAvailable"))
    except (OSError, ValueError, StopIteration):
        return float("inf")


def _words(size: float) -> str:
    return f"{size / 1e9:.3g} GB" if size >= 1e9 else f"{size / 1e6:.3g} MB"
