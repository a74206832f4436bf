"""The comparison with finite elements, and the contents of mesh files."""

from xml.etree import ElementTree

import meshio
import numpy as np
import pytest
from mechanisms import four_bar
from msgspec.structs import replace

from elastic import PRIMARY, Section, Taper, deflection, sample
from fem_check import compare, solve, write_vtu_series
from rigid import Beam, Link, Lump, Mechanism, PinDrive, PointLoad, Slider, SliderDrive, position_of
from rigid import motion as motion_of
from rigid.kinematics import repeated


def with_fields(bent, **values):
    """Return a deflection of undivided beams with other coefficients."""
    return replace(bent, amplitudes=replace(bent.amplitudes, **values))


@pytest.fixture(scope="module")
def answers():
    case = four_bar()
    turning = motion_of(case.mechanism, case.drive, case.rate, case.rate2, np.linspace(0, 0.1, 24))
    return deflection(turning, case.sections), solve(turning, case.sections, 8)


def test_the_right_answer_passes(answers):
    comparison = compare(*answers)
    assert comparison.passed
    assert comparison.compared == 24
    assert [worst.field for worst in comparison.worst] == list(PRIMARY)
    assert comparison.elements == 8


def test_the_tolerance_of_tapered_beams_is_their_discretization_error(answers):
    """The tolerance is 1/elements^4; an error of 1e-5 in the closed form is found."""
    exact, _ = answers
    shaped = [replace(section, taper=Taper(EI=(1.0, -0.7))) for section in exact.sections]
    bent = deflection(exact.motion, shaped)
    for elements, tolerance in ((4, 1e-3), (16, 16**-4), (64, 64**-4), (256, 1e-8)):
        comparison = compare(bent, solve(exact.motion, shaped, elements))
        assert comparison.tolerance == tolerance
        assert comparison.passed
    off = with_fields(bent, w=bent.amplitudes.w * (1 + 1e-5))
    assert not compare(off, solve(exact.motion, shaped, 64)).passed
    assert not compare(bent, solve(exact.motion, shaped, 16), 1e-9).passed


def test_a_rigidity_one_percent_off_fails(answers):
    exact, found = answers
    off = [Section(s.EA, 1.01 * s.EI) if k == 1 else s for k, s in enumerate(exact.sections)]
    comparison = compare(deflection(exact.motion, off), found)
    assert not comparison.passed
    by_field = dict(zip(PRIMARY, comparison.relative.max(axis=1), strict=True))
    assert all(by_field[field] < 1e-8 for field in "NVM")
    assert 1e-4 < by_field["w"] < 1e-1


@pytest.mark.parametrize("field", PRIMARY)
def test_a_single_wrong_coefficient_is_located(answers, field):
    exact, found = answers
    values = getattr(exact, field).copy()
    scale = np.abs(sample(exact, field, found.xi)).max()
    values[1, 2, 13] += 1e-3 * scale  # grows along the beam: largest at its end
    comparison = compare(with_fields(exact, **{field: values}), found)
    worst = comparison.worst[PRIMARY.index(field)]
    assert not comparison.passed
    assert (worst.field, worst.beam, worst.position, worst.xi) == (field, 2, 13, 1.0)
    assert worst.relative == pytest.approx(1e-3, rel=0.01)
    assert worst.difference == pytest.approx(1e-3 * scale, rel=1e-6)
    others = [k for k, name in enumerate(PRIMARY) if name != field]
    assert comparison.relative[others].max() < 1e-8


def test_differences_are_also_relative_to_the_beam(answers):
    exact, found = answers
    values = exact.w.copy()
    small = np.abs(sample(exact, "w", found.xi)).max(axis=(1, 2))
    beam = int(np.argmin(small))
    values[0, beam] += 1e-9 * small.max()
    comparison = compare(with_fields(exact, w=values), found)
    w = PRIMARY.index("w")
    assert comparison.passed
    assert comparison.relative[w, beam] == pytest.approx(1e-9, rel=1e-3)
    assert comparison.own[w, beam] == pytest.approx(1e-9 * small.max() / small[beam], rel=1e-3)
    assert comparison.own[w, beam] > 1.5e-9


def test_nan_on_one_side_fails(answers):
    exact, found = answers
    w = found.w.copy()
    w[:, 3] = np.nan
    comparison = compare(exact, replace(found, w=w))
    assert not comparison.passed
    assert comparison.compared == 23
    assert comparison.worst[PRIMARY.index("w")].position == 3
    nowhere = replace(found, **{field: np.full_like(getattr(found, field), np.nan) for field in PRIMARY})
    lost = with_fields(exact, **{field: np.full_like(getattr(exact, field), np.nan) for field in PRIMARY})
    assert not compare(lost, nowhere).passed


def test_round_off_in_a_zero_field_passes():
    """Without axial load, N is about 1e-16 of V in either answer."""
    case = four_bar(gravity=0.0, loads=(), crank=0.11)
    links = tuple(replace(link, lumps=()) for link in case.mechanism.links)
    still = motion_of(case.with_(links=links).mechanism, [0.4])
    exact, found = deflection(still, case.sections), solve(still, case.sections)
    noise = np.full_like(found.N, 1e-14)
    shear = np.ones_like(exact.V)
    comparison = compare(
        with_fields(exact, V=shear), replace(found, N=noise, V=sample(with_fields(exact, V=shear), "V", found.xi))
    )
    assert comparison.relative[PRIMARY.index("N")].max() <= 1e-8


def test_round_off_of_an_arm_under_a_moment_passes():
    """N and V are about 1e-16 of M/l in either answer."""
    arm = Link("arm", {"O": 0.0, "A": 0.7}, (Beam("O", "A"),))
    links, twist = (Link("ground", {"O": 0.0}), arm), PointLoad("arm", "A", 0.0, 5.0)
    mechanism = Mechanism(links, (PinDrive("arm", "O"),), {"O": 0.0, "A": 0.7}, loads=(twist,))
    held = motion_of(mechanism, [0.4])
    exact, found = deflection(held, [Section(3e6, 50.0)]), solve(held, [Section(3e6, 50.0)])
    noise = replace(found, V=found.V + 1e-15 * 5.0 / 0.7, N=found.N - 1e-15 * 5.0 / 0.7)
    assert compare(exact, noise).passed
    assert not compare(exact, replace(found, V=found.V + 1e-13 * 5.0 / 0.7)).passed


@pytest.mark.parametrize("slenderness", [5, 200])
def test_round_off_of_an_arm_in_tension_passes(slenderness):
    """w and phi are round-off relative to the bending by the same force across the arm."""
    arm = Link("arm", {"O": 0.0, "A": 0.7}, (Beam("O", "A", 0.5),), (Lump("A", 2.0),))
    mechanism = Mechanism((Link("ground", {"O": 0.0}), arm), (PinDrive("arm", "O"),), {"O": 0.0, "A": 0.7})
    turning = motion_of(mechanism, np.linspace(0.0, 6.0, 50), 30.0)
    sections = [Section(3e6, 3e6 * (0.7 / slenderness) ** 2)]
    exact, found = deflection(turning, sections), solve(turning, sections)
    assert compare(exact, found).passed
    bent = with_fields(exact, w=exact.w + 1e-12 * 2.0 * 30**2 * 0.7 * 0.7**3 / sections[0].EI)
    assert not compare(bent, found).passed


def test_section_forces_are_not_compared_at_a_node_with_a_jump():
    """Round-off decides on which side of the block's node a force acts."""
    links = (Link("ground", {"O": 0.0}), Link("arm", {"O": 0.0, "A": 1.0}, (Beam("O", "A"),)), Link("block", {"B": 0}))
    mechanism = Mechanism(
        links,
        (PinDrive("arm", "O"), SliderDrive("guide")),
        {"O": 0.0, "A": 1.0, "B": 0.5},
        (Slider("guide", "block", "arm", "B", 0.0, 1.0),),
        loads=(PointLoad("block", "B", 3 - 4j, 2.0),),
    )
    held = motion_of(mechanism, [[0.0, 0.0], [0.5, 0.5 + 1e-12]])
    exact, found = deflection(held, [Section(1e5, 30.0)]), solve(held, [Section(1e5, 30.0)], 4)
    assert compare(exact, found).passed
    M = found.M.copy()
    M[0, 1, 3] += 1e-3
    assert not compare(exact, replace(found, M=M)).passed


def test_a_mechanism_without_beams_passes():
    links = (Link("ground", {"O": 0.0}), Link("arm", {"O": 0.0, "A": 0.7}, lumps=(Lump("A", 2.0),)))
    mechanism = Mechanism(links, (PinDrive("arm", "O"),), {"O": 0.0, "A": 0.7}, gravity=-9.81j)
    held = motion_of(mechanism, [0.0, np.pi])
    found = solve(held, [])
    np.testing.assert_allclose(found.efforts, [[2 * 9.81 * 0.7, -2 * 9.81 * 0.7]], rtol=1e-14)
    comparison = compare(deflection(held, []), found)
    assert comparison.passed
    assert comparison.worst == ()


def test_runs_of_different_shape_are_rejected(answers):
    case = four_bar(count=5)
    turning = motion_of(case.mechanism, case.drive, case.rate, case.rate2)
    with pytest.raises(ValueError, match=r"\(3, 24\).*\(3, 5\)"):
        compare(answers[0], solve(turning, case.sections))


def read(path, position):
    """Return the instants of a mesh series and the mesh of one position."""
    sets = ElementTree.parse(path).getroot().findall("Collection/DataSet")
    times = [float(entry.get("timestep")) for entry in sets]
    return times, meshio.read(path.parent / sets[position].get("file"))


def test_mesh_files_of_elements_have_both_shapes_and_all_fields(answers, tmp_path):
    _, found = answers
    times, mesh = read(write_vtu_series(found, tmp_path / "new" / "folder"), 7)
    np.testing.assert_array_equal(times, np.linspace(0, 0.1, 24))
    assert mesh.points.shape == (27, 3)
    assert sum(len(block.data) for block in mesh.cells) == 24
    np.testing.assert_array_equal(mesh.cell_data["beam"][0], np.repeat([0, 1, 2], 8))
    for field in PRIMARY:
        np.testing.assert_array_equal(mesh.point_data[field], getattr(found, field)[:, 7].ravel())
    motion = found.motion
    for number, (at, beam) in enumerate(motion.mechanism.beams):
        start, end = (position_of(motion, at, point)[7] for point in (beam.start, beam.end))
        np.testing.assert_allclose(mesh.points[9 * number][:2], [start.real, start.imag], atol=1e-15)
        np.testing.assert_allclose(mesh.points[9 * number + 8][:2], [end.real, end.imag], atol=1e-15)
    moved = mesh.point_data["displacement"]
    np.testing.assert_allclose(moved[8], moved[9], rtol=1e-9)  # the pin of crank and coupler stays closed
    np.testing.assert_allclose(mesh.point_data["deformed"], mesh.points + moved, atol=1e-15)


def test_mesh_files_of_closed_forms_have_any_stations(answers, tmp_path):
    exact, _ = answers
    _, mesh = read(write_vtu_series(exact, tmp_path, "forms", [0.0, 0.3, 1.0]), 2)
    assert mesh.points.shape == (9, 3)
    for field in ("M", "q_y", "chord", "shear", "mises"):
        np.testing.assert_array_equal(mesh.point_data[field], sample(exact, field, [0.0, 0.3, 1.0])[:, 2].ravel())


def test_mesh_files_omit_positions_without_an_answer(tmp_path):
    case = four_bar(crank=0.3, coupler=0.2, rocker=0.3, base=0.4, count=12)
    turning = motion_of(case.mechanism, case.drive, case.rate, case.rate2)
    times, _ = read(write_vtu_series(solve(turning, case.sections), tmp_path), 0)
    np.testing.assert_array_equal(times, np.flatnonzero(np.isfinite(turning.condition)))


def test_misuse_of_mesh_files_is_an_error(answers, tmp_path):
    with pytest.raises(ValueError, match="written at its nodes"):
        write_vtu_series(answers[1], tmp_path, stations=[0.0, 1.0])
    turning = answers[0].motion
    several = repeated(turning, (3, 24))
    with pytest.raises(ValueError, match="3 designs"):
        write_vtu_series(replace(answers[1], motion=several), tmp_path)
    assert not list(tmp_path.iterdir())


def test_repr_of_results_is_one_line(answers):
    exact, found = answers
    assert repr(found) == "Solution(3 beams of 8 elements, columns (24,))"
    assert repr(found.ties[0]).startswith("TieForce('")
    assert repr(compare(exact, found)).startswith("Comparison(passed=True, 24 positions, ")
    assert "\n" not in repr(compare(exact, found))
