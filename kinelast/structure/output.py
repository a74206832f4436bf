"""The structure of a scene: text for the terminal, and a folder with the same text and the skeleton diagram."""

from __future__ import annotations

from dataclasses import replace
from importlib import metadata
from pathlib import Path

from kinelast.folder import add_to
from kinelast.scene.reading import SceneError, StructureScene, read_structure
from rigid import MechanismError


def structure_outcome(path: Path, out: Path) -> tuple[str, str]:
    """The text of a scene's structure, and one line about the files that were written; or nothing, and what is wrong.

    Parameters
    ----------
    out
        Where the folder named after the scene is, or is put.
    """
    try:
        scene = read_structure(path)
        text = scene_text(scene)
        files = {"structure.txt": text}
        line = f"{path.stem}: structure"
        if scene.mechanism is not None:
            from kinelast.structure.skeleton import skeleton_svg

            try:
                files["skeleton.svg"] = skeleton_svg(scene.mechanism)
                line += " and skeleton diagram"
            except MechanismError as error:
                line += f", no skeleton diagram ({error})"
        folder = out / path.stem
        add_to(folder, files, {"kinelast": metadata.version("kinelast")})
    except (SceneError, MechanismError, OSError) as error:
        return "", f"{path.stem}: {error}"
    return text, f"{line} -> {folder}"


def scene_text(scene: StructureScene) -> str:
    """The structure of a scene in lines for a terminal."""
    if scene.mechanism is None:
        from kinelast.structure.spatial_report import spatial_text

        return spatial_text(scene.joints, scene.title, scene.fixed)
    from kinelast.structure.planar_report import structure_report, structure_text

    return structure_text(replace(structure_report(scene.mechanism, scene.contacts), title=scene.title))
