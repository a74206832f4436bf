"""Arrows of loads show the force at the instant: directions from the tables of the scenes and finite differences."""

import tomllib
from pathlib import Path

import numpy as np
import pytest
from browser import Page
from matplotlib.colors import to_hex
from matplotlib.figure import Figure
from tiers import in_tiers

import kinelast
from animations.symbols import symbol_shapes
from elastic import deflection
from kinelast.cli.command import main
from kinelast.outputs.pictures import _draw_all, _sheet
from kinelast.outputs.sheet import COLORS
from kinelast.runs import computed
from kinelast.tasks.request import Request
from kinelast.tasks.task import shipped_scenes
from rigid import position_of
from rigid.postures import posture
from symbols import marks_of

GALLERY = Path(__file__).parents[1] / "docs" / "gallery"
MACHINES = "toggle_press", "jansen_leg", "needle_drive", "pusher", "wiper"
COUNT = 72
STEP = 1e-5  # of the run, for finite differences
UNCLEAR = 1e-3  # smallest share of the largest force or speed at which the expectation is certain
DRAWN = """
    const path = document.querySelector('.mechanism .mark.load');
    const turn = path.getAttribute('transform'), drawn = path.getAttribute('d') !== 'M0 0';
    const [c, s] = turn ? turn.slice(7).split(' ').map(parseFloat) : [0, 0];
    return [drawn, c, -s];"""


def path_of(name):
    return shipped_scenes().get(name, GALLERY / f"{name}.toml")


def expected(name, motion_at, times):
    """Unit vectors of the forces of each load, 0 if there is no force, and nan if a force or a speed is too small."""
    tables = tomllib.loads(path_of(name).read_text(encoding="utf-8"))
    before, here, after = (motion_at(times + shift * STEP * times[-1]) for shift in (-1, 0, 1))
    for load in tables["loads"]:
        force = complex(*(float(str(each).split()[0]) for each in load["force"]))
        force = force / abs(force) * np.ones(len(times), complex)
        if load.get("axes") == "turning":
            first, second = tables["links"][load["link"]]["points"][:2]
            arm = position_of(here, load["link"], second) - position_of(here, load["link"], first)
            force *= arm / abs(arm)
        factor = np.ones(len(times))
        if "table" in load:
            crank = position_of(here, "crank", "A") - position_of(here, "crank", "O")
            places, factors = np.array([(float(str(at).split()[0]), each) for at, each in load["table"]]).T
            middle = (places[0] + places[-1]) / 2
            factor = np.interp((np.degrees(np.angle(crank)) - middle + 180) % 360 - 180 + middle, places, factors)
            factor[(abs(factor) < UNCLEAR) & (factor != 0)] = np.nan
        if "resists" in load:
            way = position_of(after, load["link"], load["point"]) - position_of(before, load["link"], load["point"])
            power = (way * force.conj()).real
            sign = np.where(abs(power) > UNCLEAR * abs(power).max(), -np.sign(power), np.nan)
            factor = factor * (np.maximum(sign, 0) if load["resists"] == "one way" else sign)
        yield force * np.sign(factor)


def agree(found, wanted):
    """Compare unit vectors, except positions at which the expectation is nan."""
    certain = np.isfinite(wanted)
    assert certain.mean() > 0.8
    np.testing.assert_allclose(found[certain], wanted[certain], atol=1e-9)


@pytest.mark.parametrize("name", MACHINES)
def test_arrows_in_films_show_the_force_at_the_instant(name):
    scene = kinelast.load(path_of(name))
    times = scene.course.times(COUNT)
    bent = deflection(scene.course.at(times), scene.sections, joints=scene.joints)
    arrows = [mark for mark in marks_of(bent.motion) if mark.kind == "load"]
    shapes, wanted = symbol_shapes(bent, arrows, 1.0), list(expected(name, scene.course.at, times))
    assert len(shapes) == len(wanted)
    for shape, forces in zip(shapes, wanted, strict=True):
        assert np.unique(np.sign(abs(forces[np.isfinite(forces)]))).size == (1 if name == "wiper" else 2)
        points = np.array([shape.place(position) for position in range(COUNT)])
        shafts = points[:, shape.lines[0][1]] - points[:, shape.lines[0][0]]
        agree(shafts, abs(shafts).max() * forces)


@pytest.mark.parametrize("name", in_tiers(["toggle_press", "pusher"], 1, 1))
def test_the_arrow_on_the_page_follows_the_slider(name, driver, tmp_path):
    assert main([str(path_of(name)), "--positions", str(COUNT), "--quiet", "-o", str(tmp_path)]) == 0
    page = Page(driver, tmp_path / name / "report.html")
    scene = kinelast.load(path_of(name))
    (wanted,) = expected(name, scene.course.at, scene.course.times(COUNT))
    found = []
    for position in range(COUNT):
        page.run("kinelast.showPosition(arguments[0])", position)
        drawn, x, y = page.run(DRAWN)
        found.append(complex(x, y) if drawn else 0j)
    agree(np.array(found), wanted)


@pytest.mark.parametrize("name", in_tiers(["toggle_press", "pusher"], 1, 1))
def test_the_arrow_on_paper_shows_the_force_at_the_instant(name):
    scene = kinelast.load(path_of(name))
    results = computed(scene, Request(positions=COUNT, theory="quasi-static"))
    (wanted,) = expected(name, scene.course.at, scene.course.times(COUNT))
    for position in range(0, COUNT, 5):
        if np.isfinite(wanted[position]):
            sheet = _sheet(results, position, 0.0, (-0.5 - 0.5j, 0.5 + 0.5j))
            sheet.axes = Figure().add_axes((0, 0, 1, 1))
            _draw_all(results, sheet, position, 0.0, 0j)
            heads = [each for each in sheet.axes.patches if to_hex(each.get_edgecolor()) == COLORS["load"]]
            assert len(heads) == bool(wanted[position])


def test_a_posture_has_the_arrow_of_the_table_at_its_full_value():
    scene = kinelast.load(path_of("pusher"))
    here = posture(scene.course.at(np.zeros(1)), 0)
    (arrow,) = (mark for mark in marks_of(here) if mark.kind == "load")
    assert complex(arrow.direction(here)) == -1
