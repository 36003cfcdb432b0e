"""Whether the samples of many runs fit into memory, before they are computed."""

from __future__ import annotations

from collections.abc import Sequence
from math import prod
from pathlib import Path

from softhand.errors import ScenarioError
from softhand.recording.variables import COMPONENTS, VARIABLES
from softhand.scenario.scenario import Scenario
from softhand.simulation.keep import Keep

_MEMORY = Path("/proc/meminfo")
_COPIES = 2  # of a sample, while the runs are put together
_FURTHER = {"joint": 4, "pair": 3, "support": 8, "velocity": 5}
"""How many names a dimension has for each tip, at most, as long as the hand has not been read."""


def must_fit(scenarios: Sequence[Scenario], keeps: Sequence[Keep]) -> None:
    """Nothing if they do.

    Raises:
        ScenarioError: they take more than there is; names the figures.
    """
    needed, free = sum(map(_bytes, scenarios, keeps)), _free()
    if free is not None and needed > free:
        raise ScenarioError(
            f"variations: {len(scenarios):,} runs with these variables take about {needed / 1e9:.3g} GB of memory, and "
            f"{free / 1e9:.3g} GB are free; keep fewer variables, or samples further apart (every), or make fewer runs "
            "at a time.",
            key="variations", value=len(scenarios),
        )  # fmt: skip


def _bytes(scenario: Scenario, keep: Keep) -> int:
    tips = len(scenario.hand.names)
    most = max(scenario.fingertip.at(tip).slip_elements for tip in scenario.hand.names)
    further = {**_FURTHER, "element": most, "taxel": scenario.tactile.count // tips + 1 if scenario.tactile else 0}
    numbers = 0
    for name in ("joint_torque", *keep.variables):
        dims = VARIABLES[name].dims[1:]
        numbers += prod(len(COMPONENTS[dim]) if dim in COMPONENTS else tips * further.get(dim, 1) for dim in dims)
    return _COPIES * 8 * numbers * keep.samples(round(scenario.duration / scenario.control_period))


def _free() -> int | None:
    """Memory that programs can still have [bytes]; None where nothing tells."""
    try:
        lines = dict(line.split(":", 1) for line in _MEMORY.read_text().splitlines())
        return 1024 * int(lines["MemAvailable"].split()[0])
    except (OSError, KeyError, ValueError):
        return None
