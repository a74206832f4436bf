"""Summary of a result folder (summary.json), with the origin of the results and the checksums of all files."""

import hashlib
import json
from collections.abc import Mapping
from dataclasses import asdict
from pathlib import Path
from typing import Any

from msgspec import UNSET

from kinelast import __version__
from kinelast.figures.report import Origin
from kinelast.tasks.request import Request

SUMMARY = "summary.json"


def made_from(content: bytes, request: Request, files: Mapping[str, str]) -> Origin:
    """Return the origin of a report: the checksums of the input files, and the options.

    `content` is the scene file. `files` contains the texts of the files to which the scene refers, by name.
    """
    options = {name: list(value) if isinstance(value, tuple) else value for name, value in asdict(request).items()}
    digests = beside_digests(files).get("beside", UNSET)
    return Origin(sha256=hashlib.sha256(content).hexdigest(), options=options, beside=digests)


def beside_digests(files: Mapping[str, str]) -> dict[str, dict[str, str]]:
    """Return the entry `beside` of the origin of a report: the checksums of the files to which the scene refers.

    Return an empty dictionary if the scene refers to no files.
    """
    digests = {name: hashlib.sha256(text.encode()).hexdigest() for name, text in sorted(files.items())}
    return {"beside": digests} if digests else {}


def write_json(path: Path, data: Any) -> None:
    """Write indented, strict JSON."""
    path.write_bytes(json_bytes(data, indent=1) + b"\n")


def json_bytes(data: Any, indent: int = 0) -> bytes:
    """Return data as strict JSON, with null for nan.

    Characters that are not valid in UTF-8, e.g. in file names, are escaped.
    """
    import msgspec

    try:
        text = msgspec.json.encode(data)
    except UnicodeEncodeError:
        text = json.dumps(data, allow_nan=False).encode()
    return msgspec.json.format(text, indent=indent) if indent else text


def seal(folder: Path, summary: Mapping[str, Any]) -> dict[str, Any]:
    """Write the summary of a folder, with the size and checksum of each file. Call this after writing all other files.

    Returns
    -------
    dict
        The written summary, with the size of summary.json added.
    """
    whole = {**summary, "files": sizes(folder)}
    whole["sha256"] = {**_digests(folder), SUMMARY: _own_digest(whole)}
    write_json(folder / SUMMARY, whole)
    return {**whole, "files": sizes(folder)}


def changed(place: Path) -> list[str]:
    """Return the names of files that have changed since this program wrote them."""
    known = summary_in(place) or {}
    digests = {name: digest for name, digest in _known_digests(known).items() if name != SUMMARY}
    there = {name: digest for name, digest in digests.items() if isinstance(digest, str) and (place / name).exists()}
    return sorted(name for name, digest in there.items() if _digest(place / name) != digest)


def _known_digests(summary: Mapping[str, Any]) -> dict[str, Any]:
    """Return the checksums in a summary, or an empty dictionary if the summary contains no valid ones."""
    entry = summary.get("sha256")
    return entry if isinstance(entry, dict) else {}


def with_files(summary: Mapping[str, Any], part: Path) -> dict[str, Any]:
    """Return the summary of a folder, extended by the sizes and checksums of the files in the folder `part`."""
    whole = {**summary, "files": {**files_of(summary), **sizes(part)}}
    digests = {**_known_digests(summary), **_digests(part)}
    return {**whole, "sha256": {**digests, SUMMARY: _own_digest(whole)}}


def sizes(folder: Path) -> dict[str, int]:
    """Return the size [bytes] of each file and subfolder in a folder."""
    return {
        entry.name: sum(file.stat().st_size for file in entry.rglob("*")) if entry.is_dir() else entry.stat().st_size
        for entry in sorted(folder.iterdir())
    }


def _digests(folder: Path) -> dict[str, str]:
    """Return the checksum of each file and subfolder in a folder, except for the summary."""
    return {entry.name: _digest(entry) for entry in sorted(folder.iterdir()) if entry.name != SUMMARY}


def _digest(path: Path) -> str:
    if path.is_dir():
        inner = {file.relative_to(path).as_posix(): _digest(file) for file in sorted(path.rglob("*")) if file.is_file()}
        return hashlib.sha256(json.dumps(inner).encode()).hexdigest()
    with path.open("rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()


def _own_digest(summary: Mapping[str, Any]) -> str:
    """Return the checksum of a summary, computed without the entry that contains the checksums."""
    said = {key: value for key, value in summary.items() if key != "sha256"}
    return hashlib.sha256(json_bytes(said)).hexdigest()


def finished(folder: Path, made: Mapping[str, Any]) -> tuple[dict[str, Any] | None, str]:
    """Return the summary of a folder if a finished run had the origin `made` and the current version, otherwise None.

    The second value says which file of the folder has changed, is missing or is unreadable; otherwise it is empty.
    """
    before = summary_in(folder)
    if before is None:
        return None, "its summary.json is unreadable"
    if before.get("made_from") != made or before.get("kinelast") != __version__:
        return None, ""
    if before.get("failed") or not before.get("files"):
        return None, ""
    known = before.get("sha256")
    if not isinstance(known, dict) or known.get(SUMMARY) != _own_digest(before):
        return None, "its summary.json changed"
    try:
        wrong = [name for name, digest in known.items() if name != SUMMARY and _digest(folder / name) != digest]
    except OSError as error:
        return None, f"{Path(error.filename or '').name or 'a file'} is missing"
    return (None, f"{', '.join(wrong[:3])} changed") if wrong else (before, "")


def own_names(summary: Mapping[str, Any]) -> set[str]:
    """Return the names of the files that this program wrote to a folder, including the summary."""
    return {*files_of(summary), SUMMARY}


def files_of(summary: Mapping[str, Any]) -> dict[str, Any]:
    """Return the sizes of the files that a summary lists, by file name. Invalid entries are ignored."""
    files = summary.get("files")
    names = files if isinstance(files, (dict, list)) else ()
    return {name: files.get(name) if isinstance(files, dict) else None for name in names if isinstance(name, str)}


def summary_in(folder: Path) -> dict[str, Any] | None:
    """Return the summary in a folder.

    Return an empty dictionary if the folder has no summary by this program, and None if summary.json is not valid JSON.
    """
    try:
        summary = json.loads((folder / SUMMARY).read_text(encoding="utf-8"))
    except OSError:
        return {}
    except (ValueError, RecursionError):
        return None
    return summary if isinstance(summary, dict) and "kinelast" in summary else {}
