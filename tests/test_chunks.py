"""Chunks of a batch give the whole batch, on the smooth branch and in bounded memory.

References are geometry (links of a parallelogram stay parallel, gears keep their ratio) and the undivided batch,
which the other tests compare with independent references.
"""

import tracemalloc

import numpy as np
import pytest
from mechanisms import ALL, bar, four_bar, linkage, motion_of, replaced, steel_four_bar, turn, with_link
from tiers import in_tiers

from elastic import PRIMARY, deflection
from rigid import Beam, Gear, Link, Mechanism, PinDrive, motion, motion_in_chunks
from rigid.chunks import SEAM_POSITIONS

EPS = np.finfo(float).eps


def joined(chunks, name, axis=-1):
    return np.concatenate([getattr(chunk, name) for chunk in chunks], axis=axis)


def parallelogram(start=0.3):
    lean = 0.1 * np.exp(1j * start)
    places = {"O": 0, "D": 0.35, "A": lean, "B": 0.35 + lean}
    bars = (("crank", "O", "A"), ("coupler", "A", "B"), ("rocker", "D", "B"))
    return linkage(places, "OD", bars, drives=[PinDrive("crank", "O")])


class TestBranch:
    @pytest.mark.parametrize("off", [0.0, 1e-10, -1e-10])
    def test_a_seam_does_not_restart_at_a_flat_position(self, off):
        """The last position of the chunk is flat within round-off, so an earlier one becomes the drawing."""
        columns = 25
        angle = np.pi + off + (np.arange(60) - (columns - SEAM_POSITIONS - 1)) * 0.1
        chunks = list(motion_in_chunks(parallelogram(angle[0]), angle, 1.0, columns=columns))
        crank, _, rocker = joined(chunks, "direction")[1:]
        np.testing.assert_allclose(rocker, crank, rtol=0, atol=1e-6)

    @pytest.mark.parametrize("columns", in_tiers([7, 4, 25, 61, 100], 1, 2))
    def test_a_parallelogram_stays_one_for_any_seams(self, columns):
        """It is flat every half turn, sometimes at a seam; the coupler stays parallel to the ground."""
        angle = 0.3 + np.arange(300) * 0.1
        chunks = list(motion_in_chunks(parallelogram(), angle, 1.0, columns=columns))
        crank, coupler, rocker = joined(chunks, "direction")[1:]
        assert abs(coupler - 1).max() < 1e-6
        assert abs(rocker - crank).max() < 1e-6
        np.testing.assert_allclose(crank, np.exp(1j * angle), rtol=0, atol=1e-14)

    @pytest.mark.parametrize("columns", [5, 31, 32, 33, 34, 35, 36])
    @pytest.mark.parametrize("flat", in_tiers([31.5, 31.03, 31.97], 1, 2))
    def test_a_seam_beside_the_flat_position(self, columns, flat):
        """Positions 31 and 32 are on both sides of the flat one, half a step or less away."""
        angle = np.pi + (np.arange(60) - flat) * 0.05
        chunks = list(motion_in_chunks(parallelogram(), angle, 1.0, columns=columns))
        assert abs(joined(chunks, "direction")[2] - 1).max() < 1e-6

    @pytest.mark.parametrize("columns", [32, 33, 34, 35, 36])
    def test_a_seam_beside_a_position_that_is_flat(self, columns):
        """The flat position does not determine the branch, but the previous one does."""
        angle = np.pi + (np.arange(60) - 31) * 0.05
        chunks = list(motion_in_chunks(parallelogram(), angle, 1.0, columns=columns))
        assert abs(np.delete(joined(chunks, "direction")[2], 31) - 1).max() < 1e-6

    @pytest.mark.parametrize("columns", in_tiers([5, 24, 50], 1, 2))
    def test_a_group_that_is_no_dyad(self, columns):
        case = ALL["triad"](count=120)
        chunks = list(motion_in_chunks(case.mechanism, case.drive, case.rate, case.rate2, columns=columns))
        whole = motion_of(case)
        np.testing.assert_allclose(joined(chunks, "origin"), whole.origin, rtol=0, atol=1e-13)
        np.testing.assert_allclose(joined(chunks, "acceleration"), whole.acceleration, rtol=1e-11, atol=1e-11)

    def test_positions_out_of_reach_between_the_seams(self):
        """A double rocker oscillates beyond its reach, so the branch must be restored after a gap."""
        case = four_bar(crank=0.25, coupler=0.2, rocker=0.2, base=0.3, loads=())
        angle = 0.4 + 1.6 * np.sin(np.linspace(0, 6 * np.pi, 200))
        whole = motion(case.mechanism, angle)
        chunks = list(motion_in_chunks(case.mechanism, angle, columns=12))
        assert np.isnan(whole.condition).any()
        np.testing.assert_array_equal(joined(chunks, "direction"), whole.direction)

    def test_a_gear_counts_the_turns_of_earlier_chunks(self):
        """With ratio 0.3 the follower has 0.3 times the total angle after many turns of the driver."""
        links = (
            Link("ground", {"O": 0.0, "P": 1.0}),
            Link("driver", {"O": 0.0, "A": 0.2}),
            Link("follower", {"P": 0.0, "B": 0.2}),
        )
        gear = Gear(PinDrive("driver", "O"), PinDrive("follower", "P"), 0.3)
        drawing = {"O": 0, "A": 0.2, "P": 1, "B": 1.2}
        mechanism = Mechanism(links, (PinDrive("driver", "O"),), drawing, gears=(gear,))
        angle = np.arange(400) * 0.21
        chunks = list(motion_in_chunks(mechanism, angle, columns=23))
        np.testing.assert_allclose(joined(chunks, "direction")[2], np.exp(0.3j * angle), rtol=0, atol=1e-12)
        np.testing.assert_array_equal(joined(chunks, "drive"), [angle])


class TestSameNumbers:
    @pytest.mark.parametrize("name", ["RRR", "RRP", "RPR", "RPP", "arm", "six-bar"])
    def test_every_field_is_equal(self, name):
        case = ALL[name]()
        inputs = (case.drive, case.rate, case.rate2)
        whole = deflection(motion(case.mechanism, *inputs), case.sections)
        courses = motion_in_chunks(case.mechanism, *inputs, columns=7)
        chunks = [deflection(course, case.sections) for course in courses]
        assert len(chunks) == 4
        for field in PRIMARY:
            np.testing.assert_array_equal(joined(chunks, field), getattr(whole, field))

    def test_times_continue_across_chunks(self):
        case = steel_four_bar(20)
        assert list(joined(motion_in_chunks(case.mechanism, case.drive, columns=6), "time")) == list(range(20))

    def test_designs(self):
        """Cranks of nine lengths, two designs per chunk, the last one alone."""
        cranks = np.linspace(0.05, 0.12, 9)[:, None]
        case = steel_four_bar(10)
        links = tuple(
            Link("crank", {"O": 0.0, "A": cranks}, (Beam("O", "A", 3 * cranks),)) if link.name == "crank" else link
            for link in case.mechanism.links
        )
        mechanism = replaced(case.mechanism, links=links)
        whole = motion(mechanism, case.drive, case.rate)
        chunks = list(motion_in_chunks(mechanism, case.drive, case.rate, columns=20))
        assert [chunk.columns[0] for chunk in chunks] == [2, 2, 2, 2, 1]
        for field in ("origin", "direction", "velocity"):
            np.testing.assert_array_equal(joined(chunks, field, axis=1), getattr(whole, field))

    def test_designs_are_separated_if_their_positions_fill_a_chunk(self):
        cranks = np.array([[0.08], [0.1]])
        case = steel_four_bar(25)
        mechanism = with_link(case.mechanism, bar("crank", "O", "A", cranks))
        whole = motion(mechanism, case.drive)
        chunks = list(motion_in_chunks(mechanism, case.drive, columns=10))
        assert [chunk.columns for chunk in chunks] == [(1, 10), (1, 10), (1, 5)] * 2
        for design in (0, 1):
            found = joined(chunks[3 * design : 3 * design + 3], "direction")
            np.testing.assert_array_equal(found[:, 0], whole.direction[:, design])


@pytest.mark.parametrize(
    ("positions", "expected"),
    [(10, [10]), (8192, [8192]), (9000, [9000]), (20000, [10000, 10000]), (13000, [8192, 4808])],
)
def test_default_chunks_leave_no_small_rest(positions, expected):
    """The default is 8192 columns for a four-bar, or up to half as many more."""
    case = steel_four_bar(8)
    assert [len(chunk.time) for chunk in motion_in_chunks(case.mechanism, turn(positions))] == expected


def peak_memory(count):
    case = steel_four_bar(8)
    drive = turn(count)
    tracemalloc.start()
    for course in motion_in_chunks(case.mechanism, drive, 100.0, columns=500):
        deflection(course, case.sections)
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    return peak


def test_memory_does_not_grow_with_the_positions():
    """Only the results grow, by 8 bytes per number; a chunk takes about a megabyte."""
    peak_memory(1000)
    few, many = peak_memory(2_000), peak_memory(40_000)
    assert many - few < 38_000 * 2 * 8


def test_too_small_chunks_are_an_error():
    with pytest.raises(ValueError, match="chunks of 3 columns, expected more than 3"):
        next(motion_in_chunks(parallelogram(), [0.0, 0.1], columns=3))
