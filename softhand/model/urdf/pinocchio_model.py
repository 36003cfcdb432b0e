"""A URDF as a Pinocchio model."""

from __future__ import annotations

import os
import sys
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

import numpy as np
import pinocchio as pin

from softhand.errors import ModelError
from softhand.model.urdf.urdf import Urdf


def build_model(urdf: Urdf) -> pin.Model:
    """The Pinocchio model of a hand, or of an object, whose root has a free-flyer joint.

    Raises:
        ModelError: Pinocchio reads it otherwise than it is meant, or its dynamics are no numbers.
    """
    with _captured_stderr() as complaint:
        try:
            joints = [pin.JointModelFreeFlyer()] if urdf.is_object else []
            model = pin.buildModelFromXML(urdf.text, *joints)
        except (ValueError, RuntimeError) as error:
            reason = complaint() or str(error)
            raise ModelError(f"{urdf.file}: Pinocchio cannot read this URDF: {reason}", file=str(urdf.file)) from error
    _check_reading(model, urdf)
    return model


def _check_reading(model: pin.Model, urdf: Urdf) -> None:
    """Pinocchio has the joints of the file, each moves a mass, and the dynamics at zero are numbers."""
    file, joints = urdf.file, {joint.name for joint in urdf.moving_joints}
    read = set(list(model.names)[2 if urdf.is_object else 1 :])
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
