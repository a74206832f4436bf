"""Pages of the gallery: each shipped scene and each docs/gallery/*.toml, with its report and file.

The report moves in the browser; a film would take ten more seconds per scene.
"""

import re
import tomllib
from collections.abc import Iterator
from pathlib import Path

from made import Made
from runs import run

from kinelast import shipped_scenes, shipped_structures

ROOT = Path(__file__).parents[2]
SCENES, REPORT = "<!-- scenes -->", re.compile(r"^<!-- report: (\w+) -->$", re.MULTILINE)
FILES = ("report.html", "positions.csv", "summary.json")
SCHEMA = re.compile(r"^#:schema .*\n+")


def pages() -> Iterator[Made]:
    """Return all pages of the folder gallery/ and their files."""
    machines = {path.stem: path for path in sorted((ROOT / "docs" / "gallery").glob("*.toml"))}
    if machines:
        yield from _reported(machines, run([str(path) for path in machines.values()], "--jobs", "0"), "the gallery")
    shipped = shipped_scenes()
    yield from _reported(shipped, run([*shipped], "--jobs", "0"), "the program")
    structures = shipped_structures()
    yield from _structures(structures, run([*structures], "--structure"))


def _reported(scenes: dict[str, Path], out: Path, home: str) -> Iterator[Made]:
    for name, path in scenes.items():
        for file in FILES:
            yield Made(f"gallery/{name}/{file}", source=out / name / file)
        text = path.read_text(encoding="utf-8")
        if home == "the program":
            yield Made(f"gallery/{name}.toml", source=path)
            call = f"deflection-report {name} -o results"
        else:
            call = f"deflection-report docs/gallery/{name}.toml -o results"
        yield Made(
            f"gallery/{name}.md",
            f"# {_title(path)}\n\n{frame(name, '')}\n\n"
            f"Files: [report]({name}/report.html), [results per position]({name}/positions.csv), "
            f"[figures]({name}/summary.json), [scene]({name}.toml). The scene comes with {home}:\n\n"
            f"<!-- runs: as the site is built -->\n```\n{call}\n```\n\n```toml\n{SCHEMA.sub('', text)}```\n",
        )


def _structures(scenes: dict[str, Path], out: Path) -> Iterator[Made]:
    """Return the page of structure-only mechanisms."""
    parts = ["# Structures\n\nStructural analysis of mechanisms: `deflection-report NAME --structure`.\n"]
    for name, path in scenes.items():
        drawn = (out / name / "skeleton.svg").is_file()  # not for a spatial chain
        if drawn:
            yield Made(f"gallery/{name}/skeleton.svg", source=out / name / "skeleton.svg")
        text = (out / name / "structure.txt").read_text(encoding="utf-8")
        picture = f"![Skeleton of {name}]({name}/skeleton.svg)\n\n" if drawn else ""
        parts.append(f"## {_title(path)}\n\n{picture}```\n{text}```\n")
    yield Made("gallery/structures.md", "\n".join(parts))


def _title(path: Path) -> str:
    return str(tomllib.loads(path.read_text(encoding="utf-8")).get("title") or path.stem.replace("_", " "))


def frame(name: str, up: str) -> str:
    """Return the frame with the report of a scene."""
    title = f"Report of {name}, which moves"
    return f'<iframe class="report" src="{up}{name}/report.html" title="{title}" loading="lazy"></iframe>'


def with_scenes(markdown: str, page: str) -> str:
    """Fill the list of scenes and the embedded reports of a page."""
    up = "../" * page.count("/") + "gallery/"
    markdown = REPORT.sub(lambda mark: frame(mark[1], up), markdown)
    return markdown.replace(SCENES, _cards())


def _cards() -> str:
    machines = {path.stem: path for path in sorted((ROOT / "docs" / "gallery").glob("*.toml"))}
    lists = {"Machines": machines, "Scenes of the program": shipped_scenes()}
    parts = [
        f"**{heading}**\n\n" + "".join(f"- [{_title(path)}](gallery/{name}.md)\n" for name, path in scenes.items())
        for heading, scenes in lists.items()
        if scenes
    ]
    return "\n".join([*parts, "**Structures**\n\n- [Skeletons, loops and groups](gallery/structures.md)\n"])
