"""softhand in meshcat: a running simulation, a replay, an animation."""

from __future__ import annotations

import math
import threading
import time as clock
import webbrowser

import numpy as np
from meshcat import Visualizer

from softhand.errors import SofthandError
from softhand.recording.recording import Recording
from softhand.sensing.observation import Observation
from softhand.simulation.simulation import Simulation
from softhand.viewer.live.newest import Newest
from softhand.viewer.live.pace import checked_speed
from softhand.viewer.live.page import has_screen
from softhand.viewer.meshcat.animation import Take
from softhand.viewer.meshcat.drawing import Drawing
from softhand.viewer.meshcat.server import DEFAULT_PORT
from softhand.viewer.meshcat.target import Target
from softhand.viewer.scene.recorded import RecordedScene

_RATE = 30.0  # pictures a second: meshcat's server hands on all that it is told, however slow a page is


class MeshcatViewer:
    """Draws a grasp in meshcat, beside whatever else is there.

        vis = meshcat.Visualizer()
        with softhand.MeshcatViewer(simulation, vis) as viewer:
            simulation.run(watch=viewer.show)

    All of it lies below one path, in the base frame of the hand. The transform of that path is yours:
    `vis["softhand"].set_transform(...)` puts the hand where it is mounted. In a meshcat of softhand's own, gravity
    points down and the middle of the picture is the origin, about which the camera turns.

    Attributes:
        vis: the `meshcat.Visualizer`, for things of your own.

    Args:
        simulation: what `show` shows; not needed for recordings.
        vis: where to draw; by default in a new server, on this machine alone, that ends with the viewer.
        prefix: path, below that of `vis`, of all that is drawn; what was there is removed.
        port: of the page of a new server, the first to try.

    Raises:
        SofthandError: `vis` is no `meshcat.Visualizer`, or no server starts or answers.
    """

    def __init__(
        self,
        simulation: Simulation | None = None,
        vis: Visualizer | None = None,
        prefix: str = "softhand",
        port: int = DEFAULT_PORT,
    ) -> None:
        if simulation is not None and not isinstance(simulation, Simulation):
            raise SofthandError(
                f"MeshcatViewer takes a simulation first, as `build` gives it, not a {type(simulation).__name__}; "
                "name a Visualizer: MeshcatViewer(vis=...)."
            )
        self._newest = None if simulation is None else Newest(simulation, _RATE)
        self._target = Target(vis, prefix, port)
        self.vis = self._target.vis
        self._unread: list[str] = []
        self._fault: SofthandError | None = None
        self._fresh, self._ends = threading.Event(), False
        self._thread = threading.Thread(target=self._draw_newest, name="softhand meshcat", daemon=True)
        if self._newest:
            self._unread = self._newest.scene.unread
            self._target.aim(self._newest.bounds)
            self._fresh.set()
            self._thread.start()

    @property
    def address(self) -> str:
        """Of the page."""
        return self._target.address

    @property
    def notice(self) -> str:
        """Where the page is, and that another port was taken if the one asked for was busy."""
        return self._target.notice

    @property
    def unread(self) -> list[str]:
        """Meshes of the URDFs that cannot be read and are left out."""
        return self._unread

    def open(self) -> bool:
        """Show the page in the browser of this machine.

        Returns:
            Whether there is one.
        """
        return has_screen() and webbrowser.open(self.address)

    def show(self, observation: Observation) -> None:
        """Show what the simulation observes; never waits, and passes over what is younger than 1/30 s.

        Raises:
            SofthandError: the viewer has no simulation, or meshcat's server is gone.
        """
        if self._newest is None:
            raise SofthandError("show needs the simulation that runs: MeshcatViewer(simulation).")
        if self._fault:
            raise self._fault
        before = self._newest.count
        self._newest.show(observation)
        if self._newest.count != before:
            self._fresh.set()

    def replay(self, recording: Recording, speed: float = 1.0, once: bool = True) -> None:
        """Play a recording by the clock, each frame as recorded, and return at its end.

        Args:
            recording: an incomplete one plays as far as it goes.
            speed: times real time.
            once: or else again and again, until an interrupt.

        Raises:
            RecordingError: it lacks what a picture needs.
            SofthandError: the speed is not above 0, or meshcat's server is gone.
        """
        self._check_free(speed)
        scene = RecordedScene(recording)
        self._begin(scene)
        drawing, times = Drawing(scene, self._target.base), scene.times
        while True:
            start, shown = clock.perf_counter(), -1
            while shown < len(times) - 1:
                now = times[0] + speed * (clock.perf_counter() - start)
                k = int(np.searchsorted(times, now + 1e-9, side="right")) - 1
                if k != shown:
                    self._target.wire.send(drawing.draw(scene.frame(k)))
                    shown = k
                clock.sleep(1.0 / _RATE)
            if once:
                return

    def animate(
        self, recording: Recording, speed: float = 1.0, play: bool = True, repetitions: float = math.inf
    ) -> float:
        """Hand a recording to the page as an animation of meshcat, which plays, stops and winds there.

        meshcat has one animation at a time: this one takes the place of another. `vis.static_html()` is a page with it
        that needs no server.

        Args:
            recording: an incomplete one plays as far as it goes.
            speed: times real time.
            play: start at once; meshcat cannot wind what has not been started.
            repetitions: how often it plays.

        Returns:
            How long it takes on the page [s].

        Raises:
            RecordingError: it lacks what a picture needs.
            SofthandError: the speed is not above 0, or meshcat's server is gone.
        """
        self._check_free(speed)
        take = Take(recording, self._target.base, speed)
        self._begin(take.scene)
        self._target.wire.send(take.commands(play, repetitions))
        return take.duration

    def clear(self) -> None:
        """Remove all that softhand drew."""
        self._check_free()
        self._target.clear()

    def close(self) -> None:
        """Draw the last state and end; a server of our own ends too, and a page keeps its last picture."""
        self._ends = True
        self._fresh.set()
        if self._thread.is_alive():
            self._thread.join()
        self._target.close()

    def __enter__(self) -> MeshcatViewer:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def _repr_html_(self) -> str:
        """The page in a frame of a notebook."""
        return f'<iframe src="{self.address}" style="width: 100%; height: 560px; border: 0"></iframe>'

    def _begin(self, scene: RecordedScene) -> None:
        self._unread = scene.unread
        self._target.clear()
        self._target.aim(scene.bounds)

    def _draw_newest(self) -> None:
        """In a thread of its own: the newest moment, whenever there is one."""
        assert self._newest
        drawing, drawn = Drawing(self._newest.scene, self._target.base), -1
        try:
            while not self._ends or drawn != self._newest.count:
                self._fresh.wait()
                self._fresh.clear()
                drawn = self._newest.count
                self._target.wire.send(drawing.draw(self._newest.draw()[1]))
        except SofthandError as error:
            self._fault = error

    def _check_free(self, speed: float = 1.0) -> None:
        checked_speed(speed)
        if self._newest:
            raise SofthandError("This viewer shows a simulation; make another without one for recordings.")
