"""Runs of the command for the site, kept in build/ as long as program and scene stay the same."""

from __future__ import annotations

import hashlib
import shutil
from collections.abc import Sequence
from functools import cache
from pathlib import Path

from kinelast.cli.command import main

ROOT = Path(__file__).parents[2]
KEPT = ROOT / "build" / "runs"
PACKAGES = ("rigid", "elastic", "machine", "fem_check", "animations", "exchange", "kinelast")


_used: set[Path] = set()


def drop_others() -> None:
    """Drop the runs of other states of the program."""
    for out in set(KEPT.iterdir()) - _used:
        shutil.rmtree(out)


@cache
def state() -> bytes:
    """Digest of the program."""
    digest = hashlib.sha256()
    for package in PACKAGES:
        for path in sorted((ROOT / package).rglob("*")):
            if path.is_file() and path.suffix in {".py", ".toml", ".js", ".css", ".html", ".json"}:
                digest.update(path.read_bytes())
    return digest.digest()


def run(scenes: Sequence[str], *options: str) -> Path:
    """Folder of the results of the command.

    Raises
    ------
    RuntimeError
        It ended with another status than 0, or than 1: a limit that is not kept is an answer too.
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
