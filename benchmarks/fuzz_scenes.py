"""Run the command on spoilt and random scenes; check its status, messages and files.

    python benchmarks/fuzz_scenes.py --cases 3000 --seed 1 --jobs 2

`--kind spoilt` damages shipped scenes, `--kind drawn` takes scenes and options from drawn_scenes.py. Memory and time of
a process are limited. `--note` adds a row for every hundred cases to results/fuzz_scenes.csv and continues from there.
`--only 17` repeats case 17 of the seed. tests/test_fuzz.py runs some hundred of the cases.
"""

import argparse
import contextlib
import csv
import io
import json
import os
import random
import re
import signal
import sys
import tempfile
import time
import warnings
from collections import Counter
from collections.abc import Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor
from concurrent.futures.process import BrokenProcessPool
from pathlib import Path
from typing import Any, NoReturn
from unittest import mock

from drawn_scenes import drawn_case

from kinelast.cli.command import main
from kinelast.figures.registry import figures_of
from kinelast.outputs.table import csv_rows
from kinelast.tasks.task import shipped_scenes, shipped_structures
from kinelast.values.figure import LEAST

SECONDS = 20  # processor time of a case; its wall time is limited to ten times as much
MAX_MEMORY = 8 << 30  # of a process [bytes]
MAX_MESSAGES = 2500  # characters of all messages
DOCUMENTED = (0, 1, 2)
BAD_INPUT = 2
CASES_PER_ROW = 100
RESULTS = Path(__file__).parent / "results" / "fuzz_scenes.csv"
NOTICE = re.compile(
    r"take about|takes about|in about|, about [\d.]+ (?:s|min|h)|seconds a step|\d+ of \d+"
)  # announces a long computation
ENDLESS = {"buckling"} | {figure.key for figure in figures_of(None) if figure.over == LEAST}
"""Figures that are infinite for an unstressed machine; JSON has no infinity."""
NOT_A_NUMBER = re.compile(r"(?<![\w\"'.])(?:nan|inf|NaN|Infinity)(?![\w\"'])")
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
OPTIONS = ((), (), (), ("--structure",), ("--check", "1"), ("--fields", "--stations", "3"), ("--reachable",))


class Hang(BaseException):
    """Raised if a case takes too long."""


def spoilt(chance: random.Random) -> bytes:
    """Return a shipped scene with one to six mistakes, sometimes with random bytes."""
    paths = [*shipped_scenes().values(), *shipped_structures().values()]
    text = chance.choice(paths).read_text(encoding="utf-8")
    text = re.sub(r"(?m)^positions *=.*", "positions = 6", text)
    if chance.random() < 0.3:
        text = _with_friction(text, chance)
    for _ in range(chance.choice((1, 1, 1, 1, 2, 4))):
        text = chance.choice((_token, _token, _lines, _swapped, _scaled, _scaled, _scaled, _letters))(text, chance)
    content = text.encode("utf-8", "replace")
    if chance.random() < 0.03:
        at = chance.randrange(len(content) + 1)
        content = content[:at] + chance.randbytes(8) + content[at:]
    return content


def _with_friction(text: str, chance: random.Random) -> str:
    """Add valid friction to some joints, and a resisting load, of any size."""
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
    """Replace a word, number or bracket by one of the scene or of the junk."""
    tokens = list(TOKEN.finditer(text))
    if not tokens:
        return chance.choice(JUNK)
    one = chance.choice(tokens)
    other = chance.choice(JUNK) if chance.random() < 0.6 else chance.choice(tokens)[0]
    return text[: one.start()] + other + text[one.end() :]


def _scaled(text: str, chance: random.Random) -> str:
    """Multiply a number by a power of ten."""
    numbers = list(re.finditer(r"\d+\.?\d*(?:e[-+]?\d+)?", text))
    if not numbers:
        return text
    one = chance.choice(numbers)
    with contextlib.suppress(ValueError):
        return text[: one.start()] + repr(float(one[0]) * 10.0 ** chance.randint(-12, 12)) + text[one.end() :]
    return text


def _lines(text: str, chance: random.Random) -> str:
    """Remove, double or move lines."""
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
    """Replace a name of the scene by another, once or everywhere."""
    names = sorted(set(re.findall(r"[A-Za-z_]\w*", text)))
    if len(names) < 2:
        return text
    one, other = chance.sample(names, 2)
    return re.sub(rf"\b{one}\b", other, text, count=chance.choice((0, 1)))


def _letters(text: str, chance: random.Random) -> str:
    """Remove or double some characters, or cut the text off."""
    at = chance.randrange(len(text) + 1)
    return text[:at] + chance.choice(("", text[at:][1:], text[at:][:9] + text[at:], chance.choice(JUNK) + text[at:]))


def fault_of(seed: int, number: int, place: Path) -> tuple[int, str]:
    """Exit status of a spoilt scene, and the fault of the command's answer or ""."""
    chance = random.Random(f"{seed} {number}")
    content = spoilt(chance)
    words = [*chance.choice(OPTIONS)]
    if "--structure" not in words:
        words += ["--positions", str(chance.choice((1, 2, 5)))]
    return answered(content, words, place, f"case{number}")


def drawn_fault(seed: int, number: int, place: Path) -> tuple[int, str]:
    """Exit status of a random scene with random options, and the fault of the command's answer or ""."""
    case = drawn_case(seed, number)
    (place / "in").mkdir(parents=True)
    (place / "in" / "designs.csv").write_text("links.crank.length\n0.05\n0.06\n", encoding="utf-8")
    content = case.text.encode("utf-8", "replace")
    if number % 4 == 0:
        return answered(content, case.words, place, f"case{number}")
    with mock.patch("kinelast.outputs.page.report_page", return_value=b"<html></html>"):  # pages take half of the time
        return answered(content, case.words, place, f"case{number}")


def answered(content: bytes, options: Sequence[str], place: Path, name: str) -> tuple[int, str]:
    """Run the command on a scene; return its status and the fault of its messages and files, or ""."""
    (place / "in").mkdir(parents=True, exist_ok=True)
    scene = place / "in" / f"{name}.toml"
    scene.write_bytes(content)
    before = set(place.rglob("*"))
    call = [str(scene), "-o", str(place / "out"), *options]
    said = io.StringIO()
    try:
        with contextlib.redirect_stdout(said), contextlib.redirect_stderr(said), _captured(said), _time_limit():
            status = main(call)
    except Hang:
        announced = "--quiet" in options or NOTICE.search(said.getvalue())
        return (-2, "") if announced else (-1, f"no answer within {SECONDS} s, nor a notice: {said.getvalue()[-300:]}")
    words = said.getvalue()
    made = set(place.rglob("*")) - before
    strays = [path for path in made if place / "out" not in (path, *path.parents)]
    hidden = [path for path in made if path.name.startswith(".")]
    short = any(each.startswith(("--structure", "--list", "--completion")) for each in options) or (
        status == 2 and "usage:" in words
    )
    for wrong, fault in (
        (status not in DOCUMENTED or "Traceback" in words, f"status {status}: {words[-900:]}"),
        (strays, f"wrote elsewhere: {strays[:3]}"),
        (hidden, f"left half done: {hidden[:3]}"),
        (not short and len(words) > MAX_MESSAGES, f"says {len(words)} letters: {words[:200]}"),
        (re.search(r"[\x00-\x09\x0b-\x1f\x7f]", words), f"control characters: {words[:200]!r}"),
        (re.search(r"Warning\b", words), f"a warning: {words[:300]}"),
        (status < BAD_INPUT and NOT_A_NUMBER.search(words), f"no number: {words[:300]}"),
    ):
        if wrong:
            return status, fault
    return status, "" if status >= BAD_INPUT else _fault_of_files(place / "out")


def _fault_of_files(out: Path) -> str:
    """Return the fault of the result files, or ""."""

    def refuse(word: str) -> NoReturn:
        raise ValueError(word)

    for path in out.rglob("*.json"):
        try:
            content = json.loads(path.read_text(encoding="utf-8"), parse_constant=refuse)
        except ValueError as error:
            return f"{path.name}: {error}"
        for row in (content.get("acceptance") or {}).get("limits", ()) if path.name == "summary.json" else ():
            if row["passed"] and row["found"]["value"] is None and row["kind"] not in ENDLESS:
                return f"a limit is kept by an unknown figure: {row}"
    for path in out.rglob("*.csv"):
        if not NOT_A_NUMBER.search(path.read_text(encoding="utf-8")):
            continue
        headings, *rows = csv_rows(path.read_bytes())
        for heading, cell in (pair for row in rows for pair in zip(headings, row, strict=False)):
            unstressed = cell == "inf" and re.split(r"[ .]", heading)[0] in ENDLESS
            if NOT_A_NUMBER.search(cell) and not unstressed:
                return f"{path.name}: {heading}: {cell}"
    return ""


@contextlib.contextmanager
def _captured(said: io.StringIO) -> Iterator[None]:
    """Capture Python's warnings and the standard error of compiled code."""
    sys.__stderr__.flush()
    with tempfile.TemporaryFile() as file, warnings.catch_warnings(record=True) as heard:
        warnings.simplefilter("always")
        kept = os.dup(2)
        os.dup2(file.fileno(), 2)
        try:
            yield
        finally:
            os.dup2(kept, 2)
            os.close(kept)
            file.seek(0)
            said.write(file.read().decode("utf-8", "replace"))
            said.write("".join(f"{each.category.__name__}: {each.message}\n" for each in heard))


@contextlib.contextmanager
def _time_limit() -> Iterator[None]:
    """Raise `Hang` after the time limit; compiled code that never returns ends with its process."""

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

    resource.setrlimit(resource.RLIMIT_AS, (MAX_MEMORY, MAX_MEMORY))


def _case(kind: str, seed: int, number: int) -> tuple[int, int, str, float]:
    begin = time.process_time()
    with tempfile.TemporaryDirectory() as place:
        status, fault = {"spoilt": fault_of, "drawn": drawn_fault}[kind](seed, number, Path(place))
    return number, status, fault, time.process_time() - begin


def _results(kind: str, seed: int, numbers: Sequence[int], jobs: int) -> Iterator[tuple[int, int, str, float]]:
    """Yield the results of cases in order; a case that ends its process has status -9."""
    left = list(numbers)
    while left:
        with ProcessPoolExecutor(jobs, initializer=_limited) as pool:
            coming = [pool.submit(_case, kind, seed, number) for number in left]
            for number, answer in zip(list(left), coming, strict=True):
                try:
                    yield answer.result()
                except BrokenProcessPool:
                    if jobs > 1:
                        raise
                    yield number, -9, "its process died", 0.0
                    left.remove(number)
                    break
                left.remove(number)


def run() -> int:
    """Run the cases, print and note the counts; return 1 after a fault."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--kind", choices=("spoilt", "drawn"), default="spoilt")
    parser.add_argument("--cases", type=int, default=3000)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--jobs", type=int, default=os.cpu_count())
    parser.add_argument("--only", type=int, help="number of a single case")
    parser.add_argument("--note", action="store_true", help="write a row a hundred cases; continue after the last")
    options = parser.parse_args()
    numbers = range(options.cases) if options.only is None else range(options.only, options.only + 1)
    wrong = 0
    for start in range(numbers.start, numbers.stop, CASES_PER_ROW):
        if options.note and (options.kind, options.seed, start) in _noted():
            continue
        row = _row_of(options, range(start, min(start + CASES_PER_ROW, numbers.stop)))
        wrong += row["wrong"]
        print(row, flush=True)
        if options.note:
            _note(row)
    return 1 if wrong else 0


def _row_of(options: argparse.Namespace, numbers: range) -> dict[str, Any]:
    counts: Counter[int] = Counter()
    wrong, slowest, total = 0, (0.0, 0), 0.0
    for number, status, fault, seconds in _results(options.kind, options.seed, numbers, options.jobs):
        counts[status] += 1
        slowest, total = max(slowest, (seconds, number)), total + seconds
        if fault:
            wrong += 1
            print(f"case {number} of seed {options.seed}: {fault}", flush=True)
    row = {"kind": options.kind, "seed": options.seed, "first": numbers.start, "cases": len(numbers)}
    row |= {f"status {status}": counts[status] for status in DOCUMENTED}
    row |= {"slow, announced": counts[-2], "wrong": wrong, "slowest [s]": round(slowest[0], 1), "its case": slowest[1]}
    return row | {"processor [s]": round(total, 1)}


def _noted() -> set[tuple[str, int, int]]:
    """Blocks of cases in the file."""
    if not RESULTS.exists():
        return set()
    with RESULTS.open(newline="", encoding="utf-8") as file:
        return {(row["kind"], int(row["seed"]), int(row["first"])) for row in csv.DictReader(file)}


def _note(row: dict[str, Any]) -> None:
    head = not RESULTS.exists()
    with RESULTS.open("a", newline="", encoding="utf-8") as file:
        writer = csv.DictWriter(file, list(row))
        if head:
            writer.writeheader()
        writer.writerow(row)


if __name__ == "__main__":
    sys.exit(run())
