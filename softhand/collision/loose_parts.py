"""Parts of an object that do not touch each other: one rigid body all the same, but hardly meant."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import combinations

import numpy as np

from softhand.collision.distances import TOUCH, distance
from softhand.collision.solids import standing
from softhand.model.shapes.shape import Shape
from softhand.model.shapes.union import Union


def doubts_of_parts(shape: Shape) -> Iterator[str]:
    """A sentence for each group of parts that stands off the others, with the gap; nothing for a convex shape."""
    if not isinstance(shape, Union):
        return
    solids = [standing(name, part) for name, part in zip(shape.names, shape.parts, strict=True)]
    R, p = np.eye(3)[None], np.zeros((1, 3))
    gaps = {(i, j): distance(solids[i], solids[j], R, p) for i, j in combinations(range(len(solids)), 2)}
    group = list(range(len(solids)))
    for (i, j), gap in gaps.items():
        if gap < TOUCH:
            group = [group[i] if other == group[j] else other for other in group]
    for first in dict.fromkeys(group[1:]):
        members = [k for k, one in enumerate(group) if one == first]
        if first == group[0]:
            continue
        gap = min(gap for (i, j), gap in gaps.items() if (i in members) != (j in members))
        names = ", ".join(shape.names[k] for k in members)
        yield (
            f"{names} of the object {'do' if len(members) > 1 else 'does'} not touch the other parts, by "
            f"{1e3 * gap:.3g} mm; move the <origin> of the <collision>, or let parts lie in one another."
        )
