"""Check the pages' JavaScript: format and types, by Deno (`pip install deno`).

`python tests/check_scripts.py` fails on a script that is not formatted, on an unknown name and on a value of a wrong
type. `--write` formats the scripts instead. The scripts of a page share one scope: they are checked as one file.
"""

import json
import os
import re
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

from kinelast.outputs import page
from live.server import SHARED

ROOT = Path(__file__).parents[1]
EDITOR = ROOT / "live" / "web"
PAGES = {"report": page.SCRIPTS, "designs": page.DESIGN_SCRIPTS, "index": page.INDEX_SCRIPTS}
OPTIONS = {"compilerOptions": {"lib": ["dom", "dom.iterable", "esnext"], "checkJs": True, "strict": False}}
GLOBALS = """\
interface Window { kinelast: any; live: any; kernel: any }
declare class uPlot { [key: string]: any; constructor(...given: any[]); static [key: string]: any; }
"""
FORMAT = ("fmt", "--line-width", "120", "--quiet")


def scripts() -> list[str]:
    """Return the paths of all scripts of the project."""
    return [
        str(path) for folder in (page.WEB, EDITOR) for path in sorted(folder.glob("*.js")) if "uPlot" not in path.name
    ]


def type_faults(folder: Path) -> list[str]:
    """Return the type checker's complaints, each with the script and line it is about."""
    (folder / "deno.json").write_text(json.dumps(OPTIONS))
    (folder / "globals.d.ts").write_text(GLOBALS)
    origin: dict[str, list[str]] = {}
    for name, parts in PAGES.items():
        lines = ['/// <reference path="./globals.d.ts" />']
        places = ["globals"]
        for part in parts:
            own = page.script(part).splitlines()
            lines += own
            places += [f"{part}.js:{number}" for number, _ in enumerate(own, 1)]
        (folder / f"{name}.js").write_text("\n".join(lines), encoding="utf-8")
        origin[f"{name}.js"] = places
    shutil.copytree(EDITOR, folder / "live")
    for name in SHARED:
        shutil.copy(page.WEB / name, folder / "live")
    files = [*origin, "live/main.js", "live/widget.js"]
    done = deno("check", "--quiet", *files, cwd=folder)
    if not done.returncode:
        return []
    faults = []
    for block in done.stderr.split("\n\n"):
        place = re.search(rf"at file://{re.escape(str(folder))}/(\S+?):(\d+):(\d+)", block)
        if place is None:
            continue
        name, line = place[1], int(place[2])
        where = origin[name][line - 1] if name in origin else f"{name}:{line}"
        faults.append(f"{where}: {block.splitlines()[0]}")
    return sorted(set(faults)) or [done.stderr]


def deno(*words: str, cwd: Path = ROOT) -> subprocess.CompletedProcess[str]:
    """Run Deno, that of the virtual environment first, and return what it says."""
    path = f"{Path(sys.executable).parent}{os.pathsep}{os.environ['PATH']}"
    command = shutil.which("deno", path=path)
    if command is None:
        sys.exit("deno is missing: pip install deno")
    environment = {**os.environ, "NO_COLOR": "1"}
    return subprocess.run([command, *words], check=False, cwd=cwd, env=environment, capture_output=True, text=True)


def main() -> int:
    """Check or format all scripts; return the exit status."""
    if "--write" in sys.argv:
        return deno(*FORMAT, *scripts()).returncode
    formatted = deno(*FORMAT, "--check", *scripts())
    with tempfile.TemporaryDirectory() as folder:
        faults = type_faults(Path(folder).resolve())
    print(formatted.stderr, *faults, sep="\n")
    return formatted.returncode or bool(faults)


if __name__ == "__main__":
    sys.exit(main())
