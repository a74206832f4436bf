"""The structure of a mechanism, as data and as text for a terminal."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from kinelast.structure.lines import (
    WIDTH,
    loop_lines,
    rank_lines,
    redundancy_lines,
    section,
    table_lines,
    wrapped_lines,
)
from rigid import Mechanism, MechanismError, assur_groups
from rigid.decomposition import AssurGroup
from rigid.topology import (
    Contact,
    Graph,
    Mobility,
    Pair,
    assembled,
    bar_graph,
    flat_triangles,
    fundamental_loops,
    gear_contacts,
    incidence,
    kutzbach,
    link_graph,
    mobility,
    pairs,
    planar_chain,
    stressed_joints,
)

if TYPE_CHECKING:
    from kinelast.scene.data import Scene

MOST_NAMED = 3  # contacts in a message


@dataclass(frozen=True, eq=False)
class StructureReport:
    """Structure of a planar mechanism.

    Attributes
    ----------
    title
        Of the scene; may be empty.
    mechanism, joints
        What is reported on, and its pairs in the order of the branches of `links`.
    links, bars
        Graph of links and joints, and graph of joints and bars.
    ranks
        Mobility and hyperstaticity at the drawn position; what prevents them where it cannot be put together.
    redundant
        Joints whose forces statics alone cannot tell.
    triangles
        Triples of links pinned to one another in one line.
    groups
        In the order of solution; what prevents it where the drives do not determine the mechanism.
    """

    title: str
    mechanism: Mechanism
    joints: tuple[Pair, ...]
    links: Graph
    bars: Graph
    ranks: Mobility | str
    redundant: tuple[Pair, ...]
    triangles: tuple[tuple[str, str, str], ...]
    groups: tuple[AssurGroup, ...] | str


def structure_report(subject: Mechanism | Scene, contacts: Iterable[Contact] = ()) -> StructureReport:
    """Everything that is known of a mechanism's structure; `contacts` are its cams and slipping gears as drawn.

    Raises
    ------
    MechanismError
        A gear whose wheels touch nowhere.
    """
    mechanism = subject if isinstance(subject, Mechanism) else subject.mechanism
    title = "" if isinstance(subject, Mechanism) else subject.title or subject.name
    given = tuple(contacts)
    contacts = (*gear_contacts(mechanism), *given)
    joints = pairs(mechanism, contacts)
    ranks: Mobility | str
    groups: tuple[AssurGroup, ...] | str
    redundant: tuple[Pair, ...] = ()
    triangles: tuple[tuple[str, str, str], ...] = ()
    try:
        here = assembled(mechanism)
        chain = planar_chain(here, contacts)
        ranks = mobility(chain)
        redundant = tuple(joints[number] for number in stressed_joints(chain))
        triangles = flat_triangles(here)
    except MechanismError as error:
        ranks = str(error)
    try:
        groups = assur_groups(mechanism)
    except MechanismError as error:
        groups = _not_by_groups(given) if given else str(error)
    graphs = link_graph(mechanism, contacts), bar_graph(mechanism)
    return StructureReport(title, mechanism, joints, *graphs, ranks, redundant, triangles, groups)


def _not_by_groups(contacts: Sequence[Contact]) -> str:
    """Why a mechanism with contacts has no groups: mobility counts contacts, groups are joined by lower pairs."""
    names = ", ".join(f'"{contact.name}"' for contact in contacts[:MOST_NAMED])
    names += ", ..." if len(contacts) > MOST_NAMED else ""
    one = len(contacts) == 1
    who = f"the contact {names} is" if one else f"the contacts {names} are"
    return f"groups are made of pins, sliders, welds and gears, and {who} none of them"


def structure_text(subject: Mechanism | Scene | StructureReport, contacts: Iterable[Contact] = ()) -> str:
    """The structure of a mechanism in lines for a terminal."""
    report = subject if isinstance(subject, StructureReport) else structure_report(subject, contacts)
    sections = [
        (f"Links ({len(report.mechanism.links)})", _links(report)),
        (f"Joints ({len(report.joints)})", _joints(report)),
        ("Independent loops", loop_lines(report.links)),
        ("Mobility", _mobility(report)),
        ("Groups in the order of solution", _groups(report)),
        (f"Bars ({len(report.bars.branches)}) and nodes ({len(report.bars.nodes)})", _bars(report.bars)),
    ]
    head = [report.title, "=" * len(report.title), ""] if report.title else []
    return "\n".join(head) + "\n".join(section(name, lines) for name, lines in sections)


def _links(report: StructureReport) -> list[str]:
    return table_lines([(link.name, ", ".join(link.points)) for link in report.mechanism.links])


def _joints(report: StructureReport) -> list[str]:
    return table_lines(
        [
            (
                pair.name,
                pair.kind,
                f"{pair.start} - {pair.end}",
                "" if pair.drive is None else f"drive {pair.drive + 1}",
            )
            for pair in report.joints
        ]
    )


def _mobility(report: StructureReport) -> list[str]:
    welds, single, slipping = (sum(pair.freedoms == freedoms for pair in report.joints) for freedoms in (0, 1, 2))
    links = len(report.mechanism.links)
    count = kutzbach(links, single, slipping, welds)
    fixed = f" - 3 * {welds}" if welds else ""
    lines = [f"Kutzbach count: 3 ({links} - 1) - 2 * {single} - {slipping}{fixed} = {count}"]
    if isinstance(report.ranks, str):
        return [*lines, *wrapped_lines(f"m and h are not known: {report.ranks}")]
    drives = len(report.mechanism.drives)
    m = int(report.ranks.mobility)
    lines += rank_lines(report.ranks)
    lines.append(f"drives: {drives}" + (", as many as m" if drives == m else f", but m = {m}"))
    lines += redundancy_lines([f"{pair.name} ({pair.start} - {pair.end})" for pair in report.redundant])
    for trio in report.triangles:
        lines += wrapped_lines(
            f"{', '.join(trio)} are pinned to one another in one line, which is singular in every position: "
            "make them one link with three points"
        )
    return lines


def _groups(report: StructureReport) -> list[str]:
    if isinstance(report.groups, str):
        return wrapped_lines(f"none: {report.groups}")
    return table_lines(
        [
            (f"{number}", group.name, ", ".join(group.links), _driven(group.drives))
            for number, group in enumerate(report.groups, 1)
        ]
    )


def _driven(drives: Sequence[int]) -> str:
    return "drive " + ", ".join(str(drive + 1) for drive in drives) if drives else ""


def _bars(graph: Graph) -> list[str]:
    """Bars with their nodes; incidence and loop matrix as far as they fit a line."""
    rows = [(f"{number}", bar.name, f"{bar.start} -> {bar.end}") for number, bar in enumerate(graph.branches, 1)]
    lines = table_lines(rows)
    heads = [row[0] for row in rows]
    loops = fundamental_loops(graph)
    for name, matrix, labels in (
        ("incidence matrix A", incidence(graph), graph.nodes),
        ("fundamental loops B_f", loops, [str(number) for number in range(1, len(loops) + 1)]),
    ):
        table = table_lines([("", *(f"{head:>2}" for head in heads)), *_signs(matrix, labels)])
        if len(matrix) and max(map(len, table)) <= WIDTH:
            lines += ["", name, *table]
    return lines


def _signs(matrix: np.ndarray[tuple[int, ...], np.dtype[np.int64]], labels: Sequence[str]) -> list[tuple[str, ...]]:
    return [
        (label, *(f"{entry:2d}" if entry else " ." for entry in row)) for label, row in zip(labels, matrix, strict=True)
    ]
