"""Generated page or file of the site."""

from dataclasses import dataclass
from pathlib import Path
from typing import Any


@dataclass(frozen=True)
class Made:
    """Path in the site, and either a text or a file to copy."""

    path: str
    text: str = ""
    source: Path | None = None

    @property
    def content(self) -> dict[str, Any]:
        """Arguments of `File.generated`."""
        return {"abs_src_path": str(self.source)} if self.source else {"content": self.text}
