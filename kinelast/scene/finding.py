"""Finding on the reliability of a scene's figures."""

from __future__ import annotations

from dataclasses import dataclass

GOOD, OPEN, CAUTION, POOR = "good", "open", "caution", "poor"
ORDER = (POOR, CAUTION, OPEN, GOOD)


@dataclass(frozen=True)
class Finding:
    """A finding on reliability: level, heading and sentence."""

    level: str
    heading: str
    text: str
