"""Reading and writing of files of other programs.

The content of a file shows which program wrote the file. Only DXF drawings are recognised by the file extension.
"""

import json
import re
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from exchange.foreign_mechanism import ExchangeError, ForeignMechanism, with_closed_frames
from exchange.linkage2 import of_linkage2
from exchange.linkage2_written import linkage2_text
from exchange.linkage_sim import of_linkage_sim
from exchange.mec2 import of_mec2
from exchange.pmks import of_pmks
from exchange.pmks_written import pmks_text
from exchange.pylinkage import of_pylinkage

FORMATS = "PMKS+ (.pmks or a link), Linkage (.linkage2), pylinkage, mec2 and linkage_sim (.json), DXF (.dxf)"
"""Programs and files that can be read, for messages."""
WRITTEN = "PMKS+ (.pmks) and Linkage (.linkage2)"
"""Programs and files that can be written, for messages."""
WRITERS: Mapping[str, Callable[[ForeignMechanism], str]] = {".pmks": pmks_text, ".linkage2": linkage2_text}
MAX_SIZE = 20_000_000  # [bytes] largest size of a text file that is read


def written(drawing: ForeignMechanism, kind: str) -> str:
    """Return a mechanism as text of a file for another program. The file extension `kind` selects the program.

    Raises
    ------
    ExchangeError
        If no supported program uses this extension, if the mechanism has no drive, or if the program does not support
        a part that affects the motion.
    """
    if kind.lower() not in WRITERS:
        raise ExchangeError(f'files that end in "{kind}" cannot be written: choose from {WRITTEN}')
    return WRITERS[kind.lower()](drawing)


def read(source: str) -> ForeignMechanism:
    """Return the mechanism in a file of another program, or in a web link of PMKS+.

    Raises
    ------
    ExchangeError
        If the file cannot be opened, is damaged, or has an unknown format.
    """
    if re.match(r"https?://", source):
        return of_text(source, "mechanism")
    path = Path(source)
    title = path.stem or "mechanism"
    if path.suffix.lower() == ".dxf":
        from exchange.dxf import of_dxf

        return of_dxf(path, title)
    return of_text(_text(path), title)


def _text(path: Path) -> str:
    try:
        if path.stat().st_size > MAX_SIZE:
            raise ExchangeError(f"{path}: larger than {MAX_SIZE // 1_000_000} MB")
        return path.read_text(encoding="utf-8-sig")
    except OSError as error:
        raise ExchangeError(f"{path}: {error.strerror or error}") from None
    except UnicodeDecodeError:
        raise ExchangeError(f"{path}: not a text in UTF-8") from None


def of_text(text: str, title: str) -> ForeignMechanism:
    """Return the mechanism in the text of a file or in a web link of PMKS+."""
    return with_closed_frames(_as_drawn(text, title))


def _as_drawn(text: str, title: str) -> ForeignMechanism:
    if "<linkage2" in text:
        with _damage_of("Linkage"):
            return of_linkage2(text[text.index("<linkage2") :], title)
    inner = re.search(r"<mec-2[^>]*>(.*?)</mec-2>", text, re.DOTALL)
    if inner or text.lstrip().startswith("{"):
        return _of_json(inner[1] if inner else text, title)
    return of_pmks(text, title)


def _of_json(text: str, title: str) -> ForeignMechanism:
    try:
        data: Any = json.loads(text)
    except (ValueError, RecursionError) as error:
        raise ExchangeError(f"the JSON of this file is damaged: {error}") from None
    if isinstance(data, dict):
        for keys, program, reader in (
            ({"nodes", "constraints"}, "mec2", of_mec2),
            ({"bodies", "joints"}, "linkage_sim", of_linkage_sim),
            ({"joints", "links"}, "pylinkage", of_pylinkage),
        ):
            if keys <= data.keys():
                with _damage_of(program):
                    return reader(data, title)
    raise ExchangeError(f"this JSON file comes from an unknown program; kinelast reads {FORMATS}")


@contextmanager
def _damage_of(program: str) -> Iterator[None]:
    """Convert exceptions due to a damaged file to an ExchangeError with the reason."""
    try:
        yield
    except ExchangeError:
        raise
    except KeyError as error:
        raise ExchangeError(f"a part of this file of {program} refers to {error}, which is not in the file") from None
    except (TypeError, AttributeError, IndexError, StopIteration):
        raise ExchangeError(f"a part of this file of {program} has an unknown form") from None
    except ValueError as error:
        raise ExchangeError(f"a number in this file of {program} cannot be read: {error}") from None
