"""Worlds as arrays: the stage of the viewer, drawn by a Chromium without a window, as films are."""

from __future__ import annotations

import io

import numpy as np
from numpy.typing import NDArray
from PIL import Image

from softhand.envs.rendering import Renderer
from softhand.numerics.arrays import Array
from softhand.recording.recorded import read_scenario
from softhand.simulation.simulation import Simulation
from softhand.viewer.browser.browser import Browser
from softhand.viewer.live.live_scene import live_scene
from softhand.viewer.live.observed import observed_moment
from softhand.viewer.live.page import Page
from softhand.viewer.live.readings import readings
from softhand.viewer.live.server import DEFAULT_PORT, LOOPBACK
from softhand.viewer.live.stream import Words, describe, encode
from softhand.viewer.scene.moment import Moment, Past

SIZE = (640, 480)
"""Of a picture [px]."""


class Pictures(Renderer):
    """As arrays."""

    _stage: _Stage | None = None

    def draw(self) -> NDArray[np.uint8]:
        """Shape (height, width, 3)."""
        seen = self._mirror.look()
        moment = observed_moment(seen, self._mirror.simulation.plant)
        if self._stage is None:
            self._stage = _Stage(self._mirror.simulation, moment)
        return self._stage.picture(moment, np.where(seen.is_slipping != 0, 0.0, np.inf))

    def close(self) -> None:
        """Chromium ends."""
        if self._stage is not None:
            self._stage.close()
            self._stage = None


class _Stage(Page):
    """The picture of the live page alone, in a Chromium without a window."""

    def __init__(self, simulation: Simulation, first: Moment) -> None:
        browser = Browser()  # tells at once where there is none
        scene = live_scene(simulation.plant, first)
        words = Words.of(read_scenario(simulation.scenario))
        self._count, self._frame = 0, b""
        super().__init__(scene, describe(scene, scene.extent([first]), words, None), LOOPBACK, DEFAULT_PORT)
        self._draw(first, np.full(len(first.friction_use), np.inf))
        self._browser = browser.__enter__()
        self._page = self._browser.page(*SIZE)
        self._page.open(self.address)
        self._wait()
        self._page.evaluate(
            "for (const id of ['panel', 'curves', 'player', 'slip']) part(id).style.display = 'none';"
            "part('view').style.inset = 0; window.dispatchEvent(new Event('resize'));"
            "softhand.stage.orbit.view('3-D')"
        )

    def picture(self, moment: Moment, since_slip: Array) -> NDArray[np.uint8]:
        """Of a moment; `since_slip` is the time since each tip slipped [s]."""
        self._draw(moment, since_slip)
        self._wait()
        return np.array(Image.open(io.BytesIO(self._page.screenshot())).convert("RGB"))

    def close(self, message: str = "The environment is closed.") -> None:
        """Both ends."""
        self._browser.close()
        super().close(message)

    def _draw(self, moment: Moment, since_slip: Array) -> None:
        """The next frame, told by its number in the place of its time."""
        past = Past(np.array([moment.contact_on_object]), since_slip)
        self._frame = encode(self._scene, self._count + 1.0, self._scene.draw(moment, past), readings(moment))
        self._count += 1

    def _wait(self) -> None:
        """Until the page shows the newest frame."""
        self._page.evaluate(
            "new Promise((done) => { const look = () => Number(document.body.dataset.time) >= "
            f"{self._count} ? requestAnimationFrame(() => done(true)) : setTimeout(look, 5); look(); }})"
        )

    def _render(self) -> tuple[int, bytes]:
        return self._count, self._frame
