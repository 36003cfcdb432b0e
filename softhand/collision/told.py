"""Collisions among the rows and the warnings of a command."""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

from softhand.collision.record import Collisions
from softhand.errors import SofthandError

_TOLD = 5


class Told(NamedTuple):
    """What a command shows of collisions."""

    found: Collisions | None
    """None where they cannot be looked for."""
    rows: list[tuple[str, str]]
    warnings: list[str]


def told(find: Callable[[], Collisions]) -> Told:
    """What is found, or why nothing can be."""
    try:
        found = find()
    except SofthandError as error:
        return Told(None, [("collisions", f"not looked for: {error}")], [])
    rows = [("collisions", found.short()), *(("collisions, not looked at", note) for note in found.notes())]
    at_start = found.samples == 1
    warnings = []
    for one in found.found[:_TOLD]:
        if at_start:
            warnings.append(
                f"collision: {one.one} starts {1e3 * one.depth:.3g} mm deep in {one.other}, and a run lets them pass "
                "through each other; change grasp.joint_guess, grasp.contact_points or object.position."
            )
        else:
            warnings.append(
                f"collision: {one.one} is in {one.other} from {one.begin:.4g} to {one.end:.4g} s, at most "
                f"{1e3 * one.depth:.3g} mm deep; in the run they passed through each other."
            )
    if len(found.found) > _TOLD:
        warnings.append(f"collision: {len(found.found) - _TOLD} more; softhand.collisions lists all.")
    return Told(found, rows, warnings)
