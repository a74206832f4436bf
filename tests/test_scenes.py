"""Meaning of the tables in a scene file."""

import re
import tomllib
from math import cos, pi, radians, sin, sqrt
from pathlib import Path

import numpy as np
import pytest
from msgspec.structs import fields
from scene_texts import FOUR_BAR, SLIDER_CRANK, edited
from tiers import in_tiers

from elastic import deflection, sample
from kinelast.scene.data import scene_motion
from kinelast.scene.document import read_scene, scene_from_text
from kinelast.scene.schema import SCHEMAS, key_words, scene_schema, subtables
from kinelast.scene.tables import StrictTable
from kinelast.tasks.task import shipped_scenes, shipped_structures
from kinelast.values.error import SceneError
from kinelast.values.quantities import AngleOrLength
from kinelast.values.units import COMMON_FACTORS, registry
from rigid import LineLoad, PinDrive, PointLoad, SliderDrive, position_of


class TestDrives:
    """A drive starts at the drawn position, or at `start`."""

    def test_a_drive_starts_at_the_drawn_angle(self):
        text = edited(FOUR_BAR, ("A = [0.1, 0.0]", "A = [0.06, 0.08]"))
        course = scene_motion(scene_from_text(text))
        assert course.drive[0, 0] == pytest.approx(np.arctan2(0.8, 0.6))
        assert position_of(course, "crank", "A")[0] == pytest.approx(0.06 + 0.08j)

    def test_start_overrides_the_drawn_angle(self):
        course = scene_motion(scene_from_text(edited(FOUR_BAR, ("speed", 'start = "30 deg"\nspeed'))))
        assert position_of(course, "crank", "A")[0] == pytest.approx(0.1 * (cos(pi / 6) + 1j * sin(pi / 6)))

    def test_a_drive_between_moving_links_is_relative(self):
        text = edited(
            FOUR_BAR,
            ('["A", "B"]', '["A", "P"]'),
            ("A = [0.1, 0.0]", "A = [0.0, 0.1]"),
            ("[links.rocker]\npoints = [\"D\", \"B\"]\nsection = \"bar\"\nmaterial = \"steel\"\n", ""),
            ("[run]", '[[drives]]\nlink = "coupler"\non = "crank"\nspeed = "-50 rad/s"\n[run]'),
        )  # fmt: skip
        scene = scene_from_text(text)
        course = scene_motion(scene)
        assert scene.mechanism.drives == (PinDrive("crank", "O"), PinDrive("coupler", "A", "crank"))
        # Drawn: the crank is along y, and A-P = (0.2, 0.15) is (0.15, -0.2) in the crank's axes.
        assert course.drive[1, 0] == pytest.approx(np.arctan2(-0.2, 0.15))
        assert course.angular_velocity[2] == pytest.approx(np.full(36, 50.0))

    def test_a_turn_excludes_its_end(self):
        scene = scene_from_text(FOUR_BAR)
        assert (scene.run.turn, scene.run.duration) == (True, pytest.approx(2 * pi / 100))
        assert np.degrees(scene_motion(scene, 4).drive[0]) == pytest.approx([0, 90, 180, 270])
        assert scene_motion(scene).columns == (36,)

    def test_a_duration_includes_its_end(self):
        scene = scene_from_text(edited(FOUR_BAR, ("[run]", '[run]\nduration = "20 ms"')))
        assert scene.course.times(3).tolist() == [0.0, 0.01, 0.02]

    def test_a_law_runs_to_its_end(self):
        law = 'law = [{curve = "cycloidal", duration = "0.2 s", by = "90 deg"}, {curve = "dwell", duration = 0.1}, ' \
              '{curve = "harmonic", duration = "0.2 s", to = "0 deg"}]'  # fmt: skip
        scene = scene_from_text(edited(FOUR_BAR, ('speed = "100 rad/s"', law)))
        course = scene_motion(scene, 6)
        assert course.time[-1] == pytest.approx(0.5)
        assert course.drive[0] == pytest.approx(np.radians([0, 45, 90, 90, 45, 0]), abs=1e-15)
        assert course.drive_rate[0] == pytest.approx([0, pi / 0.2, 0, 0, -pi / 2 * pi / 2 / 0.2, 0], abs=1e-12)

    def test_a_driven_slider_starts_at_the_drawn_place(self):
        text = edited(SLIDER_CRANK, ('link = "crank"\nspeed = 100', 'slider = "guide"\nspeed = "-0.1 m/s"'),
                      ("[run]", '[run]\nduration = "50 ms"'), ("A = [0.1, 0.0]", "A = [0.0, 0.1]"),
                      ("B = [0.4, 0.0]", "B = [0.3, 0.0]"))  # fmt: skip
        scene = scene_from_text(text)
        assert scene.mechanism.drives == (SliderDrive("guide"),)
        course = scene_motion(scene, 2)
        assert position_of(course, "block", "B") == pytest.approx([0.3, 0.295])


class TestLoads:
    """Loads at points and along beams, in fixed or turning axes, constant or over time."""

    def load(self, text):
        scene = scene_from_text(edited(FOUR_BAR, ("[run]", f'[[loads]]\nlink = "rocker"\n{text}\n[run]')))
        return scene, scene.mechanism.loads[0]

    def test_at_a_point(self):
        _, load = self.load('point = "B"\nforce = ["1 kN", -5]\nmoment = "2 N m"\naxes = "turning"')
        assert isinstance(load, PointLoad)
        assert (load.link, load.point, load.force, load.moment, load.turning) == ("rocker", "B", 1000 - 5j, 2.0, True)

    def test_along_a_beam(self):
        _, load = self.load('beam = ["D", "B"]\nstart = [0, "-40 N/m"]\nend = [0, "-80 N/m"]')
        assert isinstance(load, LineLoad)
        assert (load.beam, load.start, load.end, load.turning) == (0, -40j, -80j, False)

    @pytest.mark.parametrize(("axes", "start", "end"), [("fixed", -80j, -40j), ("turning", 80j, 40j)])
    def test_along_a_reversed_beam(self, axes, start, end):
        _, load = self.load(f'beam = ["B", "D"]\nstart = [0, -40]\nend = [0, -80]\naxes = "{axes}"')
        assert (load.start, load.end) == (start, end)

    def test_a_reversed_beam_bends_alike(self):
        ends = [("D", "B", 30, 70), ("B", "D", -70, -30)]
        fields = []
        for first, second, start, end in ends:
            text = f'beam = ["{first}", "{second}"]\nstart = [0, {start}]\nend = [0, {end}]\naxes = "turning"'
            scene, _ = self.load(text)
            fields.append(deflection(scene_motion(scene), scene.sections).w)
        assert fields[0] == pytest.approx(fields[1], abs=1e-15)

    def test_a_table_against_time(self):
        scene, load = self.load('point = "B"\nmoment = 1\ntable = [[0, 0], ["30 ms", 3], ["0.1 s", 3]]')
        factor = load.law(scene_motion(scene, 4))
        # A turn takes 20 pi ms; a quarter takes 15.708 ms.
        assert factor == pytest.approx([0.0, pi / 2, 3.0, 3.0])

    def test_a_cubic_through_a_cubic_table_is_the_cubic(self):
        entries = ", ".join(f"[{t}, {t**3 - t}]" for t in (0.0, 0.02, 0.05, 0.07))
        scene, load = self.load(f'point = "B"\nmoment = 1\ninterpolation = "cubic"\ntable = [{entries}]')
        course = scene_motion(scene, 7)
        assert load.law(course) == pytest.approx(course.time**3 - course.time, abs=1e-15)

    def test_a_table_can_be_held(self):
        scene, load = self.load('point = "B"\nmoment = 1\nextend = "hold"\ntable = [["10 ms", 2], ["20 ms", 4]]')
        assert load.law(scene_motion(scene, 2)) == pytest.approx([2.0, 4.0])


class TestShippedScenes:
    """Every shipped scene moves, bends and names its source."""

    @pytest.mark.parametrize("name", in_tiers(sorted(shipped_scenes()), 5, 11))
    def test_shipped_scenes_move(self, name):
        scene = read_scene(shipped_scenes()[name])
        assert (scene.name, bool(scene.title), bool(scene.source)) == (name, True, True)
        bent = deflection(scene_motion(scene, 24), scene.sections)
        assert len(scene.labels) == len(bent.sections) == len(bent.length)
        assert np.isfinite(bent.w).all()

    def test_documented_scenes_are_shipped(self):
        promised = {"steel_four_bar", "utenov_four_bar", "simeon_slider_crank", "offset_slider_crank", "quick_return"}
        assert promised <= set(shipped_scenes())

    def test_the_steel_four_bar_closes_by_pythagoras(self):
        # At crank angle 0, A (0.1, 0) and D (0.35, 0) are 0.25 apart, and B is 0.3 and 0.25 away: 0.18 along, 0.24
        # up.
        course = scene_motion(read_scene(shipped_scenes()["steel_four_bar"]), 4)
        assert position_of(course, "coupler", "B")[0] == pytest.approx(0.28 + 0.24j)
        assert position_of(course, "rocker", "B")[0] == pytest.approx(0.28 + 0.24j)

    def test_simeons_rod_at_a_tenth_of_a_second(self):
        # Closed form for the published data: linear load along the rod, deflection of a simply supported beam.
        scene = read_scene(shipped_scenes()["simeon_slider_crank"])
        course = scene_motion(scene)
        bent = deflection(course, scene.sections)
        assert (course.time[-1], course.drive[0, -1]) == (0.1, pytest.approx(15.0, rel=1e-15))
        across = bent.q[:, 0, -1].imag
        assert across[0] == pytest.approx(625.479186, abs=5e-7)
        assert across.sum() == pytest.approx(-354.877376, abs=5e-7)
        middle = sample(bent, "chord", [0.5])[0, -1, 0]
        assert middle == pytest.approx(2.090334574e-4, abs=5e-13)

    def test_the_ram_rests_at_the_reversal_of_the_rocker(self):
        # The crank is normal to the rocker: the sine of the rocker's lean is 0.1/0.3.
        scene = read_scene(shipped_scenes()["quick_return"])
        turning = scene_from_text(
            edited(Path(scene.path).read_text(encoding="utf-8"),
                   ('speed = "200 rpm"', f'speed = "200 rpm"\nstart = {-np.arcsin(1 / 3)}'))
        )  # fmt: skip
        course = scene_motion(turning, 1)
        assert course.angular_velocity[scene.mechanism.index["rocker"]] == pytest.approx([0.0], abs=1e-12)
        tip = 0.5 * (1 / 3 + 1j * sqrt(8) / 3)
        assert position_of(course, "rocker", "D")[0] == pytest.approx(tip)


KINELAST = Path(__file__).parent.parent / "kinelast"
GALLERY = KINELAST.parent / "docs" / "gallery"
SHIPPED = [*shipped_scenes().values(), *shipped_structures().values(), *sorted(GALLERY.glob("*.toml"))]
# keywords without constraints
IGNORED = {"$schema", "title", "description", "default", "$defs", "discriminator", "prefixItems"}
KINDS = {"object": dict, "array": list, "string": str, "boolean": bool, "integer": int, "number": (int, float)}


def schema_errors(schema, tables):
    """Yield the locations in tables that a JSON Schema (draft 7) rejects, for the keywords used by this project."""
    whole = scene_schema(schema)

    def wrong(schema, value, place):
        held = {
            "$ref": lambda name: wrong(whole["$defs"][name.rpartition("/")[2]], value, place),
            "allOf": lambda every: (each for one in every for each in wrong(one, value, place)),
            "anyOf": lambda some: [] if any(not [*wrong(one, value, place)] for one in some) else [place],
            "type": lambda kind: [place] * (isinstance(value, bool) != (kind == "boolean")
                                            or not isinstance(value, KINDS[kind])),
            "enum": lambda words: [place] * (value not in words),
            "required": lambda keys: [place] * bool(isinstance(value, dict) and {*keys} - value.keys()),
            "additionalProperties": lambda more: [
                each for key, entry in (value if isinstance(value, dict) else {}).items()
                if key not in schema.get("properties", ())
                for each in ([place] if more is False else wrong(more, entry, f"{place}.{key}"))
            ],
            "properties": lambda known: [each for key, entry in (value if isinstance(value, dict) else {}).items()
                                         if key in known for each in wrong(known[key], entry, f"{place}.{key}")],
            "propertyNames": lambda names: [place for key in value for _ in wrong(names, key, place)],
            "items": lambda entry: [each for number, part in enumerate(value if isinstance(value, list) else ())
                                    for each in wrong(entry, part, f"{place}.{number}")],
            "minItems": lambda least: [place] * (isinstance(value, list) and len(value) < least),
            "maxItems": lambda most: [place] * (isinstance(value, list) and len(value) > most),
            "pattern": lambda form: [place] * (isinstance(value, str) and not re.search(form, value)),
            "minimum": lambda least: [place] * (isinstance(value, int | float) and value < least),
            "maximum": lambda most: [place] * (isinstance(value, int | float) and value > most),
            "exclusiveMinimum": lambda bound: [place] * (isinstance(value, int | float) and value <= bound),
            "exclusiveMaximum": lambda bound: [place] * (isinstance(value, int | float) and value >= bound),
        }  # fmt: skip
        for key, given in schema.items():
            if key not in IGNORED:
                yield from held[key](given)

    return dict.fromkeys(place.lstrip(".") for place in wrong(whole, tables, ""))


class TestFormat:
    """The published format equals the one that the program reads."""

    @pytest.mark.parametrize("path", in_tiers(SHIPPED, 10, 30), ids=lambda path: path.stem)
    def test_every_shipped_scene_is_valid_by_its_schema(self, path):
        text = path.read_text(encoding="utf-8")
        named = re.match(r"#:schema (.*)", text)
        schema = (path.parent / named[1]).resolve() if named else KINELAST / "scene.schema.json"
        assert schema.parent == KINELAST.resolve()
        assert not [*schema_errors(schema.name, tomllib.loads(text))]

    @pytest.mark.parametrize(
        ("old", "new", "place"),
        [
            ("depth =", "dpeth =", "sections.bar"),
            ('length = "300 mm"', "length = true", "links.coupler.length"),
            ('"rectangle"', '"rectangel"', "sections.bar"),
            ('link = "crank"', 'links = "crank"', "drives.0"),
            ("positions = 360", 'positions = "many"', "run.positions"),
            ('points = ["A", "B"]', 'points = "A"', "links.coupler.points"),
            ("O = [0.0, 0.0]", "O = [0.0]", "points.O"),
            ('speed = "100 rad/s"', "motion = [[0, 0], [1, true], [2, 3], [3, 4]]", "drives.0.motion"),
            ('speed = "100 rad/s"', 'motion = "lift.csv"', ""),
        ],
    )
    def test_the_schema_locates_a_mistake(self, old, new, place):
        text = edited(shipped_scenes()["steel_four_bar"].read_text(encoding="utf-8"), (old, new))
        assert [*schema_errors("scene.schema.json", tomllib.loads(text))] == [place] * bool(place)

    def test_the_schema_rejects_unknown_keys(self):
        tables = scene_schema()["$defs"]
        assert all(table["additionalProperties"] is False for table in tables.values())
        assert {"yield", "E", "density"} <= set(tables["MaterialTable"]["properties"])
        assert tables["LinkTable"]["required"] == ["points"]

    def test_a_file_with_a_byte_order_mark_and_without_numbers_in_quotes(self, tmp_path):
        plain = tmp_path / "plain.toml"
        plain.write_text(FOUR_BAR, encoding="utf-8-sig")
        assert read_scene(plain).title == "A four-bar"

    def test_gravity_and_name(self):
        scene = scene_from_text(FOUR_BAR, "mine")
        assert (scene.name, scene.mechanism.gravity) == ("mine", -9.81j)
        assert scene_from_text(SLIDER_CRANK, "my_own").title == "my own"

    def test_no_units_library_is_loaded_for_bare_numbers(self):
        import subprocess
        import sys

        bare = edited(SLIDER_CRANK, ('"8 mm"', "0.008"), ('"100 g"', "0.1"), ('"200 g"', "0.2"))
        code = (
            f"import sys; from kinelast import scene_from_text; scene_from_text({bare!r}); print('pint' in sys.modules)"
        )
        assert (
            subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True).stdout == "False\n"
        )

    def test_angles_in_radians(self):
        assert AngleOrLength.read(radians(30)) == radians(30)


class TestGuide:
    """The statements of docs/scenes.md are right."""

    guide = (Path(__file__).parent.parent / "docs" / "scenes.md").read_text(encoding="utf-8")
    example = guide.partition("```toml\n")[2].partition("```")[0]

    def test_the_example_moves(self):
        scene = scene_from_text(self.example)
        assert scene.labels == ("crank", "rod")
        assert np.isfinite(deflection(scene_motion(scene), scene.sections).w).all()

    def test_every_table_and_key_is_documented(self):
        tables = {name for file in SCHEMAS for name in scene_schema(file)["$defs"]}
        asked_for = {name for names in re.findall(r"<!-- keys: (.*) -->", self.guide) for name in names.split()}
        assert asked_for == tables

    def test_every_key_has_a_description(self):
        structs = [*subtables(StrictTable)]
        bare = [f"{struct.__name__}.{field.name}" for struct in structs for field in fields(struct)
                if field.encode_name not in key_words(struct)]  # fmt: skip
        assert len(structs) > 40
        assert not bare, "words beside a field: #:"

    @pytest.mark.parametrize("row", [line for line in guide.splitlines() if "| `press.toml:" in line])
    def test_documented_messages_are_right(self, row):
        line, message = (part.strip(" `") for part in row.strip("|").split(" | "))
        key = {"dpeth": "depth"}.get(line.split()[0], line.split()[0])
        table = message.partition("[")[2].partition("]")[0].lstrip("[")
        table = "links.rod" if key == "length" else table
        header = f"[[{table}]]" if table == "drives" else f"[{table}]"
        before, _, after = self.example.partition(header)
        old = next(candidate for candidate in after.splitlines() if candidate.startswith(f"{key} ="))
        with pytest.raises(SceneError) as caught:
            scene_motion(scene_from_text(before + header + edited(after, (old, line)), "press", "press.toml"))
        assert str(caught.value).startswith(message.removesuffix("..."))


@pytest.mark.parametrize("name", sorted(COMMON_FACTORS))
def test_common_units_agree_with_the_registry(name):
    """Common units need no pint, and agree with it to the last digit."""
    factor, unit = COMMON_FACTORS[name]
    assert float(registry().convert(1.0, registry().parse_units(name), unit)) == factor
