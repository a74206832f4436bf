"""Jobs that take too much time or memory are reported or not started."""

import json
import re

import numpy as np
import pytest
from mechanisms import steel_four_bar
from msgspec.structs import replace
from scene_texts import ARM, FALLING, FOUR_BAR, QUICK_RETURN, edited

from elastic import Section, sample
from elastic.elastodynamics import elastodynamic, solution
from elastic.elastodynamics.vibration_settings import VIBRATION
from elastic.vibration import natural_frequencies
from kinelast.cli.command import main
from kinelast.designs.studies import sensitivity_study
from kinelast.figures.beam_limits import MAX_BEAMS
from kinelast.runs import computed
from kinelast.scene.data import scene_deflection, scene_motion
from kinelast.scene.document import document_from_text, scene_from_text
from kinelast.speed_study.speeds import speeds
from kinelast.structure import structure_text
from kinelast.tasks.progress import Progress
from kinelast.tasks.request import Request
from kinelast.values.error import SceneError
from rigid import Link, Lump, Mechanism, PinDrive, motion
from rigid.dynamics import Effort, ForwardError, forward
from rigid.topology import Contact


def test_an_integration_that_needs_far_too_many_steps_stops_early():
    """A pendulum of one micrometre oscillates five million times in three hours."""
    links = (Link("ground", {"O": 0.0}), Link("bob", {"O": 0.0, "A": 1e-6}, lumps=(Lump("A", 1.0),)))
    pendulum = Mechanism(links, (PinDrive("bob", "O"),), {}, gravity=-9.81j)
    steps = []
    warned = r"it has taken 2\d steps, 10000 s would take about .*e\+\d+ times as many"
    with pytest.raises(ForwardError, match=warned) as caught:
        forward(pendulum, [Effort()], [1.0], [0.0], 1e4, 1e-8, max_steps=1000, on_step=steps.append)
    assert caught.value.kind == "steps"
    assert 20 <= len(steps) < 30
    # An integration that nearly fits is continued to the last allowed step.
    with pytest.raises(ForwardError, match="it has taken 50 steps"):
        forward(pendulum, [Effort()], [1.0], [0.0], 0.1, 1e-8, max_steps=50)


@pytest.mark.parametrize(("duration", "steps", "warned"), [(200, 60, True), (8, 1000, False)])
def test_a_warning_after_twenty_steps_announces_too_many_steps(duration, steps, warned, tmp_path, capsys):
    """The integration stops only at the limit, so an early warning is needed."""
    text = edited(FALLING, ("duration = 2", f"duration = {duration}\nsteps = {steps}"))
    (tmp_path / "arm.toml").write_text(text)
    assert main([str(tmp_path / "arm.toml"), "-o", str(tmp_path / "out")]) == (2 if warned else 0)
    said = capsys.readouterr().err
    sentence = r"arm: after 2\d steps the integration has reached .*, but it stops after \d+ \(steps under"
    assert bool(re.search(sentence, said)) == warned


def test_refinement_respects_the_memory_limit(monkeypatch):
    tried = []
    known = solution.resolved_in_time

    def counted(*given):
        tried.append(given[0].basis.shape[1])
        return known(*given)

    monkeypatch.setattr(solution, "resolved_in_time", counted)
    mechanism = steel_four_bar().mechanism
    sections = [Section(EA=1.26e7, EI=37.8)] * len(mechanism.beams)
    turning = lambda t: motion(mechanism, 60.0 * np.asarray(t), 60.0, 0.0, t)  # noqa: E731
    instants = turning(np.linspace(0.0, 2 * np.pi / 60.0, 9))
    monkeypatch.setattr(
        solution, "first_discretization", lambda model, tolerance: solution.Discretization(model, 1, 1.0, tolerance)
    )
    monkeypatch.setattr(solution, "VIBRATION", replace(VIBRATION, max_entries=0))
    rough = elastodynamic(instants, turning, 2 * np.pi / 60.0, sections, tolerance=1e-5)
    assert len(tried) == 1
    assert rough.reduction_error > 1e-5  # the error is reported


def test_contacts_count_as_constraints_in_the_structure_report():
    """A contact holds the second wheel, so there are as many drives as degrees of freedom."""
    links = (Link("ground", {"O": 0.0, "D": 3.0}), Link("a", {"O": 0.0}), Link("b", {"D": 0.0}))
    wheels = Mechanism(links, (PinDrive("a", "O"),), {"O": 0.0, "D": 3.0})
    text = " ".join(structure_text(wheels, [Contact("mesh", "a", "b", 1.0, 1j)]).split())
    assert "as many as m" in text
    assert 'but the contact "mesh" is none of these' in text
    assert "add a drive" not in text
    assert "add a drive" in " ".join(structure_text(wheels).split())


def test_the_error_for_a_tapered_guide_names_file_table_and_key():
    tapered = """
[materials.steel]
E = 210e9
density = 7850
[sections.bar]
shape = "rectangle"
depth = [0.02, 0.01]
width = 0.01
[points]"""
    rigid = 'rigid = true\nmass = 0.4\ncenter = [0.25, 0]\ninertia = "8e-3 kg m^2"'
    text = edited(QUICK_RETURN, ("[points]", tapered.strip()), (rigid, 'section = "bar"\nmaterial = "steel"'))
    scene = scene_from_text(text, "mine", "mine.toml")
    with pytest.raises(SceneError, match="is tapered, expected a prismatic one") as caught:
        scene_deflection(scene, scene_motion(scene, 4))
    assert (caught.value.file, caught.value.table, caught.value.key) == ("mine.toml", "links.rocker", "section")


def arm_of(count):
    """Return the scene of the arm, divided into `count` beams by tiny masses."""
    points = {f"P{k}": f"[{0.2 * k / count!r}, 0]" for k in range(1, count)}
    names = ", ".join(f'"{name}"' for name in ("O", *points, "A"))
    masses = ", ".join(f'{name} = "1e-9 g"' for name in points)
    drawn = "".join(f"{name} = {place}\n" for name, place in points.items())
    return edited(
        ARM,
        ("A = [0.2, 0]\n", f"A = [0.2, 0]\n{drawn}"),
        ('points = ["O", "A"]', f"points = [{names}]\nmasses = {{ {masses} }}"),
    )


@pytest.mark.slow
def test_an_arm_of_a_hundred_beams_vibrates_like_one_beam():
    """Tip deflection and frequencies agree, and the lowest frequency has a closed form.

    Rotary inertia and shear reduce the Euler-Bernoulli frequency by 4.648/2 (r/l)^2 (1 + E/kG), by Rayleigh's
    quotient.
    """
    found = []
    for count in (1, 100):
        text = arm_of(count) if count > 1 else ARM
        scene = scene_from_text(text.replace("positions = 8", "positions = 8\ngravity = [0, -9.81]"))
        course = scene_motion(scene, 8)
        bent = elastodynamic(course, scene.course.at, 2 * np.pi / 50.0, scene.sections)
        omega = natural_frequencies(course, scene.sections).omega[:, 0]
        found.append((np.abs(sample(bent.deflection, "w", [1.0])[-1]).max(), *omega))
    one, many = np.array(found)
    np.testing.assert_allclose(many, one, rtol=2e-6)
    euler = 3.51601527 * np.sqrt(210e9 * 0.006**2 / 12 / 7850) / 0.2**2
    shear = 2 * 1.3 * (12 + 11 * 0.3) / (10 * 1.3)  # E/kG by Cowper
    assert 1 - one[1] / euler == pytest.approx(4.648 / 2 * 0.006**2 / 12 / 0.2**2 * (1 + shear), rel=0.02)


@pytest.mark.slow
def test_vibration_of_too_many_beams_is_reported_as_unknown_before_it_starts(tmp_path, capsys, monkeypatch):
    def never(*_, **__):
        raise AssertionError("matrices of very many beams")

    for place in ("kinelast.answers.theory.elastodynamic", "elastic.vibration.natural_frequencies"):
        monkeypatch.setattr(place, never)
    count = MAX_BEAMS + 1
    text = arm_of(count)
    file = tmp_path / "long.toml"
    file.write_text(text)
    assert main([str(file), "--positions", "4", "--out", str(tmp_path / "out")]) == 0
    warned = capsys.readouterr().err
    assert f"not computed for {count} beams with {6 * count} coordinates" in warned
    assert f'of which {count} are in the link "arm"' in warned
    figures = json.loads((tmp_path / "out" / "long" / "summary.json").read_text())
    assert figures["theory"]["name"] == "quasi-static"
    assert figures["theory"]["error"] is None
    assert any(f"{count} beams" in finding["text"] for finding in figures["trust"])


class Recorder(Progress):
    """Record the stages of the progress."""

    def __init__(self):
        self.stages = []

    def __call__(self, stage, done, total):
        self.stages.append((stage, done, total))


@pytest.mark.slow
def test_progress_counts_integrated_designs_one_by_one():
    """Integration of one design may take seconds."""
    text = edited(ARM, ("speed = 50.0", 'effort = "0.1 N m"'), ("positions = 8", "positions = 3\nduration = 0.02"))
    recorder = Recorder()
    sensitivity_study(document_from_text(text), ["sections.bar.depth"], recorder)
    assert [done for _, done, _ in recorder.stages] == list(range(len(recorder.stages)))
    assert len(recorder.stages) > 4


def test_progress_of_speeds_shows_the_resolution():
    recorder = Recorder()
    speeds(scene_from_text(ARM), (20.0, 60.0, 2), recorder)
    assert any("solving speeds (" in stage for stage, _, _ in recorder.stages)
    assert {(0, 2), (1, 2)} <= {(done, total) for stage, done, total in recorder.stages if stage.endswith(": speeds")}
    between = [(done, total) for stage, done, total in recorder.stages if "searching between" in stage]
    assert len(between) > 2
    assert all(done < total for done, total in between)


def test_progress_of_vibration_shows_the_resolution():
    recorder = Recorder()
    scene = scene_from_text(edited(FOUR_BAR, ("positions = 36", "positions = 8")))
    computed(scene, Request(), recorder)
    assert len({stage for stage, _, _ in recorder.stages if "solving vibration (" in stage}) > 1
