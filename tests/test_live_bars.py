"""Points on the bars of links in the live editor: they divide a bar, stay in order and stay on it."""

import tomllib
from itertools import pairwise

import numpy as np
import pytest

from kinelast.tasks.task import shipped_scenes
from live.answer import quick_answer
from live.edit import EMPTY, edited
from live.parts import drawn, points_of

STEEL = shipped_scenes()["steel_four_bar"].read_text()
FOUR_BAR = (
    {"do": "link", "points": [[0, 0], [0.1, 0]]},
    {"do": "link", "points": ["B", [0.28, 0.24]]},
    {"do": "link", "points": ["C", [0.35, 0]]},
    {"do": "fix", "point": "A"},
    {"do": "fix", "point": "D"},
    {"do": "drive", "link": "link_1"},
)


def made(*changes, text=EMPTY):
    """Return a scene made by changes of the empty sheet."""
    for change in changes:
        text = edited(text, change)
    return text


def joined(text, link, between, share, start=(0.2, -0.1)):
    """Return a scene with a link more, drawn onto the bar of another, and the name of their joint."""
    place = {"link": link, "between": between, "share": share}
    text = edited(text, {"do": "link", "points": [[*start], place]})
    return text, points_of([*tomllib.loads(text)["links"].values()][-1])[1]


@pytest.mark.parametrize("half", [0, 1])
@pytest.mark.parametrize("closed", [False, True])
def test_a_second_link_is_joined_to_the_bar_that_it_is_drawn_onto(half, closed):
    corners = [[0, 0], [0.2, 0.1], [0.1, 0.3]][: 2 + closed]
    text, first = joined(made({"do": "link", "points": corners, "closed": closed}), "link_1", ["A", "B"], 0.5)
    text, second = joined(text, "link_1", [["A", first], [first, "B"]][half], 0.5, (0.3, -0.1))
    link, places = tomllib.loads(text)["links"]["link_1"], drawn(tomllib.loads(text))
    assert [places[first], places[second]] == pytest.approx([0.1 + 0.05j, (0.25 + 0.5 * half) * places["B"]])
    row = ["A", *([first, second] if half else [second, first]), "B"]
    assert link["points"] == [*row, "C"][: 4 + closed]
    assert link.get("beams") == ([[*each] for each in pairwise([*row, "C", "A"])] if closed else None)
    mistakes = quick_answer(edited(text, {"do": "fix", "point": "A"}))[0]["mistakes"]
    assert not [each for each in mistakes if "beam" in each["message"]]


def test_a_beam_with_a_section_of_its_own_is_divided_into_two_of_it():
    text = made(*FOUR_BAR)
    text = edited(text, {"do": "put", "path": ["links", "link_2", "beams"], "value": [
        {"from": "B", "to": "C", "section": "flat 30x5"}]})  # fmt: skip
    text, joint = joined(text, "link_2", ["B", "C"], 0.25)
    one, other = tomllib.loads(text)["links"]["link_2"]["beams"]
    assert one == {"from": "B", "to": joint, "section": "flat 30x5"}
    assert other == {"from": joint, "to": "C", "section": "flat 30x5"}


@pytest.mark.parametrize(("text", "link", "ends"), [(made(*FOUR_BAR), "link_2", "BC"), (STEEL, "coupler", "AB")])
def test_points_of_a_bar_stay_on_it_in_order_as_its_end_is_moved(text, link, ends):
    """Two points divide the coupler at its middle and behind, a bar is on the first, and the end is moved."""
    start, end = ends
    text, middle = joined(text, link, [start, end], 0.5)
    text, last = joined(text, link, [middle, end], 0.5)
    before = tomllib.loads(text)
    text = edited(text, {"do": "move", "point": end, "to": [0.31, 0.17]})
    after = tomllib.loads(text)
    assert points_of(after["links"][link]) == [start, middle, last, end]
    own = after["links"][link]["points"]
    at = {each: complex(*place) for each, place in own.items()} if isinstance(own, dict) else drawn(after)
    shares = [(at[each] - at[start]) / (at[end] - at[start]) for each in (middle, last)]
    np.testing.assert_allclose(shares, [0.5, 0.75], atol=1e-9)
    assert abs(at[end] - at[start]) == pytest.approx(abs(0.31 + 0.17j - drawn(after)[start]), rel=1e-9)
    assert drawn(after)[middle] == pytest.approx((drawn(after)[start] + 0.31 + 0.17j) / 2)
    unmoved = [name for name in before["points"] if name not in (middle, last, end)]
    assert {name: after["points"][name] for name in unmoved} == {name: before["points"][name] for name in unmoved}


def test_a_point_that_divides_a_bar_is_moved_alone():
    text, middle = joined(made(*FOUR_BAR), "link_2", ["B", "C"], 0.5)
    text, last = joined(text, "link_2", [middle, "C"], 0.5)
    before = drawn(tomllib.loads(text))
    text = edited(text, {"do": "move", "point": middle, "to": [0.2, 0.2]})
    assert drawn(tomllib.loads(text)) == {**before, middle: 0.2 + 0.2j}
    assert tomllib.loads(text)["links"]["link_2"]["points"] == ["B", middle, last, "C"]
