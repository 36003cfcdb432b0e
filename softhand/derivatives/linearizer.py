"""A linear model again and again: the same plant beside one state after the other."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any

from softhand.derivatives.linearization import Linearization
from softhand.derivatives.linearize import Work
from softhand.derivatives.situation import checked_state, checked_torque, find_situation
from softhand.laws.law import Law
from softhand.numerics.arrays import Array
from softhand.plant.state import State
from softhand.recording.recording import Recording
from softhand.scenario.scenario import Scenario


class Linearizer:
    """`linearize` for a controller that predicts: plant, tables and machine code are made once.

        linearizer = softhand.Linearizer("target-a", outputs=["internal_force", "limit_surface_use"])
        model = linearizer.at(simulation.state, torque)

    The period and what is said of switches are those of `linearize`. A, B, C and what a wrench does come from the
    derivatives of the sums of the step where these can be followed, within 1e-8 of the differences of `linearize`.

    Args:
        source: a scenario, its name or path, or a recording.
        outputs: as `linearize`.
        parameters: likewise; "wrench" costs as much as six joints, each other one some plants of its own at each call.
        law: at all tips in place of the scenario's.
        overrides: dotted keys and values put over those of the scenario, not of a recording.
        values: the same by the last part of the key.

    Raises:
        ScenarioError: a parameter or an output is unknown, or the stepper has no steps of one length.
        RecordingError: the recording lacks what tells its states.
        SofthandError: as `build`.
    """

    def __init__(
        self,
        source: Scenario | Recording | str | Path,
        *,
        outputs: Iterable[str] = (),
        parameters: Iterable[str] = (),
        law: Law | None = None,
        overrides: Mapping[str, Any] | None = None,
        **values: Any,
    ) -> None:
        self._work = Work(
            find_situation(source, 0, None, None, None, law, overrides, values), outputs, closed=False, again=True
        )
        self._parameters = self._work.found(parameters)

    def at(self, state: State, torque: Sequence[float] | Array) -> Linearization:
        """The linear model of the control period that begins at a state, at its time.

        Args:
            state: of this plant; it is not changed.
            torque: held for the period [N m, N], shape (n,).

        Raises:
            ScenarioError: a state or torque is no number or not of this plant.
            SimulationStopped: the period does not come to its end.
        """
        work = self._work
        work.move(checked_state(work.at.plant, state), checked_torque(torque, work.n))
        return work.linearization(self._parameters)
