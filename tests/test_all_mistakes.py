"""One run reports every mistake of a scene file, and only real mistakes.

A script plants two to four random mistakes: misspelt keys and tables, wrong units, unknown names and choices, missing
keys, invalid TOML.
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
    """Yield line number, header as in messages, key and value of each line with a key."""
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
    """Yield damaged lines for a key, each with the expected location of its message."""
    table = header.split(".")[0].partition("[")[0]
    # names of figures are checked later, when they are evaluated
    by_figures = "sweep", "optimize", "sensitivities", "limits.figures"
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
    """Return a text with two to four mistakes in different entries, and their locations."""
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


def reported(text):
    """Yield the reported locations of mistakes: table and key, or the line of invalid TOML."""
    try:
        scene_from_text(text)
    except SceneError as error:
        for each in (error, *error.others):
            line = re.search(r"not readable as TOML.*at line (\d+)", each.problem)
            yield int(line[1]) if line else re.split(r" [xy]$|\[\d+\]$", f"{each.table}.{each.key}".strip("."))[0]


def alike(found, planted):
    """Return whether a message is at the location of a planted mistake."""
    if not isinstance(planted, tuple):
        return found == planted
    header, key = planted
    return found in (f"{header}.{key}".strip("."), header)


@pytest.mark.parametrize("seed", in_tiers(range(150), 8, 16))
def test_every_mistake_is_reported_in_one_run(seed):
    text, planted = spoilt([*TEXTS.values()][seed % len(TEXTS)], seed)
    found = [*reported(text)]
    assert all(any(alike(one, other) for one in found) for other in planted), (planted, found)
    assert len(found) == len(planted), (planted, found)


def test_the_command_prints_one_line_per_mistake(tmp_path, capsys):
    text, planted = spoilt(FOUR_BAR, 5)
    (tmp_path / "bad.toml").write_text(text)
    assert main([str(tmp_path / "bad.toml"), "-o", str(tmp_path / "out")]) == 2
    lines = capsys.readouterr().err.splitlines()
    assert len(lines) == len(planted) > 2
    assert all(line.startswith(f"{tmp_path / 'bad.toml'}: ") for line in lines)
    assert not (tmp_path / "out").exists()


STEEL = shipped_scenes()["steel_four_bar"].read_text()


def test_a_pickled_error_keeps_all_mistakes():
    with pytest.raises(SceneError, match=r"\[links.crank\] lenth") as caught:
        scene_from_text(STEEL.replace("length", "lenth"))
    error = pickle.loads(pickle.dumps(caught.value))
    assert [each.table for each in (error, *error.others)] == ["links.crank", "links.coupler", "links.rocker"]
    assert str(error).count("\n") == 2


def test_a_repaired_scene_reports_no_open_joints():
    open_ = STEEL.replace("250 mm", "50 mm").replace("300 mm", "50 mm")
    assert [*reported(open_.replace("poisson", "poison"))] == ["materials.steel.poison"]


def test_a_table_with_an_unreadable_header_is_not_reported_as_missing():
    assert [*reported(STEEL.replace("[points]", "[points"))] == [STEEL.splitlines().index("[points]") + 1]
