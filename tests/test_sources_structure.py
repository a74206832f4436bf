"""The systems of the course chapter on structure, as scenes without dimensions of machines."""

import pytest

from kinelast.cli.command import main
from kinelast.scene.document import read_scene
from kinelast.structure.output import read_structure
from kinelast.tasks.task import shipped_structures
from kinelast.values.error import SceneError
from rigid.topology import (
    Action,
    cyclomatic_number,
    force_law,
    link_graph,
    mechanism_mobility,
    mobility,
    mobility_count,
    spatial_chain,
    velocity_law,
)


def structure(name):
    return read_structure(shipped_structures()[name])


@pytest.mark.parametrize(
    ("name", "links", "joints", "loops", "count", "m", "h"),
    [
        ("shear", 4, 4, 1, 1, 1, 0),
        ("vise_grips", 4, 4, 1, 1, 1, 0),
        ("car_hood", 6, 7, 2, 1, 1, 0),
        ("nacelle", 11, 13, 3, 4, 4, 0),  # N_c = 13 - 11 + 1; turret, two cylinders, platform
        ("rolling_wheels", 3, 3, 1, 0, 1, 1),  # the criterion is wrong here
    ],
)
def test_counts_of_planar_mechanisms(name, links, joints, loops, count, m, h):
    scene = structure(name)
    mechanism, contacts = scene.mechanism, scene.contacts
    graph = link_graph(mechanism, contacts)
    assert (len(graph.nodes), len(graph.branches), cyclomatic_number(graph)) == (links, joints, loops)
    assert mobility_count(mechanism, contacts) == count
    found = mechanism_mobility(mechanism, contacts)
    assert (int(found.mobility), int(found.hyperstaticity)) == (m, h)
    assert len(mechanism.drives) == m


def test_the_cycles_of_the_nacelle_are_those_of_the_text():
    graph = link_graph(structure("nacelle").mechanism)
    ends = {frozenset((branch.start, branch.end)) for branch in graph.branches}
    names = ["ground", "turret", "boom", "arm", "cylinder5", "piston6", "cylinder7", "piston8", "strut9", "lever10"]
    number = {name: k for k, name in enumerate([*names, "platform"], 1)}
    pairs = {frozenset(number[name] for name in pair) for pair in ends}
    for cycle in ((2, 3, 6, 5), (3, 7, 8, 10), (3, 10, 8, 9, 4)):
        assert all(frozenset(pair) in pairs for pair in zip(cycle, (*cycle[1:], cycle[0]), strict=True))
    assert all(frozenset(pair) in pairs for pair in ((1, 2), (2, 3), (3, 4), (4, 11)))


def test_screw_and_nut():
    # r_c = 2, m = 1, h = 4; the index is I_c - E_q = 3 - 6 (printed 6 - 3); lambda' = -p alpha'.
    chain = spatial_chain(structure("screw_and_nut").joints, "support")
    found = mobility(chain)
    assert (int(found.kinematic_rank), int(found.mobility), int(found.hyperstaticity)) == (2, 1, 4)
    assert found.sides_agree
    assert found.index == found.kinematic_unknowns - found.kinematic_equations == -3
    assert velocity_law(chain, ["P"], ["G"])[0, 0] == pytest.approx(1e-3, rel=1e-12)


def test_a_gear_shaft_transmits_the_printed_ratio():
    # r_s = 5, m = 1, h = 1; with D below the shaft F_m R = F_r r (printed with a sine instead of the cosine).
    scene = structure("gear_shaft")
    chain = spatial_chain(scene.joints, scene.fixed)
    found = mobility(chain)
    assert (int(found.static_rank), int(found.mobility), int(found.hyperstaticity)) == (5, 1, 1)
    assert (found.static_unknowns, found.static_equations, found.sides_agree) == (6, 6, True)
    R, r, c, d = 0.05, 0.03, 0.02, 0.07
    cos, sin = 0.9396926207859084, 0.3420201433256687  # 20 deg
    motor = Action("motor", "shaft", (c, R, 0), (0, -sin, cos))
    receiver = Action("receiver", "shaft", (d, 0, -r), (0, -cos, sin))
    assert abs(force_law(chain, [motor, receiver], ["receiver"], ["motor"])[0, 0]) == pytest.approx(r / R, rel=1e-12)


@pytest.mark.parametrize("name", sorted(shipped_structures()))
def test_the_command_reports_their_structure(name, tmp_path, capsys):
    assert main([name, "--structure", "-o", str(tmp_path)]) == 0
    output = capsys.readouterr().out
    scene = structure(name)
    assert scene.title in output
    assert "mobility m = " in output
    files = {entry.name for entry in (tmp_path / name).iterdir()}
    assert files == {"structure.txt", "summary.json"} | ({"skeleton.svg"} if scene.mechanism else set())
    assert (tmp_path / name / "structure.txt").read_text() in output


@pytest.mark.parametrize("name", sorted(shipped_structures()))
def test_they_name_their_source_and_are_not_accepted_as_machines(name, tmp_path, capsys):
    assert "Course chapter" in structure(name).source
    with pytest.raises(SceneError, match="use --structure"):
        read_scene(shipped_structures()[name])
    assert main([name, "-o", str(tmp_path)]) == 2
    assert "--structure" in capsys.readouterr().err
