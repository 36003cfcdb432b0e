"""Files named `package://NAME/PATH`: those that ship with softhand, and those of packages of ROS and of Python."""

from __future__ import annotations

from pathlib import Path

from softhand.errors import ScenarioError
from softhand.model.urdf.packages import package_folders, searched
from softhand.settings.wording import show

_PREFIX = "package://"
_HERE = Path(__file__).parents[1]
EXTRAS = {"example_robot_data": "robots"}
"""Extra of softhand that brings a package."""


def shipped_urdfs() -> Path:
    """Folder of the URDFs that ship: inside the package in an installed wheel, beside it in a source checkout."""
    return next((place for place in (_HERE / "urdf", _HERE.parent / "urdf") if place.is_dir()), _HERE)


def package_file(name: str) -> Path:
    """The file that `package://NAME/PATH` stands for.

    NAME is softhand, a package of ROS or an installed Python package; `model.urdf.packages` says where these are
    looked for.

    Raises:
        ScenarioError: there is no such package, there is no such file in it, or the path leads out of it.
    """
    package, _, path = name.removeprefix(_PREFIX).partition("/") if name.startswith(_PREFIX) else ("", "", "")
    if ".." in Path(path).parts:
        raise ScenarioError(
            f"{show(name)} leads out of the package; give the path of the file.", key="urdf", value=name
        )
    if package == "softhand" and path.startswith("urdf/"):
        tries, problem = [shipped_urdfs().parent / path], f"No URDF ships as {show(name)}. {_shipped()}"
    else:
        tries, problem = _tries(name, package, path)
    found = next((file for file in tries if _is_file(file)), None)
    if found is None:
        raise ScenarioError(problem, key="urdf", value=name)
    return found


def _shipped() -> str:
    names = sorted(file.name for file in shipped_urdfs().glob("*.urdf"))
    return "Shipped: " + (", ".join(f"{_PREFIX}softhand/urdf/{name}" for name in names) or "none") + "."


def _tries(name: str, package: str, path: str) -> tuple[list[Path], str]:
    """Where a file of a package may be, and what to say if it is nowhere."""
    name, folders = show(name), package_folders(package)
    there = [folder for folder in folders if folder.is_dir()]
    if not there and package in EXTRAS:
        return [], f'{name} needs another package; install it: pip install "softhand[{EXTRAS[package]}]".'
    if not there:
        where = f"looked for in {searched()}; give the path of a file"
        return [], f"{name}: there is no package of that name, {where}. {_shipped()}"
    problem = f"{name}: the package is installed in {there[0]}, but has no such file. {_shipped()}"
    return [folder / path for folder in folders], problem


def _is_file(file: Path) -> bool:
    try:
        return file.is_file()
    except (OSError, ValueError):
        return False
