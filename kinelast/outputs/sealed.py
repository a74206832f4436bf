"""Summary of a result folder: the file summary.json.

The summary contains the results of a scene, the origin of the results (checksums of the input files, and options), and
the checksums of all files in the folder. With `--resume`, a scene is not computed again if its origin and all checksums
are unchanged.
"""

import hashlib
import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import msgspec
from msgspec.structs import asdict

from kinelast import __version__
from kinelast.reports.report import Origin
from kinelast.tasks.request import Request

SUMMARY = "summary.json"


def made_from(content: bytes, request: Request, files: Mapping[str, str]) -> Origin:
    """Return the origin of a report: the checksums of the input files, and the options.

    `content` is the content of the scene file. `files` contains the texts of all files that the scene file refers to,
    by file name.
    """
    options = {name: list(value) if isinstance(value, tuple) else value for name, value in asdict(request).items()}
    digests = beside_digests(files).get("beside", msgspec.UNSET)
    return Origin(sha256=hashlib.sha256(content).hexdigest(), options=options, beside=digests)


def beside_digests(files: Mapping[str, str]) -> dict[str, dict[str, str]]:
    """Return a dictionary with the entry `beside`: the checksum of each file that a scene file refers to.

    Return an empty dictionary if the scene file refers to no other files.
    """
    digests = {name: hashlib.sha256(text.encode()).hexdigest() for name, text in sorted(files.items())}
    return {"beside": digests} if digests else {}


def write_json(path: Path, data: Any) -> None:
    """Write data to a file as strict JSON with indentation."""
    path.write_bytes(json_bytes(data, indent=1) + b"\n")


def json_bytes(data: Any, indent: int = 0) -> bytes:
    """Return data as strict JSON in UTF-8. Numbers that are nan or infinite become null.

    If a text (e.g. a file name) contains characters that UTF-8 cannot encode, all non-ASCII characters are escaped.
    """
    try:
        text = msgspec.json.encode(data)
    except UnicodeEncodeError:
        finite = json.loads(json.dumps(data), parse_constant=lambda _: None)
        text = json.dumps(finite).encode()
    return msgspec.json.format(text, indent=indent) if indent else text


def seal(folder: Path, summary: Mapping[str, Any]) -> dict[str, Any]:
    """Write summary.json to a folder that already contains all other files. Add the size and checksum of each file.

    Returns
    -------
    dict
        The summary as written, but including the size of summary.json itself.
    """
    whole = {**summary, "files": sizes(folder)}
    whole["sha256"] = {**_digests(folder), SUMMARY: _own_digest(whole)}
    write_json(folder / SUMMARY, whole)
    return {**whole, "files": sizes(folder)}


def changed(place: Path) -> list[str]:
    """Return the names of the files in a folder that have changed since this program wrote them."""
    known = summary_in(place) or {}
    digests = {name: digest for name, digest in _known_digests(known).items() if name != SUMMARY}
    there = {name: digest for name, digest in digests.items() if isinstance(digest, str) and (place / name).exists()}
    return sorted(name for name, digest in there.items() if _digest(place / name) != digest)


def _known_digests(summary: Mapping[str, Any]) -> dict[str, Any]:
    """Return the checksums in a summary by file name, or an empty dictionary if the summary has no valid checksums."""
    entry = summary.get("sha256")
    return entry if isinstance(entry, dict) else {}


def with_files(summary: Mapping[str, Any], part: Path) -> dict[str, Any]:
    """Return a copy of a summary, with the sizes and checksums of the files in the folder `part` added."""
    whole = {**summary, "files": {**files_of(summary), **sizes(part)}}
    digests = {**_known_digests(summary), **_digests(part)}
    return {**whole, "sha256": {**digests, SUMMARY: _own_digest(whole)}}


def sizes(folder: Path) -> dict[str, int]:
    """Return the size [bytes] of each file and subfolder in a folder, by name."""
    return {
        entry.name: sum(file.stat().st_size for file in entry.rglob("*")) if entry.is_dir() else entry.stat().st_size
        for entry in sorted(folder.iterdir())
    }


def _digests(folder: Path) -> dict[str, str]:
    """Return the checksum of each file and subfolder in a folder, by name. The summary is left out."""
    return {entry.name: _digest(entry) for entry in sorted(folder.iterdir()) if entry.name != SUMMARY}


def _digest(path: Path) -> str:
    if path.is_dir():
        inner = {file.relative_to(path).as_posix(): _digest(file) for file in sorted(path.rglob("*")) if file.is_file()}
        return hashlib.sha256(json.dumps(inner).encode()).hexdigest()
    with path.open("rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()


def _own_digest(summary: Mapping[str, Any]) -> str:
    """Return the checksum of the summary itself. The entry `sha256`, which contains checksums, is left out."""
    said = {key: value for key, value in summary.items() if key != "sha256"}
    return hashlib.sha256(json_bytes(said)).hexdigest()


def finished(folder: Path, made: Mapping[str, Any]) -> tuple[dict[str, Any] | None, str]:
    """Return the summary of a folder if the results in the folder are still valid, otherwise None.

    The results are valid if the run was finished, the origin of the results equals `made`, the version of kinelast is
    the current version, and all files are unchanged. The second value is a text. It says which file has changed, is
    missing or is unreadable, and is empty if the files are not the reason.
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
    """Return the names of the files that this program wrote to a folder: the listed files, and summary.json."""
    return {*files_of(summary), SUMMARY}


def files_of(summary: Mapping[str, Any]) -> dict[str, Any]:
    """Return the size of each file that a summary lists, by file name. Ignore names that are no strings."""
    files = summary.get("files")
    names = files if isinstance(files, (dict, list)) else ()
    return {name: files.get(name) if isinstance(files, dict) else None for name in names if isinstance(name, str)}


def summary_in(folder: Path) -> dict[str, Any] | None:
    """Return the summary of a folder.

    If the folder has no summary.json, or another program wrote summary.json, return an empty dictionary. If
    summary.json is not valid JSON, return None.
    """
    try:
        summary = json.loads((folder / SUMMARY).read_text(encoding="utf-8"))
    except OSError:
        return {}
    except (ValueError, RecursionError):
        return None
    return summary if isinstance(summary, dict) and "kinelast" in summary else {}
