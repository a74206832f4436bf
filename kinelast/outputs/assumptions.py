"""Sentences about the assumptions of an analysis, for readers of a printed report."""

from collections.abc import Callable, Iterator, Mapping
from typing import Any

from kinelast.outputs.words import output_words, size
from kinelast.reports.report import Report
from kinelast.scene.data import QUASI_STATIC
from kinelast.values.numbers import quantity
from kinelast.values.reading import Reading

MOTIONS = {
    QUASI_STATIC: "links deflect under the loads of the rigid motion, without vibration",
    "elastodynamic": "links vibrate",
    "geometrically-exact": "links vibrate, with large displacements",
}
BEAMS = {"Timoshenko": "beams with shear deformation", "Euler-Bernoulli": "beams without shear deformation"}


def assumptions(report: Report) -> list[str]:
    """Return sentences about the assumptions: theory, drives, loads, materials, and effects that are not computed."""
    inputs, run, output = report.inputs, report.run, report.output

    def words(found: Reading) -> str:
        return size(found, report.shown_in, 3)

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
    loads = []
    for load in inputs.loads:
        sizes = " and ".join(dict.fromkeys(words(each) for each in load.sizes if each.value is not None))
        loads.append(f"{load.kind} {sizes}".rstrip() + (f" on {load.link}" if load.link else ""))
    said.append(f"Loads: inertia; gravity {', '.join(pull) or 'none'}; others: {', '.join(loads) or 'none'}.")
    masses = [f"{words(row['mass'])} on {row['link']} {_place_words(row, words)}" for row in inputs.point_masses]
    if masses:
        said.append(f"Masses in addition to beams: {', '.join(masses)}.")
    stuffs = [
        f"{name} E {words(row.E)}" + (f", yield {words(row.yield_stress)}" if row.yield_stress.value else "")
        for name, row in inputs.materials.items()
    ]
    if stuffs:
        said.append(f"Materials: {'; '.join(stuffs)}.")
    sections = [f"{name} A {words(row['area'])}, I {words(row['inertia'])}" for name, row in inputs.sections.items()]
    if sections:
        said.append(f"Sections: {'; '.join(sections)}.")
    ratings = [f"{name}: {', '.join(rated)}" for name, rated in _ratings(report) if rated]
    if ratings:
        said.append(f"Motors: {'; '.join(ratings)}.")
    if output and output.guessed:
        said.append(f"The output was chosen automatically: {output_words(output)}.")
    if report.not_computed:
        said.append(f"Not computed: {', '.join(report.not_computed)}.")
    return said


def _place_words(mass: Mapping[str, Any], words: Callable[[Reading], str]) -> str:
    """Return a phrase about the position of a point mass on a link. `words` converts a reading to text."""
    offset = f"({', '.join(map(words, mass['offset']))}) from" if "offset" in mass else "at"
    return f"{offset} {mass['point']}"


RATINGS = {"rated_torque": "N m", "peak_torque": "N m", "rated_speed": "rad/s", "top_speed": "rad/s"}


def _ratings(report: Report) -> Iterator[tuple[str, list[str]]]:
    """Yield the name of each drive, and phrases about the ratings of the motor, such as the rated torque."""
    for name, drive in report.drives.items():
        given = drive.get("motor", {}).get("given", {})
        yield (
            name,
            [
                f"{key.replace('_', ' ')} {quantity(given[key], unit, 3, report.shown_in)}"
                for key, unit in RATINGS.items()
                if given.get(key)
            ],
        )
