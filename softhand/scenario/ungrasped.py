"""A scenario whose grasp is yet to be found."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from softhand.scenario.file import find_scenario, overridden, read_toml


def without_grasp(source: str | Path, overrides: Mapping[str, Any]) -> dict[str, Any]:
    """Overrides with which a scenario can be loaded that says nothing of its contact points.

    What stands in for them has the right count and no meaning: it is for searches that do not look at it.

    Args:
        source: as in `load_scenario`.
        overrides: likewise.

    Returns:
        What stands in for missing contact points and internal forces; nothing if there are contact points, or if the
        fingertips are not told, which loading refuses.
    """
    table = overridden(read_toml(find_scenario(source)), overrides)
    grasp, hand = table.get("grasp", {}), table.get("hand", {})
    tips = hand.get("tips") if isinstance(hand, Mapping) else None
    if not (isinstance(grasp, Mapping) and isinstance(tips, tuple)) or "contact_points" in grasp:
        return {}
    count = len(tips)
    return {
        "grasp.contact_points": [[0.0, 0.0, 0.0]] * count,
        "grasp.internal_force": [0.0] * (count * (count - 1) // 2),
    }
