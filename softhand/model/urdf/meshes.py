"""Where the meshes of a URDF lie."""

from __future__ import annotations

from pathlib import Path


def find_mesh(name: str, folder: Path | None) -> Path | None:
    """The file of a mesh, None if it is not there.

    Args:
        name: as in the URDF: a path relative to its folder, an absolute one, or package://NAME/..., which is looked for
            below the folders above the URDF, with and without NAME.
        folder: of the URDF; None if it is not known.
    """
    place = name.removeprefix("file://")
    inside = place.removeprefix("package://")
    if inside == place:
        tries = [Path(place)] if folder is None else [folder / place]
    else:
        above = [] if folder is None else [folder, *folder.parents]
        tries = [base / path for path in (inside, inside.partition("/")[2]) for base in above]
    return next((file for file in tries if _is_file(file)), None)


def _is_file(file: Path) -> bool:
    try:
        return file.is_file()
    except (OSError, ValueError):
        return False
