"""The summary of a scene's folder: its origin, and a checksum of every file and of itself."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping
from dataclasses import asdict
from pathlib import Path
from typing import Any

from kinelast import __version__
from kinelast.tasks.request import Request

SUMMARY = "summary.json"


def made_from(content: bytes, request: Request, files: Mapping[str, str]) -> dict[str, Any]:
    """Origin of a folder: the bytes of the scene's file and the options. Where they are the same, so is it.

    `files` are the texts of the files beside it that the scene names, by their names.
    """
    options = {name: list(value) if isinstance(value, tuple) else value for name, value in asdict(request).items()}
    return {"sha256": hashlib.sha256(content).hexdigest(), "options": options, **beside_digests(files)}


def beside_digests(files: Mapping[str, str]) -> dict[str, dict[str, str]]:
    """Digests of the files beside a scene by their names, as part of its origin; empty where it names none."""
    digests = {name: hashlib.sha256(text.encode()).hexdigest() for name, text in sorted(files.items())}
    return {"beside": digests} if digests else {}


def same_scene(one: Mapping[str, Any], other: Mapping[str, Any]) -> bool:
    """Whether two origins are of one scene: the same bytes, beside it too, with the same numbers changed."""
    states = [
        (origin.get("sha256"), origin.get("beside"), _dict(origin, "options").get("changes")) for origin in (one, other)
    ]
    return states[0] == states[1]


def write_json(path: Path, data: Any) -> None:
    """Indented, strict JSON."""
    path.write_bytes(json_bytes(data, indent=1) + b"\n")


def json_bytes(data: Any, indent: int = 0) -> bytes:
    """Data as strict JSON; nan is null, characters of a file's name that no text may hold are escaped by number."""
    import msgspec

    try:
        text = msgspec.json.encode(data)
    except UnicodeEncodeError:
        text = json.dumps(data, allow_nan=False).encode()
    return msgspec.json.format(text, indent=indent) if indent else text


def seal(folder: Path, summary: Mapping[str, Any], place: Path | None = None) -> dict[str, Any]:
    """Write the summary of a folder last: with the size and the digest of every file, and its own digest.

    Parameters
    ----------
    place
        Where the folder is going to stand, if files of earlier runs that are there and not among its own stay: they
        are listed as `earlier`, each with its origin and digest.

    Returns
    -------
    dict
        The summary as written, its own size among the files.
    """
    whole = {**summary, "files": sizes(folder)}
    if place is not None:
        whole["earlier"] = _earlier(place, {*whole["files"], SUMMARY})
    whole["sha256"] = {**_digests(folder), SUMMARY: _own_digest(whole)}
    write_json(folder / SUMMARY, whole)
    return {**whole, "files": sizes(folder)}


def _earlier(place: Path, made: set[str]) -> dict[str, Any]:
    """Files of this program in a place that are not made anew, each with its origin and digest."""
    known = summary_in(place) or {}
    digests, origin = _dict(known, "sha256"), _dict(known, "made_from")
    last = {name: {"made_from": origin, "sha256": digests.get(name)} for name in files_of(known)}
    before = {name: told for name, told in _dict(known, "earlier").items() if _dict(told, "made_from")}
    return {name: told for name, told in {**before, **last}.items() if name not in made and (place / name).exists()}


def changed(place: Path) -> list[str]:
    """Names of the files of this program in a place that are not as it has written them."""
    known = summary_in(place) or {}
    digests = {name: _dict(_dict(known, "earlier"), name).get("sha256") for name in _dict(known, "earlier")}
    digests |= {name: digest for name, digest in _dict(known, "sha256").items() if name != SUMMARY}
    there = {name: digest for name, digest in digests.items() if isinstance(digest, str) and (place / name).exists()}
    return sorted(name for name, digest in there.items() if _digest(place / name) != digest)


def _dict(data: Any, key: str) -> dict[str, Any]:
    """An entry that is a table; empty where somebody has put something else there."""
    entry = data.get(key) if isinstance(data, Mapping) else None
    return entry if isinstance(entry, dict) else {}


def with_files(summary: Mapping[str, Any], part: Path) -> dict[str, Any]:
    """The summary of a folder to which all files of another one are added."""
    whole = {**summary, "files": {**files_of(summary), **sizes(part)}}
    digests = {**_dict(summary, "sha256"), **_digests(part)}
    return {**whole, "sha256": {**digests, SUMMARY: _own_digest(whole)}}


def sizes(folder: Path) -> dict[str, int]:
    """Bytes of every file in a folder, and of all files in every folder in it, by name."""
    return {
        entry.name: sum(file.stat().st_size for file in entry.rglob("*")) if entry.is_dir() else entry.stat().st_size
        for entry in sorted(folder.iterdir())
    }


def _digests(folder: Path) -> dict[str, str]:
    """Digests of every file in a folder, and of every folder in it; but its summary."""
    return {entry.name: _digest(entry) for entry in sorted(folder.iterdir()) if entry.name != SUMMARY}


def _digest(path: Path) -> str:
    if path.is_dir():
        inner = {file.relative_to(path).as_posix(): _digest(file) for file in sorted(path.rglob("*")) if file.is_file()}
        return hashlib.sha256(json.dumps(inner).encode()).hexdigest()
    with path.open("rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()


def _own_digest(summary: Mapping[str, Any]) -> str:
    """Digest of a summary: of all its entries but digests."""
    said = {key: value for key, value in summary.items() if key != "sha256"}
    return hashlib.sha256(json_bytes(json.loads(json_bytes(said)))).hexdigest()


def finished(folder: Path, made: Mapping[str, Any]) -> tuple[dict[str, Any] | None, str]:
    """The summary of a folder that was made from just this by this version and is whole; None of any other.

    With it the reason why a folder that was made from just this does not do: what in it is not as it was written.
    """
    before = summary_in(folder)
    if before is None:
        return None, "its summary.json cannot be read"
    if before.get("made_from") != made or before.get("kinelast") != __version__:
        return None, ""
    if before.get("failed") or not before.get("files"):
        return None, ""
    known = before.get("sha256")
    if not isinstance(known, dict) or known.get(SUMMARY) != _own_digest(before):
        return None, "its summary.json is not as it was written"
    try:
        wrong = [name for name, digest in known.items() if name != SUMMARY and _digest(folder / name) != digest]
    except OSError as error:
        return None, f"{Path(error.filename or '').name or 'a file'} is not there"
    return (None, f"{', '.join(wrong[:3])} is not as it was written") if wrong else (before, "")


def own_names(summary: Mapping[str, Any]) -> set[str]:
    """Names that belong to this program in a folder: those of its files, of earlier runs too, and of its summary."""
    return {*files_of(summary), *_dict(summary, "earlier"), SUMMARY}


def files_of(summary: Mapping[str, Any]) -> dict[str, Any]:
    """Files listed in a summary, with their sizes; entries of another kind, put there by hand, are left out."""
    files = summary.get("files")
    names = files if isinstance(files, (dict, list)) else ()
    return {name: files.get(name) if isinstance(files, dict) else None for name in names if isinstance(name, str)}


def summary_in(folder: Path) -> dict[str, Any] | None:
    """The summary that this program has put into a folder; empty where there is none, None of an unreadable one."""
    try:
        summary = json.loads((folder / SUMMARY).read_text(encoding="utf-8"))
    except OSError:
        return {}
    except (ValueError, RecursionError):
        return None
    return summary if isinstance(summary, dict) and "kinelast" in summary else {}
