"""Round-off errors are bounded by the condition number; positions beyond are marked.

The error of a position is measured against 50-digit arithmetic, in units of eps times the condition number
(`Motion.condition`). The bound is 50 units for each field, relative to the largest force, moment, displacement or
rotation of the position.
"""

import mpmath
import numpy as np
import pytest
from exact import exact
from mechanisms import bar, scotch_yoke, tangent
from mpmath import mpf
from stress import EPS, STATIONS, FourBar, Inverted, SliderCrank, TwoDyads, error, number, references, scales, triangle
from tiers import in_tiers

from elastic import PRIMARY, Section, deflection, sample
from rigid import (
    SINGULAR,
    Beam,
    Link,
    Lump,
    Mechanism,
    MechanismError,
    PinDrive,
    Segment,
    SegmentedLaw,
    Slider,
    SliderDrive,
    drive_efforts,
    motion,
    reactions,
    with_rates,
)

BOUND = 50
TO_DEAD_POINT = [10.0**-k for k in range(1, 13)]
TO_CHANGE_POINT = [1e-1, 1e-2, 1e-3, 2e-4, 1e-5]


def plain(**more):
    """A crank-rocker far from singular positions."""
    known = {"lengths": (0.1, 0.3, 0.25), "base": 0.35, "start": 0.3} | more
    return FourBar(**known)


def stop_of(crank, coupler, rocker, base):
    """Return the crank angle at which coupler and rocker are in line."""
    return np.arccos((crank**2 + base**2 - (coupler + rocker) ** 2) / (2 * crank * base))


ROUNDED = 1e-13  # [rad] this close to its end, a rounded drive coordinate cannot decide whether a group closes


class TestDeadPoints:
    """s goes with the root of the distance: 1e-12 rad before the stop the condition is 3e11, and the bound holds."""

    @pytest.mark.parametrize("distance", in_tiers(TO_DEAD_POINT[::-1], 4, 4))
    def test_the_error_of_a_stretched_dyad_is_bounded_by_its_condition(self, distance):
        stop = stop_of(0.25, 0.2, 0.2, 0.3)
        worst, condition, motions = error(FourBar((0.25, 0.2, 0.2), 0.3, stop - 0.3), stop - distance)
        assert motions == pytest.approx(0.267 / distance, rel=0.3) or distance == 0.1
        assert worst < BOUND * condition

    @pytest.mark.parametrize("distance", in_tiers(TO_DEAD_POINT[::-1], 3, 3))
    def test_stretched_dyad_by_newton(self, distance, monkeypatch):
        monkeypatch.setattr("rigid.decomposition.groups.Group.closed_form", property(lambda group: not group.free))
        stop = stop_of(0.25, 0.2, 0.2, 0.3)
        case = FourBar((0.25, 0.2, 0.2), 0.3, stop - 0.3)
        for way in ((), (stop - 0.3, stop - 0.2)):
            worst, condition, _ = error(case, stop - distance, way=way)
            assert condition < SINGULAR
            assert worst < BOUND * condition

    @pytest.mark.parametrize(
        "before",
        in_tiers([np.array([8e-3, 2e-3, 5e-4, 1e-4]), np.logspace(-2.1, -14, 20), np.logspace(-2.1, -14, 120)], 1, 2),
    )
    def test_newton_keeps_the_branch_in_uneven_steps(self, before, monkeypatch):
        """The reference is the closed form, which keeps the sign of the sine."""
        stop = stop_of(0.25, 0.2, 0.2, 0.3)
        drive = np.concatenate([np.linspace(stop - 0.3, stop - 1e-2, 40), stop - before])
        mechanism = FourBar((0.25, 0.2, 0.2), 0.3, stop - 0.3).mechanism
        closed = motion(mechanism, drive)
        monkeypatch.setattr("rigid.decomposition.groups.Group.closed_form", property(lambda group: not group.free))
        general = motion(mechanism, drive)
        found = np.isfinite(general.direction).all(axis=0)
        assert found[:40].all()
        assert found[40:][before > ROUNDED].all()
        assert np.abs(general.direction - closed.direction)[:, found].max() < 1e-6

    @pytest.mark.parametrize("distance", in_tiers(TO_DEAD_POINT[::-1], 4, 4))
    def test_rod_normal_to_its_slide(self, distance):
        stop = np.arcsin(0.22 / 0.25)
        worst, condition, _ = error(SliderCrank(0.25, 0.2, 0.02, 0.2), stop - distance)
        assert worst < BOUND * condition

    @pytest.mark.parametrize("distance", in_tiers(TO_DEAD_POINT[::-1], 4, 4))
    def test_crank_and_rod_in_line_with_the_block_driven(self, distance):
        """At 0.1 from the line, the largest force happens to vanish and gives no scale; closer, it is a scale."""
        reach = np.sqrt(0.45**2 - 0.02**2)
        way = 0.1 * (distance if distance < 0.1 else 0.05)
        worst, condition, _ = error(SliderCrank(0.1, 0.35, 0.02, 1.0, pressed=True), reach - way, 0.4, -0.9)
        assert worst < BOUND * condition

    @pytest.mark.parametrize("distance", in_tiers(TO_CHANGE_POINT[::-1], 2, 2))
    def test_slides_nearly_parallel(self, distance):
        """Two lines at an angle with sine s; beyond the parallel position the block cannot be reached."""
        for case, drive in (
            (tangent(), np.array([[1.3 - distance]])),
            (scotch_yoke(slant=0.1 - 0.35 + distance), scotch_yoke().drive[:, 3:4]),
        ):
            course = motion(case.mechanism, drive, 7.0, -3.0)
            solved = deflection(course, case.sections)
            other = exact(case.mechanism, case.sections, drive[:, 0], [7.0], [-3.0])
            expected = {field: other.sampled(field, STATIONS) for field in PRIMARY}
            by = scales(expected)
            for field in PRIMARY:
                worst = np.abs(sample(solved, field, STATIONS)[:, 0] - expected[field]).max() / by[field] / EPS
                assert worst < BOUND * course.condition[0], f"{field}, {worst / course.condition[0]:.3g}"

    @pytest.mark.parametrize("second", [1e-2, 1e-4, 1e-6, 1e-8])
    @pytest.mark.parametrize("first", in_tiers([1e-2, 1e-4, 1e-6, 1e-8], 2, 1))
    def test_two_dyads_in_series(self, first, second):
        """The error of the first dyad moves the second."""
        worst, condition, _ = error(TwoDyads(first, second), 1.3)
        assert worst < BOUND * condition

    def test_beyond_the_limit_positions_are_marked(self):
        """A stretched dyad and a flat parallelogram: positions are known, rates and forces are nan."""
        stop = stop_of(0.25, 0.2, 0.2, 0.3)
        for case, drive in (
            (FourBar((0.25, 0.2, 0.2), 0.3, stop - 0.3), stop),
            (FourBar((0.1, 0.35, 0.1), 0.35, 0.3), np.pi - 5e-5),
            (FourBar((0.1, 0.35, 0.1), 0.35, 0.3), np.pi),
        ):
            course = motion(case.mechanism, [drive - 0.1, drive], 7.0)
            solved = deflection(course, case.sections)
            assert not course.condition[1] <= SINGULAR
            assert np.isnan(course.turning[2:, 1]).all()
            fields = [sample(solved, field, STATIONS)[1:] for field in PRIMARY]
            assert np.isnan(fields)[..., 1, :].all()
            assert np.isfinite(fields)[..., 0, :].all()

    def test_beyond_the_stop_all_is_nan(self):
        stop = stop_of(0.25, 0.2, 0.2, 0.3)
        case = FourBar((0.25, 0.2, 0.2), 0.3, stop - 0.3)
        for distance in (1e-1, 1e-4, 1e-8, 1e-12):
            course = motion(case.mechanism, [stop - 0.1, stop + distance], 7.0)
            assert np.isnan(course.condition[1])
            assert np.isnan(sample(deflection(course, case.sections), "N", STATIONS)[1:, 1]).all()


class TestChangePoints:
    """Fields stay finite at a change point, but one more power of s is lost.

    s^2 is a difference that vanishes. A relative error eps of a length changes s by eps/s, velocities by eps/s^2 and
    accelerations by eps/s^3, for any algorithm. The condition number is 1/s^3 there.
    """

    FACTOR = 0.4, 4.5  # condition number times distance^3

    CASES = (
        ("parallelogram", FourBar((0.1, 0.35, 0.1), 0.35, 0.3)),
        ("crank and base as long as the others", FourBar((0.1, 0.3, 0.15), 0.35, 0.3)),
    )

    @pytest.mark.parametrize("distance", TO_CHANGE_POINT)
    @pytest.mark.parametrize(("name", "case"), CASES)
    def test_the_error_before_a_change_point_is_bounded(self, name, case, distance):
        self.check(distance, *error(case, np.pi - distance))

    @pytest.mark.parametrize("distance", TO_CHANGE_POINT)
    @pytest.mark.parametrize(("name", "case"), CASES)
    def test_after_on_the_smooth_branch(self, name, case, distance):
        """The last step across the change point is longer or shorter than those before."""
        way = np.linspace(0.3, 3.0, 20)
        self.check(distance, *error(case, np.pi + distance, way=way, side=-1))

    @pytest.mark.parametrize("distance", in_tiers(TO_CHANGE_POINT[::-1], 2, 2))
    @pytest.mark.parametrize("side", [1, -1])
    @pytest.mark.parametrize("lengths", [(0.1, 0.35, 0.1), (0.1, 0.3, 0.15)])
    def test_at_constant_speed_without_weight(self, lengths, side, distance):
        """Finite forces and displacements are the result of cancellation: two more powers are lost."""
        case = FourBar(lengths, 0.35, 0.3, side, gravity=0.0)
        self.check(distance, *error(case, np.pi - distance, 14.0, 0.0), marked=1e-2)

    @pytest.mark.parametrize("distance", [1e-1, 1e-2, 1e-3, 1e-5, 1e-7])
    @pytest.mark.parametrize("rate2", [0.0, -3.0])
    def test_pins_meet_at_rest(self, distance, rate2):
        worst, condition, _ = error(Inverted(0.2, 0.2, 1.0), distance, 0.0, rate2)
        assert condition > 1 / distance**2
        assert worst < BOUND * condition or np.isnan(worst)

    @pytest.mark.parametrize("angle", [0.0, 1e-12, 1e-4, 1e-2])
    @pytest.mark.parametrize("rate", [7.0, 0.0])
    def test_a_translating_rod_is_not_at_a_change_point(self, angle, rate):
        """The rod is between two blocks on parallel lines: it could rotate, but no rate makes it rotate."""
        way, reach = np.exp(1j * angle), 0.3 * np.exp(1.0j)
        links = (
            Link("ground", {"G": 0.0}),
            Link("pusher", {"A": 0.0}, lumps=(Lump("A", 0.3, 0.01),)),
            bar("rod", "A", "B", 0.3, 0.4),
            Link("block", {"B": 0.0}, lumps=(Lump("B", 0.3, 0.01),)),
        )
        lines = (Slider("a", "pusher", "ground", "A", 0.0, 1.0), Slider("b", "block", "ground", "B", 0.1 + reach, way))
        mechanism = Mechanism(links, (SliderDrive("a"),), {"A": 0.1, "B": 0.1 + reach}, lines)
        course = motion(mechanism, [0.1], rate, -3.0)
        assert course.condition < 10
        assert np.isfinite(deflection(course, [Section(1e7, 40.0)]).w).all()

    def test_only_positions_with_rates_are_marked(self):
        """The same position is known at rest."""
        mechanism = FourBar((0.1, 0.35, 0.1), 0.35, 0.3).mechanism
        still, going = (motion(mechanism, [0.4, np.pi - 5e-5], rate) for rate in (0.0, 7.0))
        assert (np.isfinite(still.condition)).all()
        assert going.condition[1] == np.inf
        for other, rate, same in ((still, 7.0, going), (going, 0.0, still)):
            turned = with_rates(other, rate)
            np.testing.assert_array_equal(turned.condition, same.condition)
            np.testing.assert_array_equal(turned.turning, same.turning)

    @pytest.mark.parametrize("distance", TO_CHANGE_POINT)
    def test_slider_crank_of_equal_lengths(self, distance):
        self.check(distance, *error(SliderCrank(0.2, 0.2, 0.0, 0.2), np.pi / 2 - distance))

    @pytest.mark.parametrize("distance", TO_CHANGE_POINT)
    def test_pins_of_a_block_and_its_guide_meet(self, distance):
        """The crank is as long as the base."""
        self.check(distance, *error(Inverted(0.2, 0.2, 1.0), distance))

    @pytest.mark.parametrize("distance", [1e-1, 1e-2, 1e-3, 1e-5, 1e-8])
    def test_pins_of_a_block_and_its_guide_pass_closely(self, distance):
        """The position is smooth, but the guide's direction follows from points that are 1000 times farther apart."""
        worst, *_ = error(Inverted(0.2, 0.2002, 1.0), distance)
        assert worst < BOUND * 1000

    def check(self, distance, worst, condition, motions, marked=2e-4):
        if np.isnan(worst):
            assert distance <= marked
            assert not condition <= SINGULAR
        else:
            assert self.FACTOR[0] < motions * distance**3 < self.FACTOR[1]
            assert worst < BOUND * condition

    def test_one_ulp_of_a_length_has_the_same_effect(self):
        """Therefore no algorithm in floating point can do better."""
        lengths = 0.1, 0.3, 0.15
        one, other = (
            references(FourBar((crank, *lengths[1:]), 0.35, 0.3), np.pi - 1e-4, 7.0, -3.0)
            for crank in (lengths[0], np.nextafter(lengths[0], 0))
        )
        by = scales(one)
        moved = max(np.abs(one[field] - other[field]).max() / by[field] for field in PRIMARY)
        assert moved > 0.05 * EPS * 1e4**3


class TestSizes:
    """Far from singular positions the condition is about 1 for any size, speed, mass or stiffness."""

    def check(self, case, drive=1.0, rate=100.0, rate2=0.0):
        worst, condition, _ = error(case, drive, rate, rate2)
        assert condition < 10
        assert worst < BOUND * condition

    @pytest.mark.parametrize("slenderness", [1.0, 1e2, 1e4, 1e6])
    def test_slenderness_does_not_matter(self, slenderness):
        case = plain()
        case.sections = [Section(EA=2.1e7, EI=2.1e7 * (0.3 / slenderness) ** 2)] * 3
        self.check(case)

    @pytest.mark.parametrize("ratio", [1e-12, 1e-6, 1e6, 1e12])
    def test_one_link_softer_than_the_others(self, ratio):
        case = plain()
        case.sections = [Section(1e7, 40.0), Section(1e7, 40.0 * ratio), Section(1e7 * ratio, 40.0)]
        self.check(case)

    @pytest.mark.parametrize("size", [1e-6, 1e-3, 1.0, 1e4])
    def test_size_does_not_matter(self, size):
        self.check(plain(lengths=(0.1 * size, 0.3 * size, 0.25 * size), base=0.35 * size))

    @pytest.mark.parametrize("speed", [1e-6, 1e-3, 1.0, 1e3, 1e6])
    @pytest.mark.parametrize("gravity", [0.0, -9.81j])
    def test_speed_does_not_matter(self, speed, gravity):
        self.check(plain(gravity=gravity), rate=speed, rate2=speed**2 / 3)

    @pytest.mark.parametrize("ratio", [1e-12, 1e-6, 1e6, 1e12])
    def test_mass_ratios_do_not_matter(self, ratio):
        self.check(plain(masses=(0.5, 0.5 * ratio, 0.5)))

    @pytest.mark.parametrize("ratio", [1e2, 1e4, 1e6])
    def test_a_heavy_link_with_a_vanishing_moment(self, ratio):
        """The moment is a difference of terms that are larger by the ratio of the masses."""
        worst, condition, _ = error(plain(masses=(0.5, 0.5, 0.5 * ratio), gravity=0.0, start=0.0), 5.8908, 100.0, 0.0)
        assert worst < BOUND * condition * ratio

    @pytest.mark.parametrize("crank", [1e-8, 1e-6, 1e-4, 1e-2])
    def test_a_short_crank_does_not_matter(self, crank):
        self.check(plain(lengths=(crank, 0.3, 0.25)))

    @pytest.mark.parametrize("turns", [1, 1_000, 1_000_000])
    def test_the_number_of_turns_does_not_matter(self, turns):
        self.check(plain(), drive=1.0 + 2 * np.pi * turns)


class TestDifferences:
    """If a length is a difference of others, its last digits count by their ratio."""

    @pytest.mark.parametrize("short", [1e-6, 1e-4, 1e-2])
    @pytest.mark.parametrize("which", ["rocker", "coupler"])
    def test_a_short_link_between_long_ones(self, short, which):
        distance = abs(0.1 * np.exp(1j) - 0.35)
        lengths = (0.1, distance + 0.3 * short, short)
        case = plain(lengths=lengths if which == "rocker" else (0.1, short, lengths[1]), start=1.0)
        worst, condition, _ = error(case, 1.0, 100.0, 0.0)
        assert worst < BOUND * condition * distance / short

    @pytest.mark.parametrize("far", [1e2, 1e5, 1e8])
    def test_far_from_the_origin(self, far):
        """Ground pins have coordinates with a correspondingly larger last digit."""
        worst, condition, _ = error(plain(origin=far), 1.0, 100.0, 0.0)
        assert worst < BOUND * condition * far / 0.1

    @pytest.mark.parametrize("long", [1e1, 1e3, 1e5])
    def test_long_links_on_a_short_base_meet_at_a_small_angle(self, long):
        """The condition number shows it: (long/base)^2."""
        worst, condition, motions = error(plain(lengths=(0.1, long, long + 0.03)), 1.0, 100.0, 0.0)
        assert motions > (long / 0.35) ** 2 / 2
        assert worst < BOUND * condition


def chain(count, swing=1.3):
    """Return a chain of rockers, each driven by the previous one through a coupler: one dyad each."""
    tips, links, drawing = [0.1 * np.exp(1j * swing)], [], {"D0": 0.0}
    for k in range(1, count + 1):
        drawing[f"D{k}"] = 0.3 * k
        tips.append(0.3 * k + 0.1 * np.exp(1j * swing))
    drawing |= {f"B{k}": tip for k, tip in enumerate(tips)}
    links.append(Link("ground", {name: place for name, place in drawing.items() if name.startswith("D")}))
    links.append(bar("rocker0", "D0", "B0", 0.1))
    for k in range(1, count + 1):
        links.append(bar(f"coupler{k}", f"B{k - 1}", f"B{k}", 0.3 + 1e-3 * (-1) ** k))
        links.append(bar(f"rocker{k}", f"D{k}", f"B{k}", 0.1 - 1e-3 * (-1) ** k))
    return Mechanism(tuple(links), (PinDrive("rocker0", "D0"),), drawing)


def tips_exactly(mechanism, angle):
    """Return the positions of all joints B in the chain, triangle by triangle."""
    count = (len(mechanism.links) - 2) // 2
    length = {link.name: mpf(float(list(link.points.values())[1])) for link in mechanism.links[1:]}
    places = [length["rocker0"] * mpmath.expj(angle)]
    for k in range(1, count + 1):
        pivot = number(mechanism.links[0].points[f"D{k}"])
        places.append(triangle(places[-1], pivot, length[f"coupler{k}"], length[f"rocker{k}"], 1))
    return places


class TestChainOfAHundredDyads:
    """Each dyad propagates the error of the previous one: the bound grows with the number of dyads."""

    COUNT, ANGLE, RATE, RATE2 = 100, 1.2, 7.0, -3.0

    @pytest.fixture
    def course(self):
        return motion(chain(self.COUNT), [self.ANGLE], self.RATE, self.RATE2)

    def differentiated(self, mechanism):
        """Return positions and their first and second derivatives by the angle, from differences in 110 digits."""
        h = mpf(10) ** -25
        behind, here, ahead = (tips_exactly(mechanism, mpf(self.ANGLE) + k * h) for k in (-1, 0, 1))
        first = [(a - b) / (2 * h) for a, b in zip(ahead, behind, strict=True)]
        second = [(a - 2 * c + b) / h**2 for a, b, c in zip(ahead, behind, here, strict=True)]
        return here, first, second

    @pytest.mark.slow
    def test_errors_of_the_motion_are_bounded(self, course):
        with mpmath.workdps(110):
            places, first, second = self.differentiated(course.mechanism)
            speed = [complex(v * mpf(self.RATE)) for v in first]
            growth = [
                complex(a * mpf(self.RATE) ** 2 + v * mpf(self.RATE2)) for v, a in zip(first, second, strict=True)
            ]
        tips = slice(2, None, 2)  # origins of couplers: the tips of the rockers before them
        unit = BOUND * EPS * course.condition[0] * self.COUNT
        for got, expected in (
            (course.origin, [complex(place) for place in places]),
            (course.velocity, speed),
            (course.acceleration, growth),
        ):
            off = np.abs(got[tips, 0] - np.array(expected[:-1])).max()
            assert off < unit * np.abs(expected).max()

    @pytest.mark.slow
    def test_drive_effort(self, course):
        """The kinetic energy of all bars is J rate^2/2, so the effort is J rate2 + (dJ/dangle) rate^2/2."""
        mechanism = course.mechanism
        with mpmath.workdps(110):

            def inertia(angle):
                h = mpf(10) ** -25
                ends = zip(tips_exactly(mechanism, angle + h), tips_exactly(mechanism, angle - h), strict=True)
                speeds = [(a - b) / (2 * h) for a, b in ends]
                total = mpf(0)
                for link in mechanism.links[1:]:
                    k = int("".join(filter(str.isdigit, link.name)))
                    length = mpf(float(list(link.points.values())[1]))
                    one = speeds[k - 1] if link.name.startswith("coupler") else mpmath.mpc(0)
                    both = [abs(one) ** 2, abs(speeds[k]) ** 2, mpmath.re(mpmath.conj(one) * speeds[k])]
                    total += mpf(float(link.beams[0].mass_per_length)) * length / 3 * sum(both)
                return total

            here, step = mpf(self.ANGLE), mpf(10) ** -12
            slope = (inertia(here + step) - inertia(here - step)) / (2 * step)
            parts = [inertia(here) * mpf(self.RATE2), slope * mpf(self.RATE) ** 2 / 2]
            expected, size = float(sum(parts)), float(sum(abs(part) for part in parts))
        effort = drive_efforts(course, reactions(course))[0, 0]
        assert effort == pytest.approx(expected, abs=BOUND * EPS * course.condition[0] * self.COUNT * size)


class TestSteepLaws:
    @pytest.mark.parametrize("duration", [1.0, 1e-3, 1e-9])
    @pytest.mark.parametrize("curve", ["polynomial-345", "polynomial-4567", "cycloidal", "harmonic"])
    def test_a_jerk_after_a_long_rest(self, curve, duration):
        """Time itself is rounded: its error counts by the elapsed time relative to the segment."""
        law = SegmentedLaw(0.3, (Segment("dwell", 1.0), Segment(curve, duration, 2.0), Segment("dwell", 1.0)))
        time = 1.0 + duration * np.array([0.2, 0.45, 0.5, 0.9])
        got = law(time)
        with mpmath.workdps(40):
            expected = np.array([self.exactly(curve, mpf(t), mpf(duration)) for t in time], float).T
        lost = EPS * (1 + 1 / duration)
        for power, (ours, theirs) in enumerate(zip(got, expected, strict=True)):
            assert np.abs(ours - theirs).max() < BOUND * lost * 2.0 / duration**power

    def exactly(self, curve, time, duration):
        z, turn = (time - 1) / duration, 2 * mpmath.pi
        curves = {
            "polynomial-345": lambda z: 10 * z**3 - 15 * z**4 + 6 * z**5,
            "polynomial-4567": lambda z: 35 * z**4 - 84 * z**5 + 70 * z**6 - 20 * z**7,
            "cycloidal": lambda z: z - mpmath.sin(turn * z) / turn,
            "harmonic": lambda z: (1 - mpmath.cos(turn * z / 2)) / 2,
        }
        with mpmath.workdps(60):
            rates = [mpmath.diff(curves[curve], z, n) for n in range(3)]
        return [mpf(0.3) + 2 * rates[0], 2 * rates[1] / duration, 2 * rates[2] / duration**2]


class TestZeroLengths:
    """A length of zero gives an error that names the beam, or a marked position, never a number."""

    @pytest.mark.parametrize("lengths", [(0.0, 0.3, 0.25), (0.1, 0.0, 0.25), (0.1, 0.3, 0.0)])
    def test_a_beam_of_no_length(self, lengths):
        names = ("crank", "coupler", "rocker")
        links = [Link("ground", {"O": 0.0, "D": 0.35})]
        ends = (("O", "A"), ("A", "B"), ("D", "B"))
        links += [bar(name, *pair, length) for name, pair, length in zip(names, ends, lengths, strict=True)]
        drawing = {"O": 0, "A": 0.1, "B": 0.28 + 0.24j, "D": 0.35}
        name = names[lengths.index(0.0)]
        with pytest.raises(MechanismError, match=f'of "{name}" has no length'):
            Mechanism(tuple(links), (PinDrive("crank", "O"),), drawing)

    def test_a_beam_between_points_that_coincide(self):
        arm = Link("arm", {"O": 0.0, "A": 0.1, "C": 0.1}, (Beam("O", "A", 0.5), Beam("A", "C", 0.5)))
        with pytest.raises(MechanismError, match='"A"-"C" of "arm" has no length'):
            Mechanism((Link("ground", {"O": 0.0}), arm), (PinDrive("arm", "O"),), {"O": 0, "A": 0.1})

    def test_outer_pins_of_a_folded_dyad_meet(self):
        """Crank and base are equal, coupler and rocker too: at angle 0 the outer pins coincide."""
        case = FourBar((0.2, 0.3, 0.3), 0.2, 0.5)
        course = motion(case.mechanism, [0.5, 0.0, -0.5], 7.0)
        assert not course.condition[1] <= SINGULAR
        assert np.isnan(sample(deflection(course, case.sections), "w", STATIONS)[1:, 1]).all()
