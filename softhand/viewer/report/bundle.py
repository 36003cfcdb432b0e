"""Where three.js lies: in one file of the package meshcat, with the licences of all in it."""

from __future__ import annotations

from importlib.util import find_spec
from pathlib import Path

from softhand.errors import SofthandError


def bundle_folder() -> Path:
    """Folder of `main.min.js`, which gives `MeshCat.THREE`, and of its licences.

    The package is found, not imported: it would load IPython and a message queue.

    Raises:
        SofthandError: meshcat is not installed.
    """
    spec = find_spec("meshcat")
    if spec is None or spec.origin is None:
        raise SofthandError("The package 'meshcat' is not installed; the 3-D view needs it: pip install meshcat.")
    return Path(spec.origin).parent / "viewer" / "dist"
