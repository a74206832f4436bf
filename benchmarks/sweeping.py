"""The sweep that benchmarks/sweep.py and sweep_faults.py measure: a shipped four-bar of many lengths and depths."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import measuring  # noqa: F401  # before numpy: one thread, also in processes to come
import numpy as np

from kinelast import shipped_scenes
from kinelast.designs.evaluate import Evaluation
from kinelast.scene.document import read_document

POSITIONS = 72
CHUNK = 4629  # designs, about a second's
BOUNDS = {  # path: lowest and highest value [m]
    "links.crank.length": (0.08, 0.12),
    "links.coupler.length": (0.27, 0.33),
    "links.rocker.length": (0.23, 0.27),
    "sections.bar.depth": (3e-3, 12e-3),
}
MAXIMA = ("N", "V", "M", "u", "deflection", "phi", "chord", "stress")  # of all fields, over beams and positions


@dataclass(frozen=True)
class Spread:
    """Designs that fill a box evenly, each by its number alone.

    Multiples of powers of 1/g modulo 1, where g^(d + 1) = g + 1 in d dimensions; for d = 1 the golden ratio.
    """

    count: int
    paths: tuple[str, ...] = tuple(BOUNDS)

    def values(self, first: int, last: int) -> Any:
        """Values of some designs [m], shape (designs, paths)."""
        ratio = 1.0
        for _ in range(60):
            ratio = (1.0 + ratio) ** (1.0 / (len(self.paths) + 1))
        low, high = np.array([BOUNDS[path] for path in self.paths]).T
        step = ratio ** -np.arange(1.0, len(self.paths) + 1)
        return low + (high - low) * (np.arange(first, last)[:, None] * step % 1.0)


def four_bars(count: int, figures: tuple[str, ...] = MAXIMA) -> Evaluation:
    """So many four-bars, and which figures of them."""
    document = read_document(shipped_scenes()["steel_four_bar"]).with_positions(POSITIONS)
    return Evaluation(document, Spread(count), figures)


def identity(evaluation: Evaluation) -> dict[str, Any]:
    """What a sweep's figures depend on."""
    tables, plan = evaluation.document.tables, evaluation.plan
    return {"tables": tables, "figures": list(evaluation.figures or ()), "paths": plan.paths}


def tree(folder: Path) -> dict[str, bytes]:
    """All files of a folder with their bytes."""
    return {path.relative_to(folder).as_posix(): path.read_bytes() for path in folder.rglob("*") if path.is_file()}
