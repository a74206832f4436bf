"""The live editor in a browser: a dragged mechanism moves, bends, is answered and saved, and no text is lost."""

import json
import re
import threading
import time
import tomllib
from contextlib import contextmanager
from functools import partial
from http.server import BaseHTTPRequestHandler, SimpleHTTPRequestHandler, ThreadingHTTPServer

import pytest
from browser import accessibility_faults
from tiers import in_tiers

import kinelast
from kinelast.tasks.task import shipped_scenes
from live.edit import EMPTY
from live.file import SceneFile
from live.share import linked

pytest.importorskip("uvicorn", reason="the extra live is not installed")
live_page, live_machines = (pytest.importorskip(name) for name in ("live_page", "live_machines"))

pytestmark = pytest.mark.slow


@pytest.fixture
def scene(tmp_path):
    path = tmp_path / "mine.toml"
    path.write_text(shipped_scenes()["steel_four_bar"].read_text())
    return path


def errors(hand):
    return [entry["message"] for entry in hand.driver.get_log("browser")]


ON_LINES = """
    const lines = [...document.querySelectorAll("#layer-rigid path, #layer-bent path")], inside = [];
    for (const text of document.querySelectorAll("#layer-sizes text, #layer-names text")) {
        const { x, y, width, height } = text.getBBox(), low = y + 0.25 * height, high = y + 0.8 * height;
        for (const line of lines) for (let k = 0; k <= 200; k++) {
            const at = line.getPointAtLength(line.getTotalLength() * k / 200);
            if (at.x > x && at.x < x + width && at.y > low && at.y < high) { inside.push(text.textContent); break; }
        }
    }
    return inside"""


def test_sizes_lie_on_no_link_and_all_figures_are_in_sight(driver, scene):
    with live_page.editing(scene) as live:
        hand = live_page.Hand(driver, live.address, 1400, 900)
        width = hand.run("return document.documentElement.clientWidth")
        hand.until("return live.state.whole > 0")
        assert hand.run("return document.documentElement.clientWidth") == width  # a scroll bar shifts nothing
        hand.run("document.getElementById('sizes').click()")
        assert len(hand.run("return [...document.querySelectorAll('#layer-sizes text')]")) == 3
        assert hand.run(ON_LINES) == []
        assert hand.run("return document.querySelector('.tile:last-child').getBoundingClientRect().bottom") < 900
        verdict, tiles = (
            hand.run("return document.getElementById(arguments[0]).getBoundingClientRect().top", each)
            for each in ("line", "tiles")
        )
        assert hand.run("return document.getElementById('line').textContent").startswith("largest deflection")
        assert verdict < tiles < 900


def test_new_links_have_the_section_and_material_of_the_last_link(driver, scene):
    scene.write_text(scene.read_text().replace('section = "bar"', 'section = "flat 20x10"'))
    with live_page.editing(scene) as live:
        hand = live_page.Hand(driver, live.address)
        hand.until("return document.body.dataset.ready")
        found = hand.run("return ['section', 'material'].map((name) => document.getElementById(name).value)")
        assert found == ["flat 20x10", "steel"]


def test_joints_and_blocks_are_drawn_at_the_ends_of_bent_links(driver, scene):
    scene.write_text(shipped_scenes()["offset_slider_crank"].read_text())
    with live_page.editing(scene) as live:
        hand = live_page.Hand(driver, live.address)
        hand.until("return live.state.whole > 0")
        hand.run("const it = document.getElementById('position'); it.value = 30; it.dispatchEvent(new Event('input'))")
        ends = hand.run(
            "const end = (path, last) => { const at = path.getPointAtLength(last ? path.getTotalLength() : 0); "
            "return [at.x, at.y] }; const bent = [...document.querySelectorAll('#layer-bent path')]; "
            "return [end(bent[7], true), end(bent[8], false), end(bent.at(-1), true)]"
        )
        [*pins, block] = hand.run(
            "return [...document.querySelectorAll('[data-point=A], [data-point=B], .mark.block')].map((each) => { "
            "const { e, f } = each.transform.baseVal[0].matrix; return [e, f] }).sort((a, b) => a[0] - b[0])"
        )
        assert pins == [pytest.approx(ends[0], abs=0.1), pytest.approx(ends[2], abs=0.1)]
        assert ends[0] == pytest.approx(ends[1], abs=0.1)
        assert block == pytest.approx(pins[1], abs=0.1)
        rigid = hand.run("return document.querySelector('#layer-rigid path').getAttribute('d')")
        x, y = (float(each) for each in rigid.partition("L")[2].split(","))
        assert abs(complex(x - pins[0][0], y - pins[0][1])) > 5
        assert errors(hand) == []


def test_a_joint_is_taken_where_it_is_drawn(driver, scene):
    with live_page.editing(scene) as live:
        hand = live_page.Hand(driver, live.address)
        hand.until("return live.state.whole > 0")
        x, y, left, top = hand.run(
            "const { e, f } = document.querySelector('[data-point=B]').transform.baseVal[0].matrix, "
            "{ left, top } = document.getElementById('svg').getBoundingClientRect(); return [e, f, left, top]"
        )
        rigid, drawn = hand.at(0.28, 0.24), [x + left, y + top]
        away = complex(drawn[0] - rigid[0], drawn[1] - rigid[1])
        assert abs(away) > 10
        to = hand.at(0.25, 0.21)
        hand.drag(drawn, [to[0] + away.real, to[1] + away.imag])
        hand.until("return live.text().includes('B = [0.25, 0.21]')")


def test_only_changed_lines_are_marked(driver, scene):
    with live_page.editing(scene) as live:
        maker = live_machines.Maker(live_page.Hand(driver, live.address))
        hand, before = maker.hand, scene.read_text().splitlines()
        maker.until_changed(lambda: hand.run("live.edit({do: 'mass', point: 'B'}, {do: 'fix', point: 'O'})"))
        lines = hand.text.splitlines()
        fresh = [line for line in lines if line and line not in before]
        marked = hand.run(
            "const line = parseFloat(getComputedStyle(document.getElementById('text')).lineHeight), "
            "down = document.getElementById('text').scrollTop; "
            "return [...document.querySelectorAll('#marks .changed')]"
            ".map((each) => Math.round((parseFloat(each.style.top) - 6 + down) / line))"
        )
        assert [lines[row] for row in marked if lines[row]] == fresh == ['points = ["D"]', "[masses]", 'B = "1 kg"']


def test_a_joint_is_dragged_bends_is_answered_and_saved(driver, scene):
    before = scene.read_text()
    with live_page.editing(scene) as live:
        hand = live_page.Hand(driver, live.address)
        hand.until("return live.state.whole > 0")
        whole, deflection = hand.run("return live.state.whole"), hand.figure("deflection")
        shown = hand.run("return document.querySelector('[data-figure=deflection]').textContent")
        assert re.search(r"± [\d.]+ %", shown)
        start, *way = [hand.at(0.28 - 0.005 * k, 0.24 - 0.003 * k) for k in range(11)]
        hand.press(start)
        hand.move(way)
        hand.until("return live.text().includes('B = [0.23, 0.21]')")
        quick = hand.figure("deflection")
        assert abs(quick / deflection - 1) > 0.1
        assert "quick" in hand.run("return document.getElementById('theory').textContent")
        hand.release(way[-1])
        hand.until(f"return live.state.whole > {whole}")
        assert abs(hand.figure("deflection") / quick - 1) > 0.05  # at this speed the links vibrate
        assert scene.read_text() == before
        assert hand.run("return document.getElementById('saved').textContent") == "not saved"
        hand.run("document.getElementById('save').click()")
        hand.until("return document.getElementById('saved').textContent === 'saved'")
        assert scene.read_text() == hand.text != before
        hand.run("document.getElementById('undo').click()")
        hand.until("return live.text().includes('B = [0.28, 0.24]')")
        assert hand.text == before
        address = hand.run("return document.getElementById('report').href")
        assert accessibility_faults(hand) == []
        assert errors(hand) == []
        driver.get(address)
        hand.until("return document.body.dataset.ready")
        assert "largest deflection" in hand.run("return document.body.textContent")
        assert errors(hand) == []
        injected = "const it = document.createElement('script'); it.textContent = 'window.ran = true';"
        hand.run(f"{injected} document.head.append(it)")
        assert hand.run("return window.ran") is None


def test_the_page_follows_the_file_and_keeps_the_text_without_a_server(driver, scene):
    with live_page.editing(scene) as live:
        hand = live_page.Hand(driver, live.address)
        scene.write_text(scene.read_text().replace("B = [0.28, 0.24]", "B = [0.26, 0.24] # by hand"))
        hand.until("return live.text().includes('# by hand')")
        hand.run("live.edit({do: 'move', point: 'B', to: [0.25, 0.25]})")
        hand.until("return live.text().includes('B = [0.25, 0.25]')")
        scene.write_text(scene.read_text() + "# again\n")
        hand.until("return document.getElementById('notice').textContent.includes('changed on disk')")
        assert "B = [0.25, 0.25] # by hand" in hand.text
        hand.run("document.getElementById('save').click()")
        time.sleep(0.3)
        assert scene.read_text().endswith("# again\n")
    hand.until("return document.getElementById('notice').textContent.includes('No server any more')")
    mine = hand.text
    with live_page.editing(scene) as live:  # same address: the browser still has the text
        hand = live_page.Hand(driver, live.address)
        hand.run("document.querySelector('#notice button').click()")
        hand.until("return live.text().includes('B = [0.25, 0.25]')")
        assert hand.text == mine
        hand.run("live.state.path = null; live.edit({do: 'move', point: 'B', to: [0.24, 0.25]})")  # as from a report
        hand.until("return localStorage.getItem('live mine')?.includes('B = [0.24, 0.25]')", 20)


def test_a_motion_that_stops_has_the_words_of_the_command(driver, scene):
    words = "return document.getElementById('closes').textContent"
    text = scene.read_text()
    scene.write_text(text.replace('length = "300 mm"', 'length = "30 mm"'))
    with pytest.raises(kinelast.SceneError) as error:
        kinelast.scene_motion(kinelast.load(scene))
    with live_page.editing(scene) as live:
        hand = live_page.Hand(driver, live.address)
        shown = hand.until(words)
        assert shown[1:].startswith(error.value.problem.split(";")[0][1:])
        assert shown.endswith("Dashed: the last position in reach. The figures cover the positions up to it.")
        scene.write_text(text.replace("B = [0.28, 0.24]", "B = [0.28,"))
        hand.until(f"{words} === 'This text gives no working mechanism. The last working one is shown pale.'")


def test_a_slider_crank_is_drawn_from_the_empty_sheet(driver, tmp_path):
    path = tmp_path / "new.toml"
    path.write_text("[points]\n\n[links.ground]\npoints = []\n")
    with live_page.editing(path) as live:
        hand = live_page.Hand(driver, live.address)

        def tool(name):
            hand.run("document.querySelector(`[data-tool=${arguments[0]}]`).click()", name)

        def click(x, y):
            place, before = hand.at(x, y), hand.text
            hand.press(place)
            hand.release(place)
            hand.until(f"return live.text() !== {before!r}")

        tool("link")
        hand.drag(hand.at(0, 0), hand.at(0.06, 0.04))
        hand.until("return live.text().includes('link_1')")
        hand.drag(hand.at(0.06, 0.04), hand.at(0.3, 0))
        hand.until("return live.text().includes('link_2')")
        tool("fix")
        click(0, 0)
        tool("slot")
        click(0.3, 0)
        tool("drive")
        click(0.03, 0.02)
        hand.until("return live.state.whole > 0")
        assert hand.run("return document.getElementById('mistakes').children.length") == 0
        assert errors(hand) == []


def test_the_empty_sheet_has_a_hint_and_a_link_is_joined_to_the_middle_of_another(driver, tmp_path):
    path = tmp_path / "new.toml"
    path.write_text(EMPTY)
    with live_page.editing(path) as live:
        maker = live_machines.Maker(live_page.Hand(driver, live.address))
        hand = maker.hand
        assert hand.run("return document.getElementById('empty').checkVisibility()")
        assert not hand.run("return document.getElementById('graph').checkVisibility()")
        assert hand.run("return document.querySelectorAll('#mistakes li, .notice:not([hidden])').length") == 0
        assert accessibility_faults(hand) == []
        maker.drag((0, 0.1), (0.2, 0.1))  # the first tool of an empty sheet is the link
        assert not hand.run("return document.getElementById('empty').checkVisibility()")
        assert hand.run("return document.querySelectorAll('#mistakes li.next').length") == 1
        assert hand.run("return document.getElementById('text').ariaInvalid") == "false"
        assert hand.run("return document.getElementById('value').value") == "0 m"  # the coordinate of A
        shown = "return [...document.querySelectorAll('#number option')].length"
        assert hand.run(shown) > 3
        maker.drag((0.15, 0), (0.105, 0.101))
        links = tomllib.loads(hand.text)["links"]
        assert links["link_1"]["points"] == ["A", "C", "B"]
        assert links["link_2"]["points"] == ["D", "C"]
        assert tomllib.loads(hand.text)["points"]["C"] == [0.1, 0.1]
        hand.run("document.querySelector('[data-tool=link]').click()")
        maker.drag((0.05, 0), (0.0486, 0.1))
        assert tomllib.loads(hand.text)["points"]["E"] == [0.05, 0.1]
        for _ in range(3):
            maker.until_changed(lambda: maker.button("#undo"))
        assert hand.text == EMPTY
        hand.until(f"{shown} === 0")
        assert hand.run("return document.getElementById('value').value") == ""
        hand.until("return document.getElementById('empty').checkVisibility()")
        assert hand.run("return document.querySelectorAll('#mistakes li, .notice:not([hidden])').length") == 0
        assert errors(hand) == []


def test_ctrl_z_undoes_a_typed_field_and_then_the_scene(driver, scene):
    from selenium.webdriver import Keys
    from selenium.webdriver.common.action_chains import ActionChains

    def back():
        ActionChains(driver).key_down(Keys.CONTROL).send_keys("z").key_up(Keys.CONTROL).perform()

    with live_page.editing(scene) as live:
        maker = live_machines.Maker(live_page.Hand(driver, live.address))
        hand, value = maker.hand, "return document.getElementById('value').value"
        maker.choose("#chosen", "link rocker")
        maker.until_changed(lambda: hand.run("live.edit({do: 'move', point: 'B', to: [0.25, 0.25]})"))
        moved = hand.text
        maker.choose("#number", "links.crank.length")
        before = hand.run(value)
        maker.button("#value")
        ActionChains(driver).send_keys("77 mm").perform()
        assert hand.run(value) != before
        back()
        assert (hand.run(value), hand.text) == (before, moved)
        maker.until_changed(lambda: maker.write("#value", "77 mm"))
        assert hand.run(value) == "77 mm"
        maker.until_changed(back)
        hand.until(f"return document.getElementById('value').value === {before!r}")
        assert hand.run("return document.getElementById('number').value") == "links.crank.length"
        assert hand.text == moved
        hand.run("const it = document.getElementById('text'); it.focus(); it.setSelectionRange(0, 0)")
        ActionChains(driver).send_keys("# note\n").perform()
        back()  # letters typed in a row are one undo step
        assert hand.text == moved


def test_a_link_and_a_report_open_in_another_editor(driver, scene, tmp_path):
    text = scene.read_text().replace("100 rad/s", "90 rad/s") + '# "größer"\n'
    scene.write_text(text)
    with live_page.editing(scene) as live:
        hand = live_page.Hand(driver, live.address)
        hand.run("navigator.clipboard.writeText = async () => { throw new Error() }")
        hand.run("document.getElementById('share').click()")
        link = hand.until("return document.querySelector('#notice input')?.value")
        assert linked(link) == text
        assert link.startswith(f"http://127.0.0.1:{live.port}/#")
    other = tmp_path / "other.toml"
    other.write_text(EMPTY)
    with live_page.editing(other) as live:
        hand = live_page.Hand(driver, live.address)
        hand.driver.get("about:blank")
        hand.driver.get(f"http://127.0.0.1:{live.port}/{link[link.index('#') :]}")  # the address without the token
        hand.until(f"return window.live?.text() === {json.dumps(text)}")
        assert hand.run("return location.pathname + location.hash") == "/secret/"
        assert other.read_text() == EMPTY
        hand.until("return live.state.whole > 0")
        again = EMPTY.replace("New", "Another")  # the drawing is not empty, so it is not replaced without a question
        pasted = (
            "const clipboardData = new DataTransfer(); clipboardData.setData('text/plain', arguments[0]); "
            "document.dispatchEvent(new ClipboardEvent('paste', { clipboardData, bubbles: true, cancelable: true }))"
        )
        hand.run(pasted, "http://127.0.0.1:1/" + live_page.fragment(again))
        hand.until("return document.querySelector('#notice button')")
        assert hand.text == text
        hand.run("document.querySelector('#notice button').click()")
        hand.until(f"return live.text() === {json.dumps(again)}")
        carried = (
            "const [page, done] = arguments; "
            "import(`${location.pathname}web/share.js`).then((it) => done(it.carried(page)))"
        )
        page = kinelast.report(kinelast.scene_from_text(text)).page.decode()
        assert driver.execute_async_script(carried, page) == text
        dropped = (
            "const dataTransfer = new DataTransfer(); dataTransfer.items.add(new File(['2P'], 'mine.pmks')); "
            "document.dispatchEvent(new DragEvent('drop', { dataTransfer, cancelable: true }))"
        )
        hand.run(dropped)
        hand.until("return document.getElementById('notice').textContent.includes('--import mine.pmks')")
        assert hand.text == again
        assert errors(hand) == []


def test_dragging_a_point_shows_a_graph_and_sizes(driver, scene):
    curve = "return document.getElementById('curve').getAttribute('d')"
    with live_page.editing(scene) as live:
        maker = live_machines.Maker(live_page.Hand(driver, live.address))
        hand = maker.hand
        hand.until("return live.state.whole > 0")
        maker.write("[aria-label='Search in the list Graph']", "b.y")
        assert hand.run("return document.getElementById('figure').value") == "B.y"
        before = hand.run(curve)
        assert before.count("L") > 60
        words = "return [...document.querySelectorAll('#graph text')].map((each) => each.textContent)"
        assert hand.run(words) == ["247 mm", "140 mm", "B.y", "0 s", "time", "62.3 ms"]
        start, *way = [hand.at(0.28 - 0.005 * k, 0.24 - 0.003 * k) for k in range(11)]
        hand.press(start)
        hand.move(way)
        hand.until("return live.text().includes('B = [0.23, 0.21]')")
        hand.until(f"return document.getElementById('curve').getAttribute('d') !== {before!r}")
        assert hand.run("return live.view.picture.columns.map(({ name }) => name)") == ["B.y"]
        hand.until("return document.getElementById('graphed').textContent.startsWith('210 mm here')")
        reported = hand.run(
            "return [...document.querySelectorAll('#layer-sizes text')].map((each) => each.textContent)"
        )
        assert reported == ["247 mm, 58.24°", "241.9 mm, 119.7°"]  # by Pythagoras: A at (100, 0), D at (350, 0)
        hand.release(way[-1])
        assert accessibility_faults(hand) == []
        assert errors(hand) == []


def test_values_are_in_the_units_of_the_scene(driver, scene):
    scene.write_text(scene.read_text().replace("100 rad/s", "600 rpm"))
    with live_page.editing(scene) as live:
        maker = live_machines.Maker(live_page.Hand(driver, live.address))
        maker.hand.until("return live.state.whole > 0")
        maker.choose("#number", "drives.crank.speed")
        assert maker.hand.run("return document.getElementById('value').value") == "600 rpm"
        assert errors(maker.hand) == []


def test_tools_needed_first_come_first_and_long_lists_are_searched(driver, scene):
    with live_page.editing(scene) as live:
        maker = live_machines.Maker(live_page.Hand(driver, live.address))
        hand = maker.hand
        hand.until("return live.state.whole > 0")
        first = "return [...document.querySelectorAll('#tools button')].map((each) => each.textContent)"
        assert hand.run(first) == ["Move", "Link", "Support", "Drive", "Force"]
        assert hand.run("return document.getElementById('section').checkVisibility()")

        maker.choose("#chosen", "link crank")
        maker.write("[aria-label='Search in the list Entry']", "rig")
        assert hand.run("return document.getElementById('key').value") == "rigid"
        maker.write("[aria-label='Search in the list Number']", "nothing like it")
        assert hand.run("return document.querySelector('#number-known').previousSibling.placeholder") == "no match"
        maker.write("[aria-label='Search in the list Number']", "rocker")
        assert hand.run("return document.querySelector('#number-known').previousSibling.placeholder") == "search"
        assert hand.run("return document.getElementById('number').value") == "links.rocker.length"
        maker.until_changed(lambda: maker.button("#mirror"))  # of the selected crank
        assert tomllib.loads(hand.text)["links"]["link_1"]["points"] == ["O", "C"]
        assert tomllib.loads(hand.text)["points"]["C"] == [-0.1, 0.0]
        for _ in range(4):
            maker.button("#in")
        maker.choose("#chosen", "")
        maker.until_changed(lambda: maker.button("#copy"))
        hand.until("return live.state.queue.then(() => true)")
        places = tomllib.loads(hand.text)["points"].values()
        right = hand.run("return document.getElementById('svg').getBoundingClientRect().right")
        assert max(hand.at(*place)[0] for place in places) < right  # the copy is visible
        maker.until_changed(lambda: maker.write("[aria-label='Search in the list Begin with']", "offset_slider"))
        assert errors(hand) == []


def test_a_four_bar_is_drawn_answered_and_saved_by_keys_alone(driver, tmp_path):
    """L and the arrows draw the links, N selects their ends to fix them, D and Enter add the drive."""
    from selenium.webdriver import Keys
    from selenium.webdriver.common.action_chains import ActionChains

    path = tmp_path / "new.toml"
    path.write_text(EMPTY)
    with live_page.editing(path) as live:
        hand = live_page.Hand(driver, live.address)

        def press(*keys, until="", shift=False):
            chain = ActionChains(driver)
            if shift:
                chain.key_down(Keys.SHIFT)
            for key in keys:
                chain.send_keys(key)
            if shift:
                chain.key_up(Keys.SHIFT)
            chain.perform()
            if until:
                hand.until(f"return live.text().includes({until!r})")

        left, right, up, down = (getattr(Keys, f"ARROW_{way}") for way in ("LEFT", "RIGHT", "UP", "DOWN"))
        press("l", Keys.ENTER)
        assert hand.run("return document.getElementById('where').textContent") == "200 mm, 100 mm"
        press(left, shift=True)
        press(Keys.ENTER)
        press(*[up] * 5)
        press(Keys.ENTER, until="link_1")
        press(Keys.ENTER)
        press(right, right, shift=True)
        press(*[up] * 5)
        press(Keys.ENTER, until="link_2")
        press(Keys.ENTER)
        press(down, shift=True)
        press(Keys.ENTER, until="link_3")
        press("g", "n")
        assert hand.run("return document.getElementById('where').textContent") == "point A"
        press(Keys.ENTER, until='points = ["A"]')
        press("n", "n", "n")
        assert hand.run("return document.getElementById('where').textContent") == "point D"
        press(Keys.ENTER, until='points = ["A", "D"]')
        press("d", "n")
        assert hand.run("return document.getElementById('where').textContent") == "link link_1"
        assert accessibility_faults(hand) == []
        press(Keys.ENTER, until="[[drives]]")
        hand.until("return live.state.whole > 0")
        ActionChains(driver).key_down(Keys.CONTROL).send_keys("s").key_up(Keys.CONTROL).perform()
        hand.until("return document.getElementById('saved').textContent === 'saved'")
        scene = kinelast.read_scene(path)
        assert [link.name for link in scene.mechanism.links] == ["ground", "link_1", "link_2", "link_3"]
        assert scene.course.at([0.0]).origin[1:, 0] == pytest.approx([0.1 + 0.1j, 0.1 + 0.15j, 0.3 + 0.2j])
        assert hand.figure("deflection") > 0
        assert errors(hand) == []


@pytest.mark.parametrize("name", in_tiers(live_machines.MACHINES, 2, 0))
def test_a_machine_is_drawn_from_the_empty_sheet_answered_saved_and_reported(driver, tmp_path, name):
    path = tmp_path / "new.toml"
    path.write_text(EMPTY)
    with live_page.editing(path) as live:
        maker = live_machines.Maker(live_page.Hand(driver, live.address))
        live_machines.MACHINES[name](maker)
        address = maker.done()
        assert path.read_text() == maker.hand.text
        assert maker.hand.figure("deflection") > 0
        assert maker.presses <= 23
        assert accessibility_faults(maker.hand) == []
        assert errors(maker.hand) == []
        driver.get(address)
        maker.hand.until("return document.body.dataset.ready")


def test_a_cylinder_and_wheels_are_drawn_taken_and_typed(driver, tmp_path):
    path = tmp_path / "new.toml"
    path.write_text(EMPTY)
    with live_page.editing(path) as live:
        maker = live_machines.Maker(live_page.Hand(driver, live.address))
        hand = maker.hand
        maker.tool("link")
        maker.drag((0, 0), (0.25, 0.1))
        maker.drag((0.3, 0), (0.4, 0.1))
        maker.tool("fix")
        maker.click((0, 0), (0.3, 0))
        maker.tool("cylinder")
        maker.drag((0.1, -0.1), (0.25, 0.1))
        maker.tool("gear")
        maker.press(hand.at(0.1, 0.04))
        maker.click((0.35, 0.05))
        marks = (
            "return ['barrel', 'rod', 'wheel', 'rail'].map((kind) => document.querySelectorAll(`svg .${kind}`).length)"
        )
        assert hand.run(marks) == [1, 1, 2, 0]
        maker.choose("#number", "gears[1].ratio")
        maker.until_changed(lambda: maker.write("#value", "-0.5"))
        assert hand.run("return document.getElementById('value').value") == "-0.5"
        maker.tool("move")
        maker.press(hand.at(0.16, -0.02))
        assert hand.run("return document.getElementById('chosen').value") == "cylinder cylinder_1"
        maker.until_changed(lambda: maker.button("#delete"))
        assert "cylinder" not in hand.text
        assert errors(hand) == []


def test_parts_without_a_symbol_are_added_by_table_and_entries(driver, tmp_path):
    path = tmp_path / "new.toml"
    path.write_text(EMPTY)
    with live_page.editing(path) as live:
        maker = live_machines.Maker(live_page.Hand(driver, live.address))
        maker.tool("link")
        maker.drag((0, 0.1), (0.08, 0.1))
        maker.drag((0, -0.1), (0.17, 0.29))
        maker.tool("fix")
        maker.click((0, 0.1), (0, -0.1))
        maker.tool("slot")
        maker.click((0.08, 0.1))
        maker.tool("drive")
        maker.click((0.04, 0.1))
        maker.tool("trace")
        maker.click((0.03, -0.03))
        for part, table, key, value in (
            ("link link_1", "sections", "depth", "12 mm"),
            ("drive 0", "motors", "rotor_inertia", "1e-5 kg m^2"),
            ("link link_1", "stops", "most", "90 deg"),
            ("point B", "joints", "radius", "6 mm"),
            ("point B", "limits", "deflection", "1 mm"),
        ):
            maker.choose("#chosen", part)
            maker.until_changed(lambda table=table: maker.choose("#add", table))
            maker.hand.until(f"return document.getElementById('chosen').value !== {part!r}")
            maker.choose("#key", key)
            maker.until_changed(lambda value=value: maker.write("#entry", value))
            assert f'{key} = "{value}"' in maker.hand.text
        assert maker.hand.run("return document.getElementById('number').value").startswith("limits.")
        maker.hand.until("return document.querySelector('.tile.kept')")
        maker.button("#delete")
        maker.hand.until("return !live.text().includes('[limits]')")
        assert maker.hand.run("return document.getElementById('mistakes').children.length") == 0
        assert accessibility_faults(maker.hand) == []
        assert errors(maker.hand) == []


def test_the_editor_stands_in_the_frame_of_a_notebook_and_in_no_other_page(driver, scene, tmp_path):
    view = kinelast.live(scene)
    page = tmp_path / "page.html"
    page.write_text(f"<!doctype html><title>Notebook</title>{view._repr_html_()}")
    handler = partial(SimpleHTTPRequestHandler, directory=tmp_path)
    ready = "return document.body.dataset.ready && live.state.whole > 0"
    try:
        with ThreadingHTTPServer(("127.0.0.1", 0), handler) as notebook:
            threading.Thread(target=notebook.serve_forever, daemon=True).start()
            driver.get(f"http://localhost:{notebook.server_port}/page.html")
            driver.switch_to.frame(0)
            end = time.monotonic() + 60
            while not driver.execute_script(ready):
                assert time.monotonic() < end
                time.sleep(0.05)
            driver.execute_script("live.edit({do: 'move', point: 'B', to: [0.25, 0.25]})")
            while "B = [0.25, 0.25]" not in view.text:
                assert time.monotonic() < end
                driver.execute_script("document.getElementById('save').click()")
                time.sleep(0.1)
            driver.switch_to.default_content()
            notebook.shutdown()
        driver.get(page.as_uri())
        driver.switch_to.frame(0)
        assert not driver.execute_script("return document.body?.dataset.ready")
        driver.switch_to.default_content()
    finally:
        view.close()


WIDGET = """<!doctype html><title>Notebook</title><div id="cell"></div><script type="module">
import widget from "./widget.js";
const reported = { files: FILES, name: "mine", address: "http://127.0.0.1:1/there/" };
const model = { get: (name) => reported[name], off: () => {},
  on: (_, heard) => { model.heard = heard; },
  send: async (words) => {
    const response = await fetch("ask", { method: "POST", body: JSON.stringify(words) });
    model.heard({ number: words.number, status: response.status }, [new DataView(await response.arrayBuffer())]);
  } };
widget.render({ model, el: document.getElementById("cell") });
</script>"""


@contextmanager
def notebook_with_widget(scene, policy=None, answers=True):
    """Yield the address of a page with a widget: page requests replace messages, and no editor is served."""
    from live.notebook import PAGE
    from live.server import WEB, Live, page_file, response_to

    live = Live(SceneFile(scene), "mine", "secret", 0)
    files = {name: page_file(name).read_text() for name in PAGE}

    class Notebook(BaseHTTPRequestHandler):
        def respond(self, body, kind, status=200):
            self.send_response(status)
            self.send_header("Content-Type", kind)
            if policy:
                self.send_header("Content-Security-Policy", policy)
            self.end_headers()
            self.wfile.write(body)

        def do_GET(self):
            if self.path == "/widget.js":
                return self.respond((WEB / "widget.js").read_bytes(), "text/javascript")
            return self.respond(WIDGET.replace("FILES", json.dumps(files).replace("</", "<\\/")).encode(), "text/html")

        def do_POST(self):
            words = json.loads(self.rfile.read(int(self.headers["Content-Length"])))
            if answers:
                response = response_to(live, words["path"], words["given"])
                self.respond(response.body, response.media_type, response.status_code)

        def log_message(self, *words):
            pass

    with ThreadingHTTPServer(("127.0.0.1", 0), Notebook) as notebook:
        threading.Thread(target=notebook.serve_forever, daemon=True).start()
        try:
            yield f"http://127.0.0.1:{notebook.server_port}/"
        finally:
            notebook.shutdown()


def test_the_widget_of_a_notebook_is_the_editor_by_messages(driver, scene):
    with notebook_with_widget(scene) as address:
        driver.get(address)
        end = time.monotonic() + 60
        try:
            driver.switch_to.frame(0)
            while not driver.execute_script("return document.body.dataset.ready && live.state.whole > 0"):
                assert time.monotonic() < end
                time.sleep(0.05)
            driver.execute_script("live.edit({do: 'move', point: 'B', to: [0.25, 0.25]})")
            while "B = [0.25, 0.25]" not in scene.read_text():
                assert time.monotonic() < end
                driver.execute_script("document.getElementById('save').click()")
                time.sleep(0.1)
            driver.switch_to.default_content()
            assert not driver.execute_script("return document.querySelector('[role=status]').textContent")
        finally:
            driver.switch_to.default_content()
            driver.get("about:blank")


WEBVIEW = "script-src 'self' 'unsafe-inline' 'unsafe-eval'; style-src 'self' 'unsafe-inline'; child-src https: data:"


@pytest.mark.parametrize(
    ("policy", "answers", "words"),
    [
        (WEBVIEW, True, "keeps the editor's script from running: open http://127.0.0.1:1/there/ in a browser on the"),
        (None, False, "The kernel does not answer: the editor begins when the cell that runs has ended"),
    ],
)
def test_a_widget_that_cannot_start_gives_advice(driver, scene, policy, answers, words):
    """The policy is that of a VS Code webview with notebook.experimental.enableCsp."""
    with notebook_with_widget(scene, policy, answers) as address:
        driver.get(address)
        end = time.monotonic() + 30
        try:
            while words not in driver.execute_script(
                "return document.querySelector('[role=status]')?.textContent ?? ''"
            ):
                assert time.monotonic() < end
                time.sleep(0.1)
        finally:
            driver.get("about:blank")


@pytest.mark.parametrize("width", [390, 1280])
def test_the_mechanism_is_drawn_above_the_hint(driver, tmp_path, width):
    scene = tmp_path / "tall.toml"
    scene.write_text(shipped_scenes()["quick_return"].read_text())
    with live_page.editing(scene) as live:
        hand = live_page.Hand(driver, live.address, width, 844)
        lowest = hand.run(
            "const marks = [...document.querySelectorAll('#svg g:not(#layer-grid) > path')]; "
            "return Math.max(...marks.map((each) => each.getBoundingClientRect().bottom))"
        )
        assert 0 < lowest < hand.run("return document.querySelector('.hint').getBoundingClientRect().top")


@pytest.mark.parametrize("width", [390, 1280])
def test_the_drawing_stands_above_the_fold_and_nothing_is_cut_off(driver, scene, width):
    with live_page.editing(scene) as live:
        hand = live_page.Hand(driver, live.address, width, 844)
        box = hand.run(
            "const { top, bottom } = document.getElementById('stage').getBoundingClientRect(); return [top, bottom]"
        )
        assert 0 < box[0] < box[1] < 844
        assert hand.run("return document.documentElement.scrollWidth") <= width
        size = {"width": width, "height": 844, "deviceScaleFactor": 1, "mobile": False}  # a narrow window
        driver.execute_cdp_cmd("Emulation.setDeviceMetricsOverride", size)
        hand.run("document.querySelector('details').open = true")
        assert hand.run("const it = document.documentElement; return it.scrollWidth - it.clientWidth") == 0
        hand.run("document.querySelector('details').open = false")
        scales = hand.run(
            "const [o, d] = ['O', 'D'].map((name) => document.querySelector(`#layer-pins [data-point=${name}]`)); "
            "const [x, y] = [o, d].map((each) => each.transform.baseVal[0].matrix.e); "
            "return [(y - x) / 0.35, live.view.scale]"
        )
        assert scales[0] == pytest.approx(scales[1], rel=1e-3)  # the same scale in both directions
