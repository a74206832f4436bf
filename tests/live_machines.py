"""Four machines drawn from the empty sheet of the live editor by presses and typed letters, which are counted."""

from __future__ import annotations

from dataclasses import dataclass

from live_page import Hand

JANSEN = {  # Theo Jansen's leg, drawn at 3 mm to its cm
    "O": (0, 0), "B": (-38, -7.8), "A": (15, 0), "C": (-24.01, 31.27), "D": (-26.95, -45.52), "E": (-74.79, 8.14),
    "F": (-59.23, -28.05), "G": (-43.16, -91.76),
}  # fmt: skip
POINT, PRESS, LETTER, HOME, THINK = 1.1, 0.2, 0.28, 0.4, 1.35
"""Seconds of the keystroke-level model (Card, Moran and Newell 1980): pointing, a click, a letter of somebody who types
40 words a minute, the hand from mouse to keys, and making up one's mind."""


@dataclass
class Maker:
    """A hand on the page that counts what it does: presses of the mouse, drags among them, and letters."""

    hand: Hand
    presses: int = 0
    drags: int = 0
    letters: int = 0
    fields: int = 0

    @property
    def seconds(self) -> float:
        """Time of a person by the keystroke-level model, thinking before every press."""
        pointed = self.presses * (THINK + POINT + PRESS) + self.drags * POINT
        return pointed + self.letters * LETTER + 2 * HOME * self.fields

    def press(self, place):
        """A click."""
        self.hand.press(place)
        self.hand.release(place)
        self.presses += 1

    def button(self, selector):
        """A click on an element of the page, scrolled to where it can be seen."""
        script = (
            "const each = document.querySelector(arguments[0]); each.scrollIntoView({block: 'nearest'}); "
            "const { x, y, width, height } = each.getBoundingClientRect(); return [x + width / 2, y + height / 2]"
        )
        self.press(self.hand.run(script, selector))

    def tool(self, name):
        """Take a tool."""
        self.button(f"[data-tool={name}]")

    def until_changed(self, act):
        """Do something, and wait until the text is another and is answered."""
        before = self.hand.text
        act()
        self.hand.until(f"return live.text() !== {before!r}")

    def click(self, *places):
        """A click at each of some places of the plane, each with an edit."""
        for x, y in places:
            self.until_changed(lambda x=x, y=y: self.press(self.hand.at(x, y)))

    def corners(self, *places):
        """Clicks that make an edit together: those of a plate."""
        self.until_changed(lambda: [self.press(self.hand.at(*place)) for place in places])

    def drag(self, start, end, pixels=None):
        """A drag from a place of the plane to another, or so far on the screen."""
        begin = self.hand.at(*start)
        last = self.hand.at(*end) if pixels is None else [begin[0] + pixels[0], begin[1] + pixels[1]]
        self.until_changed(lambda: self.hand.drag(begin, last, 4))
        self.presses += 1
        self.drags += 1

    def write(self, selector, words):
        """Click a field and write into it, with Enter."""
        self.button(selector)
        self.hand.run("document.querySelector(arguments[0]).select()", selector)
        self.hand.driver.execute_cdp_cmd("Input.insertText", {"text": words})
        self.key("Enter")
        self.letters += len(words)
        self.fields += 1

    def key(self, name):
        """A key."""
        code = {"key": name, "code": name, "windowsVirtualKeyCode": {"Enter": 13}[name]}
        for kind in ({"type": "keyDown", "text": "\r"}, {"type": "keyUp"}):
            self.hand.driver.execute_cdp_cmd("Input.dispatchKeyEvent", {**code, **kind})
        self.letters += 1

    def choose(self, selector, value):
        """An entry of a list: a press that opens it, and one on the entry."""
        script = (
            "const each = document.querySelector(arguments[0]); each.value = arguments[1]; "
            "each.dispatchEvent(new Event('change'))"
        )
        self.hand.run(script, selector, value)
        self.presses += 2

    def done(self):
        """Save, and wait for the whole answer; the address of its report."""
        self.button("#save")
        self.hand.until("return document.getElementById('saved').textContent === 'saved'")
        self.hand.until("return live.state.whole > 0 && !document.getElementById('report').hidden", 120)
        return self.hand.run("return document.getElementById('report').href")


def wiper(maker):
    """A windscreen wiper: crank, rod, and the blade's arm with its lever."""
    maker.tool("link")
    maker.drag((0, 0), (0.04, 0))
    maker.drag((0.04, 0), (0.3, 0.05))
    maker.tool("plate")
    for place in ((0.3, 0.05), (0.3, -0.03), (0.3, 0.3)):
        maker.press(maker.hand.at(*place))
    maker.until_changed(lambda: maker.key("Enter"))
    maker.tool("fix")
    maker.click((0, 0), (0.3, -0.03))
    maker.tool("drive")
    maker.click((0.02, 0))


def jansen(maker):
    """Theo Jansen's leg: crank, four rods and two triangles."""
    at = {name: (0.35 + 0.003 * x, 0.2 + 0.003 * y) for name, (x, y) in JANSEN.items()}
    maker.button("summary")
    maker.button("#snap")
    maker.tool("link")
    for ends in ("OA", "AC", "AD", "BD", "EF"):
        maker.drag(*(at[end] for end in ends))
    maker.tool("plate")
    for ring in ("BCEB", "DFGD"):
        maker.corners(*(at[end] for end in ring))
    maker.tool("fix")
    maker.click(at["O"], at["B"])
    maker.tool("drive")
    maker.click(tuple((a + b) / 2 for a, b in zip(at["O"], at["A"], strict=True)))


def press(maker):
    """A toggle press: crank, rod, two toggles, and a ram that pushes with 5 kN."""
    maker.button("summary")
    maker.write("#section", "flat 50x20")
    maker.tool("link")
    for start, end in (((0.1, 0.14), (0.1, 0.18)), ((0.1, 0.18), (0.37, 0.15)), ((0.4, 0.3), (0.37, 0.15)),
                       ((0.37, 0.15), (0.4, 0))):  # fmt: skip
        maker.drag(start, end)
    maker.tool("fix")
    maker.click((0.1, 0.14), (0.4, 0.3))
    maker.tool("slot")
    maker.drag((0.4, 0), (0.4, 0.05))
    maker.tool("mass")
    maker.click((0.4, 0))
    maker.tool("drive")
    maker.click((0.1, 0.16))
    maker.tool("load")
    maker.drag((0.4, 0), None, (0, -60))
    maker.choose("#number", "loads.link_4.force.y")
    maker.until_changed(lambda: maker.write("#value", "5 kN"))


def robot(maker):
    """A robot of two arms: the second turned on the first, both there and back without a jump in acceleration."""
    maker.tool("link")
    maker.drag((0, 0), (0.25, 0.1))
    maker.drag((0.25, 0.1), (0.45, 0))
    maker.tool("fix")
    maker.click((0, 0))
    maker.tool("mass")
    maker.click((0.45, 0))
    maker.tool("drive")
    for place, by, time in (((0.125, 0.05), "60 deg", "0.5 s"), ((0.35, 0.05), "-90 deg", "0.5 s")):
        maker.click(place)
        maker.until_changed(lambda: maker.choose("#inspector select", "modified-sine"))
        maker.until_changed(lambda by=by: maker.write("#inspector label:nth-of-type(2) input", by))
        maker.until_changed(lambda time=time: maker.write("#inspector label:nth-of-type(3) input", time))


MACHINES = {"windscreen wiper": wiper, "Theo Jansen's leg": jansen, "toggle press": press, "robot of two arms": robot}
