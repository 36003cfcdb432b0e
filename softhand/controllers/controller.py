"""What a controller is: an observation in, joint torques out."""

from __future__ import annotations

from abc import ABC
from collections.abc import Callable
from typing import Any, ClassVar, Literal, TypeAlias

import numpy as np
from numpy.typing import NDArray

from softhand.controllers.formula import Law, law_of, settings_of
from softhand.sensing.observation import Observation
from softhand.settings.settings import Positive, Settings

Torque: TypeAlias = NDArray[np.float64]


class Controller(Settings, ABC):
    """A control law. Its fields are its settings; what it remembers is its memory, which goes in and comes back.

    A law of one's own has `torque`, in plain Python:

        class Damped(Controller):
            K: float = 0.02

            def torque(self, observation, memory):
                return observation.gravity_torque - self.K * observation.joint_velocity, memory

    or, to be run by the thousand in compiled loops as well, a static method `formula` in its place, in the part of
    Python that numba compiles:

        class Damped(Controller):
            K: float = 0.02

            @staticmethod
            def formula(observed, settings, memory, torque):
                for j in range(torque.shape[0]):
                    torque[j] = observed.gravity_torque[j] - settings.K * observed.joint_velocity[j]
    """

    period: Positive | None = None
    """Own sampling period [s], a whole number of control periods; each control period if not given."""

    formula: ClassVar[Callable[..., None] | None] = None
    """formula(observed, settings, memory, torque) sets `torque`, which is zero before, and may change `memory`, one
    array of numbers, in place. `observed` has the fields of an observation by their names, the time as
    `observed.clock[0]`; `settings` is what `constants` returns. `controllers.blocks` has parts to build one from."""

    @property
    def commands(self) -> Literal["torque", "position", "velocity"]:
        """What `torque` returns: torques, or set points of the joints, which a servo of that kind takes."""
        return "torque"

    def check_period(self, period: float) -> None:
        """Refuse a period between two samples [s] that the settings are not for; by default any will do.

        Raises:
            ScenarioError: of one that does not fit.
        """

    def constants(self, observation: Observation) -> Any:
        """What a formula is handed as `settings`: a NamedTuple of numbers and arrays, the same during a run.

        By default the fields of the controller that are numbers, or lists of numbers as arrays.

        Args:
            observation: for what is the same at all times: the count of joints, mass of the object, tips.
        """
        return settings_of(self)

    def start(self, observation: Observation) -> Any:
        """The memory before the first call; None for a controller that remembers nothing.

        Of a law with a `formula` it is an array of numbers, of no length if it remembers nothing.
        """
        return None if self.formula is None else np.zeros(0)

    def torque(self, observation: Observation, memory: Any) -> tuple[Torque, Any]:
        """One sample of the control law.

        Args:
            observation: the grasp now; all that the torque may depend on, beside the memory.
            memory: what `start` or the previous call returned. It is kept for a state that is saved: return another
                one, do not change this.

        Returns:
            Joint torques [N m], shape (n,), and the memory for the next call. The effort limits of the URDF are applied
            to the torques afterwards.
        """
        law = law_of(self, observation, memory)
        torque, memory = law(memory)
        if torque[0] != torque[0] and (error := self.complaint(observation, law)):
            raise error
        return torque, memory

    def complaint(self, observation: Observation, law: Law) -> Exception | None:
        """Why a formula answered with NaN; None for no more than that it did.

        Args:
            observation: to which it did.
            law: with the memory after the call.
        """
        return law.raised()

    def compiled(self, observation: Observation) -> Law | None:
        """The law as compiled code at its start; None for a law in plain Python.

        Args:
            observation: of the start.
        """
        is_python = self.formula is None or type(self).torque is not Controller.torque
        return None if is_python else Law(self, observation, self.start(observation))
