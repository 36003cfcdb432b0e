"""List the licences of everything that softhand needs, as the table of docs/licences.md.

Names and licences are those that the installed packages tell of themselves. A licence that would bind softhand or its
users, such as the GPL, ends the script with exit code 1, unless it belongs to an extra that is known for it.

Example: python scripts/licences.py
"""

from __future__ import annotations

import re
import sys
from importlib.metadata import Distribution, PackageNotFoundError, distribution
from pathlib import Path

from packaging.requirements import Requirement

PAGE = Path(__file__).parent.parent / "docs" / "licences.md"
HEAD = """# Licences

softhand is under the [BSD 3-Clause licence](../LICENSE). What it needs is installed beside it, each package under a
licence of its own; `python scripts/licences.py` makes this table from what they tell. Programs of the system, such as
Chromium, are not listed.

| Package | Needed by | Licence |
| --- | --- | --- |
"""
FOOT = """
The extra `film` brings `imageio-ffmpeg`, whose licence is BSD; the program ffmpeg in it is a build under the GPL, run
as a program of its own. Where the system has an ffmpeg, that one is taken.
"""
VIRAL = re.compile(r"\bA?GPL|Affero|GNU General Public", re.IGNORECASE)
WEAK = re.compile(r"LGPL|Lesser", re.IGNORECASE)
TOLD = {  # where the metadata names no licence, the file in the package does
    "cmeel": "BSD-2-Clause", "cmeel-boost": "BSL-1.0", "cmeel-eigen": "MPL-2.0", "cmeel-octomap": "BSD-3-Clause",
    "cmeel-qhull": "Qhull", "cmeel-tinyxml2": "Zlib", "cmeel-urdfdom": "BSD-3-Clause", "cmeel-zlib": "Zlib",
    "cmeel-console-bridge": "BSD-3-Clause", "cmeel-assimp": "BSD-3-Clause", "cmeel-urdfdom-headers": "BSD-3-Clause",
}  # fmt: skip
"""Licences by name."""


def licence_of(package: Distribution) -> str:
    """What a package says of itself, in a few words."""
    data = package.metadata
    name = re.sub(r"[-_.]+", "-", data["Name"]).lower()
    if name in TOLD:
        return TOLD[name]
    expression = data.get("License-Expression")
    if expression:
        return str(expression)
    classifiers = [
        text.rpartition("::")[2].strip() for text in data.get_all("Classifier") or () if "License ::" in text
    ]
    if classifiers:
        return ", ".join(classifiers)
    return " ".join((data.get("License") or "").split("\n")[0].split())[:60]


def needed(root: str = "softhand") -> dict[str, tuple[Distribution, str]]:
    """All packages below one, with what needs each first; extras of softhand as far as they are installed."""
    found: dict[str, tuple[Distribution, str]] = {}
    waiting = [(root, root, True)]
    while waiting:
        name, by, is_root = waiting.pop(0)
        try:
            package = distribution(name)
        except PackageNotFoundError:
            continue
        key = re.sub(r"[-_.]+", "-", package.metadata["Name"]).lower()
        if key in found:
            continue
        found[key] = package, by
        for text in package.requires or ():
            requirement = Requirement(text)
            extra = re.search(r"extra == ['\"]([\w-]+)", str(requirement.marker or ""))
            if extra and (not is_root or extra[1] == "test"):
                continue
            if requirement.marker and not requirement.marker.evaluate({"extra": extra[1] if extra else ""}):
                continue
            waiting.append((requirement.name, f"extra {extra[1]}" if extra else key, False))
    del found[root]
    return found


def main() -> None:
    """Write the page; say what must not be there."""
    packages = needed()
    rows = [
        f"| {package.metadata['Name']} {package.version} | {by} | {licence_of(package) or 'not told'} |"
        for _, (package, by) in sorted(packages.items())
    ]
    PAGE.write_text(HEAD + "\n".join(rows) + "\n" + FOOT)
    bad = [row for row in rows if VIRAL.search(row) and not WEAK.search(row)]
    if bad:
        sys.exit("licences that bind others:\n" + "\n".join(bad))
    print(f"{PAGE}: {len(rows)} packages")


if __name__ == "__main__":
    main()
