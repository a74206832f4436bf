"""Motion laws of drives."""

from math import inf, pi, sqrt

import numpy as np
import pytest

from rigid import ConstantSpeed, LawError, RepeatedLaw, Segment, SegmentedLaw, TableLaw, law_peaks
from rigid.laws import CURVES
from rigid.peaks import PEAKS as WITHIN

SMOOTH = ("harmonic", "cycloidal", "polynomial-345", "polynomial-4567", "modified-trapezoid", "modified-sine")
RISES = (*SMOOTH, "trapezoidal-velocity", "constant-acceleration")

# Largest velocity h/T and acceleration h/T^2 of the double-dwell curves: peak factors of R. L. Norton, Design of
# Machinery, chapter 8, in closed form. They are 30 z^2 (1 - z)^2 and 140 z^3 (1 - z)^3 at z = 1/2, and the
# acceleration at the roots of the jerk.
PEAKS = {
    "harmonic": (pi / 2, pi**2 / 2),
    "cycloidal": (2.0, 2 * pi),
    "polynomial-345": (1.875, 10 / sqrt(3)),
    "polynomial-4567": (2.1875, 84 / (5 * sqrt(5))),
    # The ramps reach a speed of 1; the modified trapezoid and sine follow by integration from a rise of 1.
    "trapezoidal-velocity": (1.5, 4.5),
    "constant-acceleration": (2.0, 4.0),
    "modified-trapezoid": (2.0, 8 * pi / (2 + pi)),
    "modified-sine": (4 * pi / (4 + pi), 4 * pi**2 / (4 + pi)),
}


def fine(duration: float, count: int = 20001) -> np.ndarray:
    return np.linspace(0.0, duration, count)


def assert_consistent(law: SegmentedLaw, time: np.ndarray, tolerance: float) -> None:
    """Check rate and acceleration against central differences of the coordinate."""
    step = 1e-5 * law.duration
    ahead, here, behind = law(time + step), law(time), law(time - step)
    for order in (0, 1):
        slope = (ahead[order] - behind[order]) / (2 * step)
        assert slope == pytest.approx(here[order + 1], abs=tolerance * np.abs(here[order + 1]).max())


@pytest.mark.parametrize("curve", RISES)
def test_rises_have_the_handbook_peaks(curve):
    _, rate, acceleration = SegmentedLaw(0.0, (Segment(curve, 0.2, 3.0),))(fine(0.2))
    velocity, bend = PEAKS[curve]
    assert np.abs(rate).max() == pytest.approx(velocity * 3.0 / 0.2, rel=1e-7)
    assert np.abs(acceleration).max() == pytest.approx(bend * 3.0 / 0.2**2, rel=1e-7)


@pytest.mark.parametrize("curve", SMOOTH)
def test_rises_start_and_end_at_rest_with_consistent_derivatives(curve):
    law = SegmentedLaw(1.0, (Segment(curve, 0.5, -2.0),))
    value, rate, _ = law(np.array([0.0, 0.25, 0.5]))
    assert value == pytest.approx([1.0, 0.0, -1.0], abs=1e-14)
    assert rate[[0, 2]] == pytest.approx([0.0, 0.0], abs=1e-13)
    assert_consistent(law, np.linspace(0.01, 0.49, 97), 1e-7)


@pytest.mark.parametrize("curve", ["trapezoidal-velocity", "constant-acceleration"])
def test_curves_of_constant_acceleration_equal_integrals(curve):
    z = fine(1.0)
    value, rate, acceleration = CURVES[curve](z)
    gained = np.concatenate([[0.0], np.cumsum((acceleration[1:] + acceleration[:-1]) / 2 * np.diff(z))])
    gone = np.concatenate([[0.0], np.cumsum((rate[1:] + rate[:-1]) / 2 * np.diff(z))])
    assert rate == pytest.approx(gained, abs=1e-3)
    assert value == pytest.approx(gone, abs=1e-8)
    assert value[-1] == pytest.approx(1.0, abs=1e-15)


@pytest.mark.parametrize(
    "curve", ["cycloidal", "polynomial-345", "polynomial-4567", "modified-trapezoid", "modified-sine"]
)
def test_only_the_harmonic_law_starts_with_acceleration(curve):
    assert CURVES[curve](np.array([0.0, 1.0]))[2] == pytest.approx([0.0, 0.0], abs=1e-12)
    assert CURVES["harmonic"](np.array([0.0, 1.0]))[2] == pytest.approx([pi**2 / 2, -(pi**2) / 2])


def test_segments_are_joined():
    law = SegmentedLaw(0.1, (Segment("cycloidal", 1.0, 2.0), Segment("dwell", 0.5), Segment("harmonic", 2.0, -1.0)))
    value, rate, acceleration = law([0.0, 1.0, 1.3, 2.5, 3.5, 9.0, 1.5])
    assert law.duration == 3.5
    assert value == pytest.approx([0.1, 2.1, 2.1, 1.6, 1.1, 1.1, 2.1])
    assert rate == pytest.approx([0.0, 0.0, 0.0, -pi / 4, 0.0, 0.0, 0.0], abs=1e-12)
    # At 1.5 s the dwell ends, and the harmonic starts with -pi^2/2 h/T^2. At 3.5 s it still has the acceleration
    # pi^2/2 h/T^2; afterwards nothing moves.
    assert acceleration[[2, 4, 5, 6]] == pytest.approx([0.0, pi**2 / 8, 0.0, -(pi**2) / 8])


def test_a_polynomial_continues_a_constant_speed():
    law = SegmentedLaw(
        0.0,
        (
            Segment("polynomial-345", 0.4, 1.0),
            Segment("constant-speed", 1.0, 10.0),
            Segment("polynomial-345", 0.5, 3.0),
        ),
    )
    before, after = law(np.array([0.4 - 1e-9, 1.4 - 1e-9])), law(np.array([0.4 + 1e-9, 1.4 + 1e-9]))
    assert before[1] == pytest.approx([10.0, 10.0], rel=1e-6)
    assert after[1] == pytest.approx([10.0, 10.0], rel=1e-6)
    assert np.concatenate([before[2], after[2]]) == pytest.approx(np.zeros(4), abs=1e-4)
    assert law([1.9])[0] == pytest.approx([14.0])
    assert law([1.9])[1] == pytest.approx([0.0], abs=1e-12)
    assert_consistent(law, np.linspace(0.01, 1.89, 90), 1e-7)


def test_a_constant_speed_has_no_acceleration():
    value, rate, acceleration = ConstantSpeed(0.5, -3.0)([0.0, 2.0])
    assert value.tolist() == [0.5, -5.5]
    assert rate.tolist() == [-3.0, -3.0]
    assert acceleration.tolist() == [0.0, 0.0]


@pytest.mark.parametrize(
    ("segments", "number", "message"),
    [
        ((), 1, "at least one segment"),
        ((Segment("cycloid", 1.0, 1.0),), 1, 'unknown curve "cycloid"'),
        ((Segment("dwell", 1.0), Segment("dwell", 0.0)), 2, "the duration is 0 s"),
        ((Segment("dwell", 1.0, 0.5),), 1, "a dwell cannot rise by 0.5"),
        ((Segment("dwell", 1.0), Segment("constant-speed", 2.0, 3.0)), 2, "the speed jumps from 0 to 1.5"),
    ],
)
def test_impossible_laws_are_errors(segments, number, message):
    with pytest.raises(LawError, match=message) as caught:
        SegmentedLaw(0.0, segments)
    assert caught.value.segment == number


@pytest.mark.parametrize(
    ("durations", "start", "end"),
    [((0.7, 0.1, 0.2), 0.8, 1.0), ((0.1, 0.2, 0.3), 0.3, 0.6), ((0.1, 0.1, 0.1), 0.2, 0.3)],
)
def test_the_side_of_a_segment_end_does_not_depend_on_round_off(durations, start, end):
    """A harmonic rise starts and ends with the largest acceleration, pi^2/2 h/T^2."""
    law = SegmentedLaw(0.0, tuple(map(Segment, ("dwell", "dwell", "harmonic"), durations, (0.0, 0.0, 2.0))))
    greatest = pi**2 / 2 * 2.0 / durations[2] ** 2
    near = np.array([1 - 4e-16, 1.0, 1 + 4e-16])
    np.testing.assert_allclose(law(start * near)[2], greatest, rtol=1e-6)
    np.testing.assert_allclose(law(end * near)[2], -greatest, rtol=1e-6)
    np.testing.assert_array_equal(law(end * np.array([1 + 1e-9]))[2], 0.0)


@pytest.mark.parametrize(
    ("curve", "speed", "acceleration", "jerk"),
    [
        ("cycloidal", "2.00", "6.283", "39.5"),
        ("modified-sine", "1.76", "5.53", "69.5"),
        ("modified-trapezoid", "2.00", "4.89", "61.4"),
        ("polynomial-345", "1.875", "5.77", "60.0"),
        ("polynomial-4567", "2.19", "7.51", "52.5"),
        ("harmonic", "1.57", "4.93", "inf"),
        ("constant-acceleration", "2.00", "4.00", "inf"),
    ],
)
def test_peaks_between_dwells_agree_with_the_handbook(curve, speed, acceleration, jerk):
    """Printed coefficients of a rise between dwells (VDI 2143-1; Norton, chapter 3)."""
    dwell = Segment("dwell", 0.3)
    peaks = law_peaks(SegmentedLaw(0.4, (dwell, Segment(curve, 0.5, -2.0), dwell)))
    unit = 2.0 / 0.5
    found = peaks.speed / unit, peaks.acceleration * 0.5 / unit, peaks.jerk * 0.25 / unit
    for value, printed in zip(found, (speed, acceleration, jerk), strict=True):
        digits = len(printed.partition(".")[2])
        assert value == pytest.approx(float(printed), abs=0.6 * 10**-digits)


@pytest.mark.parametrize("curve", CURVES)
def test_peaks_of_a_curve_agree_with_derivatives(curve):
    z = fine(1.0)
    _, rate, acceleration = CURVES[curve](z)
    slopes = np.diff(acceleration) / np.diff(z)
    smooth = np.abs(slopes) < 1e3  # excludes jumps in the acceleration
    found = [np.abs(each).max() for each in (rate, acceleration, slopes[smooth])]
    assert WITHIN[curve] == pytest.approx(found, rel=2e-4, abs=1e-6)
    if curve == "constant-speed":
        return
    law = SegmentedLaw(0.0, (Segment("dwell", 1.0), Segment(curve, 2.0, 0.0 if curve == "dwell" else 3.0)))
    jumps = law_peaks(law).jumps
    inside = (z[:-1][~smooth] + z[1:][~smooth]) / 2
    ends = [z for z in (0.0, 1.0) if abs(CURVES[curve](np.array([z]))[2][0]) > 1e-9]
    assert jumps == pytest.approx([1 + 2 * z for z in sorted([*inside.tolist(), *ends])], abs=1e-3)


@pytest.mark.parametrize(
    ("last", "jumps"),
    [
        (Segment("harmonic", 1.0, -1.0), ()),
        (Segment("harmonic", 2.0, -1.0), (0.0, 1.0, 3.0)),
        (Segment("cycloidal", 1.0, -1.0), (0.0, 1.0, 2.0)),
    ],
)
def test_jumps_of_a_repeated_law_include_the_repetition(last, jumps):
    """A harmonic rise and an equally long return are a cosine, with jerk pi^3/2."""
    law = SegmentedLaw(0.0, (Segment("harmonic", 1.0, 1.0), last))
    peaks = law_peaks(RepeatedLaw(law))
    if jumps:
        assert peaks.jumps[: len(jumps) - 1] == jumps[:-1]
        assert peaks.jerk == inf
    else:
        assert peaks.jerk == pytest.approx(pi**3 / 2)
        assert not peaks.jumps
    assert law_peaks(law).jerk == inf


def test_peaks_of_a_run_up():
    law = SegmentedLaw(0.0, (Segment("polynomial-345", 0.4, 1.0), Segment("constant-speed", 1.0, 10.0)))
    time = fine(0.4)
    _, rate, acceleration = law(time)
    peaks = law_peaks(law)
    assert peaks.speed == pytest.approx(np.abs(rate).max(), rel=1e-9)
    assert peaks.acceleration == pytest.approx(np.abs(acceleration).max(), rel=1e-7)
    assert peaks.jerk == pytest.approx(np.abs(np.diff(acceleration) / np.diff(time)).max(), rel=1e-3)
    assert not peaks.jumps


def test_peaks_of_a_table_are_those_of_the_spline():
    """t^3 - 2 t on 0..4 has 46, 24 and 6; a repeated cosine is fastest between entries, with nearly 1."""
    times = (0.0, 1.0, 2.5, 3.0, 4.0)
    peaks = law_peaks(TableLaw(times, tuple(t**3 - 2 * t for t in times)))
    assert (peaks.speed, peaks.acceleration, peaks.jerk, peaks.jumps) == (*map(pytest.approx, (46, 24, 6)), ())
    times = tuple(np.linspace(0, 2 * pi, 9).tolist())
    entries = np.cos(np.array(times[:-1]) + 0.3).tolist()
    law = TableLaw(times, (*entries, entries[0]), repeated=True)
    peaks, (_, rate, acceleration) = law_peaks(RepeatedLaw(law)), law(fine(2 * pi))
    assert peaks.speed == pytest.approx(np.abs(rate).max(), rel=1e-6)
    assert peaks.acceleration == pytest.approx(np.abs(acceleration).max(), rel=1e-6)
    assert peaks.speed == pytest.approx(1.0, rel=5e-3)
    assert peaks.jerk == pytest.approx(np.abs(np.diff(acceleration) / np.diff(fine(2 * pi))).max(), rel=1e-6)


def test_peaks_of_other_laws():
    assert law_peaks(ConstantSpeed(0.5, -3.0)).speed == 3.0
    assert law_peaks(lambda time: (time, time, time)) is None
