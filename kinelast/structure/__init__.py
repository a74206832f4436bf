"""Structure of a planar mechanism or of a spatial chain of joints, as data and as text."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from textwrap import wrap
from typing import TYPE_CHECKING

import numpy as np

from rigid import Mechanism, MechanismError, assur_groups, topology
from rigid.decomposition import AssurGroup
from rigid.topology import Graph, Mobility

if TYPE_CHECKING:
    from kinelast.scene.data import Scene


LINE_WIDTH = 110  # characters
NEARLY_SINGULAR = 1e-3  # ratio of smallest non-zero to largest singular value


def section(name: str, lines: Iterable[str]) -> str:
    """Format a heading, indented lines, and an empty line."""
    return "\n".join([name, *(f"  {line}".rstrip() for line in lines), ""])


def table_lines(rows: Sequence[Sequence[str]]) -> list[str]:
    """Align the columns of rows."""
    widths = [max(len(row[column]) for row in rows) for column in range(len(rows[0]))] if rows else []
    return ["  ".join(cell.ljust(width) for cell, width in zip(row, widths, strict=True)).rstrip() for row in rows]


def wrapped_lines(text: str) -> list[str]:
    """Wrap a sentence to the width of a terminal."""
    return wrap(text, LINE_WIDTH, subsequent_indent="  ", break_long_words=False, break_on_hyphens=False)


def loop_lines(graph: Graph) -> list[str]:
    """Each loop as a walk over nodes and branches."""
    lines = []
    for number, loop in enumerate(topology.fundamental_loops(graph), 1):
        steps = []
        for branch, sign in topology.loop_walk(graph, loop):
            ends = (graph.branches[branch].start, graph.branches[branch].end)
            steps.append((ends[::sign][0], graph.branches[branch].name))
        nodes = [node for node, _ in steps]
        first = nodes.index(graph.nodes[0]) if graph.nodes[0] in nodes else 0
        round_trip = [*steps[first:], *steps[:first]]
        way = " ".join(f"{node} -({joint})-" for node, joint in round_trip)
        lines += wrapped_lines(f"{number}: {way} {round_trip[0][0]}")
    return lines or ["no loops: an open chain"]


def rank_lines(ranks: Mobility) -> list[str]:
    """Ranks of the kinematic and the static side, and how clear the decision is."""
    m, h = int(ranks.mobility), int(ranks.hyperstaticity)
    kinematic = (ranks.kinematic_unknowns, ranks.kinematic_equations, int(ranks.kinematic_rank))
    static = (ranks.static_unknowns, ranks.static_equations, int(ranks.static_rank))
    lines = [
        "kinematic side: I_c = {} unknowns, E_c = {} equations, rank r_c = {}".format(*kinematic),
        "static side:    I_s = {} unknowns, E_s = {} equations, rank r_s = {}".format(*static),
        f"mobility m = {m}, hyperstaticity h = {h}, mobility index m - h = {ranks.index}",
    ]
    if not ranks.sides_agree:
        lines.append("the two sides disagree: the position is too close to a singularity")
    if float(ranks.kept) < NEARLY_SINGULAR:
        lines += wrapped_lines(
            f"nearly singular: the smallest singular value that counts is {float(ranks.kept):.1e} of the greatest. "
            "Slightly different dimensions may increase both m and h; give more digits if the dimensions are rounded"
        )
    return lines


def redundancy_lines(names: Sequence[str]) -> list[str]:
    """Joints with statically indeterminate forces."""
    if not names:
        return ["every joint force follows from statics"]
    return wrapped_lines("redundant: statics does not determine the forces in " + ", ".join(names))


MAX_NAMED = 3  # contacts named in a message


@dataclass(frozen=True, eq=False)
class StructureReport:
    """Structure of a planar mechanism.

    Attributes
    ----------
    title
        Title of the scene; may be empty.
    mechanism, joints
        The mechanism; its kinematic pairs in the order of the branches of `links`.
    links, bars
        Graph of links and joints; graph of joints and bars.
    ranks
        Mobility and hyperstaticity at the drawn position, or an error message if it cannot be assembled.
    redundant
        Joints with statically indeterminate forces.
    triangles
        Triples of links pinned to one another on one line.
    groups
        Groups in the order of solution, or an error message if the drives do not determine the mechanism.
    """

    title: str
    mechanism: Mechanism
    joints: tuple[topology.Pair, ...]
    links: Graph
    bars: Graph
    ranks: Mobility | str
    redundant: tuple[topology.Pair, ...]
    triangles: tuple[tuple[str, str, str], ...]
    groups: tuple[AssurGroup, ...] | str


def structure_report(subject: Mechanism | Scene, contacts: Iterable[topology.Contact] = ()) -> StructureReport:
    """Analyse the structure of a mechanism; `contacts` are cams and slipping gears as drawn.

    Raises
    ------
    MechanismError
        If the wheels of a gear do not touch.
    """
    mechanism = subject if isinstance(subject, Mechanism) else subject.mechanism
    title = "" if isinstance(subject, Mechanism) else subject.title or subject.name
    given = tuple(contacts)
    contacts = (*topology.gear_contacts(mechanism), *given)
    joints = topology.pairs(mechanism, contacts)
    ranks: Mobility | str
    groups: tuple[AssurGroup, ...] | str
    redundant: tuple[topology.Pair, ...] = ()
    triangles: tuple[tuple[str, str, str], ...] = ()
    try:
        here = topology.assembled(mechanism)
        chain = topology.planar_chain(here, contacts)
        ranks = topology.mobility(chain)
        redundant = tuple(joints[number] for number in topology.stressed_joints(chain))
        triangles = topology.flat_triangles(here)
    except MechanismError as error:
        ranks = str(error)
    try:
        groups = assur_groups(mechanism)
    except MechanismError as error:
        groups = _no_groups_reason(given) if given else str(error)
    graphs = topology.link_graph(mechanism, contacts), topology.bar_graph(mechanism)
    return StructureReport(title, mechanism, joints, *graphs, ranks, redundant, triangles, groups)


def _no_groups_reason(contacts: Sequence[topology.Contact]) -> str:
    """Explain why a mechanism with contacts has no groups, which consist of lower pairs."""
    names = ", ".join(f'"{contact.name}"' for contact in contacts[:MAX_NAMED])
    names += ", ..." if len(contacts) > MAX_NAMED else ""
    one = len(contacts) == 1
    who = f"the contact {names} is" if one else f"the contacts {names} are"
    return f"groups are made of pins, sliders, welds and gears, and {who} none of them"


def structure_text(subject: Mechanism | Scene | StructureReport, contacts: Iterable[topology.Contact] = ()) -> str:
    """Structure of a mechanism as text for a terminal."""
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
    count = topology.kutzbach(links, single, slipping, welds)
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
            (f"{number}", group.name, ", ".join(group.links), _drive_text(group.drives))
            for number, group in enumerate(report.groups, 1)
        ]
    )


def _drive_text(drives: Sequence[int]) -> str:
    return "drive " + ", ".join(str(drive + 1) for drive in drives) if drives else ""


def _bars(graph: Graph) -> list[str]:
    """Bars with their nodes; incidence and loop matrix if they fit the width."""
    rows = [(f"{number}", bar.name, f"{bar.start} -> {bar.end}") for number, bar in enumerate(graph.branches, 1)]
    lines = table_lines(rows)
    heads = [row[0] for row in rows]
    loops = topology.fundamental_loops(graph)
    for name, matrix, labels in (
        ("incidence matrix A", topology.incidence(graph), graph.nodes),
        ("fundamental loops B_f", loops, [str(number) for number in range(1, len(loops) + 1)]),
    ):
        table = table_lines([("", *(f"{head:>2}" for head in heads)), *_signs(matrix, labels)])
        if len(matrix) and max(map(len, table)) <= LINE_WIDTH:
            lines += ["", name, *table]
    return lines


def _signs(matrix: np.ndarray[tuple[int, ...], np.dtype[np.int64]], labels: Sequence[str]) -> list[tuple[str, ...]]:
    return [
        (label, *(f"{entry:2d}" if entry else " ." for entry in row)) for label, row in zip(labels, matrix, strict=True)
    ]


def spatial_text(joints: Sequence[topology.SpatialJoint], title: str = "", fixed: str | None = None) -> str:
    """Structure of a spatial chain of joints as text for a terminal.

    Raises
    ------
    MechanismError
        If the joints do not form a chain.
    """
    chain = topology.spatial_chain(joints, fixed)
    ranks = topology.mobility(chain)
    rows = [
        (
            joint.name,
            joint.kind.name,
            " - ".join(joint.links),
            _freedom_text(joint),
            _transmitted_text(joint),
        )
        for joint in joints
    ]
    stressed = [chain.graph.branches[number].name for number in topology.stressed_joints(chain)]
    sections = [
        (f"Links ({len(chain.graph.nodes)})", [f"{chain.graph.nodes[0]} (fixed)", *chain.graph.nodes[1:]]),
        (f"Joints ({len(rows)})", table_lines([("", "", "", "leaves free", "carries"), *rows])),
        ("Independent loops", loop_lines(chain.graph)),
        ("Mobility", [*rank_lines(ranks), *redundancy_lines(stressed)]),
        ("Input-output laws", _input_output_laws(chain.freedoms, chain.graph, topology.joint_rates(chain))),
    ]
    head = [title, "=" * len(title), ""] if title else []
    return "\n".join(head) + "\n".join(section(name, lines) for name, lines in sections)


def _freedom_text(joint: topology.SpatialJoint) -> str:
    words = " ".join(joint.kind.freedoms) or "nothing"
    return f"{words}, Vz = p Ωz, p = {joint.pitch:g} m" if joint.kind.name == "helical" else words


def _transmitted_text(joint: topology.SpatialJoint) -> str:
    words = " ".join(joint.kind.transmits) or "nothing"
    return f"{words}, N = -p Z" if joint.kind.name == "helical" else words


def _input_output_laws(
    freedoms: Sequence[Sequence[str]], graph: Graph, rates: np.ndarray[tuple[int, ...], np.dtype[np.float64]]
) -> list[str]:
    """With one degree of freedom: all rates relative to the first that is not zero."""
    if rates.shape[1] == 0:
        return ["no motion"]
    if rates.shape[1] != 1:
        return [f"{rates.shape[1]} independent motions: choose as many inputs"]
    names = [
        (branch.name, freedom) for branch, words in zip(graph.branches, freedoms, strict=True) for freedom in words
    ]
    values = rates[:, 0]
    moving = np.flatnonzero(np.abs(values) > 1e-9 * np.abs(values).max())
    base = int(moving[0])
    lines = []
    for number, (joint, freedom) in enumerate(names):
        ratio = values[number] / values[base] if number in moving else 0.0
        if number != base:
            lines.append((f"{freedom} of {joint}", f"= {ratio:.10g} * {names[base][1]} of {names[base][0]}"))
    return table_lines(lines)
