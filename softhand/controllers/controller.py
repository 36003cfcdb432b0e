"""What a controller is: an observation in, joint torques out."""

from __future__ import annotations

from abc import ABC, abstractmethod
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import NDArray

from softhand.sensing.observation import Observation
from softhand.settings.settings import Positive, Settings

Torque: TypeAlias = NDArray[np.float64]


class Controller(Settings, ABC):
    """A control law. Its fields are its settings; what it remembers is its memory, which goes in and comes back."""

    period: Positive | None = None
    """Own sampling period [s], a whole number of control periods; each control period if not given."""

    def start(self, observation: Observation) -> Any:
        """The memory before the first call; None for a controller that remembers nothing."""
        return None

    @abstractmethod
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
