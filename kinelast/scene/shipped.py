"""The scenes that come with the program."""

from __future__ import annotations

from pathlib import Path

MECHANISMS = Path(__file__).parent.parent / "mechanisms"


def shipped_scenes() -> dict[str, Path]:
    """Paths of the shipped scenes by name."""
    return {path.stem: path for path in sorted(MECHANISMS.glob("*.toml"))}


def shipped_structures() -> dict[str, Path]:
    """Paths of the shipped scenes that describe a structure alone, by name."""
    return {path.stem: path for path in sorted((MECHANISMS / "structure").glob("*.toml"))}
