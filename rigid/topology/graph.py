"""Oriented graphs: incidence matrix, spanning tree and independent loops."""

from collections.abc import Collection, Iterable

import numpy as np
from msgspec import Struct
from msgspec.structs import force_setattr

from rigid.arrays import Integers
from rigid.decomposition.connected import ConnectedSets
from rigid.parts import MechanismError


class Branch(Struct, frozen=True):
    """An oriented branch: a joint between two links, or a bar between two joints."""

    name: str
    start: str
    end: str


class Graph(Struct, frozen=True):
    """An oriented graph.

    Attributes
    ----------
    branches
        Branches, in the order of the matrices' columns. Several branches may connect the same two nodes.
    nodes
        Names of the nodes, in the order of the matrices' rows (default: the order in which the branches mention them).

    Raises
    ------
    MechanismError
        If a branch has an unknown node, or begins and ends at the same node.
    """

    branches: tuple[Branch, ...]
    nodes: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        """Collect the names of the nodes and check the ends of each branch."""
        mentioned = dict.fromkeys(node for branch in self.branches for node in (branch.start, branch.end))
        force_setattr(self, "nodes", tuple(self.nodes or mentioned))
        for branch in self.branches:
            for node in (branch.start, branch.end):
                if node not in self.nodes:
                    raise MechanismError(f'branch "{branch.name}": there is no node "{node}"')
            if branch.start == branch.end:
                raise MechanismError(f'branch "{branch.name}" begins and ends at "{branch.start}"')


def incidence(graph: Graph) -> Integers:
    """Return the incidence matrix A, shape (nodes, branches): +1 if a branch leaves a node, -1 if it enters the node.

    References
    ----------
    Scutaru, Vlase, Marin, equation (2).

    Examples
    --------
    >>> incidence(Graph((Branch("1", "O", "A"), Branch("2", "A", "B"))))
    array([[ 1,  0],
           [-1,  1],
           [ 0, -1]])
    """
    row = {node: number for number, node in enumerate(graph.nodes)}
    matrix = np.zeros((len(graph.nodes), len(graph.branches)), np.int64)
    for number, branch in enumerate(graph.branches):
        matrix[row[branch.start], number] += 1
        matrix[row[branch.end], number] -= 1
    return matrix


def components(graph: Graph) -> tuple[tuple[str, ...], ...]:
    """Return the nodes of each connected component."""
    sets = ConnectedSets(graph.nodes)
    for branch in graph.branches:
        sets.join(branch.start, branch.end)
    parts: dict[str, list[str]] = {}
    for node in graph.nodes:
        parts.setdefault(sets.root(node), []).append(node)
    return tuple(tuple(part) for part in parts.values())


def cyclomatic_number(graph: Graph) -> int:
    """Return the number of independent loops: branches - nodes + components."""
    return len(graph.branches) - len(graph.nodes) + len(components(graph))


def spanning_tree(graph: Graph, preferred: Iterable[int] = ()) -> tuple[int, ...]:
    """Return the indices of the branches of a spanning tree, in ascending order.

    Branches are added in order, `preferred` ones first. If the graph has several components, each has its own tree.
    """
    sets = ConnectedSets(graph.nodes)
    ends = [(branch.start, branch.end) for branch in graph.branches]
    return tuple(sorted(number for number in (*preferred, *range(len(ends))) if sets.join(*ends[number])))


def fundamental_loops(graph: Graph, tree: Collection[int] | None = None) -> Integers:
    """Return the fundamental loop matrix B_f, shape (loops, branches), with A B_f^T = 0.

    Each row is the loop that is closed by one branch outside the tree and by branches of the tree. Entries are +1 for
    branches in the direction of the loop, and -1 for branches against it. Remove one row per component from the
    incidence matrix A. Let A_t be the columns for branches in the tree, and A_l the columns for branches outside the
    tree. Then `B_f = [-(A_t^-1 A_l)^T : I]`, if the branches of the tree come first. In the result, the columns are in
    the order of `graph.branches`.

    Parameters
    ----------
    tree
        Indices of the branches of the tree (default: `spanning_tree(graph)`).

    Raises
    ------
    MechanismError
        If the given branches are not a spanning tree.

    References
    ----------
    Scutaru, Vlase, Marin, equation (9), with A_t in place of [A]_f.
    """
    chosen = sorted(spanning_tree(graph) if tree is None else tree)
    kept = [node not in {part[-1] for part in components(graph)} for node in graph.nodes]
    if set(spanning_tree(graph, chosen)) != set(chosen):
        names = ", ".join(graph.branches[number].name for number in chosen)
        raise MechanismError(f"the branches {names} are not a spanning tree of {len(graph.nodes)} nodes")
    chords = [number for number in range(len(graph.branches)) if number not in chosen]
    reduced = incidence(graph)[kept]
    loops = np.zeros((len(chords), len(graph.branches)), np.int64)
    loops[:, chords] = np.eye(len(chords), dtype=np.int64)
    # A_t is unimodular: the entries of its inverse are -1, 0 or 1, so rounding is exact
    loops[:, chosen] = -np.rint(np.linalg.solve(reduced[:, chosen], reduced[:, chords])).astype(np.int64).T
    return loops


def loop_walk(graph: Graph, loop: Integers) -> tuple[tuple[int, int], ...]:
    """Return the branches along a loop in order, as pairs (index, +1 or -1).

    `loop` is a row of the fundamental loop matrix. The walk is in the direction of the loop. It starts with the branch
    that has the highest index in the loop.
    """
    left = [int(number) for number in np.flatnonzero(loop)]
    steps: list[tuple[int, int]] = []
    number = left[-1]
    while left:
        left.remove(number)
        steps.append((number, int(loop[number])))
        at = _far_end(graph, *steps[-1])
        ahead = [other for other in left if _far_end(graph, other, -int(loop[other])) == at]
        number = ahead[0] if ahead else -1
    return tuple(steps)


def _far_end(graph: Graph, number: int, sign: int) -> str:
    branch = graph.branches[number]
    return branch.end if sign > 0 else branch.start
