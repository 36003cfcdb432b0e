"""Where the meshes of a URDF lie."""

from __future__ import annotations

from pathlib import Path

from softhand.model.urdf.packages import package_folders, searched

_PACKAGE = "package://"


def find_mesh(name: str, folder: Path | None) -> Path | None:
    """The file of a mesh, None if it is not there.

    Args:
        name: as in the URDF: a path relative to its folder, an absolute one, or package://NAME/..., which is looked for
            below the folders above the URDF, with and without NAME, and then in `packages.package_folders`.
        folder: of the URDF; None if it is not known.
    """
    place = name.removeprefix("file://")
    inside = place.removeprefix(_PACKAGE)
    if inside == place:
        tries = [Path(place)] if folder is None else [folder / place]
        return next(filter(_is_file, tries), None)
    package, _, path = inside.partition("/")
    above = [] if folder is None else [folder, *folder.parents]
    near = (base / part for part in (inside, path) for base in above)
    found = next(filter(_is_file, near), None)
    if found is None and ".." not in Path(path).parts:
        found = next(filter(_is_file, (base / path for base in package_folders(package))), None)
    return found


def where_searched(name: str, folder: Path) -> str:
    """Where a mesh was looked for in vain and what to do, for a message."""
    if _PACKAGE not in name:
        return f"a path is relative to {folder}"
    package = name.partition(_PACKAGE)[2].partition("/")[0]
    return (
        f"looked for in {folder} and the folders above it, with and without {package}, in {searched()}; put the folder "
        f"that holds {package} into ROS_PACKAGE_PATH"
    )


def _is_file(file: Path) -> bool:
    try:
        return file.is_file()
    except (OSError, ValueError):
        return False
