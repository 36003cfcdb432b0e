"""Asking a controller: its torque, checked and cut to the effort limits."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from copy import deepcopy
from typing import Any

import numpy as np
from numpy.typing import NDArray

from softhand.controllers.controller import Controller
from softhand.errors import ControllerError, ScenarioError, SofthandError
from softhand.numerics.arrays import AnyArray, Array, as_numbers
from softhand.numerics.compiled import compiled
from softhand.numerics.prepared import prepared
from softhand.plant.state import StateArrays
from softhand.recording.variables import COMMANDED
from softhand.sensing.observation import Observation
from softhand.settings.failures import failure
from softhand.simulation.actuation import Actuation, Drive, act, drive_of, forget
from softhand.simulation.servo import COMMANDS


class Actuators:
    """The torques that the joints are given.

    Args:
        torque: room for them [N m, N], shape (n,).
        effort_limit: largest of each [N m, N], shape (n,).
        joints: `World.joints`.
        moving: of the joints, live.
        actuation: what the drives make of a command; it is cut to the limits alone if not given.

    Attributes:
        command: what was asked for, shape (n,).
        torque: as applied.
        limited: 1 where an effort limit cut what was asked for, shape (n,).
        drive: the drives, if there are any.
        commands: name of the variable that holds what was asked for, where there are drives.
    """

    def __init__(
        self,
        torque: Array,
        effort_limit: Array,
        joints: NDArray[np.int64],
        moving: StateArrays,
        actuation: Actuation | None = None,
    ) -> None:
        self.torque, self.limited = torque, np.zeros(torque.shape, np.int8)
        self.command = np.zeros_like(torque)
        self.apply = prepared(limit, self.command, effort_limit.copy(), torque, self.limited)
        self.drive: Drive | None = None
        if actuation is not None:
            self.drive = drive_of(actuation, self.command, effort_limit.copy(), torque, self.limited, joints, moving)
            kind = "torque" if actuation.servos is None else COMMANDS[actuation.servos.kind]
            self.commands = COMMANDED[kind]
            self._period = np.zeros(1, np.int64)
            self._act = prepared(act, self.drive, self._period)

    def reset(self) -> None:
        """No torque."""
        self.torque[:], self.limited[:] = 0.0, 0
        if self.drive is not None:
            self.command[:] = 0.0
            forget(self.drive)

    apply: Callable[[], bool]
    """Give the joints what was asked for, cut to the limits; False, and nothing changes, if it is not finite."""

    def act(self, period: int) -> None:
        """Give the joints what the drives make of the commands so far, in a control period, if there are drives."""
        if self.drive is not None:
            self._period[0] = period
            self._act()

    def has_acted(self, period: int) -> bool:
        """Whether nothing is left to do in a control period."""
        return self.drive is None or int(self.drive.last[0]) == period

    def carry(self, period: int) -> dict[str, AnyArray]:
        """What `resume` needs to go on with a control period, as copies."""
        if self.drive is None:
            return {}
        drive, is_done = self.drive, self.has_acted(period)
        return {
            "command": self.command.copy(),
            "drive line": (drive.line_before if is_done else drive.line).copy(),
            "drive state": (drive.state_before if is_done else drive.state).copy(),
        }

    def resume(self, carried: Mapping[str, AnyArray]) -> None:
        """Be as when `carry` was called."""
        if self.drive is not None:
            self.command[:], self.drive.last[:] = carried["command"], -1
            self.drive.line[...], self.drive.state[:] = carried["drive line"], carried["drive state"]


class Asking:
    """A controller at work: what it is asked, and what of its answer is wrong.

    Attributes:
        memory: what the controller returned last.
        before: what it had returned before that.
    """

    def __init__(self, controller: Controller, command: Array) -> None:
        self._controller, self._command = controller, command
        self._shape = command.shape
        self.memory: Any = None
        self.before: Any = None
        self._has_started = False

    def restart(self, memory: Any = None, has_started: bool = False) -> None:
        """Ask for `start` first, or go on with a copy of a memory."""
        self.memory = self.before = deepcopy(memory)
        self._has_started = has_started

    @property
    def has_started(self) -> bool:
        """Whether the controller has a memory."""
        return self._has_started

    def remembered(self, before: bool, time: float) -> Any:
        """A copy of the memory, or of that before the last answer.

        Raises:
            ControllerError: it cannot be copied.
        """
        try:
            return deepcopy(self.before if before else self.memory)
        except Exception as error:
            raise self.bad(f"has a memory that cannot be copied: {error}", time) from error

    def ask(self, observation: Observation) -> None:
        """Set the command to the torque that the controller answers with.

        Raises:
            ControllerError: it raised, or returned no torque.
        """
        try:
            if not self._has_started:
                self.memory = self._controller.start(observation)
                self._has_started = True
            result = self._controller.torque(observation, self.memory)
        except (Exception, SystemExit) as error:
            raise raised_by(self._controller, error, observation.time) from error
        if not (type(result) is tuple and len(result) == 2):
            raise self.bad(
                f"returned {result!r}; it must return the torque and its memory, two values", observation.time
            )
        command, memory = result
        self.before, self.memory = self.memory, memory
        if not (type(command) is np.ndarray and command.dtype == np.float64 and command.shape == self._shape):
            command = self._checked(command, observation.time)
        self._command[:] = command

    def _checked(self, result: Any, time: float) -> Array:
        command = as_numbers(result)
        if command is None:
            raise self.bad(f"returned {result!r} as torque, which is no array of real numbers", time)
        if command.shape != self._shape:
            raise self.bad(
                f"returned a torque of shape {command.shape}: {command.tolist()}; the hand has {self._shape[0]} joints",
                time,
            )
        return command

    def bad(self, what: str, time: float) -> ControllerError:
        """The error for a controller at fault."""
        return at_fault(self._controller, what, time)


def raised_by(controller: Controller, error: BaseException, time: float) -> SofthandError:
    """What to raise for an error of a controller: what it raised on purpose, all else with its name."""
    if isinstance(error, ScenarioError | ControllerError):
        return error
    return at_fault(controller, f"raised {failure(error)}", time)


def at_fault(controller: Controller, what: str, time: float) -> ControllerError:
    """The error for a controller that did what it must not, at a time [s]."""
    name = type(controller).__name__
    return ControllerError(
        f"controller '{name}' {what} (at t = {time:g} s).", controller=name, reason="controller", time=time
    )


@compiled
def limit(command, effort_limit, torque, limited):
    """Apply the effort limits; False if the command is not finite, torque then stays."""
    for k in range(command.shape[0]):
        if not math.isfinite(command[k]):
            return False
    for k in range(command.shape[0]):
        torque[k] = min(max(command[k], -effort_limit[k]), effort_limit[k])
        limited[k] = torque[k] != command[k]
    return True
