"""A motion is a path from the drawing: positions that the drive cannot reach have no answer.

Reference angles and stops are from `benchmarks/branch_tracker.py`, which shares no code with the program.
"""

import numpy as np
import pytest
from mechanisms import linkage
from tiers import in_tiers

from kinelast.cli.command import main
from rigid import Link, Mechanism, PinDrive, Slider, motion, motion_in_chunks
from rigid.analysis import ReachError, require_reach, stops
from rigid.positions.knots import select, steps
from rigid.positions.trace import Trace

RODS = (("crank", "O", "K"), ("r1", "G", "A"), ("r2", "H", "B"), ("r3", "K", "C"))


def plate_on_rods(places):
    return linkage(places | {"O": 0}, "OGH", RODS, [("plate", "ABC")], [PinDrive("crank", "O")])


def angles(course, link, *ends):
    """Return the angle of the line between two points of a link, shape (positions,)."""
    at = course.mechanism.index[link]
    points = course.mechanism.links[at].points
    return np.angle(course.direction[at] * (points[ends[1]] - points[ends[0]]))


@pytest.fixture(scope="module")
def stopping():
    """A triad with a dead point after nine of 90 steps; another assembly closes beyond it."""
    places = {"K": -0.19070431641163083 + 0.12463678675332758j, "A": -0.1160107609583973 + 0.4073359491185786j}
    places |= {"B": 0.044108179242725545 + 0.4282210921513012j, "C": -0.025995123679405457 + 0.5742362155598768j}
    places |= {"G": 0.07482561834430901 + 0.10733594911857863j, "H": -0.05577150877833437 + 0.12822109215130123j}
    return plate_on_rods(places), 2.5627185955888687 - np.linspace(0, 6.213372137099814, 90)


STOP = 1.8863539849052864


@pytest.mark.slow
def test_a_drive_does_not_jump_over_its_stop(stopping):
    mechanism, drive = stopping
    course = motion(mechanism, drive)
    np.testing.assert_array_equal(np.isfinite(course.direction).all(axis=0), drive > STOP)
    np.testing.assert_allclose(
        angles(course, "plate", "A", "B")[[0, 1, 5, 8, 9]],
        [0.129702929, -0.001534956, -0.631140272, -1.317793784, -1.66839223],
        rtol=0,
        atol=2e-9,
    )


def test_the_error_gives_the_stop(stopping):
    course = motion(*stopping)
    [(place, joint)] = stops(course)
    assert place[0] == pytest.approx(STOP, abs=1e-7)
    assert joint in {"A", "B", "C", "G", "H"}
    with pytest.raises(ReachError, match=rf'89% .* stops at "crank" at 108.08 deg, where the joint "{joint}" opens'):
        require_reach(course)


def test_chunks_have_the_same_stop(stopping):
    mechanism, drive = stopping
    whole = motion(mechanism, drive)
    parts = [part.direction for part in motion_in_chunks(mechanism, drive, columns=16)]
    np.testing.assert_array_equal(np.concatenate(parts, axis=-1), whole.direction)


@pytest.mark.slow
def test_the_first_position_is_reached_by_the_longer_way_if_the_shorter_is_blocked(stopping):
    course = motion(stopping[0], [1.5, 1.4])
    np.testing.assert_allclose(angles(course, "plate", "A", "B")[0], 2.75728285, rtol=0, atol=1e-8)


@pytest.mark.slow
def test_after_a_turn_the_assembly_is_different():
    """An eight-bar completes a turn with another assembly, and stops in the second turn."""
    places = {"J0": 0.6055800129523379 + 0.9999592316503161j, "J1": 0.3978951398323819 + 0.9826576534679021j}
    places |= {"J2": 0.28423027531655043 + 0.8302931958280844j, "J3": 0.7972542870050527 + 0.43849063105357333j}
    places |= {"J4": 0.25888493001972956 + 0.002398719251167747j, "J5": 0.059760675830834775 + 0.390825815105887j}
    places |= {"J6": 0.8077470065248197 + 0.5315573606065915j, "J7": 0.7311161255713782 + 0.33836199577787807j}
    places |= {"J8": 0.40571094834238386 + 0.30317700893120336j, "J9": 0.7934005832456239 + 0.36746861544899634j}
    plates = [("t1", ("J1", "J6", "J8")), ("t2", ("J0", "J3", "J4")), ("t3", ("J2", "J4", "J9"))]
    bars = (("crank", "J7", "J3"), ("b1", "J0", "J1"), ("b2", "J8", "J9"), ("b3", "J2", "J5"))
    mechanism = linkage(places, ("J5", "J6", "J7"), bars, plates, [PinDrive("crank", "J7")])
    drive = 0.9870528773522712 + 0.5 * np.linspace(0, 37.66420525803763, 1080)[::4]
    course = motion(mechanism, drive)
    np.testing.assert_array_equal(np.isfinite(course.direction).all(axis=0), drive < 8.94531466434619)
    found = angles(course, "t2", "J0", "J3")
    np.testing.assert_allclose(found[[0, 57]], [-1.241821142, 0.14771693], rtol=0, atol=2e-9)
    assert abs(np.exp(1j * found[90]) - np.exp(1j * found[0])) > 1.0


@pytest.mark.slow
def test_an_avoided_crossing_is_passed_smoothly():
    """The sine drops to 1e-4 within 1e-4 rad; coarse tracking would go straight through."""
    places = {"K": -0.04654236408105347 + 0.08850880377536838j, "G": 0.3000040271859749 - 2.1603621709751288e-06j}
    places |= {"A": 0.2534606084110442 + 0.08850752352353106j, "H": 0.1499971018785951 + 0.2999975824625111j}
    places |= {"B": 0.10345696393259868 + 0.38851036816867596j, "C": 0.03345763591894653 + 0.18850880377536838j}
    course = motion(plate_on_rods(places), 2.054909520377838 + np.linspace(0, 6.213372137099814, 90))
    np.testing.assert_allclose(
        angles(course, "plate", "A", "B")[[0, 1, 45, 72, 73, 88, 89]],
        [2.034449861, 2.034459991, 2.034467602, 2.000873756, 1.961415214, 1.956929336, 2.000626514],
        rtol=0,
        atol=2e-9,
    )


def test_a_mechanism_drawn_near_a_dead_point_leaves_it():
    """The drawing is within 1e-3 rad of the dead point."""
    places = {"J0": 0.05553878110812882 + 0.6830830610151518j, "J1": -0.0087154722616936 + 0.7368457549246978j}
    places |= {"J2": 0.33066185913263757 + 0.09583892736130373j, "J3": 0.06638035015565968 + 0.6432475847745216j}
    places |= {"J4": 0.8015459639039866 + 0.07611060259496383j, "J5": 0.6403956496699923 + 0.7354977483318944j}
    places |= {"J6": 0.5781135367196789 + 0.007366547826979208j, "J7": 0.6387053020907006 + 0.10536060177550399j}
    places |= {"J8": 0.05922706365250607 + 0.07976807294160526j, "J9": 0.07224326700336614 + 0.224933925476557j}
    plates = [("t1", ("J1", "J6", "J7")), ("t2", ("J4", "J5", "J6")), ("t3", ("J0", "J2", "J8"))]
    bars = (("crank", "J3", "J1"), ("b1", "J2", "J9"), ("b2", "J0", "J4"), ("b3", "J5", "J7"))
    mechanism = linkage(places, ("J3", "J8", "J9"), bars, plates, [PinDrive("crank", "J3")])
    course = motion(mechanism, np.linspace(2.2469512035913453, 3.817747530386242, 61))
    np.testing.assert_allclose(
        angles(course, "t2", "J4", "J5")[[0, 1, 30, 59, 60]],
        [1.81049191, 1.952698502, -2.860097351, -1.985098928, -1.959767797],
        rtol=0,
        atol=2e-9,
    )


@pytest.mark.slow
def test_a_mechanism_drawn_at_a_dead_point_leaves_it():
    """The drawing is within 1e-12 rad: large steps fail and are retracted, and certified steps succeed."""
    places = {"O": 0.07747922715691768 + 0.4124790592464411j, "K": 0.11175786091559972 + 0.466626813006864j}
    places |= {"G": 0.18674705433930794 - 0.292714507977602j, "H": -0.16145951908900047 + 0.24989371303998176j}
    places |= {"A": 0.39810275260978756 - 0.2116562827612125j, "B": 0.021980854957852458 + 0.17074757624768788j}
    places |= {"C": 0.3416480045840227 + 0.22920012383673968j}
    bars = (("crank", "O", "K"), *RODS[1:])
    mechanism = linkage(places, "OGH", bars, [("plate", "ABC")], [PinDrive("crank", "O")])
    course = motion(mechanism, 1.00642392896588 + np.linspace(0, 1, 12))
    assert np.isfinite(course.direction).all()
    found = angles(course, "plate", "A", "B")[[1, 5, 11]]
    np.testing.assert_allclose(found, [2.41697221, 2.50531039, 2.55706157], rtol=0, atol=1e-8)


@pytest.mark.slow
def test_positions_beyond_an_uncertain_change_point_are_unknown(monkeypatch):
    """Two equal rods and a third from an equal crank carry a plate in parallel; they align at 1.789 rad."""
    for name in ("_passes_smoothly", "_turns_with_drive"):
        monkeypatch.setattr(Trace, name, lambda *_: False)
    way = 0.1 * np.exp(1.2j)
    places = {"K": way, "C": 0.35 + 0.3j, "G": 0.3 + 0.05j, "H": 0.2 + 0.5j}
    course = motion(plate_on_rods(places | {"A": places["G"] + way, "B": places["H"] + way}), 1.2 + 0.1 * np.arange(63))
    np.testing.assert_array_equal(np.isfinite(course.direction).all(axis=0), course.drive[0] < 1.789)
    np.testing.assert_allclose(np.ptp(angles(course, "plate", "A", "B")[:6]), 0.0, atol=1e-9)


def equal_cranks(way, third, count, off=0.0):
    """Return the motion of a plate on two rods equal to the crank, and a third rod or the crank itself."""
    points = [0.3 + 0.05j, 0.2 + 0.5j]
    places = {"K": way, "G": points[0], "H": points[1], "A": points[0] + way, "B": points[1] + way + off}
    if third == "rod":
        mechanism = plate_on_rods(places | {"C": 0.35 + 0.3j})
    else:
        bars = (RODS[0], ("r1", "G", "A"), ("r2", "H", "B"))
        mechanism = linkage(places | {"O": 0}, "OGH", bars, [("plate", "KAB")], [PinDrive("crank", "O")])
    return motion(mechanism, np.angle(way) + np.linspace(0, 4 * np.pi, count, endpoint=False))


@pytest.mark.parametrize(
    ("third", "angle"), in_tiers([("crank", 1.2), ("rod", 1.2), ("rod", 1.789), ("rod", -0.3)], 1, 1)
)
def test_a_plate_on_equal_cranks_moves_in_parallel(third, angle):
    """It passes all change points; the additional crank makes it redundant."""
    course = equal_cranks(0.1 * np.exp(1j * angle), third, 73)
    known = np.isfinite(course.direction).all(axis=0)
    assert np.count_nonzero(~known) <= 1  # at a change point
    at = course.mechanism.index["plate"]
    np.testing.assert_allclose(course.direction[at, known], course.direction[at, known][0], rtol=0, atol=1e-7)
    for rod in ("r1", "r2"):
        turned = course.direction[course.mechanism.index[rod], known]
        np.testing.assert_allclose(turned, np.exp(1j * course.drive[0, known]), rtol=0, atol=1e-7)


@pytest.mark.exhaustive
def test_a_design_of_equal_cranks_continues_although_another_stops():
    """Designs are traced over eight turns, since the stopped design never repeats."""
    way, off = np.exp(1.2j), np.array([[0.0], [1e-3]])
    crank, foot, other, third = np.array([[0.1], [0.12]]), 0.3 + 0.05j, 0.2 + 0.5j, 0.35 + 0.3j
    along, tip = (other - foot) / abs(other - foot), foot + 0.1 * way
    plate = {"A": 0j, "B": abs(other - foot), "C": (third - tip) / along}
    links = [("crank", {"O": 0j, "K": crank}), ("plate", plate), ("r1", {"G": 0j, "A": crank})]
    links += [("r2", {"H": 0j, "B": crank + off}), ("r3", {"K": 0j, "C": abs(third - 0.1 * way)})]
    drawing = {"O": 0j, "K": 0.1 * way, "G": foot, "H": other, "A": tip, "B": other + 0.1 * way, "C": third}
    ground = Link("ground", {"O": 0j, "G": foot, "H": other})
    mechanism = Mechanism((ground, *(Link(*link) for link in links)), (PinDrive("crank", "O"),), drawing)
    direction = motion(mechanism, 1.2 + np.linspace(0, 4 * np.pi, 73, endpoint=False)).direction[2]
    np.testing.assert_allclose(direction[0], along, rtol=0, atol=1e-7)
    assert np.isnan(direction[1]).any()


@pytest.mark.slow
def test_slightly_unequal_cranks_are_not_treated_as_equal(monkeypatch):
    carried = []
    plain = Trace._turns_with_drive
    monkeypatch.setattr(Trace, "_turns_with_drive", lambda *given: carried.append(plain(*given)) or carried[-1])
    equal_cranks(0.1 * np.exp(1.2j), "rod", 73, 1e-13 * np.exp(0.4j))
    assert carried
    assert not any(carried)


def test_the_certificate_of_a_step_does_not_depend_on_other_steps():
    """The drawing is 4.4e-6 rad before the dead point of the last dyad, which closes again 0.023 rad beyond.

    A step across the gap must not be accepted because of other steps in the same batch.
    """
    places = {"D0": -0.250503905285663 - 0.04766986590254707j, "D1": 0.05904084929877307 + 0.40585182779962325j}
    places |= {"D2": 0.39829559406700465 + 0.16669156288887477j, "K": -0.31004129870839936 + 0.1364449125340887j}
    places |= {"P": 0.14960254048581775 - 0.3998156168894246j, "S0": -0.34801668672881003 - 0.1390271148451756j}
    places |= {"S1": 0.4695173515170074 + 0.15961129807930374j, "S2": -0.18812775949077326 - 0.22786644609155704j}
    places |= {"S3": -0.2991857726712836 + 0.37353948918260654j, "O": -0.2467405192156582 + 0.3586598558200298j}
    rods = ("PS0", "D2S0", "S0S1", "D1S1", "KS2", "PS2", "D1S2", "D0S3", "S1S3", "KS3")
    bars = (("crank", "O", "K"), *((f"b{k}", rod[:-2], rod[-2:]) for k, rod in enumerate(rods)))
    mechanism = linkage(places, ("O", "D0", "D1", "D2"), bars, drives=[PinDrive("crank", "O")])
    drive = -1.8483086217923526 - 0.09666438934122445 * np.arange(65)
    np.testing.assert_array_equal(np.isfinite(motion(mechanism, drive).direction).all(axis=0), drive > -1.84831302)
    (branch,) = mechanism.__dict__["_branches"].values()
    at = steps(branch.table)
    low, high = select(branch.table, at), select(branch.table, at + 1)
    together = branch.certify(low, high, 4)[0]
    for k in range(len(at)):
        np.testing.assert_array_equal(branch.certify(select(low, [k]), select(high, [k]), 4)[0], together[k : k + 1])


THREE_CRANKS = """
sections.bar = {shape = "rigidities", EA = 1e6, EI = 1e3, mass_per_length = 1.0}
points = {A0 = [0.0, 0.0], A1 = [1.0, 0.0], A2 = [2.0, 0.0], B0 = [0.0, 1.0], B1 = [1.0, 1.0], B2 = [2.0, 1.0]}
[links]
ground = {points = ["A0", "A1", "A2"]}
u0 = {points = ["A0", "B0"], section = "bar"}
u1 = {points = ["A1", "B1"], section = "bar"}
u2 = {points = ["A2", "B2"], section = "bar"}
h = {points = ["B0", "B1", "B2"], section = "bar"}
[[drives]]
link = "u0"
effort = 0.0
speed = -1.0
[run]
duration = 10.0
positions = 101
gravity = [0.0, -9.81]
"""


@pytest.mark.slow
def test_three_released_cranks_have_an_answer(tmp_path):
    """A redundant mechanism passes flat positions."""
    (tmp_path / "cranks.toml").write_text(THREE_CRANKS)
    assert main([str(tmp_path / "cranks.toml"), "-o", str(tmp_path / "out")]) in (0, 1)
    assert (tmp_path / "out" / "cranks" / "summary.json").exists()


class TestParallelLines:
    """A block on two lines; one line rotates with the crank, at a distance from the pivot."""

    @staticmethod
    def block(height):
        """Return a block on a line 1 m from the crank's pivot, and on a line parallel to x at a height [m]."""
        links = Link("ground", {"O": 0}), Link("crank", {"O": 0, "A": 1}), Link("tool", {"P": 0, "T": 1})
        sliders = Slider("guide", "tool", "ground", "P", 1j * height, 1), Slider("slot", "block", "crank", "P", 1j, 1)
        place = (np.cos(1) * height - 1) / np.sin(1) + 1j * height
        drawn = {"O": 0, "A": np.exp(1j), "P": place, "T": place + 1}
        return Mechanism((*links, Link("block", {"P": 0})), (PinDrive("crank", "O"),), drawn, sliders)

    @pytest.mark.parametrize("height", [2.0, 0.5])
    def test_the_motion_ends_if_they_become_parallel(self, height):
        """x = (h cos a - 1) / sin a, infinite at 0 and 180 degrees."""
        angle = 1 + np.linspace(0, 2.5, 40)
        x = motion(self.block(height), angle).origin[2].real
        expected = (height * np.cos(angle) - 1) / np.sin(angle)
        np.testing.assert_allclose(x, np.where(angle < np.pi, expected, np.nan), rtol=1e-9)

    def test_the_motion_continues_if_they_coincide(self):
        """x = -tan(a / 2) for h = 1: finite at 0, infinite at 180 degrees."""
        angle = 1 - np.linspace(0, 5, 80)
        x = motion(self.block(1.0), angle).origin[2].real
        np.testing.assert_allclose(x, np.where(angle > -np.pi, -np.tan(angle / 2), np.nan), rtol=1e-6)
