"""Motions that tell what a log does not: simulated, and looked at in the same way, before they are proposed."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from softhand.assembly.build import assemble
from softhand.assembly.resolve import Setup, resolve
from softhand.calibration.fit import look
from softhand.calibration.log import Log
from softhand.calibration.parameters import Parameter
from softhand.calibration.recorded_log import log_of_recording
from softhand.calibration.told import Direction
from softhand.errors import SofthandError
from softhand.scenario.scenario import Scenario

_DURATION, _LEG = 2.0, 0.4  # [s]
_TURN, _SHIFT = math.radians(8.0), 0.004  # [rad], [m]
_SHARES = (0.3, 0.5, 0.7, 0.9)
_NOISE = {"joint_position": 1e-4, "object_position": 1e-4, "object_orientation": 1e-3, "contact_force": 0.02}


@dataclass(frozen=True)
class Motion:
    """A motion that tells more.

    Attributes:
        name: in words.
        scenario: of it, to be run on the hand.
        left: what even this does not tell.
    """

    name: str
    scenario: Scenario
    left: tuple[str, ...]

    @property
    def text(self) -> str:
        """What is proposed, as a sentence."""
        rest = f", all but {', '.join(self.left)}" if self.left else ""
        return f"A motion that would tell it{rest}, as a simulation of it shows: {self.name}."


def propose(
    setup: Setup, parameters: Sequence[Parameter], unknown: Sequence[Direction], log: Log, length: float, threads: int
) -> Motion | None:
    """The first of some motions that tells all, or the one that leaves the least.

    Args:
        setup: of the scenario.
        parameters: that are asked for.
        unknown: what the log does not tell.
        log: as it is; the motion is measured as it was.
        length: of a piece [s].
        threads: at work at the same time.
    """
    best: Motion | None = None
    missing = {name for way in unknown for name in way.parameters}
    for name, changes in _motions(setup.asked):
        try:
            scenario = setup.asked.replace({**changes, **_instruments(setup.asked, parameters, log)})
            chosen = resolve(scenario, law=setup.law)
            recording = assemble(chosen).run()
            seen = log_of_recording(recording, scenario, name)
            measured = {key: values for key, values in seen.measured.items() if key in log.measured}
            seen = Log(seen.time, seen.joint_torque, measured, seen.joints, name)
            left = {one for way in look(seen, chosen, parameters, length, threads) for one in way.parameters}
        except SofthandError:
            continue  # the grasp does not bear this motion
        if best is None or len(left) < len(best.left):
            best = Motion(name, scenario, tuple(sorted(left)))
        if not left:
            break
    return best if best is not None and len(best.left) < len(missing) else None


def _instruments(scenario: Scenario, parameters: Sequence[Parameter], log: Log) -> dict[str, Any]:
    """Instruments of usual noise for what was logged, if the scenario has none."""
    given = scenario.sensing.instruments if scenario.sensing is not None else {}
    missing = [name for name in _NOISE if name in log.measured and name not in given]
    changes: dict[str, Any] = {f"sensing.{name}.noise": _NOISE[name] for name in missing}
    return changes


def _motions(scenario: Scenario) -> list[tuple[str, dict[str, Any]]]:
    """Names, and what they put over the scenario."""
    force = list(scenario.grasp.internal_force)
    usual = {"duration": _DURATION, "push": ()}
    slow, fast = _turning(scenario, force, 1.0), _turning(scenario, force, 2.0)
    slips = {**usual, "fingertip.contact": "coulomb", "reference": slow}
    pushed = [
        ("push the object along each axis until tips slip, while it is turned and squeezed",
         {**slips, "push": _pushes(scenario, share)})
        for share in _SHARES
    ]  # fmt: skip
    return [
        (
            "turn the object by 8 deg about each axis in turn, and squeeze it harder and softer",
            {**usual, "reference": slow},
        ),
        ("the same twice as fast", {**usual, "reference": fast}),
        *pushed,
    ]


def _turning(scenario: Scenario, force: list[float], pace: float) -> dict[str, Any]:
    p, rpy = scenario.object.position, scenario.object.rpy
    ways = (
        (1, 0, 0),
        (-1, 1, 0),
        (0, -1, 1),
        (0, 0, -1),
        (1, 1, 1),
        (-1, 0, -1),
        (0, 1, -1),
        (1, -1, 0),
        (-1, -1, 1),
        (0, 0, 0),
    )
    legs = []
    for k, way in enumerate(ways[: int(_DURATION * pace / _LEG)]):
        squeeze = 1.3 if k % 2 == 0 else 0.9
        legs.append({
            "duration": _LEG / pace,
            "object_position": [a + _SHIFT * b for a, b in zip(p, way[::-1], strict=True)],
            "object_rpy": [a + _TURN * b for a, b in zip(rpy, way, strict=True)],
            "internal_force": [squeeze * f for f in force],
        })  # fmt: skip
    return {"kind": "waypoints", "waypoints": legs}


def _pushes(scenario: Scenario, share: float) -> list[dict[str, Any]]:
    """One along each axis, a share of what friction bears at most."""
    most = 2.0 * scenario.fingertip.friction * sum(scenario.grasp.internal_force)
    axes = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))
    return [
        {"force": [share * most * a for a in axis], "start": 0.3 + 0.5 * k, "duration": 0.1}
        for k, axis in enumerate(axes)
    ]
