"""The branch does not depend on the requested positions; redundant mechanisms and flat positions are handled."""

import sys
from pathlib import Path

import numpy as np
import pytest
from mechanisms import bar, drawn_bar, linkage, parallelogram
from tiers import in_tiers

from elastic import Section, deflection, sample
from rigid import Beam, Link, Mechanism, PinDrive, Slider, drive_efforts, motion
from rigid.dynamics import Effort, ForwardError, forward, motion_during

sys.path.insert(0, str(Path(__file__).parents[1] / "benchmarks"))
import branch_certainty

PLATE = {
    "A": 0.027919744804337017 + 0.3817358100484221j,
    "B": 0.31547904485197353 + 0.43990729208932466j,
    "C": 0.18704455043586918 + 0.522278262193203j,
    "G": 0.20273991047319695 + 0.08173581004842212j,
    "H": 0.20560565929570193 + 0.13990729208932468j,
    "K": 0.013828309269791894 + 0.8745732926645884j,
    "O": 0.053469760233059986 + 0.8436503391361801j,
}
START = float(np.angle(PLATE["K"] - PLATE["O"]))


@pytest.fixture(scope="module")
def plate_on_rods():
    bars = (("r1", "G", "A"), ("r2", "H", "B"), ("r3", "K", "C"), ("crank", "O", "K"))
    return linkage(PLATE, "GHO", bars, [("plate", "ABC")], [PinDrive("crank", "O")])


@pytest.mark.parametrize(("turns", "count"), [(5, 181), (5, 31), (50, 60), (1000, 37), (-5, 181)])
def test_a_plate_on_three_rods_over_several_turns(plate_on_rods, turns, count):
    """Its loops have several assemblies; the reference takes steps of a thousandth of a turn."""
    angle = START - np.linspace(0, turns * 2 * np.pi, count)
    within = START + np.mod(angle - START, 2 * np.pi)
    dense = motion(plate_on_rods, START + np.linspace(0, 2 * np.pi, 1001))
    found = motion(plate_on_rods, angle)
    for link in range(1, 6):
        expected = np.exp(1j * np.interp(within, dense.drive[0], np.unwrap(np.angle(dense.direction[link]))))
        np.testing.assert_allclose(found.direction[link], expected, rtol=0, atol=1e-4)


@pytest.mark.parametrize(("turns", "count"), [(100, 360), (100, 61), (1000, 360), (-100, 360)])
@pytest.mark.parametrize("general", in_tiers([False, True], 3, 3))
def test_a_parallelogram_over_many_turns(turns, count, general, monkeypatch):
    if general:
        monkeypatch.setattr("rigid.decomposition.groups.Group.closed_form", property(lambda group: not group.free))
    angle = 0.3 + np.linspace(0, turns * 2 * np.pi, count)
    found = motion(parallelogram(), angle)
    np.testing.assert_allclose(found.direction[3], np.exp(1j * angle), rtol=0, atol=1e-6)


@pytest.mark.slow
def test_random_mechanisms_at_random_positions_are_on_the_right_branch(monkeypatch):
    """Seconds of `benchmarks/branch_certainty.py`, against independent tracking and closed forms."""
    monkeypatch.setattr(branch_certainty, "STEPS", 2000)
    for kinds, mechanisms in ((("dyads", "triads"), 2), (tuple(branch_certainty.CHANGING), 6)):
        for kind, count in branch_certainty.run(mechanisms, 7, kinds).items():
            assert count.wrong == count.missed == 0, f"{kind}: {count}"
            assert count.right > 10, f"{kind}: {count}"


@pytest.mark.slow
def test_positions_beyond_the_stop_are_unknown(monkeypatch):
    """The drive cannot pass, although other assemblies are near and the mechanism would close again turns later."""
    links = (
        Link("ground", {"O": 0.0, "D": 0.3}),
        Link("crank", {"O": 0.0, "A": 0.25}),
        Link("coupler", {"A": 0.0, "B": 0.2}),
        Link("rocker", {"D": 0.0, "B": 0.2}),
    )
    tip = 0.25 * np.exp(0.5j)
    middle, half = (tip + 0.3) / 2, (0.3 - tip) / 2
    fold = middle + 1j * half / abs(half) * np.sqrt(0.2**2 - abs(half) ** 2)
    drawing = {"O": 0.0, "D": 0.3, "A": tip, "B": fold}
    stop = np.arccos((0.25**2 + 0.3**2 - 0.4**2) / (2 * 0.25 * 0.3))
    angle = np.linspace(0, 6 * np.pi, 50)
    reached = angle < stop
    dyads = motion(Mechanism(links, (PinDrive("crank", "O"),), drawing), angle)
    np.testing.assert_array_equal(np.isfinite(dyads.direction[3]), reached)
    monkeypatch.setattr("rigid.decomposition.groups.Group.closed_form", property(lambda group: not group.free))
    found = motion(Mechanism(links, (PinDrive("crank", "O"),), drawing), angle)
    np.testing.assert_array_equal(np.isfinite(found.direction[3]), reached)
    np.testing.assert_allclose(found.direction[3, reached], dyads.direction[3, reached], rtol=0, atol=1e-9)


STEEL = Section(2e6, 20.0)


@pytest.mark.slow
def test_certain_knots_are_kept_beyond_an_avoided_crossing():
    """Tracking passes its last knot on unchanged; a new start from farther back gave another branch, 0.1 rad off.

    The plate angles are from benchmarks/branch_tracker.py, which has its own certified steps.
    """
    points = {
        "O": -0.23200970091607154 - 0.1464607628433221j, "G": -0.3808553575980851 + 0.4716779166016192j,
        "H": -0.22126310466706056 - 0.11963517766629572j, "K": -0.2979559927918779 - 0.20433122073086907j,
        "A": 0.15766484865155073 + 0.3090049742133306j, "B": 0.14403900286669835 + 0.390193897914044j,
        "C": 0.5546634564868438 + 0.29702757424242154j,
    }  # fmt: skip
    links = [Link("ground", {point: points[point] for point in "OGH"})]
    for name, on in {"crank": "OK", "plate": "ABC", "r1": "GA", "r2": "HB", "r3": "KC"}.items():
        along = (points[on[1]] - points[on[0]]) / abs(points[on[1]] - points[on[0]])
        links.append(Link(name, {point: (points[point] - points[on[0]]) / along for point in on}))
    mechanism = Mechanism(tuple(links), (PinDrive("crank", "O"),), points)
    step, start = -0.07306029426952998, np.angle(points["K"] - points["O"])
    moved = motion(mechanism, start + step * np.arange(60), 1.0)
    assert np.angle(moved.direction[2, 39:42]) == pytest.approx([2.98941686, 2.9534228, 2.9173094], abs=1e-7)


def test_a_crosshead_in_two_parallel_guides_moves_like_in_one():
    tip = 0.1 * np.exp(1j)
    block = tip.real + np.sqrt(0.3**2 - tip.imag**2)
    links = (
        Link("ground", {"O": 0.0}),
        bar("crank", "O", "A", 0.1),
        bar("rod", "A", "B", 0.3),
        Link("cross", {"U": 0.05j, "B": 0.0, "L": -0.05j}, (Beam("U", "B", 0.5), Beam("B", "L", 0.5))),
    )
    guides = tuple(Slider(name, "cross", "ground", name, place, 1.0) for name, place in (("U", 0.05j), ("L", -0.05j)))
    drawing = {"O": 0, "A": tip, "B": block, "U": block + 0.05j, "L": block - 0.05j}
    two = motion(Mechanism(links, (PinDrive("crank", "O"),), drawing, guides), 1 + np.linspace(0, 6, 9), 3.0)
    angle = two.drive[0]
    expected = 0.1 * np.cos(angle) + np.sqrt(0.09 - 0.01 * np.sin(angle) ** 2)
    np.testing.assert_allclose(two.origin[3], expected, rtol=0, atol=1e-12)
    assert np.isfinite(deflection(two, [STEEL] * 4).w).all()


def test_twin_rods_move_like_one_and_share_its_load():
    four = {"O": 0, "D": 0.35, "A": 0.1j, "B": 0.22 + 0.21j}
    lengths = abs(four["B"] - four["A"]), abs(four["B"] - four["D"])
    ground, crank, one, rocker = (
        Link("ground", {"O": 0.0, "D": 0.35}),
        bar("crank", "O", "A", 0.1),
        bar("one", "A", "B", lengths[0]),
        bar("rocker", "D", "B", lengths[1]),
    )
    twin = bar("two", "A", "B", lengths[0])
    angle = np.pi / 2 + np.linspace(0, 6, 9)
    single = motion(Mechanism((ground, crank, one, rocker), (PinDrive("crank", "O"),), four), angle, 5.0)
    both = motion(Mechanism((ground, crank, one, twin, rocker), (PinDrive("crank", "O"),), four), angle, 5.0)
    for name in ("one", "two"):
        found = both.direction[both.mechanism.index[name]]
        np.testing.assert_allclose(found, single.direction[2], rtol=0, atol=1e-12)
    assert np.isfinite(deflection(both, [STEEL] * 4).w).all()


@pytest.mark.parametrize("angle", [0.0, 4e-18, -4e-18, 2 * np.pi, 4 * np.pi])
def test_a_kite_passes_its_folded_position(angle):
    """In this position the crank pin is on the rocker's pivot; the bisector of the crank angle gives the rocker's."""
    side, start = 0.3, 1.0

    def fold(turned):
        half = turned / 2
        return np.exp(1j * half) * (0.1 * np.cos(half) + np.sqrt(side**2 - (0.1 * np.sin(half)) ** 2))

    links = (
        Link("ground", {"O": 0.0, "D": 0.1}),
        drawn_bar("crank", "O", "A", {"O": 0, "A": 0.1}),
        drawn_bar("coupler", "A", "B", {"A": 0, "B": side}),
        drawn_bar("rocker", "D", "B", {"D": 0, "B": side}),
    )
    drawing = {"O": 0, "D": 0.1, "A": 0.1 * np.exp(1j * start), "B": fold(start)}
    angles = np.array([start, angle, angle + 0.5])
    found = motion(Mechanism(links, (PinDrive("crank", "O"),), drawing), angles)
    np.testing.assert_allclose(found.direction[3], (fold(angles) - 0.1) / side, rtol=0, atol=1e-7)
    assert not found.condition[1] <= 1e12


def windows(count):
    """IFToMM's A02: parallel rods of 1 m and 1 kg, joined by equal bars."""
    tip = np.exp(0.5j * np.pi)
    ground = Link("ground", {f"O{k}": float(k) for k in range(count + 1)})
    rods = [Link(f"rod{k}", {f"O{k}": 0.0, f"A{k}": 1.0}, (Beam(f"O{k}", f"A{k}", 1.0),)) for k in range(count + 1)]
    bars = [Link(f"bar{k}", {f"A{k}": 0.0, f"A{k + 1}": 1.0}, (Beam(f"A{k}", f"A{k + 1}", 1.0),)) for k in range(count)]
    drawing = {f"O{k}": complex(k) for k in range(count + 1)} | {f"A{k}": k + tip for k in range(count + 1)}
    return Mechanism((ground, *rods, *bars), (PinDrive("rod0", "O0"),), drawing, gravity=-9.81j)


@pytest.mark.parametrize("count", [2, pytest.param(6, marks=pytest.mark.exhaustive)])
def test_falling_windows_bend_by_closed_forms(count):
    """Without effort all links bend like beams on two supports, by transverse weight and inertia."""
    g, EI = 9.81, 50.0
    inertia, weight = (count + 1) / 3 + count, g * ((count + 1) / 2 + count)
    theta, rate = np.array([0.7, 1.3, 2.2]), np.array([-1.0, -2.0, 0.5])
    turning = -weight / inertia * np.cos(theta)
    moved = motion(windows(count), theta, rate, turning)
    bent = deflection(moved, [Section(1e6, EI)] * (2 * count + 1))
    size = count * g
    assert np.abs(drive_efforts(moved, bent.forces)).max() < 1e-9 * size
    x = np.linspace(0.0, 1.0, 5)

    def supported(even, growing):
        """Return V, M and chord w for q = even + growing x, with only V at the ends."""
        even, growing = even[:, None], growing[:, None]
        V = even * (x - 1 / 2) + growing * (x**2 / 2 - 1 / 6)
        M = even * x * (x - 1) / 2 + growing * x * (x**2 - 1) / 6
        w = even * x * (x**3 - 2 * x**2 + 1) / 24 + growing * x * (3 * x**4 - 10 * x**2 + 7) / 360
        return V, M, w / EI

    rods, bars = slice(0, count + 1), slice(count + 1, None)
    rise = turning * np.cos(theta) - rate**2 * np.sin(theta)
    for part, loads in ((rods, (-g * np.cos(theta), -turning)), (bars, (-(g + rise), 0 * theta))):
        for field, expected in zip(("V", "M", "chord"), supported(*loads), strict=True):
            found = sample(bent, field, x)[part]
            assert np.abs(found - expected).max() < 1e-8 * size / (EI if field == "chord" else 1.0), field
    along = turning * -np.sin(theta) - rate**2 * np.cos(theta)
    N = sample(bent, "N", [0.0, 1.0])[bars]
    assert np.abs(N[..., 1] - N[..., 0] - along[:, None].T).max() < 1e-8 * size  # N' = -q


class TestForwardDynamics:
    @pytest.mark.parametrize("count", [1, 2])
    def test_windows_fall_through_flat_positions(self, count):
        """All rods have the same angle, so it is a physical pendulum."""
        from scipy.integrate import solve_ivp

        inertia, weight = (count + 1) / 3 + count, 9.81 * ((count + 1) / 2 + count)
        course = forward(windows(count), [Effort()], np.pi / 2, -1.0, 1.5, 1e-9)
        times = np.linspace(0, 1.5, 7)
        found = motion_during(course, times)
        pendulum = solve_ivp(
            lambda _, y: [y[1], -weight / inertia * np.cos(y[0])],
            (0, 1.5),
            [np.pi / 2, -1.0],
            method="DOP853",
            rtol=1e-12,
            atol=1e-12,
            t_eval=times,
        )
        assert pendulum.y[0].min() < -1.0
        np.testing.assert_allclose(found.drive[0], pendulum.y[0], rtol=0, atol=1e-6)
        np.testing.assert_allclose(found.direction[2], found.direction[1], rtol=0, atol=1e-9)

    @pytest.mark.slow
    def test_two_windows_after_ten_seconds(self):
        """B0 of the IFToMM library's double four-bar after 10 s, with five passes of the flat positions."""
        course = forward(windows(2), [Effort()], np.pi / 2, -1.0, 10.0, 1e-9)
        place = np.exp(1j * motion_during(course, np.array([10.0])).drive[0, -1])
        assert place == pytest.approx(0.3284581115408154 + 0.944518538178601j, abs=1e-7)

    @pytest.mark.slow
    def test_forty_windows_after_ten_seconds(self):
        """The library's N = 40: a pendulum of (1/3 41 + 40) kg m^2."""
        from scipy.integrate import solve_ivp

        inertia, weight = 41 / 3 + 40, 9.81 * (41 / 2 + 40)
        course = forward(windows(40), [Effort()], np.pi / 2, -1.0, 10.0, 1e-9, evaluations=10**6)
        slope = lambda _, y: [y[1], -weight / inertia * np.cos(y[0])]  # noqa: E731
        swung = solve_ivp(slope, (0, 10.0), [np.pi / 2, -1.0], method="DOP853", rtol=1e-12, atol=1e-12).y[0, -1]
        found = motion_during(course, np.array([10.0]))
        assert found.drive[0, -1] == pytest.approx(swung, abs=1e-6)
        np.testing.assert_allclose(found.direction[40, -1], found.direction[1, -1], rtol=0, atol=1e-8)

    def test_a_bound_on_evaluations_keeps_the_results(self):
        with pytest.raises(ForwardError, match="it has taken 100 evaluations") as caught:
            forward(windows(1), [Effort()], np.pi / 2, -1.0, 1.5, evaluations=100)
        reached = caught.value.motion
        assert 0 < reached.time[-1] == caught.value.time < 1.5
        assert np.isfinite(motion_during(reached, reached.time).direction).all()

    def test_progress_can_stop_the_integration(self):
        instants = []

        def progress(time):
            instants.append(time)
            if len(instants) == 3:
                raise KeyboardInterrupt

        with pytest.raises(ForwardError, match="it was interrupted") as caught:
            forward(windows(1), [Effort()], np.pi / 2, -1.0, 1.5, on_step=progress)
        assert len(instants) == 3
        assert caught.value.kind == "interrupted"
        assert caught.value.motion.time[-1] == instants[-1]
        assert 0 < instants[0] < instants[1] < instants[2] < 1.5


def test_requested_instants_are_on_the_integrated_branch():
    """A four-bar of 1, 2, 2.5 and 3.5 m falls through its flat position repeatedly, and its sign changes there."""
    places = {"O": 0, "A": 1j, "B": 1.7 + 2j, "D": 3.5}
    links = (
        Link("ground", {"O": 0.0, "D": 3.5}),
        Link("crank", {"O": 0.0, "A": 1.0}, (Beam("O", "A", 1.0),)),
        Link("coupler", {"A": 0.0, "B": 2.0}, (Beam("A", "B", 1.0),)),
        Link("rocker", {"D": 0.0, "B": 2.5}, (Beam("D", "B", 1.0),)),
    )
    mechanism = Mechanism(links, (PinDrive("crank", "O"),), places, gravity=-9.81j)
    found = motion_during(forward(mechanism, [Effort()], np.pi / 2, 6.0, 2.0, 1e-6), np.linspace(0, 2, 2001))
    angle = found.drive[0]
    passed = np.floor((angle - np.pi) / (2 * np.pi)) + 1
    assert passed.max() - passed.min() > 2
    base = 3.5 - np.exp(1j * angle)
    along = (np.abs(base) ** 2 + 2.0**2 - 2.5**2) / (2 * np.abs(base))
    expected = base / np.abs(base) * (along + 1j * (-1.0) ** passed * np.sqrt(2.0**2 - along**2)) / 2.0
    np.testing.assert_allclose(found.direction[2], expected, rtol=0, atol=1e-6)
