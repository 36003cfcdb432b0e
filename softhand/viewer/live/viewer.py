"""The live viewer: a page that shows a simulation while it runs, or replays a recording."""

from __future__ import annotations

import math
import os
import sys
import threading
import time as clock
import webbrowser
from dataclasses import replace
from typing import Any

import numpy as np

from softhand.errors import SofthandError
from softhand.recording.recording import Recording
from softhand.sensing.observation import Observation
from softhand.sensing.sensor import Sensor
from softhand.simulation.simulation import Simulation
from softhand.viewer.live.live_scene import live_scene
from softhand.viewer.live.server import DEFAULT_PORT, LOOPBACK, PageServer
from softhand.viewer.live.stream import describe, encode
from softhand.viewer.scene.moment import Past, observed_moment
from softhand.viewer.scene.recorded import RecordedScene
from softhand.viewer.scene.scene import Scene

FRAMES_PER_SECOND = 60.0
_LONGEST_TRAIL = 2000  # points; a longer one loses every second
_HOLD = 0.8  # [s] that a replay rests at its end before it starts again
_OPENING = 10.0  # [s] that a browser may take to show the page


class Page:
    """What a live viewer and a replay share: a page at an address.

    Use it as a context manager, or call `close`.
    """

    _server: PageServer
    _scene: Scene

    @property
    def unread(self) -> list[str]:
        """Meshes of the URDFs that cannot be read and are left out."""
        return self._scene.unread

    @property
    def address(self) -> str:
        """Of the page."""
        return self._server.address

    @property
    def notice(self) -> str:
        """Where the page is, and that another port was taken if the one asked for was busy."""
        server = self._server
        busy = f" (port {server.asked_port} is busy)" if server.port != server.asked_port else ""
        return f"viewer at {server.address}{busy}"

    def open(self) -> bool:
        """Show the page in the browser of this machine and wait until it is there, some seconds at most.

        Returns:
            Whether a browser showed it.
        """
        return _has_screen() and webbrowser.open(self.address) and self._server.opened.wait(_OPENING)

    def close(self, message: str = "The run has ended.") -> None:
        """End the page's stream; the last picture stays in the browser, with the message."""
        self._server.close(message)

    def __enter__(self) -> Any:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def _repr_html_(self) -> str:
        """The page in a frame of a notebook."""
        return f'<iframe src="{self.address}" style="width: 100%; height: 560px; border: 0"></iframe>'


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
        self._scene = live_scene(plant, first)
        self._moment, self._trail, self._due = first, [first.contact_on_object], 0.0
        self._slipped = np.full(len(first.friction_use), -np.inf)  # when each tip did so last [s]
        self._count, self._drawn = 0, (-1, b"")
        bounds = self._scene.extent([first])
        self._server = PageServer(
            describe(self._scene, bounds, "", None), self._render, lambda command: None, host, port
        )

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


class Pace:
    """Holds a simulation back to the time of the clock on the wall, times a speed."""

    def __init__(self, speed: float = 1.0) -> None:
        self._speed = _checked_speed(speed)
        self._start: float | None = None

    def wait(self, time: float) -> None:
        """Wait until the simulated time [s] is due; the first call sets the start."""
        now = clock.perf_counter()
        if self._start is None:
            self._start = now - time / self._speed
        delay = self._start + time / self._speed - now
        if delay > 0.0:
            clock.sleep(delay)


class Replay(Page):
    """Replays a recording on a page, which can stop and wind it.

    Args:
        recording: what is replayed; an incomplete one as far as it goes.
        speed: times real time.
        once: stop at the end instead of starting again.
        host: interface to listen on; by default this machine alone can see the page.
        port: the first to try.

    Raises:
        RecordingError: the recording lacks what a picture needs.
        SofthandError: it cannot listen there, or the speed is not above 0.
    """

    def __init__(
        self,
        recording: Recording,
        speed: float = 1.0,
        once: bool = False,
        host: str = LOOPBACK,
        port: int = DEFAULT_PORT,
    ) -> None:
        self._speed, self._once = _checked_speed(speed), once
        scene = self._recorded = RecordedScene(recording)
        self._scene, self._times = scene, scene.times
        self._lock = threading.Lock()
        self._playing, self._position, self._since = True, 0.0, clock.perf_counter()
        self._drawn = (-1, b"")
        end = "" if recording.complete else f"incomplete: {recording.reason}"
        description = describe(scene, scene.bounds, end, float(self._times[-1]))
        self._server = PageServer(description, self._render, self._obey, host, port)

    @property
    def ended(self) -> bool:
        """Whether a replay that plays once has reached its end."""
        return self._once and self.time >= self._times[-1]

    @property
    def time(self) -> float:
        """Recorded time that is shown [s]."""
        with self._lock:
            return self._now()

    def play(self) -> None:
        """Start from the beginning."""
        self._obey({"time": float(self._times[0]), "playing": True})

    def wait(self) -> None:
        """Return when a replay that plays once has ended; another never ends."""
        while not self.ended:
            clock.sleep(0.05)

    def _now(self) -> float:
        """Position by the clock [s]; a replay that goes on rests at its end and starts again."""
        if not self._playing:
            return self._position
        end = float(self._times[-1])
        time = self._position + self._speed * (clock.perf_counter() - self._since)
        if not self._once and time > end + _HOLD * self._speed:
            self._position, self._since = float(self._times[0]), clock.perf_counter()
            return self._position
        return min(time, end)

    def _obey(self, command: dict[str, Any]) -> None:
        """What a page asks for: {"playing": ...}, {"time": ...} or {"speed": ...}."""
        with self._lock:
            self._position, self._since = self._now(), clock.perf_counter()
            if "time" in command:
                self._position = float(np.clip(float(command["time"]), self._times[0], self._times[-1]))
            if "speed" in command:
                self._speed = _checked_speed(float(command["speed"]))
            if "playing" in command:
                self._playing = bool(command["playing"])
                if self._playing and "time" not in command and self._position >= self._times[-1]:
                    self._position = float(self._times[0])

    def _render(self) -> tuple[int, bytes]:
        k = int(np.searchsorted(self._times, self.time + 1e-9, side="right")) - 1
        if self._drawn[0] != k:
            self._drawn = k, encode(self._scene, float(self._times[k]), self._recorded.frame(k))
        return self._drawn


def view(
    recording: Recording | str | os.PathLike[str],
    speed: float = 1.0,
    once: bool = False,
    host: str = LOOPBACK,
    port: int = DEFAULT_PORT,
) -> Replay:
    """Replay a recording on a page, in the background.

    `.address` tells where, `.open()` shows it in the browser, `.close()` ends it. As the last line of a notebook's cell
    it shows itself there.

    Args:
        recording: a recording, or its file.
        speed: times real time.
        once: stop at the end instead of starting again.
        host: interface to listen on; by default this machine alone can see the page.
        port: the first to try; busy ones are passed over.

    Raises:
        RecordingError: it cannot be read, or lacks what a picture needs.
        SofthandError: it cannot listen there, or the speed is not above 0.
    """
    if not isinstance(recording, Recording):
        recording = Recording.load(recording)
    return Replay(recording, speed, once, host, port)


def _has_screen() -> bool:
    """Whether a browser would show a window; without one, Python may start a browser for the terminal."""
    return sys.platform in ("darwin", "win32") or any(os.environ.get(name) for name in ("DISPLAY", "WAYLAND_DISPLAY"))


def _checked_speed(speed: float) -> float:
    if not (math.isfinite(speed) and speed > 0.0):
        raise SofthandError(f"speed: got {speed:g}; it must be above 0, 1 is real time.", value=speed)
    return speed
