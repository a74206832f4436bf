"""What a scene's designs were asked for, written into its folder, and its figures."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

from kinelast.designs.studies import optimum_study, sensitivity_study, tolerance_study
from kinelast.designs.tolerances import DESIGNS
from kinelast.outputs.optimum import optimum_figures, write_optimum
from kinelast.outputs.sensitivities import sensitivity_bars, sensitivity_figures, write_sensitivities
from kinelast.outputs.tolerances import tolerance_bars, tolerance_figures, write_tolerances
from kinelast.progress import Progress
from kinelast.scene.document import Document
from kinelast.scene.text import of_file

FILES = ("sensitivities.csv", "sensitivities.svg", "tolerances.csv", "tolerances.svg", "optimum.csv", "optimum.toml")


@dataclass(frozen=True)
class Studies:
    """What is asked of a scene's designs: sensitivities, tolerances with so many samples, the best one."""

    sensitivities: bool = False
    tolerances: bool = False
    optimize: bool = False
    samples: int | None = None


def write_studies(part: Path, document: Document, asked: Studies, progress: Progress) -> dict[str, Any]:
    """Files of what is asked for, and the figures of it by what they are of.

    Parameters
    ----------
    part
        Where to.
    document
        Of the scene.

    Raises
    ------
    SceneError
        It cannot be answered.
    """
    figures = {}
    with of_file(document.path):
        if asked.sensitivities:
            found = sensitivity_study(document, progress=progress)
            write_sensitivities(part / "sensitivities.csv", *found)
            (part / "sensitivities.svg").write_text(sensitivity_bars(*found), encoding="utf-8")
            figures["sensitivities"] = sensitivity_figures(*found)
        if asked.tolerances:
            ranges = tolerance_study(document, asked.samples or DESIGNS, progress)
            write_tolerances(part / "tolerances.csv", ranges)
            (part / "tolerances.svg").write_text(tolerance_bars(ranges), encoding="utf-8")
            figures["tolerances"] = tolerance_figures(ranges)
        if asked.optimize:
            best = optimum_study(document, progress)
            paths = (number.path for number in best.sought.variables)
            values = dict(zip(paths, best.optimum.values.tolist(), strict=True))
            kept = "all limits kept" if best.optimum.feasible else "NOT all limits kept"
            head = f"The best design by [optimize] of the scene {document.name}, quasi-statically: {kept}."
            new = document.with_values(values).text(head)
            (part / "optimum.toml").write_text(new, encoding="utf-8")
            write_optimum(part / "optimum.csv", best)
            figures["optimum"] = optimum_figures(best)
    return figures
