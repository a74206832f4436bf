"""Links welded together behave like one link, and a weld transmits the section forces there."""

import fem_vibrating
import numpy as np
import pytest
from mechanisms import at_speed, six_bar, triad
from msgspec.structs import replace
from nonlinear import nonlinear_equilibrium
from second_routes import multiplier_forces

from elastic import PRIMARY, JointCompliance, Section, deflection, sample
from elastic.elastodynamics import elastodynamic
from elastic.vibration import natural_frequencies
from fem_check import compare, solve
from kinelast import shipped_scenes
from kinelast.designs import evaluate
from kinelast.scene.data import scene_motion
from kinelast.scene.document import document_from_text, scene_from_text
from kinelast.values.error import SceneError
from rigid import Beam, Link, Mechanism, MechanismError, PinDrive, PointLoad, Weld, drive_efforts, motion, reactions
from rigid.analysis import transmission_angles
from rigid.decomposition import assur_groups
from rigid.dynamics import Effort, forward, motion_during
from rigid.joints import WeldJoint
from rigid.topology import bar_graph, mechanism_mobility, mobility_count

MASS = 0.8
SECTION = Section(EA=2e6, EI=50.0)
TURN = np.exp(0.3j)  # from the axes of the first link to those of the second
STATIONS = np.linspace(0.0, 1.0, 5)
CRANK = (PinDrive("crank", "O"),)


def bars(name, points, *beams):
    return Link(name, points, tuple(Beam(*beam, MASS) for beam in beams))


def placed_in(turn, origin, **points):
    """Return points in the axes of a link at `origin` with direction `turn`."""
    return {name: (place - origin) / turn for name, place in points.items()}


def four_bar(*coupler, welds=()):
    """Return a four-bar with a corner K in its coupler A-K-B, drawn at a crank angle of 90 degrees."""
    links = (
        Link("ground", {"O": 0, "D": 0.35}),
        bars("crank", {"O": 0, "A": 0.06}, ("O", "A")),
        *coupler,
        bars("rocker", {"D": 0, "B": 0.22}, ("D", "B")),
    )
    reach, way = abs(CORNERED["B"]), 0.35 - 0.06j
    ahead = (reach**2 - 0.22**2 + abs(way) ** 2) / (2 * abs(way))
    B = 0.06j + way / abs(way) * (ahead + 1j * np.sqrt(reach**2 - ahead**2))
    turn = (B - 0.06j) / CORNERED["B"]
    drawing = {"O": 0, "D": 0.35, "A": 0.06j, "B": B, "K": 0.06j + turn / abs(turn) * CORNERED["K"]}
    return Mechanism(links, CRANK, drawing, gravity=-9.81j, welds=welds)


CORNERED = {"A": 0j, "K": 0.2 + 0j, "B": 0.25 + 0.15j}
WHOLE = bars("coupler", CORNERED, ("A", "K"), ("K", "B"))
HALVES = (
    bars("first", {"A": 0, "K": 0.2}, ("A", "K")),
    bars("second", placed_in(TURN, 0.2, K=0.2, B=0.25 + 0.15j), ("K", "B")),
)
FOUR_BARS = {
    "welded": four_bar(*HALVES, welds=(Weld("K", "second", "first", TURN),)),
    "welded the other way": four_bar(*HALVES, welds=(Weld("K", "first", "second", np.conj(TURN)),)),
}
ANGLES = np.pi / 2 + np.linspace(0, 2 * np.pi, 19)


def near(found, expected, share=1e-12):
    found, expected = np.asarray(found), np.asarray(expected)
    return np.abs(found - expected).max() <= share * np.abs(expected).max()


def answer(mechanism, drive=ANGLES, rate=30.0, section=SECTION, **more):
    return deflection(motion(mechanism, drive, rate), [section] * len(mechanism.beams), **more)


def same_fields(found, expected, share=1e-12):
    return all(near(sample(found, field, STATIONS), sample(expected, field, STATIONS), share) for field in PRIMARY)


def forces_by_name(bent):
    joints = bent.motion.structure.joints
    pairs = zip(joints, bent.forces.force, bent.forces.moment, strict=True)
    return {joint.name: (force, moment) for joint, force, moment in pairs}


class TestCoupler:
    @pytest.mark.parametrize("name", FOUR_BARS)
    def test_welded_links_move_and_bend_like_one_link(self, name):
        found, expected = answer(FOUR_BARS[name]), answer(four_bar(WHOLE))
        assert same_fields(found, expected)
        forces = forces_by_name(found)
        assert all(near(forces[joint][0], force) for joint, (force, _) in forces_by_name(expected).items())
        efforts = [drive_efforts(bent.motion, bent.forces) for bent in (found, expected)]
        assert near(*efforts)

    @pytest.mark.parametrize("name", FOUR_BARS)
    def test_the_weld_transmits_the_section_forces(self, name):
        bent = answer(FOUR_BARS[name])
        force, moment = forces_by_name(bent)["K"]
        joint = next(joint for joint in bent.motion.structure.joints if joint.name == "K")
        sign = 1 if bent.motion.mechanism.links[joint.child].name == "second" else -1
        at = 2  # beam K-B
        section = [sample(bent, field, [0.0])[at, :, 0] for field in ("N", "V", "M")]
        along = (
            np.exp(1j * np.angle(HALVES[1].points["B"])) * bent.motion.direction[bent.motion.mechanism.index["second"]]
        )
        assert near(sign * force, -along * (section[0] + 1j * -section[1]))
        assert near(sign * moment, -section[2])

    def test_positions_have_a_closed_form_like_a_dyad(self):
        found = motion(FOUR_BARS["welded"], ANGLES, 30.0)
        assert found.structure.closed_form
        angles = [transmission_angles(each)[0].angle for each in (found, motion(four_bar(WHOLE), ANGLES, 30.0))]
        assert near(*angles)

    def test_multipliers_give_the_same_forces(self):
        bent = motion(FOUR_BARS["welded"], ANGLES, 30.0)
        one, other = reactions(bent), multiplier_forces(bent)
        for pair in (*zip(one.force, other.force, strict=True), *zip(one.moment, other.moment, strict=True)):
            assert np.abs(np.subtract(*pair)).max() < 1e-12 * max(np.abs(force).max() for force in one.force)

    def test_natural_frequencies_are_equal(self):
        found, expected = (
            natural_frequencies(motion(each, ANGLES), [SECTION] * 4, 3, 4).omega
            for each in (FOUR_BARS["welded"], four_bar(WHOLE))
        )
        assert near(found, expected)

    def test_frequencies_by_finite_elements(self):
        moved = motion(FOUR_BARS["welded"], ANGLES[:2])
        ours = natural_frequencies(moved, [SECTION] * 4, 2, 2, tolerance=1e-6).omega
        assert near(fem_vibrating.natural_frequencies(moved, [SECTION] * 4, 8, 2), ours, 1e-3)

    def test_vibrations_are_equal(self):
        def steady(mechanism):
            period, motion_at = 2 * np.pi / 30.0, at_speed(mechanism, 30.0, np.pi / 2)
            return elastodynamic(motion_at(np.arange(8) * period / 8), motion_at, period, [SECTION] * 4, damping=1e-4)

        found, expected = steady(FOUR_BARS["welded"]), steady(four_bar(WHOLE))
        assert same_fields(found.deflection, expected.deflection, 1e-9)

    @pytest.mark.parametrize("name", FOUR_BARS)
    def test_finite_elements_agree(self, name):
        bent = answer(FOUR_BARS[name], ANGLES[:5])
        solution = solve(bent.motion, bent.sections)
        assert compare(bent, solution).passed
        moments = [tie.moment for tie in solution.ties if tie.name == "K" and np.ndim(tie.moment)]
        assert any(near(np.abs(moment), np.abs(forces_by_name(bent)["K"][1]), 1e-7) for moment in moments)

    def test_the_mobility_is_one(self):
        assert mobility_count(FOUR_BARS["welded"]) == 1
        found = mechanism_mobility(FOUR_BARS["welded"])
        assert (int(found.mobility), int(found.hyperstaticity)) == (1, 0)


DRIVE = PinDrive("base", "O")


def frame(*links, welds=(), drives=(DRIVE,), loads=(), **drawing):
    ground = Link("ground", {"O": 0, "P": 1.0})
    return Mechanism((ground, *links), drives, {"O": 0, "P": 1.0} | drawing, gravity=-9.81j, welds=welds, loads=loads)


def test_a_driven_link_of_two_parts():
    whole = bars("base", {"O": 0, "K": 0.5, "T": 0.5 + 0.3j}, ("O", "K"), ("K", "T"))
    halves = bars("base", {"O": 0, "K": 0.5}, ("O", "K")), bars("tip", {"K": 0, "T": 0.3}, ("K", "T"))
    found = frame(*halves, welds=(Weld("K", "tip", "base", 1j),))
    assert same_fields(answer(found, [0.0, 1.0]), answer(frame(whole), [0.0, 1.0]))


def test_three_links_at_one_point():
    whole = bars("base", {"O": 0, "K": 0.5, "T": 0.8, "S": 0.5 + 0.3j}, ("O", "K"), ("K", "T"), ("K", "S"))
    parts = (
        bars("base", {"O": 0, "K": 0.5}, ("O", "K")),
        bars("tip", {"K": 0, "T": 0.3}, ("K", "T")),
        bars("side", {"K": 0, "S": 0.3}, ("K", "S")),
    )
    expected = answer(frame(whole), [0.0, 1.0])
    stars = (Weld("K", "tip", "base"), Weld("K", "side", "base", 1j))
    chain = (Weld("K", "tip", "side", -1j), Weld("K", "base", "tip"))
    for welds in (stars, chain):
        bent = answer(frame(*parts, welds=welds), [0.0, 1.0])
        assert same_fields(bent, expected)
        assert compare(bent, solve(bent.motion, bent.sections)).passed


def triangle():
    """Return one triangular link of three beams, and the same triangle as three links welded at the corners."""
    corners = {"O": 0, "K": 0.4 + 0j, "T": 0.2 + 0.3j}
    sides = [("O", "K"), ("K", "T"), ("T", "O")]
    whole = bars("base", corners, *sides)
    names, links, turns = ("base", "second", "third"), [], []
    for name, (start, end) in zip(names, sides, strict=True):
        turn = (corners[end] - corners[start]) / abs(corners[end] - corners[start])
        links.append(
            bars(name, placed_in(turn, corners[start], **{start: corners[start], end: corners[end]}), (start, end))
        )
        turns.append(turn)
    welds = tuple(
        Weld(point, names[one], names[other], turns[one] / turns[other])
        for point, one, other in (("K", 1, 0), ("T", 2, 1), ("O", 0, 2))
    )
    return frame(whole, K=0.4, T=corners["T"]), frame(*links, welds=welds, K=0.4, T=corners["T"])


def test_a_ring_of_welds():
    whole, ring = triangle()
    drive = [0.0, 1.0]
    found, expected = answer(ring, drive), answer(whole, drive)
    assert [len(group.rings) for group in found.motion.structure.groups].count(1) == 1
    assert same_fields(found, expected)
    assert compare(found, solve(found.motion, found.sections)).passed


def test_a_pinned_ring_with_one_weld():
    """A triangle with pins at two corners and a weld at the third has a moment there only by bending."""
    _, ring = triangle()
    pinned = frame(*ring.links[1:], welds=ring.welds[:1], K=0.4, T=ring.drawing["T"])
    bent = answer(pinned, [0.0, 1.0])
    assert bent.motion.structure.surplus
    assert compare(bent, solve(bent.motion, bent.sections)).passed
    assert np.abs(forces_by_name(bent)["K"][1]).min() > 0


def test_a_beam_welded_to_the_ground_at_both_ends():
    """Handbook: F l^3/192EI in the middle, moments of F l/8 at the ends."""
    load = PointLoad("beam", "M", -100j)
    beam = bars("beam", {"O": 0, "M": 0.5, "P": 1.0}, ("O", "M"), ("M", "P"))
    crank = bars("base", {"O": 0, "A": 0.1}, ("O", "A"))
    welds = Weld("O", "beam", "ground"), Weld("P", "beam", "ground")
    held = Mechanism(
        (Link("ground", {"O": 0, "P": 1.0}), beam, crank),
        (DRIVE,),
        {"O": 0, "P": 1, "A": 0.1, "M": 0.5},
        loads=(load,),
        welds=welds,
    )
    bent = deflection(motion(held, [0.0]), [SECTION] * 3)
    assert sample(bent, "w", [1.0])[0, 0, 0] == pytest.approx(-100 / (192 * SECTION.EI), rel=1e-12)
    moments = [
        np.abs(m)
        for joint, m in zip(bent.motion.structure.joints, bent.forces.moment, strict=True)
        if not joint.freedoms
    ]
    assert np.allclose(moments, 100 / 8, rtol=1e-12)
    assert compare(bent, solve(bent.motion, bent.sections)).passed


def test_a_soft_weld_rotates_by_compliance_times_moment():
    parts = bars("base", {"O": 0, "K": 0.5}, ("O", "K")), bars("tip", {"K": 0, "T": 0.3}, ("K", "T"))
    mechanism = frame(*parts, welds=(Weld("K", "tip", "base"),))
    stiff, soft = (answer(mechanism, [0.0], joints=joints) for joints in ({}, {"K": JointCompliance(rotation=1e-3)}))
    moment = forces_by_name(stiff)["K"][1]
    turned = sample(soft, "phi", [0.0])[1] - sample(stiff, "phi", [0.0])[1]
    assert near(turned[:, 0], -1e-3 * moment * (1 if soft.motion.structure.joints[-1].child == 2 else -1))


def test_large_displacements_of_welded_beams():
    """A clamped arm of two welded parts sags like the arm of one part."""

    def arm(*links, welds=()):
        load = PointLoad(links[-1].name, "T", -2000j)
        drawing = {"O": 0, "K": 0.5, "T": 1.0}
        return Mechanism(
            (Link("ground", {"O": 0}), *links), (PinDrive("base", "O"),), drawing, loads=(load,), welds=welds
        )

    whole = arm(bars("base", {"O": 0, "K": 0.5, "T": 1.0}, ("O", "K"), ("K", "T")))
    halves = bars("base", {"O": 0, "K": 0.5}, ("O", "K")), bars("tip", {"K": 0, "T": 0.5j}, ("K", "T"))
    found, expected = (
        nonlinear_equilibrium(each, [SECTION] * 2, [lambda time: (0 * time,) * 3], np.linspace(0, 1, 5), 4)
        for each in (arm(*halves, welds=(Weld("K", "tip", "base", -1j),)), whole)
    )
    assert near(found.w[-1], expected.w[-1], 1e-9)


class TestFaults:
    PARTS = (bars("base", {"O": 0, "K": 0.5}, ("O", "K")), bars("tip", {"K": 0, "T": 0.3}, ("K", "T")))

    @pytest.mark.parametrize(
        ("weld", "words"),
        [
            (Weld("K", "tap", "base"), 'there is no link "tap"'),
            (Weld("T", "tip", "base"), 'link "base" has no point "T"'),
            (Weld("K", "tip", "tip"), "cannot be welded to itself"),
            (Weld("K", "tip", "base", 2.0), "its turn is not a unit vector"),
        ],
    )
    def test_wrong_names_are_errors(self, weld, words):
        with pytest.raises(MechanismError, match=words):
            frame(*self.PARTS, welds=(weld,))

    def test_a_drive_at_a_weld(self):
        with pytest.raises(MechanismError, match='welded at "K"'):
            motion(
                frame(*self.PARTS, welds=(Weld("K", "tip", "base"),), drives=(DRIVE, PinDrive("tip", "K", "base"))),
                [[0.0], [0.0]],
            )

    def test_the_same_weld_twice(self):
        welds = (Weld("K", "tip", "base"), Weld("K", "base", "tip"))
        with pytest.raises(MechanismError, match="welded 2 times"):
            frame(*self.PARTS, welds=welds)


def test_a_weld_is_symmetric_in_its_links():
    joint = next(joint for joint in motion(FOUR_BARS["welded"], [0.0]).structure.joints if isinstance(joint, WeldJoint))
    other = joint.exchanged()
    assert (other.owner, other.block) == (joint.owner, joint.block)
    here = motion(FOUR_BARS["welded"], ANGLES)
    assert np.abs(other.rotation_gap(here)).max() < 1e-14
    assert near(other.child_place(here, 0.0)[0], here.origin[joint.parent])


SCENE = """
[materials.steel]
E = "210 GPa"
density = 7850
[sections.bar]
shape = "rectangle"
depth = "10 mm"
width = "6 mm"
[points]
O = [0, 0]
A = [0, 0.06]
K = [0.18, 0.12]
B = [0.26, 0.21]
D = [0.35, 0]
[links]
ground = { points = ["O", "D"] }
crank = { points = ["O", "A"], section = "bar", material = "steel" }
rocker = { points = ["D", "B"], section = "bar", material = "steel" }
{COUPLER}
[[drives]]
link = "crank"
speed = "60 rad/s"
[run]
positions = 12
gravity = [0, -9.81]
"""
HALF = 'section = "bar", material = "steel" }'
WELDED = f'first = {{ points = ["A", "K"], {HALF}\nsecond = {{ points = ["K", "B"], {HALF}\n'
ENTIRE = f'coupler = {{ points = ["A", "K", "B"], beams = [["A", "K"], ["K", "B"]], {HALF}'


def scene(coupler, *more):
    return scene_from_text("\n".join((SCENE.replace("{COUPLER}", coupler), *more)))


class TestScene:
    def test_links_are_welded_as_drawn(self):
        made = [scene(WELDED, "[welds.K]"), scene(WELDED, '[welds.K]\nlinks = ["second", "first"]'), scene(ENTIRE)]
        found, other, expected = (deflection(scene_motion(each), each.sections, each.joints) for each in made)
        order = [0, 1, 2, 3]
        for bent in (found, other):
            for field in PRIMARY:
                one, whole = (sample(each, field, STATIONS) for each in (bent, expected))
                assert near(one[order], whole)

    def test_designs_are_welded_as_drawn(self):
        values = [[0.12], [0.14]]
        found, expected = (
            evaluate(document_from_text(SCENE.replace("{COUPLER}", coupler) + more), ["points.K.y"], values)
            for coupler, more in ((WELDED, "[welds.K]"), (ENTIRE, ""))
        )
        assert list(found.reason) == ["", ""]
        for name in ("deflection", "joint_force", "drive_effort"):
            assert near(found.columns[name], expected.columns[name])

    @pytest.mark.parametrize(
        ("table", "words"),
        [
            ("[welds.Q]", 'no point "Q"'),
            ("[welds.A]\nlinks = ['first', 'rocker']", 'the link "rocker" has no point "A"'),
            ("[welds.K]\nlinks = ['first', 'furst']", 'did you mean "first"'),
            ("[welds.K]\nlinks = ['first', 'first']", "is listed 2 times"),
            ("[welds.D]\n[joints.D]\nfriction = 0.1\nradius = 0.01", "welded here: no friction"),
        ],
    )
    def test_wrong_welds_are_errors(self, table, words):
        with pytest.raises(SceneError, match=words):
            scene(WELDED + "", table)


def test_groups_of_welded_links_are_named():
    links = bars("base", {"P": 0, "O": -1}, ("P", "O")), bars("arm", {"O": 0, "T": 0.3}, ("O", "T"))
    ground = Link("ground", {"P": 1.0})
    held = Mechanism(
        (ground, *links),
        (PinDrive("arm", "O", "base"),),
        {"P": 1, "O": 0, "T": 0.3},
        welds=(Weld("P", "base", "ground"),),
    )
    assert [group.name for group in assur_groups(held)] == ["welded link", "driven link"]
    assert [group.name for group in assur_groups(FOUR_BARS["welded"])] == ["driven link", "dyad RRR, class II"]
    _, ring = triangle()
    assert assur_groups(ring)[-1].name == "overconstrained link, 3 redundant constraints"
    assert mobility_count(ring) == 1 - 3
    assert int(mechanism_mobility(ring).mobility) == 1
    bodies = bar_graph(FOUR_BARS["welded"]).branches
    assert [(bar.start, bar.end) for bar in bodies] == [("O", "D"), ("O", "A"), ("A", "B"), ("D", "B")]


def cut_in_two(mechanism, name):
    """Return a mechanism whose last beam of a link is a new link, welded to the rest."""
    link = mechanism.links[mechanism.index[name]]
    last = link.beams[-1]
    rest = {point for beam in link.beams[:-1] for point in (beam.start, beam.end)}
    at, tip = (last.start, last.end) if last.start in rest else (last.end, last.start)
    own = placed_in(TURN, link.points[at], **{at: link.points[at], tip: link.points[tip]})
    lumps = tuple(replace(lump, offset=lump.offset / TURN) for lump in link.lumps if lump.point == tip)
    parts = (
        replace(
            link,
            points={point: place for point, place in link.points.items() if point != tip},
            beams=link.beams[:-1],
            lumps=tuple(lump for lump in link.lumps if lump.point != tip),
        ),
        Link("cut off", own, (last,), lumps),
    )
    links = (*(parts[0] if each is link else each for each in mechanism.links), parts[1])
    return Mechanism(
        links, mechanism.drives, mechanism.drawing, gravity=mechanism.gravity, welds=(Weld(at, "cut off", name, TURN),)
    )


@pytest.mark.parametrize(("make", "name"), [(six_bar, "coupler"), (triad, "plate")])
def test_larger_mechanisms_with_a_divided_link(make, name):
    case = make()
    whole = replace(case.mechanism, loads=(), friction={})
    cut = cut_in_two(whole, name)
    ends = [[(beam.start, beam.end) for _, beam in each.beams] for each in (whole, cut)]
    order = [ends[1].index(pair) for pair in ends[0]]
    sections = [case.sections[ends[0].index(pair)] for pair in ends[1]]
    expected = deflection(motion(whole, case.drive, case.rate, case.rate2), case.sections)
    bent = deflection(motion(cut, case.drive, case.rate, case.rate2), sections)
    for field in PRIMARY:
        assert near(sample(bent, field, STATIONS)[order], sample(expected, field, STATIONS))


def test_forward_dynamics_of_welded_links():
    def course(mechanism):
        return motion_during(forward(mechanism, [Effort(0.5)], np.pi / 2, 0.0, 0.2), np.linspace(0, 0.2, 5)).drive

    assert near(course(FOUR_BARS["welded"]), course(four_bar(WHOLE)), 1e-9)


@pytest.mark.slow
def test_a_weld_that_closes_no_dyad_is_an_error():
    """One joint of the dyad lies on the centre of the other, so that rotation about it has no effect."""
    text = shipped_scenes()["flapping_wing"].read_text(encoding="utf-8") + "\n[welds.c]\n"
    scene = scene_from_text(text)
    with pytest.raises((SceneError, MechanismError), match="cannot be assembled"):
        scene_motion(scene, 2)
