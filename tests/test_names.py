"""Pictures: names of links are next to their links or have leader lines; undeformed rollers touch their cams."""

from pathlib import Path

import numpy as np
import pytest
from browser import Page
from tiers import in_tiers

import kinelast
from animations import Picture, Style, off_screen
from animations.shapes import moved_beams
from elastic import deflection
from kinelast.answers.results import Results
from kinelast.cli.command import main
from kinelast.outputs import sheet
from kinelast.outputs.pictures import draw_mechanism
from kinelast.scene.data import scene_deflection, scene_motion
from kinelast.tasks.task import shipped_scenes

GALLERY = Path(__file__).parents[1] / "docs" / "gallery"
CROWDED = ["excavator_arm", "scissor_lift"]
AMONG = """
    const svg = document.querySelector('svg.mechanism'), onScreen = svg.getScreenCTM().inverse();
    const { model } = JSON.parse(document.getElementById('scene').textContent);
    const along = (path, count) => {
        const long = path.getTotalLength(), turn = onScreen.multiply(path.getScreenCTM());
        const at = (n) => path.getPointAtLength((n * long) / count).matrixTransform(turn);
        return Array.from({ length: count + 1 }, (_, n) => at(n));
    };
    const linkOf = new Map();
    for (const path of svg.querySelectorAll('.link[data-beam]')) linkOf.set(path, model.beams[path.dataset.beam].link);
    for (const path of svg.querySelectorAll('.link[data-link]')) linkOf.set(path, Number(path.dataset.link));
    const isUnder = ({ level }) => level === 'guide' || level === 'ground';
    const marks = [...model.marks.filter(isUnder), ...model.marks.filter((mark) => !isUnder(mark))];
    const paths = [...svg.querySelectorAll('.mark')];
    marks.forEach((mark, k) => {
        if (mark.kind === 'barrel' || mark.kind === 'block') linkOf.set(paths[k], mark.at.link);
        if (mark.kind === 'rod') linkOf.set(paths[k], mark.to.link);
    });
    const drawn = [...linkOf].filter(([path]) => path.getTotalLength() > 0);
    const lines = drawn.map(([path, link]) => [link, along(path, 400)]);
    const leaders = (svg.querySelector('.leader').getAttribute('d') ?? '').split('M').slice(1)
        .map((line) => line.split('L').map((end) => end.split(',').map(Number)));
    const away = (box, { x, y }) =>
        Math.hypot(Math.max(box.x - x, 0, x - box.x - box.width), Math.max(box.y - y, 0, y - box.y - box.height));
    const named = model.links.map((_, k) => k).filter((k) => k && !model.links[k].name.includes(' '));
    const labels = [...svg.querySelectorAll('.linkname')].map((text, n) => ({ text, k: named[n] }));
    const shown = labels.filter(({ text }) => text.getAttribute('display') !== 'none');
    return [shown.length, shown.filter(({ k, text }) => {
        const box = text.getBBox(), least = (own) => Math.min(...lines.filter(([link]) => (link === k) === own)
            .flatMap(([, places]) => places.map((place) => away(box, place))));
        if (least(true) < 20 && least(true) < least(false)) return false;
        return !leaders.some(([foot, end]) => away(box, { x: end[0], y: end[1] }) < 4 && lines.some(([link, places]) =>
            link === k && places.some(({ x, y }) => Math.hypot(x - foot[0], y - foot[1]) < 2)));
    }).map(({ text }) => text.textContent)];"""
MACHINES = {path.stem: path for path in GALLERY.glob("*.toml")} | shipped_scenes()
NEAREST = """
    const svg = document.querySelector('svg.mechanism'), { model } = kinelast, spots = {};
    const isUnder = ({ level }) => level === 'guide' || level === 'ground';
    const marks = [...model.marks.filter(isUnder), ...model.marks.filter((mark) => !isUnder(mark))];
    svg.querySelectorAll('.mark').forEach((path, k) => {
        const { link, point } = marks[k].at, turn = path.getAttribute('transform');
        if (point && turn) spots[point] = turn.slice(7, -1).split(' ').slice(4).map(Number);
    });
    const leaders = (svg.querySelector('.leader').getAttribute('d') ?? '').split('M').slice(1)
        .map((line) => line.split('L').map((end) => end.split(',').map(Number)));
    const apart = ([x, y], [u, v]) => Math.hypot(u - x, v - y);
    const away = (box, [x, y]) =>
        Math.hypot(Math.max(box.x - x, 0, x - box.x - box.width), Math.max(box.y - y, 0, y - box.y - box.height));
    const names = [...svg.querySelectorAll('.names text:not(.linkname)')].filter((text) =>
        text.getAttribute('display') !== 'none' && spots[text.textContent]);
    return [names.length, names.filter((text) => {
        const own = spots[text.textContent], box = text.getBBox();
        if (leaders.some(([foot, end]) => apart(foot, own) < 2 && away(box, end) < 4)) return false;
        return Object.values(spots).some((other) => apart(other, own) > 3 && away(box, other) <= away(box, own));
    }).map((text) => text.textContent)];"""
TOUCHES = """
    const round = (path) => /A/.test(path.getAttribute('d'));
    const path = [...document.querySelectorAll('.mechanism .rigid path')].find(round);
    const cam = document.querySelector('.mechanism .mark.cam');
    const { x, y } = path.getPointAtLength(0).matrixTransform(path.getScreenCTM()), onScreen = path.getScreenCTM();
    const centre = [onScreen.e, onScreen.f], radius = Math.hypot(x - centre[0], y - centre[1]);
    const long = cam.getTotalLength(), turn = cam.getScreenCTM();
    const away = Array.from({ length: 4000 }, (_, n) => cam.getPointAtLength((n * long) / 4000).matrixTransform(turn))
        .map(({ x, y }) => Math.hypot(x - centre[0], y - centre[1]));
    return [Math.min(...away), radius];"""


@pytest.fixture(scope="module")
def out(tmp_path_factory):
    folder = tmp_path_factory.mktemp("names")
    scenes = [str(GALLERY / f"{name}.toml") for name in [*CROWDED, "valve_train"]]
    assert main([*scenes, "--positions", "72", "--quiet", "-o", str(folder)]) == 0
    return folder


@pytest.mark.slow
@pytest.mark.parametrize("name", CROWDED)
def test_the_name_of_a_link_is_next_to_it_or_has_a_leader_line(name, driver, out):
    page = Page(driver, out / name / "report.html", 1366)
    total = 0
    for position in range(0, 72, 9):
        page.run("kinelast.showPosition(arguments[0])", position)
        count, astray = page.run(AMONG)
        assert astray == []
        total += count
    assert total > 40


@pytest.mark.slow
def test_an_undeformed_roller_touches_its_cam(driver, out):
    page = Page(driver, out / "valve_train" / "report.html", 1366)
    for position in range(0, 72, 9):
        page.run("kinelast.showPosition(arguments[0])", position)
        away, radius = page.run(TOUCHES)
        assert away == pytest.approx(radius, abs=0.5)  # pixels


@pytest.mark.parametrize("name", in_tiers(CROWDED[::-1], 1, 1))
def test_a_name_in_a_film_is_next_to_its_link_or_has_a_leader_line(name):
    scene = kinelast.load(GALLERY / f"{name}.toml")
    bent = deflection(scene.course.at(scene.course.times(24)), scene.sections, joints=scene.joints)
    with off_screen(), Picture(bent, "deflection", Style(show=("links",))) as picture:
        labels, view = picture._labels, picture.view
    axes, beams = moved_beams(bent, 0.0), np.array([link for link, _ in bent.motion.mechanism.beams])
    links = {link.name: at for at, link in enumerate(bent.motion.mechanism.links)}
    leaders = 0
    for label in labels:
        at = links[label.text]
        for position in [each for each in range(24) if label.at(each) and at in beams]:
            lines = view.flat(axes(position))
            foot, end = label.leader(position)
            away = [distance(label, position, line).min() for line in lines]
            own, others = (min(each for each, of in zip(away, beams, strict=True) if (of == at) == same)
                           for same in (True, False))  # fmt: skip
            if foot == end:
                assert own < others
                continue
            leaders += 1
            assert distance(label, position, np.array([end])).max() < 1.0
            assert np.abs(segments(lines[beams == at]) - foot).min() < 0.02 * label.height + 1.0
    assert leaders


def distance(label, position, points):
    """Return the distances of points from the box of a label [pixels]."""
    way = points - label.middle[position]
    return np.hypot(np.maximum(abs(way.real) - label.half.real, 0), np.maximum(abs(way.imag) - label.half.imag, 0))


def segments(lines):
    """Return points that divide the segments of lines finely."""
    return lines[:, :-1, None] + np.diff(lines)[..., None] * np.linspace(0.0, 1.0, 101)


def test_a_far_name_on_paper_has_a_leader_line():
    from matplotlib.figure import Figure

    axes = Figure(figsize=(7.0, 4.0)).add_axes((0, 0, 1, 1))
    scene = kinelast.load(GALLERY / "excavator_arm.toml")
    draw_mechanism(Results(scene, scene_deflection(scene, scene_motion(scene, 24))), axes, 7 + 4j)
    (text,) = (each for each in axes.texts if each.get_text() == "stick_barrel")
    box = text.get_window_extent().padded(3)
    leaders = [axes.transData.transform(line.get_xydata()) for line in axes.lines if line.get_linewidth() == 0.6]
    assert any(box.contains(*end) for ends in leaders for end in ends)


@pytest.mark.parametrize("name", in_tiers(["valve_train", "wiper", *sorted(MACHINES.keys() - {"valve_train", "wiper"})],
                                          1, 4))  # fmt: skip
def test_the_name_of_a_point_on_the_page_is_nearest_to_it_or_has_a_leader_line(name, driver, tmp_path):
    arguments = ["--theory", "quasi-static", "--positions", "24", "--quiet", "-o", str(tmp_path)]
    main([str(MACHINES[name]), *arguments])
    (report,) = tmp_path.glob("*/report.html")
    page = Page(driver, report)
    total = 0
    for position in range(0, page.run("return kinelast.model.positions"), 3):
        page.run("kinelast.showPosition(arguments[0])", position)
        count, astray = page.run(NEAREST)
        assert astray == []
        total += count
    assert total > 10


@pytest.mark.parametrize("name", sorted(MACHINES))
def test_the_name_of_a_point_on_paper_is_nearest_to_it_or_has_a_leader_line(name, monkeypatch):
    from matplotlib.figure import Figure

    placed = []

    def recorded(axes, names, *rest):
        placed.extend(names)
        place(axes, names, *rest)

    place = sheet.place_names
    monkeypatch.setattr(sheet, "place_names", recorded)
    scene = kinelast.load(MACHINES[name])
    axes = Figure(figsize=(7.0, 4.0)).add_axes((0, 0, 1, 1))
    draw_mechanism(Results(scene, scene_deflection(scene, scene_motion(scene, 24))), axes, 7 + 4j)
    leaders = [line.get_xydata() @ (1, 1j) for line in axes.lines if line.get_linewidth() == 0.6]
    points = {each.text.get_text(): each for each in placed if each.always}
    assert len(points) == len({point for link in scene.mechanism.links for point in link.points})

    def away(text, spot):
        box, (x, y) = text.get_window_extent(), axes.transData.transform((spot.real, spot.imag))
        return np.hypot(max(box.x0 - x, 0, x - box.x1), max(box.y0 - y, 0, y - box.y1))

    for point, each in points.items():
        own = each.line[0]
        if any(abs(line[0] - own) < 1e-9 for line in leaders):
            continue
        others = [other.line[0] for other in points.values() if abs(other.line[0] - own) > 1e-6]
        assert all(away(each.text, own) < away(each.text, other) for other in others), point
