"""The newest moment of a simulation that runs, and the scene to draw it in."""

from __future__ import annotations

import time as clock
from dataclasses import replace

import numpy as np

from softhand.numerics.arrays import Array
from softhand.sensing.observation import Observation
from softhand.sensing.sensor import Sensor
from softhand.simulation.simulation import Simulation
from softhand.viewer.live.live_scene import live_scene
from softhand.viewer.live.observed import observed_moment
from softhand.viewer.live.readings import readings
from softhand.viewer.scene.item import Update
from softhand.viewer.scene.moment import Past

FRAMES_PER_SECOND = 60.0
_LONGEST_TRAIL = 2000  # points; a longer one loses every second


class Newest:
    """Keeps the newest state of a simulation for a thread that draws it; nobody waits for the other.

    Attributes:
        scene: to draw in.
        bounds: of what is there to see at the start.
        count: of moments that were kept.

    Args:
        simulation: what runs.
        rate: moments that are kept a second, at most; of the others slips alone are noted.
    """

    def __init__(self, simulation: Simulation, rate: float = FRAMES_PER_SECOND) -> None:
        sensor = Sensor(simulation.plant, simulation.reference.desired)
        plant = self._plant = simulation.plant
        first = observed_moment(sensor.observe(simulation.state, simulation.time), plant)
        first = replace(first, desired_pose=first.object_pose)  # nothing is asked for before the first sample
        self.scene = live_scene(plant, first)
        self.bounds = self.scene.extent([first])
        self.count = 0
        self._moment, self._trail, self._due, self._pause = first, [first.contact_on_object], 0.0, 1.0 / rate
        self._slipped = np.full(len(first.friction_use), -np.inf)  # when each tip did so last [s]

    def show(self, observation: Observation) -> None:
        """Keep this as the newest; if the last one is younger than a frame, note slips alone."""
        if observation.is_slipping.any():
            self._slipped[observation.is_slipping != 0] = observation.time
        now = clock.perf_counter()
        if now >= self._due:
            self._due = now + self._pause
            moment = observed_moment(observation, self._plant)
            if moment.time < self._moment.time:
                self._trail = []
                self._slipped = np.where(observation.is_slipping != 0, moment.time, -np.inf)
            if len(self._trail) >= _LONGEST_TRAIL:
                self._trail = self._trail[::2]
            self._trail = [*self._trail, moment.contact_on_object]  # a new list: the other thread may read the old one
            self._moment = moment
            self.count += 1

    def readings(self) -> Array:
        """Of the newest moment, see `readings`."""
        return readings(self._moment)

    def draw(self) -> tuple[float, list[Update]]:
        """Time of the newest moment [s] and one update an item of the scene."""
        moment = self._moment
        past = Past(np.array(self._trail), np.maximum(moment.time - self._slipped, 0.0))
        return moment.time, self.scene.draw(moment, past)
