"""Four machines drawn in the live editor from the empty sheet; presses and letters are counted."""

from dataclasses import dataclass

from live_page import Hand

JANSEN = {  # Theo Jansen's leg, 3 mm per cm
    "O": (0, 0), "B": (-38, -7.8), "A": (15, 0), "C": (-24.01, 31.27), "D": (-26.95, -45.52), "E": (-74.79, 8.14),
    "F": (-59.23, -28.05), "G": (-43.16, -91.76),
}  # fmt: skip
POINT, PRESS, LETTER, HOME, THINK = 1.1, 0.2, 0.28, 0.4, 1.35
"""Seconds of the keystroke-level model (Card, Moran and Newell 1980): pointing, a click, a letter of somebody who types
40 words a minute, the hand from mouse to keys, and making up one's mind."""


@dataclass
class Maker:
    """Operates the page and counts clicks, drags and letters."""

    hand: Hand
    presses: int = 0
    drags: int = 0
    letters: int = 0
    fields: int = 0

    @property
    def seconds(self) -> float:
        """Return a person's time by the keystroke-level model, with thinking before every press."""
        pointed = self.presses * (THINK + POINT + PRESS) + self.drags * POINT
        return pointed + self.letters * LETTER + 2 * HOME * self.fields

    def press(self, place):
        """Click at a screen position."""
        self.hand.press(place)
        self.hand.release(place)
        self.presses += 1

    def button(self, selector):
        """Click an element, scrolled into view."""
        script = (
            "const each = document.querySelector(arguments[0]); each.scrollIntoView({block: 'nearest'}); "
            "const { x, y, width, height } = each.getBoundingClientRect(); return [x + width / 2, y + height / 2]"
        )
        self.press(self.hand.run(script, selector))

    def tool(self, name):
        """Select a tool."""
        self.button(f"[data-tool={name}]")

    def until_changed(self, act):
        """Do something, and wait until the text has changed and is answered."""
        before = self.hand.text
        act()
        self.hand.until(f"return live.text() !== {before!r}")

    def click(self, *places):
        """Click locations of the plane, each with an edit."""
        for x, y in places:
            self.until_changed(lambda x=x, y=y: self.press(self.hand.at(x, y)))

    def corners(self, *places):
        """Click places that make one edit together, like the corners of a plate."""
        self.until_changed(lambda: [self.press(self.hand.at(*place)) for place in places])

    def drag(self, start, end, pixels=None):
        """Drag from a location of the plane to another, or by pixels."""
        begin = self.hand.at(*start)
        last = self.hand.at(*end) if pixels is None else [begin[0] + pixels[0], begin[1] + pixels[1]]
        self.until_changed(lambda: self.hand.drag(begin, last, 4))
        self.presses += 1
        self.drags += 1

    def write(self, selector, words):
        """Type words into a field, with Enter."""
        self.button(selector)
        self.hand.run("document.querySelector(arguments[0]).select()", selector)
        self.hand.driver.execute_cdp_cmd("Input.insertText", {"text": words})
        self.key("Enter")
        self.letters += len(words)
        self.fields += 1

    def key(self, name):
        """Press a key."""
        code = {"key": name, "code": name, "windowsVirtualKeyCode": {"Enter": 13}[name]}
        for kind in ({"type": "keyDown", "text": "\r"}, {"type": "keyUp"}):
            self.hand.driver.execute_cdp_cmd("Input.dispatchKeyEvent", {**code, **kind})
        self.letters += 1

    def choose(self, selector, value):
        """Select an entry of a list: one press to open it, one on the entry."""
        script = (
            "const each = document.querySelector(arguments[0]); each.value = arguments[1]; "
            "each.dispatchEvent(new Event('change'))"
        )
        self.hand.run(script, selector, value)
        self.presses += 2

    def done(self):
        """Save, wait for the full answer, and return the address of its report."""
        self.button("#save")
        self.hand.until("return document.getElementById('saved').textContent === 'saved'")
        self.hand.until("return live.state.whole > 0 && !document.getElementById('report').hidden", 120)
        return self.hand.run("return document.getElementById('report').href")


def wiper(maker):
    """Draw a windscreen wiper: crank, rod, and the blade's arm with its lever."""
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
    """Draw Theo Jansen's leg: crank, four rods and two triangles."""
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
    """Draw a toggle press: crank, rod, two toggles, and a ram with a force of 5 kN."""
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
    """Draw a robot of two arms: the second rotates on the first, and both return smoothly."""
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
