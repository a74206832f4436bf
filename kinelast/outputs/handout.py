"""Sentences of the one-page print: assumptions and checks."""

from __future__ import annotations

from typing import Any

from kinelast.figures.report import Report
from kinelast.outputs.words import check_words, further_checks, size
from kinelast.scene.data import QUASI_STATIC
from kinelast.scene.numbers import error_percent
from kinelast.scene.reading import Reading

MOTIONS = {
    QUASI_STATIC: "links deflect under the loads of the rigid motion, without vibration",
    "elastodynamic": "links vibrate",
    "geometrically-exact": "links vibrate, with large displacements",
}
BEAMS = {"Timoshenko": "beams with shear deformation", "Euler-Bernoulli": "beams without shear deformation"}


def handout(report: Report) -> dict[str, Any]:
    """Return the sentences `assumptions` and the sentence `checked`."""
    return {"assumptions": assumptions(report), "checked": checked(report)}


def assumptions(report: Report) -> list[str]:
    """Return sentences on theory, drives, loads, materials and neglected effects."""
    inputs, run, output = report.inputs, report.run, report.output

    def words(found: Reading) -> str:
        return size(found, report.told_in, 3).replace("^2", "²").replace("^3", "³")

    said = ["Plane motion. No link has beams: all are rigid."]
    if report.links:
        theory = report.theory.name
        said = [f"Plane motion, linear material; {MOTIONS.get(theory, theory)}; {BEAMS[inputs.theory]}."]
    if (run.end.value or 0.0) > (run.start.value or 0.0):
        said.append(f"Computed at {run.positions} positions from {words(run.start)} to {words(run.end)}.")
    drives = [f"{name} {'' if row.steady else 'up to '}{words(row.speed)}" for name, row in inputs.drives.items()]
    if drives:
        said.append(f"Drives follow their motion exactly: {', '.join(drives)}.")
    pull = [f"{words(row)} in {way}" for way, row in inputs.gravity.items() if row.value]
    loads = [f"{load.kind} on {load.link}" if load.link else load.kind for load in inputs.loads]
    said.append(f"Loads: inertia; gravity {', '.join(pull) or 'none'}; others: {', '.join(loads) or 'none'}.")
    stuffs = [
        f"{name} E {words(row.E)}" + (f", yield {words(row.yield_stress)}" if row.yield_stress.value else "")
        for name, row in inputs.materials.items()
    ]
    if stuffs:
        said.append(f"Materials: {'; '.join(stuffs)}.")
    if output and output.guessed:
        said.append(f"The output was chosen automatically: {output.kind} {output.name}.")
    if report.not_computed:
        said.append(f"Not computed: {', '.join(report.not_computed)}.")
    return said


def checked(report: Report) -> str:
    """Return a sentence on the error of the answer and its checks."""
    theory, words = report.theory, []
    if theory.error is not None:
        worst = f" ({theory.figure})" if theory.figure else ""
        words.append(f"Largest estimated error of the main figures: {error_percent(theory.error)}{worst}")
    elif theory.problem and report.links:
        words.append(f"Error unknown: {theory.problem}")
    words.append(check_words(report.check) if report.check else "not compared with finite elements (--check)")
    return "; ".join([*words, *further_checks(report.nonlinear_check, report.solid_check)]) + "."
