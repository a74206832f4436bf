"""What is asked of a scene besides what it says itself."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from kinelast.scene.data import Scene, Theory


@dataclass(frozen=True)
class Request:
    """What is asked of a scene; the fields are the options of the command."""

    fields: bool = False
    stations: int = 101
    check: int | None = None
    nonlinear: bool = False
    solid: bool = False
    theory: str | None = None
    accuracy: float | None = None
    speeds: tuple[float, float, int] | None = None
    animate: tuple[str, ...] = ()
    frames: int | None = None
    picture: str = "mp4"
    fps: float | None = None
    size: tuple[int, int] | None = None
    style: str = "plain"
    exaggeration: float | None = None
    background: str | None = None
    show: tuple[str, ...] | None = None
    mesh: bool = False
    stills: bool = False
    positions: int | None = None
    refine: bool = False
    reachable: bool = False
    sensitivities: bool = False
    tolerances: bool = False
    samples: int | None = None
    optimize: bool = False
    units: str | None = None
    changes: tuple[str, ...] = ()

    def theory_of(self, scene: Scene) -> Theory:
        """The theory of motion that is asked for: by the command, or else by the scene."""
        if self.theory is None and self.accuracy is None:
            return scene.theory
        return replace(scene.theory, name=self.theory, accuracy=self.accuracy)


class RequestError(ValueError):
    """Something is asked for that cannot be given."""
