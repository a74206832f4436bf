"""Units are factors on every number: powers of two change no digit, other factors only the last digits."""

import re

import numpy as np
import pytest
from mechanisms import ALL, motion_of, replaced
from msgspec.structs import replace
from tiers import in_tiers

from elastic import PRIMARY, deflection
from kinelast import scene_from_text
from kinelast.cli.command import main
from kinelast.scene.data import scene_motion
from kinelast.scene.document import document_from_text
from kinelast.values.error import SceneError
from kinelast.values.numbers import RAISED, coordinate, quantity, with_limit
from kinelast.values.units import Quantity
from rigid import LineLoad, PinDrive, PointLoad

EPS = np.finfo(float).eps
BOUND = 50
LOWERED = {raised: chr(plain) for plain, raised in RAISED.items()}
BY_ELIMINATION = ("triad", "six-bar, ring")  # their linear systems are scaled by square roots, or iterated


def in_units(case, L, M, T):
    """Return the case in other units: each number is scaled by its dimension."""
    force = M * L / T**2

    def link(one):
        beams = tuple(replace(beam, mass_per_length=beam.mass_per_length * (M / L)) for beam in one.beams)
        lumps = tuple(
            replace(lump, mass=lump.mass * M, inertia=lump.inertia * (M * L**2), offset=lump.offset * L)
            for lump in one.lumps
        )
        return replace(one, points={k: v * L for k, v in one.points.items()}, beams=beams, lumps=lumps)

    def section(one):
        return replace(one, EA=one.EA * force, EI=one.EI * (force * L**2), kGA=one.kGA * force)

    def load(one):
        if isinstance(one, LineLoad):
            return replace(one, start=one.start * (force / L), end=one.end * (force / L))
        assert isinstance(one, PointLoad)
        return replace(one, force=one.force * force, moment=one.moment * (force * L))

    mechanism = case.mechanism
    turns = np.array([isinstance(drive, PinDrive) for drive in mechanism.drives])[:, None]
    unit = np.where(turns, 1.0, L)
    return replace(
        case,
        mechanism=replaced(
            mechanism,
            links=tuple(link(one) for one in mechanism.links),
            sliders=tuple(replace(one, origin=one.origin * L) for one in mechanism.sliders),
            drawing={k: v * L for k, v in mechanism.drawing.items()},
            gravity=mechanism.gravity * (L / T**2),
            loads=tuple(load(one) for one in mechanism.loads),
        ),
        sections=tuple(
            replace(one, EA=one.EA * force, EI=one.EI * (force * L**2), kGA=one.kGA * force) for one in case.sections
        ),
        drive=case.drive * unit,
        rate=case.rate * unit / T,
        rate2=case.rate2 * unit / T**2,
    )


def dimension(L, M, T):
    force = M * L / T**2
    return {"N": force, "V": force, "M": force * L, "u": L, "w": L, "phi": 1.0}


class TestUnits:
    def solved(self, case):
        return deflection(motion_of(case), case.sections)

    @pytest.mark.parametrize("units", [(2.0**-20, 2.0**13, 2.0**-5), (2.0**30, 2.0**-40, 2.0**7)])
    @pytest.mark.parametrize("name", [name for name in ALL if name not in BY_ELIMINATION])
    def test_powers_of_two_change_no_digit(self, name, units):
        one, other = self.solved(ALL[name]()), self.solved(in_units(ALL[name](), *units))
        np.testing.assert_array_equal(other.motion.condition, one.motion.condition)
        for field in PRIMARY:
            np.testing.assert_array_equal(getattr(other, field), getattr(one, field) * dimension(*units)[field])

    @pytest.mark.parametrize("units", [(1e3, 1e-3, 1.0), (39.37007874, 2.20462262, 1e3), (1e-9, 1e6, 1e-6)])
    @pytest.mark.parametrize("name", in_tiers(ALL, 5, 5))
    def test_other_units_change_the_last_digits(self, name, units):
        """Millimetres and tonnes; inches, pounds and milliseconds; arbitrary units."""
        one, other = self.solved(ALL[name]()), self.solved(in_units(ALL[name](), *units))
        condition = one.motion.condition.max()
        for field in PRIMARY:
            ours = getattr(one, field) * dimension(*units)[field]
            off = np.abs(getattr(other, field) - ours).max() / np.abs(ours).max()
            assert off < BOUND * EPS * condition, field


WRITTEN = """
units = "mm"
materials.steel = {E = "210 GPa", density = 7850}
sections.bar = {shape = "rectangle", depth = 6, width = 10}
points = {O = [0, 0], A = [0, 60], B = [200, 180], C = [250, 0]}
links.ground = {points = ["O", "C"]}
links.crank = {points = ["O", "A"], section = "bar", material = "steel"}
links.rod = {points = ["A", "B"], section = "bar", material = "steel"}
links.rocker = {points = ["B", "C"], section = "bar", material = "steel"}
limits = {output = "0.05 deg"}
run = {output = "rocker.angle", positions = 36, theory = "quasi-static"}
[[drives]]
link = "crank"
speed = "900 rpm"
[sweep.vary]
"drives.crank.speed" = ["600 rpm", "900 rpm"]
"""


class TestUnitsOfTheScene:
    """Output has the units of the scene file."""

    def lines(self, tmp_path, capsys, text, *options):
        (tmp_path / "scene.toml").write_text(text)
        main([str(tmp_path / "scene.toml"), "-o", str(tmp_path / "out"), *options])
        return capsys.readouterr().out

    def test_limits_and_lengths_on_the_terminal(self, tmp_path, capsys):
        reported = self.lines(tmp_path, capsys, WRITTEN)
        assert re.search(r"NOT ACCEPTABLE: output error 0\.0\d+° ± \S+ % \(limit 0\.05°\)", reported)
        assert re.search(r"largest deflection 0\.1\d+ mm ± .* \(rod, 1\d\d mm along it", reported)
        assert "stress 5" in reported
        assert " MPa" in reported
        heads = (tmp_path / "out" / "scene" / "positions.csv").read_text().splitlines()[0]
        assert "crank.M_max [N m]" in heads
        assert "crank.w_max [mm]" in heads

    def test_speeds_of_a_sweep(self, tmp_path, capsys):
        output = self.lines(tmp_path, capsys, WRITTEN, "--sweep")
        assert "drives.crank.speed 600 rpm" in output

    def test_of_a_file_in_si_units(self, tmp_path, capsys):
        plain = WRITTEN.replace('units = "mm"', "").replace('"900 rpm"', "94.2").replace('"0.05 deg"', '"0.9 mrad"')
        plain = plain.replace("depth = 6", 'depth = "6 mm"').replace("width = 10", 'width = "10 mm"')
        plain = re.sub(r"= \[(\d+), (\d+)\]", lambda row: f"= [{int(row[1]) / 1e3}, {int(row[2]) / 1e3}]", plain)
        output = self.lines(tmp_path, capsys, plain)
        assert "(limit 0.9 mrad)" in output
        assert re.search(r"largest deflection 1\d\d\.?\d* µm", output)

    def test_the_most_frequent_unit_is_used(self):
        scene = scene_from_text(WRITTEN.replace('speed = "900 rpm"', 'speed = "15 rev/s"\nstart = "1 rad"'))
        assert scene.shown_in["rad/s"] == (pytest.approx(1 / (2 * np.pi)), "rev/s")
        assert scene.shown_in["m"] == (1e3, "mm")

    def test_a_changed_speed_is_shown_in_the_unit_of_the_scene(self):
        document = document_from_text(WRITTEN).with_changes("drives.crank.speed=334 rpm")
        assert quantity(100.0, "rad/s", 3, document.scene.shown_in) == "955 rpm"
        assert document.value("drives.crank.speed", "334 rpm") == document.scene.laws[0].speed

    @pytest.mark.parametrize("unit", ["m^2", "m^4", "m^3/s", "kg/m^3", "1/K", "m/s^2", "W/m^2", "N/m", "N m", "Pa"])
    def test_printed_quantities_are_read_back(self, unit):
        """A prefix before a square or a cube is squared or cubed too."""
        for size in 1.25 * 10.0 ** np.arange(-10, 10):
            text = re.sub(r"·10([⁻⁰¹²³⁴-⁹]+)", lambda raised: "e" + raised[1].translate(LOWERED), quantity(size, unit))
            assert Quantity.of_unit(unit, text) == pytest.approx(size, rel=1e-9)

    def test_slides_and_gaps_use_the_length_unit_of_the_scene(self):
        """A and C are 60 and 250 mm from O at a right angle; the rocker is (50, 180) mm long, the rod 1 mm."""
        assert coordinate(2.071e-5, "m", scene_from_text(WRITTEN).shown_in) == "0.02071 mm"
        short = WRITTEN.replace('["A", "B"]', '["A", "B"], length = 1')
        with pytest.raises(SceneError, match=r"257\.1 mm apart, the links between them reach from 185\.8 to 187\.8 mm"):
            scene_motion(scene_from_text(short))

    def test_small_stresses_and_times_next_to_limits(self):
        shown_in = scene_from_text(WRITTEN).shown_in
        assert [quantity(size, "Pa", shown_in=shown_in) for size in (200.0, 0.0, 2e5)] == ["200 Pa", "0 MPa", "0.2 MPa"]
        assert with_limit(6294.0, 7.2e7, "s") == ("1.748 h", "20000 h")
        assert with_limit(0.36, 7.2e7, "s") == ("0.0001 h", "20000 h")
        assert quantity(1800.0, "s") == "1800 s"

    def test_a_flow_has_the_unit_of_the_scene(self):
        text = WRITTEN + '[cylinders.lift]\nbore = 63\npressure = "200 bar"\nflow = "6 l/min"\n'
        assert quantity(1.247e-4, "m^3/s", shown_in=scene_from_text(text).shown_in) == "7.482 l/min"
