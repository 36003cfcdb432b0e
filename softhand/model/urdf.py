"""Reading a URDF into Pinocchio, with the reason when it cannot be read."""

from __future__ import annotations

import os
import sys
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import numpy as np
import pinocchio as pin

from softhand.errors import ModelError


def parse_urdf(text: str, file: Path, floating: bool = False) -> pin.Model:
    """A Pinocchio model of one URDF.

    Args:
        text: the URDF.
        file: where it comes from, for messages.
        floating: give the root a free-flyer joint.

    Raises:
        ModelError: it is no XML, no URDF, or has a moving link without a possible inertia.
    """
    try:
        root = ElementTree.fromstring(text)
    except ElementTree.ParseError as error:
        raise ModelError(f"{file}: not an XML file: {error}.", file=str(file)) from error
    if root.tag != "robot":
        raise ModelError(f"{file}: the root element is <{root.tag}>; a URDF starts with <robot>.", file=str(file))
    with _captured_stderr() as complaint:
        try:
            model = pin.buildModelFromXML(text, pin.JointModelFreeFlyer()) if floating else pin.buildModelFromXML(text)
        except (ValueError, RuntimeError) as error:
            reason = complaint() or str(error)
            raise ModelError(f"{file}: Pinocchio cannot read this URDF: {reason}", file=str(file)) from error
    _check_inertias(model, file)
    return model


def read_text(file: Path) -> str:
    """The text of a URDF file.

    Raises:
        ModelError: there is no such file, or it cannot be read.
    """
    try:
        return Path(file).read_text(encoding="utf-8")
    except FileNotFoundError as error:
        raise ModelError(f"{file}: there is no such URDF file.", file=str(file)) from error
    except (OSError, UnicodeDecodeError) as error:
        raise ModelError(f"{file}: cannot read this URDF file: {error}.", file=str(file)) from error


def _check_inertias(model: pin.Model, file: Path) -> None:
    """Every body that moves needs a mass and a positive definite inertia, or M is singular."""
    for index in range(1, model.njoints):
        inertia = model.inertias[index]
        numbers = np.concatenate([[inertia.mass], inertia.lever, inertia.inertia.ravel()])
        if not np.all(np.isfinite(numbers)):
            reason = "has an inertia with NaN or infinity"
        elif inertia.mass <= 0.0:
            reason = f"has the mass {inertia.mass:g} kg"
        elif np.linalg.eigvalsh(inertia.inertia)[0] <= 0.0:
            reason = "has an inertia that is not positive definite"
        else:
            continue
        raise ModelError(
            f"{file}: what joint '{model.names[index]}' moves {reason}; "
            "give its link an <inertial> with a mass > 0 and a positive definite inertia.",
            file=str(file),
        )


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
