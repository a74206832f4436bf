"""Pages of single designs show the figures of their row, and a failed page does not lose the sweep."""

import csv
import json
import shlex

import pytest
from browser import Page
from sweeps import swept_scene

from kinelast.cli.command import main
from kinelast.sweep.pages import paged_designs

SWEEP = """
[sweep]
figures = ["deflection", "mass", "stress", "joint_force", "drive_effort"]
smallest = "stress"

[sweep.vary]
"sections.bar.depth" = {from = "4.1 mm", to = "9.3 mm", count = 4}
"sections.bar.width" = ["20 mm", "40 mm"]
"""


@pytest.fixture
def scene(tmp_path):
    path = swept_scene(tmp_path / "my bars.toml", SWEEP)
    text = path.read_text(encoding="utf-8")
    assert 'accuracy = "5 %"' in text
    path.write_text(text.replace('accuracy = "5 %"', 'theory = "quasi-static"'), encoding="utf-8")  # like the rows
    return path


def swept(scene, *options):
    return main([str(scene), "--sweep", "-o", str(scene.parent / "out"), *options])


def linked_designs(folder):
    """Return the designs linked_designs on the page of a sweep, best first."""
    head = '<script type="application/json" id="designs">'
    page = (folder / "designs.html").read_text(encoding="utf-8")
    return json.loads(page.split(head)[1].split("</script>")[0])["pages"]


def test_the_report_of_a_design_shows_the_figures_of_its_row(scene, capsys):
    assert swept(scene, "--pages", "2", "--positions", "10") == 0
    folder = scene.parent / "out" / "my bars"
    with (folder / "designs.csv").open(newline="") as file:
        rows = {row["design"]: row for row in csv.DictReader(file)}
    pages = linked_designs(folder)
    best = min(rows, key=lambda number: float(rows[number]["stress [Pa]"]))
    assert len(pages) == 2
    assert best in pages
    for number, address in pages.items():
        assert (folder / address).is_file()
        found = json.loads((folder / "designs" / number / "summary.json").read_text())
        assert found["scene"]["title"].endswith(f", design {number}")
        assert found["theory"]["name"] == "quasi-static"
        assert "what_if" not in found  # two numbers vary
        assert found["run"]["positions"] == 10
        figures = {
            "deflection [m]": abs(found["largest_deflection"]["value"]),
            "mass [kg]": sum(link["mass"]["value"] for link in found["links"]),
            "stress [Pa]": found["largest_stress"]["value"],
            "joint_force [N]": max(joint["force"]["value"] for joint in found["joints"]),
            "drive_effort [N m]": max(abs(drive["effort"]["value"]) for drive in found["drives"].values()),
        }
        for name, value in figures.items():  # the scene file has 12 digits
            assert value == pytest.approx(float(rows[number][name]), rel=1e-10), name
        assert main([str(scene), "--design", number, "-o", str(scene.parent)]) == 0
        one = f"my bars_design_{number}.toml"
        assert (folder / "designs" / one).read_bytes() == (scene.parent / one).read_bytes()


@pytest.mark.slow
def test_a_page_that_fails_does_not_lose_the_sweep(scene, monkeypatch, capsys):
    def fails(*_):
        raise ValueError("no ink")

    folder = scene.parent / "out" / "my bars"
    with monkeypatch.context() as patch:
        patch.setattr("kinelast.outputs.page.report_page", fails)
        assert swept(scene, "--pages", "1") == 3
    assert "the program failed on report.html" in capsys.readouterr().err
    assert (folder / "designs.csv").is_file()
    assert linked_designs(folder) == {}
    assert swept(scene, "--pages", "1", "--resume") == 0
    [address] = linked_designs(folder).values()
    made = (folder / address).stat().st_mtime_ns
    assert swept(scene, "--pages", "1", "--resume") == 0
    assert (folder / address).stat().st_mtime_ns == made
    (folder / "designs").rename(folder / "others")
    (folder / "designs").write_text("somebody's own")
    assert swept(scene, "--pages", "1") == 2
    assert "no pages of single designs" in capsys.readouterr().err
    assert linked_designs(folder) == {}
    assert (folder / "designs").read_text() == "somebody's own"


def test_pages_are_made_for_the_best_design_and_the_front():
    columns = {"mass": [1.0, 2.0, 3.0, 3.0, 9.0], "safety": [1.0, 2.0, 1.5, 4.0, 3.0]}  # the front is 0, 1, 3
    assert paged_designs(columns, ("mass", "safety"), 4, 20) == [4, 0, 1, 3]
    assert paged_designs(columns, ("mass", "safety"), 3, 20) == [3, 0, 1]
    assert paged_designs(columns, ("mass", "safety"), None, 2) == [0, 3]
    assert paged_designs(columns, ("mass", "safety"), 4, 1) == [4]


@pytest.mark.slow
def test_a_click_opens_a_report_or_shows_its_command(scene, driver, monkeypatch, capsys):
    assert swept(scene, "--pages", "1") == 0
    path = scene.parent / "out" / "my bars" / "designs.html"
    page, best = Page(driver, path), next(iter(linked_designs(path.parent)))
    assert page.run("return document.getElementById('commands')") is None
    other = page.run(
        "const row = [...document.querySelectorAll('#designs-table tbody tr')]"
        ".find((each) => each.dataset.design !== arguments[0]); "
        "row.querySelector('button').click(); return row.dataset.design",
        best,
    )
    assert page.run("return document.querySelector('#chosen a')") is None
    commands = page.run("return document.getElementById('commands').textContent").splitlines()
    monkeypatch.chdir(scene.parent)
    for command in commands:
        program, *words = shlex.split(command)
        assert program == "deflection-report"
        assert main(words) == 0
    [made] = scene.parent.glob(f"deflection-report/*_design_{other}/summary.json")
    with (path.parent / "designs.csv").open(newline="") as file:
        row = list(csv.DictReader(file))[int(other)]
    found = json.loads(made.read_text())["largest_stress"]["value"]
    assert found == pytest.approx(float(row["stress [Pa]"]), rel=1e-10)
    page.run("document.querySelector(`#designs-table tr[data-design='${arguments[0]}'] button`).click()", best)
    page.run("document.querySelector('#chosen a').click()")
    assert page.run("return document.body.dataset.ready") == "yes"
    assert driver.current_url.endswith(f"/designs/{best}/report.html")


@pytest.mark.slow
def test_a_report_has_a_slider_for_a_single_varied_number(scene, driver):
    text = scene.read_text(encoding="utf-8").replace('"sections.bar.width" = ["20 mm", "40 mm"]\n', "")
    one = scene.with_name("one.toml")
    one.write_text(text.replace('{from = "4.1 mm", to = "9.3 mm", count = 4}', '["9 mm", "5 mm", "7 mm"]'))
    assert swept(one, "--pages", "1", "--positions", "10") == 0
    folder = scene.parent / "out" / "one"
    [address] = linked_designs(folder).values()
    page = Page(driver, folder / address)
    with (folder / "designs.csv").open(newline="") as file:
        rows = sorted(csv.DictReader(file), key=lambda row: float(row["sections.bar.depth [m]"]))
    given = page.run("return kinelast.summary.what_if")
    assert given["values"] == [float(row["sections.bar.depth [m]"]) for row in rows]
    assert rows[given["here"]]["design"] == address.split("/")[1]
    for figure in given["figures"]:
        heading = f"{figure['name']} [{figure['unit']}]".replace(" [1]", "")
        assert figure["values"] == [float(row[heading]) for row in rows], heading
    page.run(
        "const slider = document.getElementById('what-if-value'); slider.value = 0; "
        "slider.dispatchEvent(new Event('input'))"
    )
    shown = page.run(
        "return [...document.querySelectorAll('#what-if tbody tr')].map((row) => row.children[3].textContent)"
    )
    mass = [figure["name"] for figure in given["figures"]].index("mass")
    here = given["figures"][mass]["values"]
    assert shown[mass][1:] == f"{100 * (1 - here[0] / here[given['here']]):.3g} %"
    assert page.run("return document.querySelectorAll('#what-if .chart').length") == 4
    assert page.logs() == []
