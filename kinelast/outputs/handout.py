"""Sentences of the one-page print: assumptions and checks."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from kinelast.outputs.words import check_words, further_checks
from kinelast.scene.data import QUASI_STATIC
from kinelast.scene.numbers import error_percent, quantity

MOTIONS = {
    QUASI_STATIC: "links deflect under the loads of the rigid motion, without vibration",
    "elastodynamic": "links vibrate",
    "geometrically-exact": "links vibrate, with large displacements",
}
BEAMS = {"Timoshenko": "beams with shear deformation", "Euler-Bernoulli": "beams without shear deformation"}


def handout(figures: Mapping[str, Any]) -> dict[str, Any]:
    """Return the sentences `assumptions` and the sentence `checked`."""
    return {"assumptions": assumptions(figures), "checked": checked(figures)}


def assumptions(figures: Mapping[str, Any]) -> list[str]:
    """Return sentences on theory, drives, loads, materials and neglected effects."""
    inputs, output, told_in = figures["inputs"], figures["output"] or {}, figures["told_in"]

    def size(row: Mapping[str, Any]) -> str:
        return quantity(row["value"], row["unit"], 3, told_in).replace("^2", "²").replace("^3", "³")

    said = ["Plane motion. No link has beams: all are rigid."]
    if figures["links"]:
        theory = figures["theory"]["name"]
        said = [f"Plane motion, linear material; {MOTIONS.get(theory, theory)}; {BEAMS[inputs['theory']]}."]
    run = figures["run"]
    if run["end"]["value"] > run["start"]["value"]:
        said.append(f"Computed at {run['positions']} positions from {size(run['start'])} to {size(run['end'])}.")
    drives = [
        f"{name} {'' if row['steady'] else 'up to '}{size(row['speed'])}" for name, row in inputs["drives"].items()
    ]
    if drives:
        said.append(f"Drives follow their motion exactly: {', '.join(drives)}.")
    pull = [f"{size(row)} in {way}" for way, row in inputs["gravity"].items() if row["value"]]
    loads = [f"{load['kind']} on {load['link']}" if load["link"] else load["kind"] for load in inputs["loads"]]
    said.append(f"Loads: inertia; gravity {', '.join(pull) or 'none'}; others: {', '.join(loads) or 'none'}.")
    stuffs = [
        f"{name} E {size(row['E'])}" + (f", yield {size(row['yield'])}" if row["yield"]["value"] else "")
        for name, row in inputs["materials"].items()
    ]
    if stuffs:
        said.append(f"Materials: {'; '.join(stuffs)}.")
    if output.get("guessed"):
        said.append(f"The output was chosen automatically: {output['kind']} {output['name']}.")
    if figures["not_computed"]:
        said.append(f"Not computed: {', '.join(figures['not_computed'])}.")
    return said


def checked(figures: Mapping[str, Any]) -> str:
    """Return a sentence on the error of the answer and its checks."""
    theory, words = figures["theory"], []
    if theory["error"] is not None:
        worst = f" ({theory['figure']})" if theory["figure"] else ""
        words.append(f"Largest estimated error of the main figures: {error_percent(theory['error'])}{worst}")
    elif theory["problem"] and figures["links"]:
        words.append(f"Error unknown: {theory['problem']}")
    check = figures["check"]
    words.append(check_words(check) if check else "not compared with finite elements (--check)")
    return "; ".join([*words, *further_checks(figures)]) + "."
