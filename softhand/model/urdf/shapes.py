"""What visual and collision shapes are checked for: sizes, and whether meshes are there."""

from __future__ import annotations

from pathlib import Path

from softhand.model.urdf.document import Element
from softhand.model.urdf.findings import Findings
from softhand.model.urdf.grammar import numbers_of
from softhand.model.urdf.meshes import find_mesh, where_searched

_LARGE = 1.0  # [m] for a part of a hand or an object in it
_SIZES = {
    "box": (("size", "0 0 0"),),
    "sphere": (("radius", "0"),),
    "cylinder": (("radius", "0"), ("length", "0")),
    "capsule": (("radius", "0"), ("length", "0")),
}


def check_shapes(root: Element, folder: Path | None, is_touched: bool, findings: Findings) -> None:
    """Sizes of shapes, and their meshes if the folder of the URDF is known.

    A mesh that is missing is a warning where nothing is computed from it.

    Args:
        root: of the URDF.
        folder: where its meshes lie, if known.
        is_touched: whether contacts need its collision shapes.
        findings: added to.
    """
    for kind in ("visual", "collision"):
        for shape in root.iterfind(f"link/{kind}/geometry/*"):
            assert isinstance(shape, Element)
            _check_size(shape, findings)
            if shape.tag == "mesh":
                _check_mesh(shape, folder, is_touched and kind == "collision", findings)


def _check_size(shape: Element, findings: Findings) -> None:
    for name, default in _SIZES.get(shape.tag, ()):
        values = numbers_of(shape, name, default)
        if values and max(values) > _LARGE:
            text = shape.get(name, "")
            findings.warn(
                shape,
                f'{name}="{text}" is more than {_LARGE:g} m; is it in millimetres? URDF has metres.',
                text,
                "large",
            )


def _check_mesh(mesh: Element, folder: Path | None, is_needed: bool, findings: Findings) -> None:
    scale = numbers_of(mesh, "scale", "1 1 1")
    if scale and 0.0 in scale:
        findings.error(mesh, f'scale="{mesh.get("scale")}" flattens the mesh; write three numbers other than 0.')
    name = mesh.get("filename", "").strip()
    if folder is None or not name or find_mesh(name, folder) is not None:
        return
    tell = findings.error if is_needed else findings.warn
    tell(mesh, f'filename="{name}": there is no such file; {where_searched(name, folder)}.', name, "missing mesh")
