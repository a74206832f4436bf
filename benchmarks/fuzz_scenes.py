"""Spoil shipped scenes at random and see that the command answers every one: one status, short messages, no more.

`python benchmarks/fuzz_scenes.py --cases 3000 --seed 1 --jobs 2` spoils scenes in processes that may take so much
memory and time; tests/test_fuzz.py does some hundred of the cases. A case is its seed and number: `--only 17` does
one again.
"""

from __future__ import annotations

import argparse
import contextlib
import io
import os
import random
import re
import signal
import sys
import tempfile
import time
from collections import Counter
from collections.abc import Iterator
from concurrent.futures import ProcessPoolExecutor
from pathlib import Path
from typing import Any, NoReturn

from kinelast.cli.command import main
from kinelast.tasks.task import shipped_scenes, shipped_structures

SECONDS = 20  # that a case may take of a processor, and ten times that of a clock on the wall
MEMORY = 8 << 30  # bytes
LONGEST = 2500  # letters of all messages
DOCUMENTED = (0, 1, 2)
TOKEN = re.compile(r'"[^"\n]*"|[-+]?\d[\w.+-]*|[A-Za-z_][\w-]*|[\[\]{}=,.\n#]')
JUNK = (
    "0", "-1", "1", "2", "1e-300", "5e-324", "1e-9", "1e300", "1e18", "inf", "-inf", "nan", "true", "[]", "{}",
    "[[]]", '""', "9" * 30, "9" * 5000, "0x" + "f" * 9000, '"1 m^9^9^9"', '"1 m^99999999"',
    '"' + "1" * 20000 + ' mm"', '"3 kg/(m s)^2"', '"' + "(" * 60 + 'm"', '"10 mm"', '"100 rpm"', '"210 GPa"',
    '"-5 deg"', '"1e308 m"', '"\\u0000\\u001b[31m"', '"' + "x" * 50000 + '"', "[" * 500 + "]" * 500,
    "[" * 50 + "1" + "]" * 50, "1979-05-27T07:32:00Z", "07:32:00", '"ground"', '"O"', '"A"', '"B"', '"crank"',
    "[0, 0]", "[1e9, 1]", '["A", "B"]', '["A", "A"]', "{A = [0, 0], B = [1, 0]}", "\x00", "\x1b", "é", "\u202e", "\\",
    "'''", '"""', "#", "rigid = true", "mass = 1", "friction = 0.1", 'theory = "timoshenko"', 'units = "mm"', "[run]",
    "[[drives]]", "[[gears]]", "[[loads]]", "[[springs]]", "duration = 1e9", "positions = 1000000",
    "gravity = [0, -9.81]", 'effort = "3 N m"', "speed = 1e9", "speed = 0", 'resists = "one way"', "viscosity = 1",
    'radius = "5 mm"', "[joints.A]", 'viscosity = "0.1 N m s/rad"', "length = 0.05",
)  # fmt: skip
OPTIONS = (
    (),
    (),
    (),
    ("--structure",),
    ("--check", "1"),
    ("--fields", "--stations", "3"),
    ("--refine",),
    ("--reachable",),
)


class Hang(BaseException):
    """A case takes too long."""


def spoilt(chance: random.Random) -> bytes:
    """A shipped scene with one to six mistakes in it, sometimes no text any more."""
    paths = [*shipped_scenes().values(), *shipped_structures().values()]
    text = chance.choice(paths).read_text(encoding="utf-8")
    text = re.sub(r"(?m)^positions *=.*", "positions = 6", text)
    if chance.random() < 0.3:
        text = _rubbing(text, chance)
    for _ in range(chance.choice((1, 1, 1, 1, 2, 4))):
        text = chance.choice((_token, _token, _lines, _swapped, _scaled, _scaled, _scaled, _letters))(text, chance)
    content = text.encode("utf-8", "replace")
    if chance.random() < 0.03:
        at = chance.randrange(len(content) + 1)
        content = content[:at] + chance.randbytes(8) + content[at:]
    return content


def _rubbing(text: str, chance: random.Random) -> str:
    """Friction in some joints, and a load that resists: as they should be, but of any size."""
    points = re.findall(r"(?m)^(\w+) *= *\[", text.partition("[points]")[2].partition("\n[")[0])
    sliders = re.findall(r"(?m)^\[(?:sliders|slots)\.(\w+)\]", text)
    for name in {chance.choice([*points, *sliders] or ["A"]) for _ in range(chance.choice((1, 2, 6)))}:
        size = "length" if name in sliders else "radius"
        keys = (f"friction = {10 ** chance.uniform(-3, 1):.3g}", f"{size} = {10 ** chance.uniform(-4, 0):.3g}")
        text += "\n".join(("", f"[joints.{name}]", *keys, f"viscosity = {10 ** chance.uniform(-6, 3):.3g}", ""))
    links = re.findall(r"(?m)^\[links\.(\w+)\]", text)
    if links and points and chance.random() < 0.5:
        where = f'link = "{chance.choice(links)}"\npoint = "{chance.choice(points)}"'
        text += f'\n[[loads]]\n{where}\nforce = [30, -5]\nresists = "{chance.choice(("one way", "both ways"))}"\n'
    return text


def _token(text: str, chance: random.Random) -> str:
    """Another word, number or bracket in the place of one, from the scene itself or from the junk."""
    tokens = list(TOKEN.finditer(text))
    if not tokens:
        return chance.choice(JUNK)
    one = chance.choice(tokens)
    other = chance.choice(JUNK) if chance.random() < 0.6 else chance.choice(tokens)[0]
    return text[: one.start()] + other + text[one.end() :]


def _scaled(text: str, chance: random.Random) -> str:
    """A number times a power of ten."""
    numbers = list(re.finditer(r"\d+\.?\d*(?:e[-+]?\d+)?", text))
    if not numbers:
        return text
    one = chance.choice(numbers)
    with contextlib.suppress(ValueError):
        return text[: one.start()] + repr(float(one[0]) * 10.0 ** chance.randint(-12, 12)) + text[one.end() :]
    return text


def _lines(text: str, chance: random.Random) -> str:
    """A line or a table lost, twice there, or at another place."""
    lines = text.splitlines(keepends=True) or [""]
    one, other = (chance.randrange(len(lines)) for _ in range(2))
    match chance.randrange(4):
        case 0:
            del lines[one : one + chance.choice((1, 1, 4))]
        case 1:
            lines.insert(other, lines[one])
        case 2:
            lines[one], lines[other] = lines[other], lines[one]
        case _:
            lines.insert(one, chance.choice(JUNK) + "\n")
    return "".join(lines)


def _swapped(text: str, chance: random.Random) -> str:
    """A name of the scene in the place of another, everywhere."""
    names = sorted(set(re.findall(r"[A-Za-z_]\w*", text)))
    if len(names) < 2:
        return text
    one, other = chance.sample(names, 2)
    return re.sub(rf"\b{one}\b", other, text, count=chance.choice((0, 1)))


def _letters(text: str, chance: random.Random) -> str:
    """Some letters lost or doubled, or all behind a place lost."""
    at = chance.randrange(len(text) + 1)
    return text[:at] + chance.choice(("", text[at:][1:], text[at:][:9] + text[at:], chance.choice(JUNK) + text[at:]))


def fault_of(seed: int, number: int, place: Path) -> tuple[int, str]:
    """Exit status of a case, and what is wrong with how the command answered it; empty where all is well."""
    chance = random.Random(f"{seed} {number}")
    (place / "in").mkdir(parents=True)
    scene = place / "in" / f"case{number}.toml"
    scene.write_bytes(spoilt(chance))
    before = set(place.rglob("*"))
    call = [str(scene), "-o", str(place / "out"), *chance.choice(OPTIONS)]
    if "--structure" not in call:
        call += ["--positions", str(chance.choice((1, 2, 5)))]
    said = io.StringIO()
    try:
        with contextlib.redirect_stdout(said), contextlib.redirect_stderr(said), _watched():
            status = main(call)
    except Hang:
        return -1, f"no answer within {SECONDS} s"
    words = said.getvalue()
    made = set(place.rglob("*")) - before
    strays = [path for path in made if place / "out" not in (path, *path.parents)]
    hidden = [path for path in made if path.name.startswith(".")]
    for wrong, what in (
        (status not in DOCUMENTED or "Traceback" in words, f"status {status}: {words[-900:]}"),
        (strays, f"wrote elsewhere: {strays[:3]}"),
        (hidden, f"left half done: {hidden[:3]}"),
        ("--structure" not in call and len(words) > LONGEST, f"says {len(words)} letters: {words[:200]}"),
        (re.search(r"[\x00-\x09\x0b-\x1f\x7f]", words), f"control characters: {words[:200]!r}"),
    ):
        if wrong:
            return status, what
    return status, ""


@contextlib.contextmanager
def _watched() -> Iterator[None]:
    """Raise `Hang` where something takes too long; what is stuck in compiled code ends its process later."""

    def hang(*_: Any) -> NoReturn:
        raise Hang

    clocks = ((signal.SIGPROF, signal.ITIMER_PROF, SECONDS), (signal.SIGALRM, signal.ITIMER_REAL, 10 * SECONDS))
    before = [signal.signal(number, hang) for number, _, _ in clocks]
    for _, clock, seconds in clocks:
        signal.setitimer(clock, seconds)
    try:
        yield
    finally:
        for (number, clock, _), handler in zip(clocks, before, strict=True):
            signal.setitimer(clock, 0)
            signal.signal(number, handler)


def _limited() -> None:
    import resource

    resource.setrlimit(resource.RLIMIT_AS, (MEMORY, MEMORY))


def _case(seed: int, number: int) -> tuple[int, int, str, float]:
    begin = time.monotonic()
    with tempfile.TemporaryDirectory() as place:
        status, fault = fault_of(seed, number, Path(place))
    return number, status, fault, time.monotonic() - begin


def run() -> int:
    """Spoil scenes, print the counts; 1 where an answer was wrong."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--cases", type=int, default=3000)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--jobs", type=int, default=os.cpu_count())
    parser.add_argument("--only", type=int, help="the number of one case")
    options = parser.parse_args()
    numbers = [options.only] if options.only is not None else range(options.cases)
    counts: Counter[int] = Counter()
    wrong, slowest = 0, (0.0, 0)
    with ProcessPoolExecutor(options.jobs, initializer=_limited) as pool:
        for number, status, fault, seconds in pool.map(_case, [options.seed] * len(numbers), numbers, chunksize=8):
            counts[status] += 1
            slowest = max(slowest, (seconds, number))
            if fault:
                wrong += 1
                print(f"case {number} of seed {options.seed}: {fault}", flush=True)
    print(f"{sum(counts.values())} cases, statuses {dict(sorted(counts.items()))}, {wrong} wrong")
    print(f"slowest {slowest[0]:.1f} s, case {slowest[1]}")
    return 1 if wrong else 0


if __name__ == "__main__":
    sys.exit(run())
