"""What pictures of a world are made of: a simulation beside it that viewers know."""

from __future__ import annotations

from abc import ABC, abstractmethod

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from softhand.assembly.build import assemble
from softhand.envs.episodes import Episodes
from softhand.sensing.observation import Observation
from softhand.sensing.sensor import Sensor
from softhand.simulation.simulation import Simulation


class Mirror:
    """The first world of some episodes as a simulation that viewers know, which is never run."""

    def __init__(self, episodes: Episodes) -> None:
        self._episodes = episodes
        self.simulation: Simulation = assemble(episodes.worlds.setups[0])
        self._sensor = Sensor(self.simulation.plant, self.simulation.reference.desired)

    def look(self) -> Observation:
        """The world as it is now; live."""
        episodes, simulation = self._episodes, self.simulation
        run, setup = episodes.worlds.runs[0], episodes.worlds.setups[0]
        if simulation.plant.world is not setup.world:
            simulation.plant.become(setup.world, setup.fingertips, setup.supports)
        for own, now in zip(simulation.state.arrays, run.mechanics.state, strict=True):
            own[...] = now
        wanted = simulation.reference.desired.coordinates
        wanted[:3] = episodes.goals[0, :3]
        wanted[3:] = Rotation.from_quat(episodes.goals[0, 3:]).as_euler("xyz")
        simulation.plant.at[0] = np.nan
        return self._sensor.observe(simulation.state, float(episodes.worlds.time()[0]))


class Renderer(ABC):
    """Draws the first world of some episodes.

    Args:
        episodes: whose.
    """

    def __init__(self, episodes: Episodes) -> None:
        self._mirror = Mirror(episodes)

    @abstractmethod
    def draw(self) -> NDArray[np.uint8] | None:
        """The world as it is now."""

    @abstractmethod
    def close(self) -> None:
        """End what was begun."""
