"""The files of the pages: our own, and three.js in one file of the package meshcat, with the licences of all in it."""

from __future__ import annotations

from importlib.resources import files
from importlib.util import find_spec
from pathlib import Path

from softhand.errors import SofthandError

LICENCES = "main.min.js.THIRD_PARTY_LICENSES.json"


def page_file(name: str) -> str:
    """The text of a file of ours, such as report.js."""
    return (files("softhand.viewer.page") / name).read_text("utf-8")


def three_file(name: str = "main.min.js") -> str:
    """The text of a file of the package meshcat: the library itself, which gives `MeshCat.THREE`, or its licences.

    The package is found, not imported: it would load IPython and a message queue.

    Raises:
        SofthandError: meshcat is not installed.
    """
    spec = find_spec("meshcat")
    if spec is None or spec.origin is None:
        raise SofthandError("The package 'meshcat' is not installed; the 3-D view needs it: pip install meshcat.")
    return (Path(spec.origin).parent / "viewer" / "dist" / name).read_text("utf-8")
