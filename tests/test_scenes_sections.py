"""Beams and soft joints of a scene: tapers, shear, free strain, rings, guides and compliances."""

import re
import tomllib
from inspect import signature
from typing import get_args

import numpy as np
import pytest
from scene_texts import ARM, FOUR_BAR, QUICK_RETURN, edited
from tiers import in_tiers

from animations.solid import cross_sections
from elastic import SHAPES, deflection, displacement_of, extremes, sample, section_of, tapered
from elastic.beams import outline
from kinelast.cli.command import main
from kinelast.designs import evaluate
from kinelast.scene.data import scene_motion
from kinelast.scene.document import scene_from_text
from kinelast.scene.format import Dimensioned, SectionTable
from kinelast.scene.library import library_entries, named_material, named_section
from kinelast.values.error import SceneError
from rigid.analysis import Slide
from rigid.constants import mass_moments

LOADED_ARM = edited(
    ARM,
    (
        "E = 210e9\ndensity = 7850",
        'E = 200e9\ndensity = 8000\npoisson = 0.25\nexpansion = "12e-6 1/K"\nyield = "300 MPa"',
    ),
    ("depth = 0.006\nwidth = 0.01", 'depth = "20 mm"\nwidth = "10 mm"'),
    ("A = [0.2, 0]", "A = [0.4, 0]"),
    ("speed = 50.0", 'law = [{curve = "dwell", duration = 1}]'),
    (
        "[run]\npositions = 8",
        '[[loads]]\nlink = "arm"\npoint = "A"\nforce = [0, "-100 N"]\n[run]\nbeams = "euler-bernoulli"\npositions = 2',
    ),
)
WHOLE = ('beams = "euler-bernoulli"\n', "")  # beams have shear by default
A, I, L, P = 2e-4, 0.01 * 0.02**3 / 12, 0.4, 100.0  # noqa: E741
E = 200e9


def bent(text):
    scene = scene_from_text(text)
    return deflection(scene_motion(scene), scene.sections, joints=scene.joints)


def tip(text):
    """Return the displacement of the arm's end [m], complex."""
    return displacement_of(bent(text), "arm", "A")[0]


class TestSections:
    """Sections, compared with the handbook cantilever."""

    def test_a_slender_arm(self):
        assert tip(LOADED_ARM) == pytest.approx(-1j * P * L**3 / (3 * E * I), rel=1e-12)

    @pytest.mark.parametrize("theory", ["", 'beams = "timoshenko"'])
    @pytest.mark.parametrize("given", ["poisson = 0.25", 'G = "80 GPa"'])
    def test_shear_counts_by_default(self, given, theory):
        # Cowper: k = 10 (1 + nu)/(12 + 11 nu) for a rectangle; G = E/(2 (1 + nu)) = 80 GPa.
        text = edited(LOADED_ARM, ('beams = "euler-bernoulli"', theory), ("poisson = 0.25", given))
        k = 10 * 1.25 / (12 + 11 * 0.25)
        assert tip(text) == pytest.approx(-1j * (P * L**3 / (3 * E * I) + P * L / (k * 80e9 * A)), rel=1e-10)

    def test_the_default_poisson_ratio_is_that_of_metals(self):
        text = edited(LOADED_ARM, WHOLE, ("poisson = 0.25\n", ""))
        G, k = E / 2.6, 10 * 1.3 / (12 + 11 * 0.3)
        assert tip(text) == pytest.approx(-1j * (P * L**3 / (3 * E * I) + P * L / (k * G * A)), rel=1e-10)

    @pytest.mark.parametrize(
        ("shape", "kGA"),
        [('shape = "properties"\nA = 2e-4\nI = "6666 mm^4"\nshear_area = "150 mm^2"', 80e9 * 1.5e-4),
         ('shape = "rigidities"\nEA = 1e7\nEI = 1000\nmass_per_length = 1\nkGA = "3 MN"', 3e6)],
    )  # fmt: skip
    def test_any_shape_can_give_its_shear_rigidity(self, shape, kGA):
        plain = edited(LOADED_ARM, ('shape = "rectangle"\ndepth = "20 mm"\nwidth = "10 mm"', shape))
        if "rigidities" in shape:
            plain = edited(plain, ('material = "steel"', ""))
        sheared = edited(plain, WHOLE)
        assert tip(sheared) - tip(plain) == pytest.approx(-1j * P * L / kGA, rel=1e-9)
        (known,) = scene_from_text(plain).sections
        assert np.isinf(known.kGA)
        assert known.shear_rigidity == pytest.approx(kGA, rel=1e-12)  # so the effect of neglected shear is known

    def test_two_sizes_taper(self):
        # A cantilever whose depth grows linearly from h at the tip to H, by integrals of x^2/(E I(x)).
        text = edited(LOADED_ARM, ('depth = "20 mm"', 'depth = ["20 mm", "10 mm"]'))
        x = (np.arange(200000) + 0.5) / 200000 * L
        depth = 0.02 - 0.01 * x / L
        expected = np.mean(P * (L - x) ** 2 / (E * 0.01 * depth**3 / 12)) * L
        assert tip(text) == pytest.approx(-1j * expected, rel=1e-9)
        (arm,) = scene_from_text(text).mechanism.links[1:]
        mass, first, _ = mass_moments(arm)
        assert mass == pytest.approx(8000 * 0.01 * 0.015 * L)
        assert first / mass == pytest.approx(L * (20 + 2 * 10) / (3 * (20 + 10)))

    @pytest.mark.parametrize(
        ("shape", "hole"),
        [
            ('"circle"\ndiameter', lambda outer: 0.0),
            ('"tube"\ninner = "5 mm"\nouter', lambda outer: 0.005),
            ('"tube"\nwall = "2 mm"\nouter', lambda outer: outer - 0.004),
            ('"tube"\nwall = ["2 mm", "3 mm"]\nouter', lambda outer: outer - 0.004 - 0.002 * (0.02 - outer) / 0.01),
        ],
    )
    def test_round_sections_taper_too(self, shape, hole):
        drawn = '"rectangle"\ndepth = "20 mm"\nwidth = "10 mm"'
        text = edited(LOADED_ARM, (drawn, f'{shape} = ["20 mm", "10 mm"]'))
        x = (np.arange(200000) + 0.5) / 200000 * L
        outer = 0.02 - 0.01 * x / L
        inertia = np.pi * (outer**4 - hole(outer) ** 4) / 64
        assert tip(text) == pytest.approx(-1j * np.mean(P * (L - x) ** 2 / (E * inertia)) * L, rel=1e-8)

    def test_a_tube_by_its_wall(self):
        drawn = '"rectangle"\ndepth = "20 mm"\nwidth = "10 mm"'
        outer, wall = np.array([0.018, 0.03]), np.array([0.001, 0.004])
        inertia = np.pi * (outer**4 - (outer - 2 * wall) ** 4) / 64
        text = edited(LOADED_ARM, (drawn, f'"tube"\nouter = {outer[0]}\nwall = {wall[0]}'))
        assert tip(text) == pytest.approx(-1j * P * L**3 / (3 * E * inertia[0]), rel=1e-12)
        paths = ["sections.bar.outer", "sections.bar.wall"]
        found = evaluate(tomllib.loads(text), paths, np.array([outer, wall]).T, ["deflection"])
        np.testing.assert_allclose(found.columns["deflection"], P * L**3 / (3 * E * inertia), rtol=1e-9)

    def test_stress_and_yield_come_from_shape_and_material(self):
        text = edited(LOADED_ARM, ("force", "moment = 0\nforce"))
        found = bent(text)
        assert sample(found, "left", [0.0])[0, 0, 0] == pytest.approx(P * L * 0.01 / I, rel=1e-12)
        assert found.sections[0].yield_stress == 300e6

    def test_rigid_links_have_stress_but_no_deflection(self):
        found = bent(edited(LOADED_ARM, ('material = "steel"', 'material = "steel"\nrigid = true')))
        assert sample(found, "left", [0.0])[0, 0, 0] == pytest.approx(P * L * 0.01 / I, rel=1e-12)
        assert np.abs(found.w).max() == 0.0

    @pytest.mark.parametrize(
        ("where", "strain"),
        [('temperature = "50 K"', 6e-4), ("strain = 1e-3", 1e-3), ('strain = 1e-3\ntemperature = "-50 K"', 4e-4),
         ('temperature = "9 K"\nbeams = [{from = "O", to = "A", temperature = "50 K"}]', 6e-4)],
    )  # fmt: skip
    def test_warm_beams_are_longer(self, where, strain):
        longer = tip(edited(LOADED_ARM, ('material = "steel"', f'material = "steel"\n{where}')))
        assert longer.real == pytest.approx(strain * L, rel=1e-12)
        assert longer.imag == pytest.approx(tip(LOADED_ARM).imag, rel=1e-12)

    def test_beams_can_close_a_ring(self):
        # A square frame pulled at two opposite corners: the end moments of its sides are F a/4, with a half the
        # diagonal.
        square = edited(
            LOADED_ARM,
            ("A = [0.4, 0]", "A = [0.4, 0]\nB = [0.2, 0.2]\nC = [0.2, -0.2]"),
            ('["O", "A"]\n', '["O", "A", "B", "C"]\nbeams = [["O", "B"], ["B", "A"], ["A", "C"], ["C", "O"]]\n'),
            ('[0, "-100 N"]', '["100 N", 0]'),
        )
        moments = sample(bent(square), "M", [0.0, 1.0])[:, 0]
        # By symmetry the end moments of a side are equal and opposite, except for the effect of stretch.
        assert np.abs(moments) == pytest.approx(np.full((4, 2), P * 0.2 / 4), rel=3e-3)


class TestGuides:
    """A block on an elastic link bends the beam at the contact."""

    elastic = edited(
        QUICK_RETURN,
        ('rigid = true\nmass = 0.4\ncenter = [0.25, 0]\ninertia = "8e-3 kg m^2"', 'section = "s"'),
        ("mass = 0.05", "mass = 0"),
        ("[points]", '[sections.s]\nshape = "rigidities"\nEA = 1e7\nEI = 30\nmass_per_length = 0\n[points]'),
        ("[run]", '[[loads]]\nlink = "rocker"\npoint = "D"\nforce = [0, "10 N"]\naxes = "turning"\n[run]'),
    )

    def test_the_moment_is_largest_under_the_block(self):
        scene = scene_from_text(self.elastic)
        course = scene_motion(scene)
        found = deflection(course, scene.sections)
        reach = 0.4 + Slide("slot").value(course)
        largest = extremes(found, ("M",))["M"]
        assert largest.value[0] == pytest.approx(10 * (0.5 - reach), rel=1e-9)
        assert largest.xi[0] == pytest.approx(reach / 0.5, rel=1e-9)

    def test_a_block_beyond_the_end_of_its_beam_is_an_error(self, tmp_path, capsys):
        short = tmp_path / "short.toml"
        short.write_text(edited(self.elastic, ("D = [0.0, 0.5]", "D = [0.0, 0.39]"), ('"D"\nforce', '"D"\nforce')))
        assert main([str(short), "-o", str(tmp_path / "out")]) == 2
        assert 'the block of "slot" leaves the beam "C"-"D" at 0 s' in capsys.readouterr().err


class TestSoftJoints:
    """Joints with compliance or misfit."""

    def soft(self, keys):
        return tip(edited(LOADED_ARM, ("[[drives]]", f"[joints.O]\n{keys}\n[[drives]]"))) - tip(LOADED_ARM)

    def test_compliance_displaces_along_the_force(self):
        assert self.soft('compliance = "2e-6 m/N"') == pytest.approx(-1j * 2e-6 * P, rel=1e-9)

    def test_a_soft_drive_rotates(self):
        assert self.soft('rotation = "1e-4 rad/(N m)"') == pytest.approx(-1j * 1e-4 * P * L * L, rel=1e-9)

    def test_gap_and_turn(self):
        assert self.soft('gap = ["1 mm", "-2 mm"]') == pytest.approx(1e-3 - 2e-3j, rel=1e-9)
        assert self.soft('turn = "0.1 deg"') == pytest.approx(1j * np.radians(0.1) * L, rel=1e-9)

    def test_the_check_agrees(self, tmp_path):
        path = tmp_path / "soft.toml"
        soft = '[joints.B]\ncompliance = "1e-6 m/N"\ngap = ["0.1 mm", 0]\n[joints.O]\nrotation = 1e-4\n'
        path.write_text(edited(FOUR_BAR, ("[run]", f"{soft}[run]")))
        assert main([str(path), "-o", str(tmp_path / "out"), "--quiet", "--check"]) == 0


def test_each_shape_is_a_function_and_a_table():
    """All dimensions of a table are used, tapered and drawn."""
    tables = {kind.__struct_config__.tag: kind for kind in get_args(SectionTable) if issubclass(kind, Dimensioned)}
    assert set(tables) == set(SHAPES)
    for function in SHAPES.values():
        keys = len(signature(function).parameters)
        start, end = (tuple(factor / number**3 for number in range(1, keys + 1)) for factor in (0.02, 0.01))
        taper, _ = tapered(function, start, end)
        drawn = cross_sections(section_of(function(*start), 210e9, taper=taper), 1.0)
        # otherwise it is drawn equally deep on both sides of the axis
        middle = function(*start).fibre <= 0.01 * (1 + 1e-9)
        assert drawn.depth[[0, -1]] == pytest.approx([0.02, 0.01] if middle else drawn.depth[0] * np.array([1, 0.5]))
        assert 0.02 * (1 - 1e-9) <= drawn.depth[0] < 0.04
        assert drawn.width[-1] == pytest.approx(drawn.width[0] / 2)


# A [cm^2] and I [cm^4]: EN 10365 from manufacturers' tables of IPE, HEA and HEB, and EN 10219-2 for hollow sections
PUBLISHED = {
    "IPE 80": (7.64, 80.1), "IPE 100": (10.3, 171), "IPE 120": (13.2, 318), "IPE 140": (16.4, 541),
    "IPE 160": (20.1, 869), "IPE 180": (23.9, 1317), "IPE 200": (28.5, 1943), "IPE 220": (33.4, 2772),
    "IPE 240": (39.1, 3892), "IPE 270": (45.9, 5790), "IPE 300": (53.8, 8356),
    "HEA 100": (21.2, 349), "HEA 120": (25.3, 606), "HEA 140": (31.4, 1033), "HEA 160": (38.8, 1673),
    "HEA 180": (45.3, 2510), "HEA 200": (53.8, 3692),
    "HEB 100": (26.0, 450), "HEB 120": (34.0, 864), "HEB 140": (43.0, 1509), "HEB 160": (54.3, 2492),
    "HEB 180": (65.3, 3831), "HEB 200": (78.1, 5696),
    "RHS 40x20x2": (2.14, 4.05), "RHS 50x30x3": (4.21, 12.83), "RHS 60x40x3": (5.41, 25.38),
    "SHS 40x40x3": (4.21, 9.32),
    # EN 10365 (UPE) and AISC's shapes database (W: 2.96, 4.71, 2.68 in^2; 30.8, 68.9, 16.4 in^4) in tables
    "UPE 80": (10.1, 107), "UPE 100": (12.5, 207), "UPE 160": (21.7, 911), "UPE 200": (29.0, 1909),
    "W8X10": (19.1, 1282), "W10x15": (28.45, 2868), "W 6x9": (17.3, 683),
}  # fmt: skip
LEGS = {  # EN 10056-1: A [cm^2], I about an axis along a leg, and I about the weaker principal axis [cm^4]
    "L 40x40x4": (3.08, 4.47, 1.86), "L 50x50x5": (4.80, 11.0, 4.55), "L 60x60x6": (6.91, 22.8, 9.44),
    "L 80x80x8": (12.3, 72.2, 29.9),
}  # fmt: skip


def ring(depth, width, y=0.0, z=0.0):
    """Return the corners of a rectangle as an outline."""
    return ((y, z), (y + depth, z), (y + depth, z + width), (y, z + width))


OUTLINES = {  # dimensions of a shape, and its corners
    "rectangle": ((0.02, 0.01), (ring(0.02, 0.01),)),
    "box": ((0.06, 0.04, 0.004), (ring(0.06, 0.04), ring(0.052, 0.032, 0.004, 0.004))),
    "angle": ((0.04, 0.03, 0.004), (((0, 0), (0.04, 0), (0.04, 0.004), (0.004, 0.004), (0.004, 0.03), (0, 0.03)),)),
    "T": ((0.05, 0.04, 0.004, 0.004), (((0, 0), (0, 0.04), (0.004, 0.04), (0.004, 0.022), (0.05, 0.022), (0.05, 0.018),
                                         (0.004, 0.018), (0.004, 0)),)),
    "channel": ((0.08, 0.04, 0.004, 0.006), (((0, 0), (0.08, 0), (0.08, 0.04), (0.074, 0.04), (0.074, 0.004),
                                               (0.006, 0.004), (0.006, 0.04), (0, 0.04)),)),
    "I": ((0.08, 0.046, 0.0038, 0.0052), (((0, 0), (0, 0.046), (0.0052, 0.046), (0.0052, 0.0249), (0.0748, 0.0249),
          (0.0748, 0.046), (0.08, 0.046), (0.08, 0), (0.0748, 0), (0.0748, 0.0211), (0.0052, 0.0211), (0.0052, 0)),)),
}  # fmt: skip


class TestOutlines:
    """Sections by outline, compared with closed forms."""

    @pytest.mark.parametrize("name", in_tiers(OUTLINES, 0, 2))
    def test_closed_forms_agree_with_finite_elements(self, name):
        sizes, (corners, *holes) = OUTLINES[name]
        known, found = SHAPES[name](*sizes), outline(corners, tuple(holes))
        for key in ("area", "inertia", "fibre", "width"):
            assert getattr(found, key) == pytest.approx(getattr(known, key), rel=1e-10), key
        assert found.peak_shear == pytest.approx(known.peak_shear, rel=0.015)
        thin = 1e-4 if name == "rectangle" else 0.08  # Cowper's formula and the shear flow are for thin walls
        assert found.shear_coefficient(0.0) == pytest.approx(known.shear_coefficient(0.0), rel=thin)

    @pytest.mark.slow
    def test_a_rolled_angle_agrees_with_finite_elements(self):
        """L 40x40x4 with 64 chords per fillet: A, I, and the extreme fibre at the rounded end of a leg."""
        around = np.exp(1j * np.linspace(0, np.pi / 2, 65))
        toe, root = 3 * around, 6 * around
        corners = np.concatenate([[0, 40], 37 + 1j + toe, 10 + 10j - root[::-1], 1 + 37j + toe, [40j]]) / 1000
        found = outline(tuple((each.real, each.imag) for each in corners))
        known = SHAPES["angle"](0.04, 0.04, 0.004, 0.006, 0.003)
        for key in ("area", "inertia", "fibre"):
            assert getattr(found, key) == pytest.approx(getattr(known, key), rel=1e-4), key

    @pytest.mark.slow
    def test_an_oblique_flat_bar_bends_sideways(self):
        """The compliance of an oblique flat bar combines those of the principal axes."""
        turn, deep, wide = np.exp(0.3j), 0.02, 0.005
        corners = turn * np.array([0, deep, deep + wide * 1j, wide * 1j])
        found = outline(tuple((each.real, each.imag) for each in corners))
        strong, weak = wide * deep**3 / 12, deep * wide**3 / 12
        soft = turn.real**2 / strong + turn.imag**2 / weak
        assert found.inertia == pytest.approx(1 / soft, rel=1e-9)

    @pytest.mark.slow
    def test_a_scene_can_draw_its_section(self):
        drawn = edited(
            LOADED_ARM,
            ('shape = "rectangle"\ndepth = "20 mm"\nwidth = "10 mm"',
             'shape = "outline"\npoints = [[0, 0], ["20 mm", 0], ["20 mm", "10 mm"], [0, "10 mm"]]'),
        )  # fmt: skip
        assert tip(drawn) == pytest.approx(tip(LOADED_ARM), rel=1e-9)
        assert tip(edited(drawn, WHOLE)) == pytest.approx(tip(edited(LOADED_ARM, WHOLE)), rel=1e-4)
        crossed = edited(drawn, ('["20 mm", 0], ["20 mm", "10 mm"]', '["20 mm", "10 mm"], ["20 mm", 0]'))
        with pytest.raises(SceneError, match=r"\[sections.bar\] points: not a valid section: its sides cross"):
            scene_from_text(crossed)
        paths, corners = ["sections.bar.points[4].y"], np.array([[0.01], [0.0]])  # the second is a triangle
        found = evaluate(tomllib.loads(edited(drawn, ("force", "moment = 0\nforce"))), paths, corners, ["deflection"])
        stiff = 0.01 * 0.02**3 / 12, 0.01 * 0.02**3 / 36 - (0.01**2 * 0.02**2 / 72) ** 2 / (0.02 * 0.01**3 / 36)
        assert found.columns["deflection"] == pytest.approx(P * L**3 / (3 * E * np.array(stiff)), rel=1e-9)


class TestLibrary:
    """Sections and materials by their trade names."""

    def test_rolled_sections_have_the_published_properties(self):
        listed = {name for name, _ in library_entries("sections") if name[:2] in ("IP", "HE")}
        assert listed == {name for name in PUBLISHED if name[:2] in ("IP", "HE")}
        for name, (area, inertia) in PUBLISHED.items():
            table = named_section(name)
            shape = SHAPES[table.__struct_config__.tag](*(ends[0] for ends in table.dimensions("")))
            assert 1e4 * shape.area == pytest.approx(area, rel=4e-3), name
            assert 1e8 * shape.inertia == pytest.approx(inertia, rel=4e-3), name

    def test_angles_bend_about_both_principal_axes(self):
        """At 45 degrees 1/I = (1/I_u + 1/I_v)/2, with the published I_v and I_u = 2 I - I_v."""
        for name, (area, along, weak) in LEGS.items():
            shape = SHAPES["angle"](*(ends[0] for ends in named_section(name).dimensions("")))
            assert 1e4 * shape.area == pytest.approx(area, rel=5e-3), name
            assert 1e8 * shape.inertia == pytest.approx(2 / (1 / weak + 1 / (2 * along - weak)), rel=5e-3), name

    def test_a_balanced_laminate_agrees_with_lamination_theory(self):
        along, across, nu, shear = 181.0, 10.3, 0.28, 7.17  # T300/5208 [GPa]
        whole = 1 - nu**2 * across / along
        q11, q22, q12 = along / whole, across / whole, nu * across / whole
        mean, coupled = (3 * (q11 + q22) + 2 * q12 + 4 * shear) / 8, (q11 + q22 + 6 * q12 - 4 * shear) / 8
        known = named_material("CFRP quasi-isotropic")
        stiff = mean - coupled**2 / mean
        assert pytest.approx(1e9 * stiff, rel=1e-3) == known.E
        assert known.poisson == pytest.approx(coupled / mean, abs=0.005)

    @pytest.mark.parametrize(
        ("name", "own"),
        [
            ("pipe 33.7x2.6", 'shape = "tube"\nouter = "33.7 mm"\nwall = "2.6 mm"'),
            ("flat 40x8", 'shape = "rectangle"\ndepth = "40 mm"\nwidth = "8 mm"'),
            ("ROUND12", 'shape = "circle"\ndiameter = 0.012'),
            ("shs 40x3", 'shape = "box"\ndepth = 0.04\nwidth = 0.04\nwall = 0.003\ncorner = 0.006'),
            ("RHS 120x80x8", 'shape = "box"\ndepth = 0.12\nwidth = 0.08\nwall = 0.008\ncorner = 0.02'),
            ("ipe 80", 'shape = "I"\ndepth = 0.08\nwidth = 0.046\nweb = 0.0038\nflange = 0.0052\nfillet = 0.005'),
        ],
    )
    def test_a_named_section_equals_one_by_its_sizes(self, name, own):
        by_name = scene_from_text(edited(ARM, ('section = "bar"', f'section = "{name}"')))
        sizes = edited(ARM, ('shape = "rectangle"\ndepth = 0.006\nwidth = 0.01', own))
        for one, other in zip(by_name.sections, scene_from_text(sizes).sections, strict=True):
            for key in ("EA", "EI", "kGA", "area", "inertia", "fibre", "peak_shear"):
                assert getattr(one, key) == pytest.approx(getattr(other, key), rel=1e-12), key

    @pytest.mark.parametrize(
        "name", ["IPE 85", "RHS 60x40", "RHS 60x40x0", "SHS 40x0", "pipe 0x2", "pipe 3..4x2", "flat", "x", "RHS 4x4x4"]
    )
    def test_an_unknown_name_is_an_error(self, name):
        with pytest.raises(SceneError, match=r"section|wall"):
            scene_from_text(edited(ARM, ('section = "bar"', f'section = "{name}"')))

    def test_a_material_of_the_scene_overrides_the_library(self):
        named = scene_from_text(edited(ARM, ('material = "steel"', 'material = "en aw-6082 t6"')))
        assert named.materials["en aw-6082 t6"].E == 70e9
        assert named.sections[0].yield_stress == 250e6
        own = edited(ARM, ('material = "steel"', 'material = "S235"'), ("[materials.steel]", "[materials.S235]"))
        assert scene_from_text(own).materials["S235"].E == 210e9
        assert scene_from_text(own).materials["S235"].yield_stress is None, "the scene's own, which does not tell"

    def test_every_material_is_read_and_has_a_source(self):
        entries = library_entries("materials")
        assert len(entries) >= 10
        for name, source in entries:
            assert named_material(name).E > 1e9
            assert re.search(r"\b(EN|ASTM|ISO|1980)\b", source.partition("(")[2]), name
            assert not re.search(r"\d{6}\.0|\de\+", source), name

    def test_the_command_lists_sections(self, capsys):
        assert main(["--list", "sections", "IPE", "80"]) == 0
        assert capsys.readouterr().out.startswith("IPE 80   A 7.643 cm²")
        assert main(["--list", "sectons"]) == 2
