"""Manifest in the folder of a sweep: a file with the inputs of the sweep, and the state of the chunks."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Collection, Mapping, Sequence
from contextlib import suppress
from functools import cache
from importlib import metadata
from pathlib import Path
from typing import Any

from msgspec import Struct, field
from msgspec.structs import asdict

from kinelast import __version__
from kinelast.outputs.sealed import json_bytes
from kinelast.tasks.request import RequestError
from kinelast.values.error import plain

NAME = "manifest.json"
MAX_VALUE_CHARACTERS = 60  # a message shows at most this number of characters of each value


class ChunkChecksum(Struct, frozen=True):
    """Number of designs (`rows`), number of bytes (`size`), and SHA-256 of a chunk."""

    rows: int
    size: int
    sha256: str

    @classmethod
    def of(cls, rows: int, content: bytes) -> ChunkChecksum:
        """Return the checksum of a chunk with the given content and `rows` designs."""
        return cls(rows, len(content), hashlib.sha256(content).hexdigest())

    def fits(self, content: bytes) -> bool:
        """Return True if the content matches the checksum."""
        return len(content) == self.size and hashlib.sha256(content).hexdigest() == self.sha256


class Manifest(Struct, frozen=True):
    """State of a sweep.

    A chunk is complete if the content of the chunk's file matches the stored checksum.

    Attributes
    ----------
    identity
        Inputs on which the results depend, including the versions of the software.
    designs, chunk
        Number of designs, and number of designs per chunk (the last chunk may be smaller).
    store
        Name of the file or folder that contains the designs.
    columns
        Dictionary that maps each column name to a unit, in the order of the columns; empty until a chunk is complete.
    failed
        Dictionary that maps the index of each failed chunk to the reason for the failure.
    kept
        Checksums of all chunks if the sweep is complete, otherwise empty.
    complete
        True if all designs are stored.
    """

    identity: Mapping[str, Any]
    designs: int
    chunk: int
    store: str
    columns: Mapping[str, str] = field(default_factory=dict)
    failed: Mapping[int, str] = field(default_factory=dict)
    kept: Sequence[ChunkChecksum] = ()
    complete: bool = False

    @property
    def chunks(self) -> int:
        """Number of chunks."""
        return -(-self.designs // self.chunk)

    def span(self, number: int) -> tuple[int, int]:
        """Return (index of the first design of a chunk, index of the last design + 1)."""
        return number * self.chunk, min((number + 1) * self.chunk, self.designs)

    def count(self, numbers: Collection[int]) -> int:
        """Return the number of designs in the chunks with the indices `numbers`."""
        last = self.chunks - 1
        return len(numbers) * self.chunk - (self.chunks * self.chunk - self.designs if last in numbers else 0)


@cache
def versions() -> dict[str, str]:
    """Return the versions of the software that affects the last digits of results or the bytes of files."""
    found = {"kinelast": __version__, "numpy": metadata.version("numpy"), "scipy": metadata.version("scipy")}
    with suppress(metadata.PackageNotFoundError):
        found["pyarrow"] = metadata.version("pyarrow")
    return found


def manifest_bytes(manifest: Manifest) -> bytes:
    """Return a manifest as JSON. Equal manifests give equal bytes."""
    data = asdict(manifest)
    data["identity"] = dict(manifest.identity)
    data["failed"] = {str(number): why for number, why in sorted(manifest.failed.items())}
    return json_bytes({**data, "sha256": _digest(data)}, indent=1) + b"\n"


def _digest(data: Mapping[str, Any]) -> str:
    """Return the checksum of the entries of a manifest."""
    return hashlib.sha256(json.dumps(json.loads(json_bytes(data)), sort_keys=True).encode()).hexdigest()


def read_manifest(folder: Path) -> Manifest | None:
    """Read the manifest of a folder; return None if there is no manifest.

    Raises
    ------
    RequestError
        The manifest cannot be read, or has changed since it was written.
    """
    path = folder / NAME
    if not path.exists():
        return None
    try:
        data = json.loads(path.read_bytes())
        if data.pop("sha256") != _digest(data):
            raise ValueError("it has changed since it was written")
        data["failed"] = {int(number): str(why) for number, why in data["failed"].items()}
        data["kept"] = [ChunkChecksum(**each) for each in data["kept"]]
        return Manifest(**data)
    except (OSError, ValueError, TypeError, KeyError, AttributeError) as error:
        message = plain(str(error), 200)
        raise RequestError(
            f"{path} is not the manifest of a sweep ({message}): choose another -o, or remove it"
        ) from None


def require_same(kept: Manifest, requested: Manifest, folder: Path) -> None:
    """Raise RequestError if a stored sweep has other inputs than the requested sweep.

    The message lists the differences.
    """
    there, here = _flat(kept), _flat(requested)
    names = sorted(name for name in there.keys() | here.keys() if there.get(name) != here.get(name))
    if names:
        shown = "; ".join(
            f"{name}: {_shown(there.get(name))} there, {_shown(here.get(name))} here" for name in names[:4]
        )
        more = f" and {len(names) - 4} more" if len(names) > 4 else ""
        raise RequestError(f"{folder} contains another sweep ({shown}{more}): choose another -o, or remove it")


def _flat(manifest: Manifest) -> dict[str, Any]:
    """Return the entries of a manifest that must not change if a sweep is resumed.

    The result maps names to entries. The name of a nested entry contains dots, e.g. "versions.numpy".
    """
    flat: dict[str, Any] = {"designs": manifest.designs, "chunk": manifest.chunk, "store": manifest.store}
    waiting: list[tuple[str, Any]] = list(json.loads(json_bytes(dict(manifest.identity))).items())
    while waiting:
        name, value = waiting.pop()
        if isinstance(value, dict):
            waiting += [(f"{name}.{key}", each) for key, each in value.items()]
        else:
            flat[name] = value
    return flat


def _shown(value: Any) -> str:
    return "none" if value is None else plain(str(value), MAX_VALUE_CHARACTERS)
