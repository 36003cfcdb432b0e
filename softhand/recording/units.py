"""Units of the arrays of a recording: of each joint by whether it turns or slides."""

from __future__ import annotations

import json
from collections.abc import Iterable, Mapping
from functools import lru_cache
from pathlib import Path
from typing import Any

from softhand.errors import ModelError
from softhand.model.urdf.document import read_document
from softhand.recording.variables import VARIABLES


@lru_cache(maxsize=16)
def slides_in(hand_urdf: str) -> frozenset[str]:
    """Names of the joints of a URDF that slide; none where the text is not known."""
    try:
        root = read_document(hand_urdf, Path("the URDF of a recording")) if hand_urdf else ()
    except ModelError:
        return frozenset()
    return frozenset(part.get("name", "") for part in root if part.tag == "joint" and part.get("type") == "prismatic")


def table_of(text: object) -> Any:
    """What an attribute of a recording has as JSON; None if it is none."""
    try:
        return json.loads(text) if isinstance(text, str) else None
    except ValueError:
        return None


def units_along(
    name: str, labels: Mapping[str, tuple[str, ...]], hand_urdf: str, sliding_motors: Iterable[str] = ()
) -> tuple[str, ...]:
    """Unit of each place along the last dimension of an array; one unit alone where it is that of all.

    Args:
        name: of the array.
        labels: along the dimensions of the model.
        hand_urdf: text of the hand's URDF.
        sliding_motors: motors of coupled joints that slide, which the URDF does not know by name.
    """
    variable = VARIABLES[name]
    hinge, is_mixed, slide = variable.units.partition(" or ")
    units = tuple(hinge.split(", "))
    if is_mixed:
        slides = {*slides_in(hand_urdf), *sliding_motors}
        joints = {*labels["joint"], *labels.get("coupled_joint", ())}
        of_object = {True: "N m", False: "N"}  # a moment about an axis rx, a force along x
        units = tuple(
            (slide if place in slides else hinge) if place in joints else of_object[place.startswith("object r")]
            for place in labels[variable.dims[-1]]
        )
    return units[:1] if len(set(units)) == 1 else units
