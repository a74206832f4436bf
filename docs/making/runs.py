"""Runs of the command for the site, cached in build/ until the program or the scene changes."""

import hashlib
import shutil
from collections.abc import Sequence
from functools import cache
from pathlib import Path

from kinelast.cli.command import main

ROOT = Path(__file__).parents[2]
KEPT = ROOT / "build" / "runs"
PACKAGES = ("rigid", "elastic", "symbols", "machine", "fem_check", "animations", "exchange", "kinelast")


_used: set[Path] = set()


def drop_others() -> None:
    """Delete the runs of other program versions."""
    for out in set(KEPT.iterdir()) - _used:
        shutil.rmtree(out)


@cache
def state() -> bytes:
    """Return a digest of the program's files."""
    digest = hashlib.sha256()
    for package in PACKAGES:
        for path in sorted((ROOT / package).rglob("*")):
            if path.is_file() and path.suffix in {".py", ".toml", ".js", ".css", ".html", ".json"}:
                digest.update(path.read_bytes())
    return digest.digest()


def run(scenes: Sequence[str], *options: str) -> Path:
    """Run the command; return the folder of results.

    Raises
    ------
    RuntimeError
        Exit status other than 0 and 1; a violated limit has status 1.
    """
    digest = hashlib.sha256(state() + repr(options).encode())
    for scene in scenes:
        digest.update(Path(scene).read_bytes() if scene.endswith(".toml") else scene.encode())
    out = KEPT / digest.hexdigest()[:16]
    _used.add(out)
    if not (out / "done").is_file():
        shutil.rmtree(out, ignore_errors=True)
        status = main([*scenes, *options, "--quiet", "-o", str(out)])
        if status not in (0, 1):
            raise RuntimeError(f"deflection-report {' '.join([*scenes, *options])} ended with status {status}")
        (out / "done").touch()
    return out
