"""A page that shows a simulation while it runs."""

from __future__ import annotations

from softhand.recording.recorded import read_scenario
from softhand.sensing.observation import Observation
from softhand.simulation.simulation import Simulation
from softhand.viewer.live.newest import Newest
from softhand.viewer.live.page import Page
from softhand.viewer.live.server import DEFAULT_PORT, LOOPBACK
from softhand.viewer.live.stream import Words, describe, encode


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
        newest = self._newest = Newest(simulation)
        self._drawn = (-1, b"")
        words = Words.of(read_scenario(simulation.scenario))
        super().__init__(newest.scene, describe(newest.scene, newest.bounds, words, None), host, port)

    def show(self, observation: Observation) -> None:
        """Show this; if the last picture is younger than 1/60 s, note slips alone."""
        self._newest.show(observation)

    def _render(self) -> tuple[int, bytes]:
        count = self._newest.count
        if self._drawn[0] != count:
            self._drawn = count, encode(self._scene, *self._newest.draw(), self._newest.readings())
        return self._drawn
