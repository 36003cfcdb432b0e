"""A page that replays a recording, which it can stop and wind."""

from __future__ import annotations

import os
import threading
import time as clock
from typing import Any

import numpy as np

from softhand.recording.recorded import scenario_of
from softhand.recording.recording import Recording
from softhand.viewer.live.pace import checked_speed
from softhand.viewer.live.page import Page
from softhand.viewer.live.readings import readings
from softhand.viewer.live.server import DEFAULT_PORT, LOOPBACK
from softhand.viewer.live.stream import Words, describe, encode
from softhand.viewer.scene.ellipsoids import Ellipsoids, ellipsoids_of
from softhand.viewer.scene.recorded import RecordedScene
from softhand.viewer.scene.samples import recorded_moment

_MOST_SAMPLES = 600  # of a curve: more than its panel has pixels
_HOLD = 0.8  # [s] that a replay rests at its end before it starts again


class Replay(Page):
    """Replays a recording on a page, which can stop and wind it.

    Args:
        recording: what is replayed; an incomplete one as far as it goes.
        speed: times real time.
        once: stop at the end instead of starting again.
        host: interface to listen on; by default this machine alone can see the page.
        port: the first to try.
        stiffness: how the object gives way, see `ellipsoids_of`; not drawn without.

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
        stiffness: tuple[Ellipsoids, ...] = (),
    ) -> None:
        self._speed, self._once = checked_speed(speed), once
        scene = self._recorded = RecordedScene(recording, stiffness=stiffness)
        self._times = scene.times
        self._lock = threading.Lock()
        self._playing, self._position, self._since = True, 0.0, clock.perf_counter()
        self._drawn = (-1, b"")
        end = "" if recording.complete else f"incomplete: {recording.reason}"
        words = Words.of(scenario_of(recording), end)
        some = np.unique(np.linspace(0, len(recording) - 1, _MOST_SAMPLES).astype(int))
        curves = self._times[some], np.array([readings(recorded_moment(recording, k)) for k in some])
        self._numbers = lambda k: readings(recorded_moment(recording, k))
        description = describe(scene, scene.bounds, words, float(self._times[-1]), self._speed, curves)
        super().__init__(scene, description, host, port)

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
                self._speed = checked_speed(float(command["speed"]))
            if "playing" in command:
                self._playing = bool(command["playing"])
                if self._playing and "time" not in command and self._position >= self._times[-1]:
                    self._position = float(self._times[0])

    def _render(self) -> tuple[int, bytes]:
        k = int(np.searchsorted(self._times, self.time + 1e-9, side="right")) - 1
        if self._drawn[0] != k:
            self._drawn = k, encode(self._scene, float(self._times[k]), self._recorded.frame(k), self._numbers(k))
        return self._drawn


def view(
    recording: Recording | str | os.PathLike[str],
    speed: float = 1.0,
    once: bool = False,
    host: str = LOOPBACK,
    port: int = DEFAULT_PORT,
    stiffness: bool = False,
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
        stiffness: whether the compliance of the held object, with locked joints, is drawn as ellipsoids.

    Raises:
        RecordingError: it cannot be read, or lacks what a picture needs.
        SofthandError: it cannot listen there, or the speed is not above 0.
    """
    if not isinstance(recording, Recording):
        recording = Recording.load(recording)
    found = ellipsoids_of(recording) if stiffness else ()
    return Replay(recording, speed, once, host, port, found)
