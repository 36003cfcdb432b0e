"""A page that shows a simulation while it runs."""

from __future__ import annotations

import time as clock
from dataclasses import replace

import numpy as np

from softhand.sensing.observation import Observation
from softhand.sensing.sensor import Sensor
from softhand.simulation.simulation import Simulation
from softhand.viewer.live.live_scene import live_scene
from softhand.viewer.live.observed import observed_moment
from softhand.viewer.live.page import Page
from softhand.viewer.live.server import DEFAULT_PORT, LOOPBACK
from softhand.viewer.live.stream import describe, encode
from softhand.viewer.scene.moment import Past

FRAMES_PER_SECOND = 60.0
_LONGEST_TRAIL = 2000  # points; a longer one loses every second


class Viewer(Page):
    """Shows a simulation while it runs, from a loop of your own.

        with softhand.Viewer(simulation) as viewer:
            viewer.open()
            while simulation.time < 2.0:
                viewer.show(simulation.sample())
                simulation.step()

    `show` never waits: it keeps the newest state, a thread draws it when a page has drawn the one before.

    Args:
        simulation: what runs.
        host: interface to listen on; by default this machine alone can see the page.
        port: the first to try; busy ones are passed over.

    Raises:
        SofthandError: it cannot listen there.
    """

    def __init__(self, simulation: Simulation, host: str = LOOPBACK, port: int = DEFAULT_PORT) -> None:
        sensor = Sensor(simulation.plant, simulation.reference.desired)
        plant = self._plant = simulation.plant
        first = observed_moment(sensor.observe(simulation.state, simulation.time), plant)
        first = replace(first, desired_pose=first.object_pose)  # nothing is asked for before the first sample
        scene = live_scene(plant, first)
        self._moment, self._trail, self._due = first, [first.contact_on_object], 0.0
        self._slipped = np.full(len(first.friction_use), -np.inf)  # when each tip did so last [s]
        self._count, self._drawn = 0, (-1, b"")
        super().__init__(scene, describe(scene, scene.extent([first]), "", None), host, port)

    def show(self, observation: Observation) -> None:
        """Show this; if the last picture is younger than 1/60 s, note slips alone."""
        if observation.is_slipping.any():
            self._slipped[observation.is_slipping != 0] = observation.time
        now = clock.perf_counter()
        if now >= self._due:
            self._due = now + 1.0 / FRAMES_PER_SECOND
            moment = observed_moment(observation, self._plant)
            if moment.time < self._moment.time:
                self._trail = []
                self._slipped = np.where(observation.is_slipping != 0, moment.time, -np.inf)
            if len(self._trail) >= _LONGEST_TRAIL:
                self._trail = self._trail[::2]
            self._trail = [*self._trail, moment.contact_on_object]  # a new list: the other thread may read the old one
            self._moment = moment
            self._count += 1

    def _render(self) -> tuple[int, bytes]:
        count = self._count
        if self._drawn[0] != count:
            moment = self._moment
            past = Past(np.array(self._trail), np.maximum(moment.time - self._slipped, 0.0))
            self._drawn = count, encode(self._scene, moment.time, self._scene.draw(moment, past))
        return self._drawn
