"""A film takes as long as rendering and encoding its frames: what finding and moving the geometry adds."""

from __future__ import annotations

import tempfile
from pathlib import Path
from typing import Any

import measuring
import numpy as np
from jobs import steel_four_bar

from animations import Picture, RenderingUnavailable, Style, movie, off_screen
from elastic import deflection

FRAMES = 24


def main() -> None:
    import imageio.v2 as imageio

    job = steel_four_bar(360)
    solved = deflection(job.motion(), job.sections)
    rows: list[dict[str, Any]] = []
    positions = [360 * k // FRAMES for k in range(FRAMES)]
    with tempfile.TemporaryDirectory() as folder:
        try:
            for diagram in ("deflection", "bending-moment"):
                rows += of_diagram(solved, diagram, positions, Path(folder), imageio)
        except RenderingUnavailable as missing:
            print(missing)
            return
    measuring.report("animation", f"Animation: {FRAMES} frames of the steel four-bar at 1280 x 720", {"frames": rows})
    with measuring.figure("animation", size=(7, 3)) as axis:
        axis.barh([f"{row['diagram']}: {row['what']}" for row in rows][::-1], [row["ms a frame"] for row in rows][::-1])
        axis.set(xlabel="milliseconds a frame")


def of_diagram(solved: Any, diagram: str, positions: list[int], folder: Path, imageio: Any) -> list[dict[str, Any]]:
    style = Style()
    with off_screen(), Picture(solved, diagram, style) as picture:
        images = [np.array(picture.show(position)) for position in positions]

        def moved() -> None:
            for position in positions:
                for shape, mesh in zip(picture.shapes, picture.meshes, strict=True):
                    mesh.points[:, :2] = (
                        np.ascontiguousarray(picture.view.flat(shape.place(position))).view(float).reshape(-1, 2)
                    )

        def rendered() -> None:
            for _ in positions:
                picture._canvas.image()

        def shown() -> None:
            for position in positions:
                picture.show(position)

        calls = {"finding and moving the geometry": moved, "bare rendering": rendered, "geometry and rendering": shown}
        taken = measuring.in_turn(calls, 1.0, 3)

    def encoded() -> None:
        with imageio.get_writer(folder / "bare.mp4", fps=25, macro_block_size=8) as writer:
            for image in images:
                writer.append_data(image)

    def whole() -> None:
        movie(solved, diagram, folder / "whole.mp4", FRAMES, style)

    taken |= measuring.in_turn({"bare encoding": encoded, "the whole film, window and all": whole}, 1.0, 3)
    return [{"diagram": diagram, "what": name, "ms a frame": time / FRAMES * 1e3} for name, time in taken.items()]


if __name__ == "__main__":
    main()
