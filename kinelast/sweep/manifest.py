"""The manifest of a sweep's folder: its sweep, its division into chunks, and the chunks that failed."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Collection, Mapping, Sequence
from contextlib import suppress
from dataclasses import asdict, dataclass, field
from functools import cache
from importlib import metadata
from pathlib import Path
from typing import Any

from kinelast import __version__
from kinelast.outputs.sealed import json_bytes
from kinelast.scene.error import plain
from kinelast.tasks.request import RequestError

NAME = "manifest.json"
SHOWN = 60  # letters of a value in a message


@dataclass(frozen=True)
class Kept:
    """Fingerprint of a chunk's content: how many designs and bytes it has, and their SHA-256."""

    rows: int
    size: int
    sha256: str

    @classmethod
    def of(cls, rows: int, content: bytes) -> Kept:
        """The fingerprint of a chunk's content."""
        return cls(rows, len(content), hashlib.sha256(content).hexdigest())

    def fits(self, content: bytes) -> bool:
        """Whether a content is the one that was kept."""
        return len(content) == self.size and hashlib.sha256(content).hexdigest() == self.sha256


@dataclass(frozen=True)
class Manifest:
    """A sweep and how far it is.

    A chunk is done where its content is what it is known by, see `store`; failed where it is named here; in flight
    or to come elsewhere.

    Attributes
    ----------
    identity
        All that the figures depend on: what the caller says, and the versions of what computes them.
    designs, chunk
        How many designs there are, and how many of them are a chunk, save the last one.
    store
        Name of the file or the folder with the designs.
    columns
        Names of the columns and their units, in the order of the store; empty until a chunk is done.
    failed
        Why chunks failed, by their number.
    kept
        What the chunks of a complete store are known by, in their order.
    complete
        Whether every design is in the store.
    """

    identity: Mapping[str, Any]
    designs: int
    chunk: int
    store: str
    columns: Mapping[str, str] = field(default_factory=dict)
    failed: Mapping[int, str] = field(default_factory=dict)
    kept: Sequence[Kept] = ()
    complete: bool = False

    @property
    def chunks(self) -> int:
        """How many chunks there are."""
        return -(-self.designs // self.chunk)

    def span(self, number: int) -> tuple[int, int]:
        """The first design of a chunk, and the one after its last."""
        return number * self.chunk, min((number + 1) * self.chunk, self.designs)

    def count(self, numbers: Collection[int]) -> int:
        """How many designs some chunks hold."""
        last = self.chunks - 1
        return len(numbers) * self.chunk - (self.chunks * self.chunk - self.designs if last in numbers else 0)


@cache
def versions() -> dict[str, str]:
    """Versions that have a say in the last digits of a figure and in the bytes of a file."""
    found = {"kinelast": __version__, "numpy": metadata.version("numpy"), "scipy": metadata.version("scipy")}
    with suppress(metadata.PackageNotFoundError):
        found["pyarrow"] = metadata.version("pyarrow")
    return found


def manifest_bytes(manifest: Manifest) -> bytes:
    """A manifest as JSON, the same for the same content."""
    data = asdict(manifest)
    data["identity"] = dict(manifest.identity)
    data["failed"] = {str(number): why for number, why in sorted(manifest.failed.items())}
    return json_bytes({**data, "sha256": _digest(data)}, indent=1) + b"\n"


def _digest(data: Mapping[str, Any]) -> str:
    """Digest of a manifest."""
    return hashlib.sha256(json.dumps(json.loads(json_bytes(data)), sort_keys=True).encode()).hexdigest()


def read_manifest(folder: Path) -> Manifest | None:
    """The manifest in a folder; None where there is none.

    Raises
    ------
    RequestError
        It cannot be read.
    """
    path = folder / NAME
    if not path.exists():
        return None
    try:
        data = json.loads(path.read_bytes())
        if data.pop("sha256") != _digest(data):
            raise ValueError("it is not as it was written")
        data["failed"] = {int(number): str(why) for number, why in data["failed"].items()}
        data["kept"] = [Kept(**each) for each in data["kept"]]
        return Manifest(**data)
    except (OSError, ValueError, TypeError, KeyError, AttributeError) as error:
        told = plain(str(error), 200)
        raise RequestError(f"{path} is no manifest of a sweep ({told}): choose another -o, or remove it") from None


def require_same(kept: Manifest, asked: Manifest, folder: Path) -> None:
    """Raise where a folder holds another sweep than the one that is to go on in it, told by the differences."""
    there, here = _flat(kept), _flat(asked)
    names = sorted(name for name in there.keys() | here.keys() if there.get(name) != here.get(name))
    if names:
        shown = "; ".join(
            f"{name}: {_shown(there.get(name))} there, {_shown(here.get(name))} here" for name in names[:4]
        )
        more = f" and {len(names) - 4} more" if len(names) > 4 else ""
        raise RequestError(
            f"{folder} holds another sweep ({shown}{more}), and two are not mixed: choose another -o, or remove it"
        )


def _flat(manifest: Manifest) -> dict[str, Any]:
    """The entries that must be the same, by names to tell differences by."""
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
    return "none" if value is None else plain(str(value), SHOWN)
