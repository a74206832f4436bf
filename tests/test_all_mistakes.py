"""Claim: every mistake of a scene's file is told in one run, and none that is not there.

A script plants two to four mistakes in scenes, at random places: a key or a table misspelt, a unit of another
dimension, a name that nothing has, a key left out, a choice that there is not, a line that is no TOML.
"""

import pickle
import random
import re
from itertools import groupby

import pytest
from scene_texts import FOUR_BAR, QUICK_RETURN, SLIDER_CRANK
from tiers import in_tiers

from kinelast import SceneError, scene_from_text, shipped_scenes
from kinelast.cli.command import main

NAMES = ("section", "material", "link", "through", "point", "on")
REQUIRED = {"materials": ("E", "density"), "sections": ("depth", "width"), "sliders": ("through", "direction")}
TEXTS = {
    "four-bar": FOUR_BAR,
    "slider-crank": SLIDER_CRANK,
    "quick return": QUICK_RETURN,
    **{name: shipped_scenes()[name].read_text() for name in ("pusher", "drs_push_up", "offset_slider_crank")},
}


def misspelt(word, draw):
    at = draw.randrange(1, len(word)) if len(word) > 1 else 1
    return word[:at] + draw.choice("qxz") + word[at:]


def entries(lines):
    """Of every line with a key: its number, the entry's header as messages name it, key and value."""
    header, counts = "", {}
    for number, line in enumerate(lines):
        if match := re.fullmatch(r"(\[+)([\w.-]+)\]+\s*(#.*)?", line):
            header = match[2]
            if match[1] == "[[":
                counts[header] = counts.get(header, 0) + 1
                header = f"{header}[{counts[header]}]"
        elif match := re.fullmatch(r"([\w-]+) *= *(\S.*?)\s*(#[^\"]*)?", line):
            yield number, header, match[1], match[2]


def mistakes_for(header, key, value, draw):
    """Spoilt lines for a key, each with the place that its message must have."""
    table = header.split(".")[0].partition("[")[0]
    by_figures = "sweep", "optimize", "sensitivities", "limits.figures"  # whose names are known once they are judged
    if header in ("sections", "points", "tolerances", "", "masses", *by_figures):
        if table == "points" and value.startswith("["):
            yield f'{key} = ["3 kg", 0.0]', (header, key)
        return
    if re.fullmatch(r'"[-\d.e]+ \S[^"]*"', value):
        yield f'{key} = "3 cd"', (header, key)
        yield f"{key} = {value.strip(chr(34))}", None
    wrong = misspelt(key, draw)
    yield f"{wrong} = {value}", (header, wrong if key != "shape" else key)
    if key in NAMES and value.startswith('"') and not value.startswith('"ground'):
        yield f'{key} = "{misspelt(value.strip(chr(34)), draw)}"', (header, key)
    if key == "points" and (names := re.findall(r'"(\w+)"', value)) and header != "links.ground":
        yield f"{key} = {value.replace(names[-1], names[-1] + 'q')}", (header, key)
    if key == "shape":
        yield 'shape = "rectangel"', (header, key)
    if key in REQUIRED.get(table, ()):
        yield f"# no {key}", (header, key)


def spoilt(text, seed):
    """A text with two to four mistakes, no two in one line or entry, and where each is: of no TOML the line."""
    draw = random.Random(seed)
    lines = text.splitlines()
    while True:
        places, changed = [], [*lines]
        by_entry = [[*rows] for _, rows in groupby(entries(lines), lambda row: row[1])]
        for rows in draw.sample(by_entry, draw.randint(2, 4)):
            number, header, key, value = draw.choice(rows)
            top = header.split(".")[0].partition("[")[0]
            if draw.random() < 0.1 and top in ("links", "materials", "loads", "drives", "sliders"):
                number -= next(back for back in range(99) if lines[number - back].startswith("["))
                wrong = top[:2] + top[3] + top[2] + top[4:]
                changed[number] = changed[number].replace(top, wrong)
                places.append(("", wrong))
                continue
            if choices := [*mistakes_for(header, key, value, draw)]:
                changed[number], place = draw.choice(choices)
                places.append(place or number + 1)
        if len(places) == len({*places}) > 1:
            return "\n".join(changed), places


def told(text):
    """Where the mistakes of a text are told to be: table and key, or the line of what is no TOML."""
    try:
        scene_from_text(text)
    except SceneError as error:
        for each in (error, *error.others):
            line = re.search(r"not readable as TOML.*at line (\d+)", each.problem)
            yield int(line[1]) if line else re.split(r" [xy]$|\[\d+\]$", f"{each.table}.{each.key}".strip("."))[0]


def alike(found, planted):
    """Whether a message is at a planted mistake."""
    if not isinstance(planted, tuple):
        return found == planted
    header, key = planted
    return found in (f"{header}.{key}".strip("."), header)


@pytest.mark.parametrize("seed", in_tiers(range(150), 8, 16))
def test_every_mistake_is_told_in_one_go(seed):
    text, planted = spoilt([*TEXTS.values()][seed % len(TEXTS)], seed)
    found = [*told(text)]
    assert all(any(alike(one, other) for one in found) for other in planted), (planted, found)
    assert len(found) == len(planted), (planted, found)


def test_the_command_tells_each_on_a_line_of_its_own(tmp_path, capsys):
    text, planted = spoilt(FOUR_BAR, 5)
    (tmp_path / "bad.toml").write_text(text)
    assert main([str(tmp_path / "bad.toml"), "-o", str(tmp_path / "out")]) == 2
    lines = capsys.readouterr().err.splitlines()
    assert len(lines) == len(planted) > 2
    assert all(line.startswith(f"{tmp_path / 'bad.toml'}: ") for line in lines)
    assert not (tmp_path / "out").exists()


STEEL = shipped_scenes()["steel_four_bar"].read_text()


def test_the_first_is_the_error_and_the_others_come_with_it_through_a_pickle():
    with pytest.raises(SceneError, match=r"\[links.crank\] lenth") as caught:
        scene_from_text(STEEL.replace("length", "lenth"))
    error = pickle.loads(pickle.dumps(caught.value))
    assert [each.table for each in (error, *error.others)] == ["links.crank", "links.coupler", "links.rocker"]
    assert str(error).count("\n") == 2


def test_what_does_not_close_is_not_told_of_a_mechanism_that_was_mended():
    open_ = STEEL.replace("250 mm", "50 mm").replace("300 mm", "50 mm")
    assert [*told(open_.replace("poisson", "poison"))] == ["materials.steel.poison"]


def test_a_table_whose_head_cannot_be_read_is_not_told_to_be_missing():
    assert [*told(STEEL.replace("[points]", "[points"))] == [STEEL.splitlines().index("[points]") + 1]
