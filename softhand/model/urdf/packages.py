"""Where `package://NAME` lies on this machine: packages of ROS, and installed Python packages."""

from __future__ import annotations

import importlib.util
import os
from pathlib import Path

ROS, AMENT = "ROS_PACKAGE_PATH", "AMENT_PREFIX_PATH"
"""Environment variables of ROS 1 and ROS 2, lists of folders."""


def package_folders(name: str) -> list[Path]:
    """Folders that may be those of a package, in the order in which they are looked at.

    First those of ROS_PACKAGE_PATH, each of which is a package or holds some, itself or one folder below; then
    share/NAME of those of AMENT_PREFIX_PATH; then those of a Python package of that name, see `python_folders`.

    Args:
        name: of the package.
    """
    if not name or name in (".", "..") or os.path.basename(name) != name or "\0" in name:
        return []
    return [*_of_ros(name), *(place / "share" / name for place in _listed(AMENT)), *python_folders(name)]


def python_folders(name: str) -> list[Path]:
    """The folder of an installed Python package and `share/NAME` of those above it, none if it is not installed.

    With hyphens for underscores too: there packages of ROS and their wheels keep their data. Nothing is imported.
    """
    try:
        found = importlib.util.find_spec(name) if name.isidentifier() else None
    except (ImportError, ValueError):
        found = None
    folders = list(found.submodule_search_locations or []) if found else []
    if not folders:
        return []
    folder = Path(folders[0])
    spellings = dict.fromkeys((name, name.replace("_", "-")))
    return [folder, *(above / "share" / spelling for above in folder.parents for spelling in spellings)]


def searched() -> str:
    """What is searched for packages beside the folders above a URDF, in words."""
    return ", ".join(f"{variable} ({_shown(variable)})" for variable in (ROS, AMENT)) + " and installed Python packages"


def _of_ros(name: str) -> list[Path]:
    tries = []
    for place in _listed(ROS):
        tries += [place] if place.name == name else []
        tries += [place / name, *(below / name for below in _folders(place))]
    return tries


def _folders(place: Path) -> list[Path]:
    try:
        return sorted(below for below in place.iterdir() if below.is_dir())
    except OSError:
        return []


def _listed(variable: str) -> list[Path]:
    return [Path(word) for word in os.environ.get(variable, "").split(os.pathsep) if word]


def _shown(variable: str) -> str:
    text = os.environ.get(variable, "")
    return ("is not set" if not text else text if len(text) <= 120 else f"{text[:117]}...").replace("\n", " ")
