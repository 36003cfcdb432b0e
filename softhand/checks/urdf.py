"""What is doubtful about a URDF beyond its text."""

from __future__ import annotations

import pinocchio as pin

from softhand.errors import ModelError
from softhand.model.shapes.reading import read_shape
from softhand.model.urdf.urdf import Urdf


def doubts_of_shape(urdf: Urdf, body: pin.Model) -> list[str]:
    """Why the tips cannot touch an object as it is, and what to do; nothing for a hand."""
    try:
        if urdf.is_object:
            read_shape(urdf, body)
    except ModelError as error:
        return [str(error)]
    return []
