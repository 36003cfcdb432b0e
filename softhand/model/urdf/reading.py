"""Reading a URDF into Pinocchio, once it has passed all checks."""

from __future__ import annotations

import os
import stat
import sys
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np
import pinocchio as pin

from softhand.errors import ModelError
from softhand.model.urdf.document import LARGEST
from softhand.model.urdf.examination import examine
from softhand.model.urdf.tree import Tree


def parse_urdf(text: str, file: Path, floating: bool = False, folder: Path | None = None) -> pin.Model:
    """A Pinocchio model of one URDF.

    Args:
        text: the URDF.
        file: where it comes from, for messages.
        floating: one rigid body whose root has a free-flyer joint.
        folder: where its meshes must be; they are not looked for if None.

    Raises:
        ModelError: it is no XML, no URDF, or describes no possible hand or object.
    """
    examination = examine(text, file, floating, folder)
    examination.findings.raise_errors()
    assert examination.tree is not None
    with _captured_stderr() as complaint:
        try:
            model = pin.buildModelFromXML(text, pin.JointModelFreeFlyer()) if floating else pin.buildModelFromXML(text)
        except (ValueError, RuntimeError) as error:
            reason = complaint() or str(error)
            raise ModelError(f"{file}: Pinocchio cannot read this URDF: {reason}", file=str(file)) from error
    _check_reading(model, examination.tree, floating, file)
    return model


def read_text(file: Path) -> str:
    """The text of a URDF file.

    Raises:
        ModelError: there is no such file, it is too long, or it cannot be read.
    """
    try:
        # a pipe or a device could be read for ever
        if not stat.S_ISREG(os.stat(file).st_mode):
            raise ModelError(f"{file}: this is no regular file; a .urdf file is needed.", file=str(file))
        with Path(file).open("rb") as stream:
            data = stream.read(LARGEST + 1)
        if len(data) > LARGEST:
            raise ModelError(f"{file}: longer than {LARGEST} bytes, which no URDF is; is it a mesh?", file=str(file))
        return data.decode("utf-8-sig")
    except FileNotFoundError as error:
        raise ModelError(f"{file}: there is no such URDF file.", file=str(file)) from error
    except (OSError, ValueError) as error:
        raise ModelError(f"{file}: cannot read this URDF file: {error}.", file=str(file)) from error


def _check_reading(model: pin.Model, tree: Tree, floating: bool, file: Path) -> None:
    """Pinocchio has the joints of the file, each moves a mass, and the dynamics at zero are numbers."""
    joints = {joint.name for joint in tree.joints if joint.is_moving}
    read = set(list(model.names)[2 if floating else 1 :])
    if joints != read:
        raise ModelError(
            f"{file}: Pinocchio reads the joints {sorted(read)}, the file has {sorted(joints)}; rename those.",
            file=str(file),
        )
    if not model.nv:
        return
    data = model.createData()
    q = pin.neutral(model)
    M = np.triu(pin.crba(model, data, q))
    terms = pin.nonLinearEffects(model, data, q, np.ones(model.nv))
    M = M + np.triu(M, 1).T
    if not (np.isfinite(M).all() and np.isfinite(terms).all() and _is_positive(M)):
        raise ModelError(
            f"{file}: the mass matrix at zero is not positive definite, or the dynamics are not finite; "
            "look at masses, inertias and lengths.",
            file=str(file),
        )


def _is_positive(M: np.ndarray) -> bool:
    """Whether a symmetric matrix is positive definite, whatever the units of its rows."""
    scale = np.sqrt(np.abs(np.diag(M)))
    if not np.all(scale > 0.0):
        return False
    return bool(np.linalg.eigvalsh(M / np.outer(scale, scale))[0] > 1e-14)


@contextmanager
def _captured_stderr() -> Iterator[Any]:
    """Pinocchio's URDF parser explains itself on the C stderr only; yields a function that returns that text."""
    sys.stderr.flush()
    with tempfile.TemporaryFile() as sink:
        saved = os.dup(2)
        os.dup2(sink.fileno(), 2)

        def text() -> str:
            sink.seek(0)
            return " ".join(sink.read().decode(errors="replace").split())

        try:
            yield text
        finally:
            os.dup2(saved, 2)
            os.close(saved)
