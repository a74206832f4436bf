"""Each link closes its joints, stays on the drawn branch, and has the right velocities.

References are the drawing, closed forms, and derivatives of Fourier series of the positions.
"""

import re

import numpy as np
import pytest
from mechanisms import (
    ALL,
    DYADS,
    bar,
    double_rocker,
    four_bar,
    inverted_slider_crank,
    motion_of,
    replaced,
    scaled,
    scotch_yoke,
    six_bar,
    slider_crank,
    steel_four_bar,
    turn,
    with_link,
)
from tiers import in_tiers

from rigid import (
    Beam,
    LineLoad,
    Link,
    Lump,
    Mechanism,
    MechanismError,
    PinDrive,
    PointLoad,
    Slider,
    SliderDrive,
    acceleration_of,
    motion,
    position_of,
    structure,
    velocity_of,
)
from rigid.analysis import ReachError, reachable, require_reach, stops

FULL_TURN = {name: make for name, make in ALL.items() if np.ptp(make().drive[0]) > 6 and name != "triad"}
EPS = np.finfo(float).eps


def along(slider, going):
    """Return the direction of a slider's line and the vector from the line's origin to the sliding point."""
    on, link = (going.mechanism.index[name] for name in (slider.on, slider.link))
    line = going.direction[on] * slider.direction
    return line, position_of(going, link, slider.point) - position_of(going, on, slider.origin)


@pytest.mark.parametrize("name", ALL)
class TestJointsClose:
    def test_links_with_a_common_point_meet_there(self, name):
        going = motion_of(ALL[name]())
        spots = {}
        for at, link in enumerate(going.mechanism.links):
            for point in link.points:
                spots.setdefault(point, []).append(position_of(going, at, point))
        for places in spots.values():
            for place in places:
                np.testing.assert_allclose(place, places[0], rtol=0, atol=1e-14)

    def test_links_keep_their_shape(self, name):
        np.testing.assert_allclose(abs(motion_of(ALL[name]()).direction), 1, rtol=0, atol=8 * EPS)

    def test_sliders_stay_on_their_line_without_rotation(self, name):
        going = motion_of(ALL[name]())
        for slider in going.mechanism.sliders:
            line, way = along(slider, going)
            np.testing.assert_allclose((np.conj(line) * way).imag, 0, rtol=0, atol=1e-14)
            on, link = (going.mechanism.index[end] for end in (slider.on, slider.link))
            np.testing.assert_allclose(going.direction[link], going.direction[on] * slider.turn, rtol=0, atol=1e-14)

    def test_drives_have_their_coordinates(self, name):
        going = motion_of(ALL[name]())
        index = going.mechanism.index
        for coordinate, drive in zip(going.drive, going.mechanism.drives, strict=True):
            if isinstance(drive, PinDrive):
                turned = going.direction[index[drive.link]] / going.direction[index[drive.on]]
                np.testing.assert_allclose(turned, np.exp(1j * coordinate), rtol=0, atol=1e-14)
            else:
                line, way = along(next(s for s in going.mechanism.sliders if s.name == drive.slider), going)
                np.testing.assert_allclose((np.conj(line) * way).real, coordinate, rtol=0, atol=1e-14)


@pytest.mark.parametrize("name", [name for name in ALL if name not in ("arm", "arm, motor turned about")])
def test_the_drawn_coordinate_reproduces_the_drawing(name):
    """The branch follows the drawing, and so does each link with a single drawn point."""
    mechanism = ALL[name]().mechanism
    place = mechanism.drawing
    drive = mechanism.drives[0]
    if isinstance(drive, SliderDrive):
        slider = mechanism.sliders[0]
        coordinate = (np.conj(slider.direction) * (place["B"] - slider.origin)).real
    elif name == "PRP":
        # the arm has one drawn point: its slider's line, 0.02i + x e^(0.1i) in local axes, passes through P
        distance, off = abs(place["P"]), (np.exp(-0.1j) * 0.02j).imag
        coordinate = np.angle(place["P"]) - np.arcsin(off / distance) - 0.1
    else:
        coordinate = np.angle(place["A"] - place["O"])
    going = motion(mechanism, [coordinate])
    for link in mechanism.links:
        for point in link.points:
            if point in place:
                assert abs(position_of(going, link.name, point)[0] - place[point]) < 1e-14, f"{link.name} {point}"


class TestClosedForms:
    def test_slider_crank(self):
        """x = r cos + sqrt(l^2 - r^2 sin^2) (Norton, Design of Machinery, chapter 4, offset 0)."""
        r, L = 0.1, 0.35
        case = slider_crank(r, L, offset=0.0, slope=0.0)
        angle = case.drive[0]
        expected = r * np.cos(angle) + np.sqrt(L**2 - (r * np.sin(angle)) ** 2)
        np.testing.assert_allclose(position_of(motion_of(case), "block", "B"), expected, rtol=1e-14, atol=1e-15)

    def test_four_bar(self):
        """Freudenstein: K1 cos t4 - K2 cos t2 + K3 = cos(t2 - t4) (Norton, chapter 4)."""
        a, b, c, d = 0.1, 0.3, 0.25, 0.35
        going = motion_of(steel_four_bar(48))
        t2, t4 = (np.angle(going.direction[at]) for at in (1, 3))
        K3 = (a**2 - b**2 + c**2 + d**2) / (2 * a * c)
        np.testing.assert_allclose(d / a * np.cos(t4) - d / c * np.cos(t2) + K3, np.cos(t2 - t4), rtol=0, atol=1e-13)

    def test_quick_return(self):
        """A slotted lever about D points at the crank pin: tan = r sin/(d + r cos), with D below the crank's centre."""
        r, base = 0.1, -0.3
        case = inverted_slider_crank(r, base, lean=0.0, foot=0.0)
        rocker = motion_of(case).direction[3]
        angle = case.drive[0]
        expected = np.arctan2(r * np.sin(angle), -base + r * np.cos(angle))
        np.testing.assert_allclose(np.angle(rocker), expected, rtol=0, atol=1e-14)

    def test_scotch_yoke(self):
        """A straight slot gives simple harmonic motion: acceleration -w^2 r cos."""
        r, w = 0.1, 7.0
        links = (
            Link("ground", {"O": 0.0}),
            Link("crank", {"O": 0.0, "A": r}),
            Link("block", {"A": 0.0}),
            Link("yoke", {"Y": 0.0}),
        )
        sliders = (Slider("rail", "yoke", "ground", "Y", 0.0, 1.0), Slider("slot", "block", "yoke", "A", 0.0, 1j))
        mechanism = Mechanism(links, (PinDrive("crank", "O"),), {"O": 0, "A": r, "Y": r}, sliders)
        going = motion(mechanism, turn(16), w)
        np.testing.assert_allclose(position_of(going, "yoke", "Y"), r * np.cos(turn(16)), rtol=0, atol=1e-16)
        expected = -(w**2) * r * np.cos(turn(16))
        np.testing.assert_allclose(acceleration_of(going, "yoke", "Y"), expected, rtol=0, atol=1e-14)

    def test_parallelogram(self):
        """The coupler of a parallelogram does not rotate."""
        links = (Link("ground", {"O": 0.0, "D": 0.3}), *(bar(*ends) for ends in [("left", "O", "A", 0.1)]))
        links += (bar("top", "A", "B", 0.3), bar("right", "D", "B", 0.1))
        mechanism = Mechanism(links, (PinDrive("left", "O"),), {"O": 0, "A": 0.1j, "B": 0.3 + 0.1j, "D": 0.3})
        going = motion(mechanism, np.linspace(0.3, 2.8, 9), 5.0)
        np.testing.assert_allclose(going.direction[2], 1, rtol=0, atol=1e-15)
        np.testing.assert_allclose(going.angular_velocity[2], 0, rtol=0, atol=1e-14)


def derivative(values, rate):
    """Return the derivative of periodic values over a turn by their Fourier series."""
    n = len(values)
    order = np.fft.fftfreq(n, 1 / n)
    return np.fft.ifft(1j * order * rate * np.fft.fft(values))


@pytest.mark.parametrize("name", FULL_TURN)
def test_velocities_and_accelerations_are_derivatives(name):
    """Over a turn at constant rate the series converges to round-off."""
    count, rate = 256, 3.0
    mechanism = FULL_TURN[name]().mechanism
    drive = np.stack([turn(count)] + [0.4 * np.sin(turn(count))] * (len(mechanism.drives) - 1))
    rates = np.stack([np.full(count, rate)] + [0.4 * rate * np.cos(turn(count))] * (len(mechanism.drives) - 1))
    rates2 = np.stack([np.zeros(count)] + [-0.4 * rate**2 * np.sin(turn(count))] * (len(mechanism.drives) - 1))
    going = motion(mechanism, drive, rates, rates2)
    for at, link in enumerate(mechanism.links):
        for point in link.points:
            place, speed = position_of(going, at, point), velocity_of(going, at, point)
            near = {"rtol": 0, "atol": 1e-11}
            np.testing.assert_allclose(speed, derivative(place, rate), **near)
            np.testing.assert_allclose(acceleration_of(going, at, point), derivative(speed, rate), **near)
        spin = derivative(going.direction[at], rate) / (1j * going.direction[at])
        np.testing.assert_allclose(going.angular_velocity[at], spin, rtol=0, atol=1e-10)
        growth = derivative(going.angular_velocity[at], rate)
        np.testing.assert_allclose(going.angular_acceleration[at], growth, rtol=0, atol=1e-9)


@pytest.mark.parametrize("name", DYADS)
def test_newton_agrees_with_the_closed_form(name, monkeypatch):
    case = DYADS[name](count=90)
    closed = motion_of(case)
    monkeypatch.setattr("rigid.decomposition.groups.Group.closed_form", property(lambda group: not group.free))
    general = motion_of(case)
    for field in ("origin", "direction", "velocity", "acceleration", "angular_velocity", "angular_acceleration"):
        expected = getattr(closed, field)
        np.testing.assert_allclose(getattr(general, field), expected, rtol=0, atol=1e-12 * (1 + abs(expected).max()))
    assert (general.sine >= closed.sine / 2).all()
    assert (general.sine <= closed.sine * 1.005).all()


def test_designs_of_a_general_group_equal_single_ones():
    """One bar of the triad has three lengths."""
    case = ALL["triad"]()
    length = case.mechanism.links[case.mechanism.index["left"]].points["P"]
    sizes = np.array([[0.99], [1.0], [1.01]]) * length

    def moving(value):
        return motion(with_link(case.mechanism, bar("left", "A", "P", value)), case.drive, 7.0, -3.0)

    together = moving(sizes)
    assert together.columns == (3, 24)
    for row, size in enumerate(sizes[:, 0]):
        alone = moving(size)
        for field in ("origin", "direction", "velocity", "acceleration"):
            values = getattr(alone, field)
            near = 1e-11 * (1 + abs(values).max())
            np.testing.assert_allclose(getattr(together, field)[:, row], values, rtol=0, atol=near)


@pytest.mark.parametrize("name", ["RRR", "RRP", "RPR"])
@pytest.mark.parametrize("ahead", [1.5, 3.0, -2.5])
def test_newton_starts_from_the_drawing(name, ahead, monkeypatch):
    """A single position far from the drawing is on the drawn branch."""
    case = DYADS[name]()
    closed = motion(case.mechanism, case.drive[:, :1] + ahead)
    monkeypatch.setattr("rigid.decomposition.groups.Group.closed_form", property(lambda group: not group.free))
    general = motion(case.mechanism, case.drive[:, :1] + ahead)
    np.testing.assert_allclose(general.direction, closed.direction, rtol=0, atol=1e-12)


@pytest.mark.parametrize("name", in_tiers(DYADS, 2, 3))
def test_the_condition_by_newton_has_no_unit(name, monkeypatch):
    case = DYADS[name](count=9)
    monkeypatch.setattr("rigid.decomposition.groups.Group.closed_form", property(lambda group: not group.free))
    metres = motion_of(case)
    millimetres = motion(scaled(case.mechanism, 1000.0), case.drive, case.rate, case.rate2)
    np.testing.assert_allclose(millimetres.condition, metres.condition, rtol=1e-10)


class TestBranches:
    @pytest.mark.parametrize("make", [four_bar, slider_crank])
    def test_each_side_is_kept_over_the_turn(self, make):
        left, right = (motion_of(make(side=side)) for side in (1.0, -1.0))
        link = 2 if make is four_bar else 3
        assert (
            abs(left.origin[link] - right.origin[link]) + abs(left.direction[link] - right.direction[link])
        ).min() > 0.1

    def test_a_general_group_keeps_its_branch_far_from_the_drawing(self):
        case = ALL["triad"](count=120)
        whole = motion_of(case)
        later = motion(case.mechanism, case.drive[:, 60:], 7.0, -3.0)
        np.testing.assert_allclose(later.origin, whole.origin[:, 60:], rtol=0, atol=1e-13)

    def test_a_flat_drawing_is_ambiguous(self):
        case = four_bar()
        flat = replaced(case.mechanism, drawing={"O": 0, "A": 0.1, "B": 0.2, "D": 0.4})
        with pytest.raises(MechanismError, match=r'"D", "A", "B" are drawn in line.*move the drawing'):
            motion(flat, [0.0])

    def test_flatness_does_not_depend_on_the_unit(self):
        """A mechanism that folds by a tenth of its size is not flat at any scale; one that folds by 1e-10 is."""
        for size in (1e-6, 1.0, 1e6):
            links = (
                Link("ground", {"O": 0.0, "D": 4 * size}),
                *(bar(*ends) for ends in (("a", "O", "A", size), ("b", "A", "B", 3 * size), ("c", "D", "B", 3 * size))),
            )
            drawn = {"O": 0.0, "A": size, "B": (2.5 + 1e-4j) * size, "D": 4 * size}
            mechanism = Mechanism(links, (PinDrive("a", "O"),), drawn)
            assert position_of(motion(mechanism, [0.1]), "b", "B")[0].imag > 0
            with pytest.raises(MechanismError, match="in line"):
                motion(replaced(mechanism, drawing=drawn | {"B": (2.5 + 1e-10j) * size}), [0.1])


class TestCondition:
    def test_of_a_four_bar_follows_from_the_transmission_angle(self):
        """cos mu = (b^2 + c^2 - |AD|^2)/(2 b c) (Norton, chapter 4, transmission angles); condition 1/sin^2 mu."""
        going = motion_of(steel_four_bar(24))
        square = abs(position_of(going, "crank", "A") - 0.35) ** 2
        cosine = (0.3**2 + 0.25**2 - square) / (2 * 0.3 * 0.25)
        np.testing.assert_allclose(going.condition, 1 / (1 - cosine**2), rtol=1e-13)

    def test_of_a_slider_crank_follows_from_the_rod_angle(self):
        case = slider_crank(0.1, 0.3, 0.0, 0.0)
        sine = 0.1 * np.sin(case.drive[0]) / 0.3
        np.testing.assert_allclose(motion_of(case).condition, 1 / (1 - sine**2), rtol=1e-13)

    def test_of_a_moving_parallelogram(self):
        """A motion of the crank's tip across the coupler would rotate the rocker 1/s times as fast."""
        mechanism = four_bar(0.1, 0.3, 0.1, 0.3).mechanism
        drive = [0.3, 0.7, 2.2]
        np.testing.assert_allclose(motion(mechanism, drive, 5.0).condition, 1 / np.sin(drive) ** 3, rtol=1e-12)
        np.testing.assert_allclose(motion(mechanism, drive).condition, 1 / np.sin(drive) ** 2, rtol=1e-12)

    def test_is_infinite_if_links_align(self):
        """The crank is as long as the base minus coupler and rocker: stretched at angle pi."""
        mechanism = four_bar(0.25, 0.5, 0.25, 0.5).mechanism
        assert motion(mechanism, [np.pi]).condition[0] == np.inf


class TestReach:
    """Links 0.3, 0.2 and 0.25 on a base of 0.4: the crank stops with coupler and rocker in line, |AD| = 0.45."""

    LIMIT = np.arccos((0.3**2 + 0.4**2 - 0.45**2) / (2 * 0.3 * 0.4))

    def moved(self, angles, *rates):
        return motion(double_rocker(0.9), angles, *rates)

    def test_where_it_stops(self):
        going = self.moved(np.linspace(0.5, 2.5, 41), 1.0)
        assert reachable(going).sum() == np.count_nonzero(going.drive[0] < self.LIMIT)
        [(coordinate, joint)] = stops(going)
        assert coordinate[0] == pytest.approx(self.LIMIT, rel=1e-14)
        assert joint == "B"

    @pytest.mark.parametrize(
        ("angles", "words"),
        [
            # Tips 0.3 apart from a base of 0.4 at a right angle are 0.5 apart: coupler 0.2 and rocker 0.25 do not meet.
            (
                [np.pi / 2],
                '"B" is out of reach at every position: "A" and "D" are 0.5 m apart, '
                "the links between them reach from 0.05 to 0.45 m",
            ),
            ([np.pi / 2, np.pi], f'to any position, it stops at "crank" at {np.degrees(LIMIT):.6g} deg: the joint "B"'),
            (np.linspace(0.5, 2.5, 41), f'"crank" at {np.degrees(LIMIT):.6g} deg, where the joint "B" opens'),
        ],
    )
    def test_the_message_names_the_joint_and_the_limit(self, angles, words):
        with pytest.raises(ReachError, match=re.escape(words)):
            require_reach(self.moved(angles))

    def test_a_rod_too_short_for_its_line_is_reported_with_its_length(self):
        words = '"A" is 0.2 m from the line of "guide", the link between them is 0.15 m long'
        with pytest.raises(ReachError, match=re.escape(words)):
            require_reach(motion(slider_crank(0.2, 0.15, 0.0, 0.0).mechanism, [np.pi / 2]))

    def test_positions_in_reach_are_kept(self):
        going = self.moved([0.5, 2.5, 1.0], 1.0)
        assert np.isfinite(going.origin[:, [0, 2]]).all()
        assert np.isnan(going.origin[3, 1]) or np.isnan(going.direction[3, 1])
        assert np.isnan(going.condition[1])

    def test_a_mechanism_that_is_never_assembled_names_the_joint(self):
        never = with_link(four_bar(coupler=0.6, rocker=0.5, loads=()).mechanism, bar("rocker", "D", "B", 0.05))
        with pytest.raises(ReachError, match=r'cannot be assembled: the joint "B" is out of reach at every position'):
            require_reach(motion(never, turn(12)))

    def test_within_reach_nothing_is_raised(self):
        require_reach(motion_of(four_bar()))


def named(beam="B", lump="B"):
    """Return a ground and a bar, with the given names of the beam's end and the lump's point."""
    return (Link("ground", {"O": 0.0}), Link("bar", {"A": 0.0, "B": 1.0}, (Beam("A", beam),), (Lump(lump, 1.0),)))


class TestMistakes:
    """Each message is raised once, for a suitable mechanism."""

    def of(self, *, links=None, drives=None, sliders=(), drawing=None, loads=()):
        base = (
            Link("ground", {"O": 0.0, "D": 0.4}),
            bar("crank", "O", "A", 0.1),
            bar("coupler", "A", "B", 0.3),
            bar("rocker", "D", "B", 0.3),
        )
        drawing = drawing or {"O": 0.0, "A": 0.1j, "B": 0.28 + 0.25j, "D": 0.4, "E": 0.3 + 0.1j}
        drives = (PinDrive("crank", "O"),) if drives is None else drives
        mechanism = Mechanism(links or base, drives, drawing, sliders, loads=loads)
        return motion(mechanism, [0.3] * len(drives))

    def links(self, **more):
        base = {"ground": {"O": 0.0, "D": 0.4}, "crank": {"O": 0, "A": 0.1}, "coupler": {"A": 0, "B": 0.3}}
        base |= {"rocker": {"D": 0, "B": 0.3}}
        return tuple(Link(name, points) for name, points in (base | more).items() if points is not None)

    @pytest.mark.parametrize(
        ("words", "change"),
        [
            ('no link is named "ground"', {"links": (Link("base", {"O": 0}),)}),
            ("two links have the same name", {"links": (Link("ground", {"O": 0}), Link("ground", {"O": 0}))}),
            ('links "crank", "coupler", "rocker" are left with 1 freedom', {"drives": ()}),
            ('two drives move the joint "O"', {"drives": (PinDrive("crank", "O"), PinDrive("crank", "O"))}),
            ('drive of "crank" on "rocker": they share no pin "O"', {"drives": (PinDrive("crank", "O", "rocker"),)}),
            ('beam "A"-"X" of "bar": link "bar" has no point "X"', {"links": named(beam="X")}),
            ('beam "A"-"A" of "bar" has no length', {"links": named(beam="A")}),
            ('a lump: link "bar" has no point "X"', {"links": named(lump="X")}),
            ('slider "rail": there is no link "table"', {"sliders": (Slider("rail", "table", "ground", "A", 0, 1),)}),
            (
                'slider "rail": link "crank" has no point "X"',
                {"sliders": (Slider("rail", "crank", "ground", "X", 0, 1),)},
            ),
            ('a load: there is no link "bat"', {"loads": (PointLoad("bat", "A", 1.0),)}),
            ('a load: link "crank" has no point "X"', {"loads": (PointLoad("crank", "X", 1.0),)}),
            ('beam 1 of "crank", which has 1 beam', {"loads": (LineLoad("crank", 1, 1.0, 1.0),)}),
            ('a line load on "ground", which does not move', {"loads": (LineLoad("ground", 0, 1.0, 1.0),)}),
            ('drive of slider "rail": there is no such slider', {"drives": (SliderDrive("rail"),)}),
        ],
    )
    def test_each_mistake_has_its_message(self, words, change):
        with pytest.raises(MechanismError, match=re.escape(words)):
            self.of(**change)

    @pytest.mark.parametrize(
        "change",
        [
            {"ground": {"O": 0, "D": 0.4, "E": 0.3}, "coupler": {"A": 0, "B": 0.3, "E": 0.15 + 0.1j}},
            {
                "coupler": {"A": 0, "B": 0.3, "E": 0.15},
                "third": {"F": 0, "E": 0.2},
                "ground": {"O": 0, "D": 0.4, "F": 0.2},
            },
            {"crank": {"O": 0, "A": 0.1, "K": 0.05}, "ground": {"O": 0, "D": 0.4, "K": 0.05}},
            {"rocker": {"A": 0, "B": 0.3, "D": 0.2}, "coupler": {"A": 0, "B": 0.3}},
        ],
        ids=["a coupler pinned to the ground", "a third crank", "a crank with two pins", "a doubled link"],
    )
    def test_redundant_links_that_do_not_fit(self, change):
        answers = "does not close|cannot be assembled|overconstrained|held|too many|are locked"
        with pytest.raises(MechanismError, match=answers):
            require_reach(self.of(links=self.links(**change)))

    def test_drives_that_fight(self):
        with pytest.raises(MechanismError, match=r"too many drives|does not close|cannot be assembled"):
            require_reach(self.of(drives=(PinDrive("crank", "O"), PinDrive("rocker", "D"))))

    def test_points_drawn_in_one_place(self):
        mechanism = with_link(slider_crank().mechanism, Link("block", {"B": 0.0, "E": 0.1}))
        drawing = mechanism.drawing | {"E": mechanism.drawing["B"]}
        with pytest.raises(MechanismError, match='link "block": points "B" and "E" coincide'):
            motion(replaced(mechanism, drawing=drawing), [0.4])

    def test_coordinates_for_another_number_of_drives(self):
        case = ALL["arm"]()
        with pytest.raises(MechanismError, match=r"3 drive coordinates were given for 2 drive"):
            motion(case.mechanism, np.zeros((3, 4)))
        with pytest.raises(MechanismError, match=r"4 drive coordinates were given for 2 drive"):
            motion(case.mechanism, np.zeros(4))


def test_order_of_links_and_points_does_not_matter():
    case = six_bar()
    forward = motion_of(case)
    links = tuple(reversed(case.mechanism.links))
    backward = motion(replaced(case.mechanism, links=links), case.drive, case.rate, case.rate2)
    for link in case.mechanism.links:
        for field in ("origin", "direction", "acceleration", "angular_acceleration"):
            one, other = (getattr(m, field)[m.mechanism.index[link.name]] for m in (forward, backward))
            np.testing.assert_allclose(one, other, rtol=0, atol=1e-13 * (1 + abs(one).max()))


def test_the_five_dyads_are_different_groups():
    """Guards the list of dyads."""
    kinds = set()
    for make in DYADS.values():
        group = structure(make().mechanism).groups[1]
        outer = sorted(joint.letter for joint in group.tree)
        kinds.add((tuple(outer), group.cut[0].letter))
    assert len(kinds) == 5
    assert scotch_yoke in DYADS.values()
