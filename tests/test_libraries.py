"""Sections and materials from a library file equal those in the scene, and a run depends on its library."""

import math

import pytest
from scene_texts import ARM, edited

from exchange import ExchangeError, section_of_dxf
from kinelast import SceneError, read_document, scene_from_text
from kinelast.cli.command import main
from kinelast.designs import evaluate
from kinelast.scene.document import document_from_text
from kinelast.scene.text import reader_in
from live.answer import quick_answer
from live.full import whole_answer

SHOP = """
[materials.ours]
E = "205 GPa"
density = 7800
[sections.heavy]
shape = "rectangle"
depth = "30 mm"
width = "8 mm"
[sections.light]
shape = "tube"
outer = "10 mm"
wall = "1 mm"
"""
NAMED = edited(ARM, ('section = "bar"', 'section = "heavy"'), ('material = "steel"', 'material = "ours"'))
SCENE = f'library = "shop.toml"\n{NAMED}'


@pytest.fixture
def scene(tmp_path):
    (tmp_path / "shop.toml").write_text(SHOP)
    path = tmp_path / "arm.toml"
    path.write_text(SCENE)
    return path


def test_a_library_section_equals_the_same_section_in_the_scene(scene):
    found, written = read_document(scene), scene_from_text(NAMED + SHOP)
    for key in ("EA", "EI", "kGA", "fibre"):
        assert getattr(found.scene.sections[0], key) == getattr(written.sections[0], key), key
    assert "light" not in found.text(), "nothing names it"
    assert scene_from_text(found.text()).sections[0].EI == written.sections[0].EI, "the text stands alone"
    own = document_from_text(
        f"{SCENE}\n[sections.heavy]\nshape = 'circle'\ndiameter = '1 cm'", read=reader_in(scene.parent)
    )
    assert own.scene.sections[0].area == pytest.approx(math.pi * 1e-4 / 4), "the scene's own goes before it"


def test_numbers_of_a_library_can_be_varied(scene):
    document = read_document(scene).with_values({"sections.heavy.depth": 0.04})
    assert document.scene.sections[0].area == pytest.approx(0.04 * 0.008)
    assert scene_from_text(document.text()).sections[0].area == pytest.approx(0.04 * 0.008)
    evaluated = evaluate(read_document(scene), ["sections.heavy.depth"], [[0.03], [0.04]], ["mass"])
    assert evaluated.columns["mass"][1] == pytest.approx(4 / 3 * evaluated.columns["mass"][0])


def test_a_run_depends_on_its_library(scene, tmp_path, capsys):
    command = [str(scene), "-o", str(tmp_path / "out"), "--resume"]
    assert main(command) == 0
    assert main(command) == 0
    assert "already finished" in capsys.readouterr().out
    (scene.parent / "shop.toml").write_text(SHOP.replace("7800", "7801"))
    assert main(command) == 0
    assert "already finished" not in capsys.readouterr().out


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (('"30 mm"', "30"), 'library: shop.toml: depth of "heavy" needs a unit, as in "30 mm"'),
        (("density", "densty"), r'\[materials.ours\] densty: .* did you mean "density"\? \(in shop.toml\)'),
        (("[materials.ours]", "[points]"), "library: shop.toml: a library has only .* got points"),
        (("[materials.ours]", "[materials.ours"), "library: shop.toml: not readable as TOML"),
    ],
)
def test_mistakes_name_the_library(scene, change, message):
    (scene.parent / "shop.toml").write_text(edited(SHOP, change))
    with pytest.raises(SceneError, match=message) as error:
        read_document(scene)
    assert error.value.others == (), "what follows of it is no mistake"


@pytest.mark.parametrize(
    ("name", "message"),
    [
        ("../shop.toml", "is not in the folder of the scene"),
        ("shop.csv", "with the suffix .toml"),
        ("sho.toml", 'mean "shop.toml"'),
    ],
)
def test_libraries_elsewhere_are_rejected(scene, name, message):
    scene.write_text(SCENE.replace("shop.toml", name))
    with pytest.raises(SceneError, match=message):
        read_document(scene)


def test_the_live_editor_reads_a_library(scene):
    answer, _ = quick_answer(SCENE, with_numbers=True, folder=scene.parent)
    assert answer["mistakes"] == []
    assert answer["picture"] is not None
    assert "sections.heavy.depth" not in [each["path"] for each in answer["numbers"]], "it is not in the text"
    whole, _, _ = whole_answer(SCENE, "arm", folder=scene.parent)
    assert not whole.get("mistakes")


DRAWN = edited(ARM, ('shape = "rectangle"\ndepth = 0.006\nwidth = 0.01', 'shape = "outline"\ndrawing = "profile.dxf"'))


@pytest.fixture
def drawing(tmp_path):
    """Write a DXF rectangle of four lines, 20 by 40 mm, with a hole of 12 mm and a text."""
    import ezdxf

    drawn = ezdxf.new()
    drawn.header["$INSUNITS"] = 4
    page = drawn.modelspace()
    corners = [(5, 5), (25, 5), (25, 45), (5, 45)]
    for k, start in enumerate(corners):
        page.add_line(start, corners[(k + 1) % 4])
    page.add_circle((15, 25), 6)
    page.add_text("profile")
    drawn.saveas(tmp_path / "profile.dxf")
    path = tmp_path / "arm.toml"
    path.write_text(DRAWN)
    return path


@pytest.mark.slow
def test_a_drawing_defines_a_section(drawing):
    document = read_document(drawing)
    (section,) = document.scene.sections
    assert section.area == pytest.approx(8e-4 - math.pi * 36e-6, rel=2e-5)  # chords approximate the arc
    assert section.inertia == pytest.approx((20 * 40**3 / 12 - math.pi * 6**4 / 4) * 1e-12, rel=2e-6)
    assert section.width == pytest.approx(0.02)
    assert pytest.approx(section.EI, rel=1e-12) == scene_from_text(document.text()).sections[0].EI


@pytest.mark.slow
def test_an_open_outline_or_another_file_is_an_error(drawing):
    import ezdxf

    drawn = ezdxf.new()
    drawn.modelspace().add_line((0, 0), (10, 0))
    drawn.saveas(drawing.parent / "profile.dxf")
    with pytest.raises(
        SceneError, match=r"\[sections.bar\] drawing: profile.dxf: a line from \(0, 0\) is on no closed"
    ):
        read_document(drawing)
    (drawing.parent / "profile.dxf").write_text("no drawing")
    with pytest.raises(SceneError, match=r"profile.dxf: not a DXF drawing"):
        read_document(drawing)


def profile(*added):
    """Return the DXF text of a rectangle, 30 by 40 mm, with further entities."""
    from io import StringIO

    import ezdxf

    drawn = ezdxf.new()
    page = drawn.modelspace()
    page.add_lwpolyline([(0, 0), (30, 0), (30, 40), (0, 40)], close=True)
    for add in added:
        add(page)
    text = StringIO()
    drawn.write(text)
    return text.getvalue()


@pytest.mark.slow
def test_a_drawing_of_several_areas_or_open_lines_is_rejected():
    """Half a section, or a section without its second part, would give a wrong answer."""

    def centre(page):
        page.add_line((15, 0), (15, 40))

    def longer(page):
        page.add_line((15, -5), (15, 45))

    def second(page):
        page.add_lwpolyline([(50, 0), (60, 0), (60, 9)], close=True)

    def island(page):
        page.add_circle((15, 20), 9)
        page.add_circle((15, 20), 4)

    def beyond(page):
        page.add_circle((15, 20), 18)

    def hidden(page):
        page.add_line((15, -5), (15, 45), dxfattribs={"layer": "CENTER"})

    assert len(section_of_dxf(profile())) == 1
    assert section_of_dxf(profile(hidden)) == section_of_dxf(profile()), "its layer says what it is"
    for added in (centre, second, island, beyond):
        with pytest.raises(ExchangeError, match="areas, expected one outline"):
            section_of_dxf(profile(added))
    with pytest.raises(ExchangeError, match="is on no closed outline: move centre lines"):
        section_of_dxf(profile(longer))


@pytest.mark.slow
def test_a_drawing_without_units_uses_the_units_of_the_scene():
    text = profile().replace("$INSUNITS", "$NOUNITS_")
    (in_mm,), (in_inches,) = section_of_dxf(text), section_of_dxf(text, "in")
    assert max(x for x, _ in in_mm) == pytest.approx(0.03)
    assert max(x for x, _ in in_inches) == pytest.approx(30 * 0.0254)
