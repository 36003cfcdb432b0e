"""Which solids may collide, and which pairs of links are disregarded, with the reason."""

from __future__ import annotations

from itertools import combinations
from typing import NamedTuple

import numpy as np

from softhand.collision.distances import TOUCH, distance
from softhand.collision.solids import BASE, Cast, Solid

NEIGHBOURS, RIGID, AT_ZERO, SOFT = (
    "neighbours in the hand",
    "neither moves against the other",
    "overlap with all joints at zero",
    "wholly inside a soft ball of the contact model",
)
"""Why a pair is disregarded."""


class Disregarded(NamedTuple):
    """Two names between which no collision is looked for."""

    one: str
    other: str
    reason: str
    """`NEIGHBOURS`, `RIGID`, `AT_ZERO` or `SOFT`."""


def list_pairs(cast: Cast) -> tuple[list[tuple[Solid, Solid]], list[Disregarded]]:
    """The pairs of solids that count, and the others by name.

    Obstacles meet the object in the contact model, and links and tips in none. The object and the table meet what is
    left of the links outside the soft balls; they meet each other in the contact model, and so do tips where a scenario
    lets them.
    """
    pairs: list[tuple[Solid, Solid]] = []
    others: dict[tuple[str, str], str] = {}
    overlaps = _at_zero(cast)
    carriers = {solid.body for solid in cast.links if not solid.is_palm}
    for a, b in combinations(cast.links, 2):
        names = _names(a, b)
        if names[0] == names[1]:
            continue
        if a.body == b.body:
            others[names] = RIGID
        elif not (a.is_palm or b.is_palm) and _are_neighbours(cast, a.body, b.body, carriers):
            others[names] = NEIGHBOURS
        elif names in overlaps:
            others[names] = AT_ZERO
        elif cast.tips_touch and {a.body, b.body} <= cast.tipped:
            _add(cast.clipped[a], cast.clipped[b], names, pairs, others)
        else:
            pairs.append((a, b))
    for link in cast.links:
        for body in cast.held:
            _add(cast.clipped[link], body, (link.name, body.name), pairs, others)
        if cast.table is not None:
            if link.body == BASE:
                others[link.name, cast.table.name] = RIGID
            else:
                _add(cast.clipped[link], cast.table, (link.name, cast.table.name), pairs, others)
        for obstacle in cast.obstacles:
            if link.body == BASE:
                others[link.name, obstacle.name] = RIGID
            else:
                pairs.append((link, obstacle))
    counted = {_names(a, b) for a, b in pairs}
    return pairs, [Disregarded(*names, why) for names, why in others.items() if tuple(sorted(names)) not in counted]


def _names(a: Solid, b: Solid) -> tuple[str, str]:
    one, other = sorted((a.name, b.name))
    return one, other


def _add(
    one: Solid | None,
    other: Solid | None,
    names: tuple[str, str],
    pairs: list[tuple[Solid, Solid]],
    others: dict[tuple[str, str], str],
) -> None:
    if one is None or other is None:
        others[names] = SOFT
    else:
        pairs.append((one, other))


def _are_neighbours(cast: Cast, one: int, other: int, carriers: set[int]) -> bool:
    """Whether no other body with a link's shape is between two of them, of which one carries the other."""
    return _next(cast, one, carriers) == other or _next(cast, other, carriers) == one


def _next(cast: Cast, body: int, carriers: set[int]) -> int:
    """The nearest body towards the base that carries a solid; -1 from the base."""
    parents = cast.kinematics.model.parents
    while body != BASE:
        body = int(parents[body])
        if body in carriers:
            return body
    return -1


def _at_zero(cast: Cast) -> set[tuple[str, str]]:
    """Names of links that overlap with all joints at zero, or at the limit nearest to it."""
    kinematics = cast.kinematics
    R, p = kinematics.poses(kinematics.rest[None], np.zeros((1, 3)), np.eye(3)[None])
    return {
        _names(a, b) for a, b in combinations(cast.links, 2) if a.body != b.body and distance(a, b, R[0], p[0]) < -TOUCH
    }
