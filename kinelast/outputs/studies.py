"""Studies of a scene's designs, written into its folder, and their figures."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from kinelast.designs.studies import optimum_study, sensitivity_study, tolerance_study
from kinelast.designs.tolerances import DESIGNS
from kinelast.outputs.optimum import optimum_figures, optimum_table
from kinelast.outputs.sensitivities import sensitivity_bars, sensitivity_figures, sensitivity_table
from kinelast.outputs.table import write_table
from kinelast.outputs.tolerances import tolerance_bars, tolerance_figures, tolerance_table
from kinelast.process.progress import Progress
from kinelast.scene.document import Document
from kinelast.scene.text import of_file
from kinelast.tasks.request import Request


def write_studies(part: Path, document: Document, request: Request, progress: Progress) -> dict[str, Any]:
    """Files of the studies asked for, and their figures by study.

    Parameters
    ----------
    part
        Where to.
    document
        Of the scene.
    request
        Which studies, of how many samples, and in which formats.

    Raises
    ------
    SceneError
        It cannot be answered.
    """
    figures = {}
    with of_file(document.path):
        if request.sensitivities:
            found = sensitivity_study(document, progress=progress)
            write_table(part / "sensitivities.csv", sensitivity_table(*found), request.tables)
            (part / "sensitivities.svg").write_text(sensitivity_bars(*found), encoding="utf-8")
            figures["sensitivities"] = sensitivity_figures(*found)
        if request.tolerances:
            ranges = tolerance_study(document, request.samples or DESIGNS, progress)
            write_table(part / "tolerances.csv", tolerance_table(ranges), request.tables)
            (part / "tolerances.svg").write_text(tolerance_bars(ranges), encoding="utf-8")
            figures["tolerances"] = tolerance_figures(ranges)
        if request.optimize:
            best = optimum_study(document, progress)
            paths = (number.path for number in best.task.variables)
            values = dict(zip(paths, best.optimum.values.tolist(), strict=True))
            kept = "all limits kept" if best.optimum.feasible else "NOT all limits kept"
            head = f"The best design by [optimize] of the scene {document.name}, quasi-statically: {kept}."
            new = document.with_values(values).text(head)
            (part / "optimum.toml").write_text(new, encoding="utf-8")
            write_table(part / "optimum.csv", optimum_table(best), request.tables)
            figures["optimum"] = optimum_figures(best)
    return figures
