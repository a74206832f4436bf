"""Text that describes the structure of a planar mechanism or of a spatial chain of joints."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from textwrap import wrap
from typing import TYPE_CHECKING

import numpy as np

from rigid import Mechanism, MechanismError, assur_groups, topology
from rigid.topology import Graph, Mobility

if TYPE_CHECKING:
    from kinelast.scene.data import Scene


LINE_WIDTH = 110  # [characters]
NEARLY_SINGULAR = 1e-3  # warn if (smallest nonzero singular value) / (largest singular value) is below this value


def section(name: str, lines: Iterable[str]) -> str:
    """Return a section of a text: a heading, indented lines, and an empty line."""
    return "\n".join([name, *(f"  {line}".rstrip() for line in lines), ""])


def table_lines(rows: Sequence[Sequence[str]]) -> list[str]:
    """Return the rows of a table as lines with aligned columns."""
    widths = [max(len(row[column]) for row in rows) for column in range(len(rows[0]))] if rows else []
    return ["  ".join(cell.ljust(width) for cell, width in zip(row, widths, strict=True)).rstrip() for row in rows]


def wrapped_lines(text: str) -> list[str]:
    """Split a text into lines of at most `LINE_WIDTH` characters."""
    return wrap(text, LINE_WIDTH, subsequent_indent="  ", break_long_words=False, break_on_hyphens=False)


def loop_lines(graph: Graph) -> list[str]:
    """Return lines that list the nodes and branches of each independent loop, in order around the loop."""
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
    """Return lines with the ranks of the kinematic and static matrices, and a warning if the ranks are uncertain."""
    m, h = int(ranks.mobility), int(ranks.hyperstaticity)
    kinematic = (ranks.kinematic_unknowns, ranks.kinematic_equations, int(ranks.kinematic_rank))
    static = (ranks.static_unknowns, ranks.static_equations, int(ranks.static_rank))
    lines = [
        "kinematic side: I_c = {} unknowns, E_c = {} equations, rank r_c = {}".format(*kinematic),
        "static side:    I_s = {} unknowns, E_s = {} equations, rank r_s = {}".format(*static),
        f"mobility m = {m}, hyperstaticity h = {h}, mobility index m - h = {ranks.index}",
    ]
    if not ranks.sides_agree:
        lines.append("the two sides differ: the position is too close to a singularity")
    if float(ranks.kept) < NEARLY_SINGULAR:
        lines += wrapped_lines(
            f"nearly singular: the smallest nonzero singular value is {float(ranks.kept):.1e} times the largest. "
            "Slightly different dimensions may increase both m and h; give more digits if the dimensions are rounded"
        )
    return lines


def redundancy_lines(names: Sequence[str]) -> list[str]:
    """Return lines that name the joints with statically indeterminate forces."""
    if not names:
        return ["every joint force follows from statics"]
    return wrapped_lines("redundant: statics does not determine the forces in " + ", ".join(names))


MAX_NAMED = 3  # maximum number of contacts named in a message


def structure_text(subject: Mechanism | Scene, contacts: Iterable[topology.Contact] = (), title: str = "") -> str:
    """Return a text that describes the structure of a mechanism or scene.

    Parameters
    ----------
    contacts
        Contacts between links (cams and slipping gears) in the drawn position of the mechanism.

    Raises
    ------
    MechanismError
        The wheels of a gear do not touch.
    """
    mechanism = subject if isinstance(subject, Mechanism) else subject.mechanism
    title = title if isinstance(subject, Mechanism) else subject.title or subject.name
    given = tuple(contacts)
    contacts = (*topology.gear_contacts(mechanism), *given)
    joints, bars = topology.pairs(mechanism, contacts), topology.bar_graph(mechanism)
    links = [(link.name, ", ".join(link.points)) for link in mechanism.links]
    sections = [
        (f"Links ({len(links)})", table_lines(links)),
        (f"Joints ({len(joints)})", _joints(joints)),
        ("Independent loops", loop_lines(topology.link_graph(mechanism, contacts))),
        ("Mobility", _mobility(mechanism, joints, contacts)),
        ("Groups in the order of solution", _groups(mechanism, given)),
        (f"Bars ({len(bars.branches)}) and nodes ({len(bars.nodes)})", _bars(bars)),
    ]
    return titled(title, sections)


def titled(title: str, sections: Iterable[tuple[str, Iterable[str]]]) -> str:
    """Return a text that consists of an underlined title and sections. An empty title is left out."""
    head = [title, "=" * len(title), ""] if title else []
    return "\n".join(head) + "\n".join(section(name, lines) for name, lines in sections)


def _no_groups_reason(contacts: Sequence[topology.Contact]) -> str:
    """Return the reason why a mechanism with cams or slipping gears cannot be divided into groups."""
    names = ", ".join(f'"{contact.name}"' for contact in contacts[:MAX_NAMED])
    names += ", ..." if len(contacts) > MAX_NAMED else ""
    one = len(contacts) == 1
    who = f"the contact {names} is" if one else f"the contacts {names} are"
    return f"groups only consist of pins, sliders, welds and gears, but {who} none of these"


def _joints(joints: Iterable[topology.Pair]) -> list[str]:
    rows = []
    for pair in joints:
        drive = "" if pair.drive is None else f"drive {pair.drive + 1}"
        rows.append((pair.name, pair.kind, f"{pair.start} - {pair.end}", drive))
    return table_lines(rows)


def _mobility(mechanism: Mechanism, joints: Sequence[topology.Pair], contacts: Sequence[topology.Contact]) -> list[str]:
    welds, single, slipping = (sum(pair.freedoms == freedoms for pair in joints) for freedoms in (0, 1, 2))
    links = len(mechanism.links)
    count = topology.kutzbach(links, single, slipping, welds)
    fixed = f" - 3 * {welds}" if welds else ""
    lines = [f"Kutzbach count: 3 ({links} - 1) - 2 * {single} - {slipping}{fixed} = {count}"]
    try:
        here = topology.assembled(mechanism)
        chain = topology.planar_chain(here, contacts)
        ranks = topology.mobility(chain)
        redundant = [joints[number] for number in topology.stressed_joints(chain)]
        triangles = topology.flat_triangles(here)
    except MechanismError as error:
        return [*lines, *wrapped_lines(f"m and h are unknown: {error}")]
    drives, m = len(mechanism.drives), int(ranks.mobility)
    lines += rank_lines(ranks)
    lines.append(f"drives: {drives}" + (", as many as m" if drives == m else f", but m = {m}"))
    lines += redundancy_lines([f"{pair.name} ({pair.start} - {pair.end})" for pair in redundant])
    for trio in triangles:
        lines += wrapped_lines(
            f"{', '.join(trio)} are pinned to one another in a straight line, which is singular in every position: "
            "make them one link with three points"
        )
    return lines


def _groups(mechanism: Mechanism, contacts: Sequence[topology.Contact]) -> list[str]:
    """Return lines that list the groups of links, in the order of solution, or the reason why there are no groups."""
    try:
        groups = assur_groups(mechanism)
    except MechanismError as error:
        return wrapped_lines(f"none: {_no_groups_reason(contacts) if contacts else error}")
    rows = []
    for number, group in enumerate(groups, 1):
        drives = ", ".join(str(drive + 1) for drive in group.drives)
        rows.append((f"{number}", group.name, ", ".join(group.links), f"drive {drives}" if drives else ""))
    return table_lines(rows)


def _bars(graph: Graph) -> list[str]:
    """Return lines with the bars, their nodes, and the incidence and loop matrices.

    A matrix wider than `LINE_WIDTH` is left out.
    """
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
    """Return a text that describes the structure of a spatial chain of joints.

    Raises
    ------
    MechanismError
        The joints do not form a chain.
    """
    chain = topology.spatial_chain(joints, fixed)
    ranks = topology.mobility(chain)
    rows = [
        (joint.name, joint.kind.name, " - ".join(joint.links), _freedom_text(joint), _transmitted_text(joint))
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
    return titled(title, sections)


def _freedom_text(joint: topology.SpatialJoint) -> str:
    words = " ".join(joint.kind.freedoms) or "nothing"
    return f"{words}, Vz = p Ωz, p = {joint.pitch:g} m" if joint.kind.name == "helical" else words


def _transmitted_text(joint: topology.SpatialJoint) -> str:
    words = " ".join(joint.kind.transmits) or "nothing"
    return f"{words}, N = -p Z" if joint.kind.name == "helical" else words


def _input_output_laws(
    freedoms: Sequence[Sequence[str]], graph: Graph, rates: np.ndarray[tuple[int, ...], np.dtype[np.float64]]
) -> list[str]:
    """Return lines with all joint rates relative to the first nonzero rate.

    If the number of degrees of freedom is not 1, return a message instead.
    """
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
