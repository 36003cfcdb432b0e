"""softhand in meshcat: a running simulation, a replay, an animation."""

from __future__ import annotations

import contextlib
import io
import math
import threading
import time as clock
import webbrowser
from collections.abc import Iterable

import numpy as np
from meshcat import Visualizer
from meshcat.path import Path

from softhand.errors import SofthandError
from softhand.numerics.arrays import Array
from softhand.recording.recording import Recording
from softhand.sensing.observation import Observation
from softhand.simulation.simulation import Simulation
from softhand.viewer.live.newest import Newest
from softhand.viewer.live.pace import checked_speed
from softhand.viewer.meshcat.animation import Take
from softhand.viewer.meshcat.drawing import Drawing
from softhand.viewer.meshcat.objects import place, remove, tell
from softhand.viewer.meshcat.server import DEFAULT_PORT, MeshcatServer
from softhand.viewer.meshcat.wire import Command, Wire
from softhand.viewer.scene.camera import Bounds
from softhand.viewer.scene.poses import pose
from softhand.viewer.scene.recorded import RecordedScene
from softhand.viewer.scene.scene import Scene

_RATE = 30.0  # pictures a second: meshcat's server hands on all that it is told, however slow a page is
_CAMERA = Path(("Cameras", "default"))
_DISTANCE = 1.5  # of the camera from the middle of what it fits, in radii of that


class MeshcatViewer:
    """Draws a grasp in meshcat, beside whatever else is there.

        vis = meshcat.Visualizer()
        with softhand.MeshcatViewer(simulation, vis) as viewer:
            simulation.run(watch=viewer.show)

    All of it lies below one path; its transform is yours: `vis["softhand"].set_transform(...)` puts the hand where it is
    mounted. In a meshcat of softhand's own the camera looks at the grasp, and gravity points down.

    Attributes:
        vis: the `meshcat.Visualizer`, for things of your own.

    Args:
        simulation: what `show` shows; not needed for recordings.
        vis: where to draw; by default in a new server, on this machine alone, that ends with the viewer.
        prefix: path, below that of `vis`, of all that is drawn.
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
        _check(simulation, vis, prefix)
        self._server = MeshcatServer(port) if vis is None else None
        self.vis = _visualizer(self._server.zmq_url) if self._server else vis
        self.asked_port = port
        self._wire = Wire(self.vis.window.zmq_url)
        self._base = self.vis.path.append(prefix)
        self._newest = None if simulation is None else Newest(simulation, _RATE)
        self._unread: list[str] = []
        self._fault: SofthandError | None = None
        self._fresh, self._ends, self._thread = threading.Event(), False, None
        self.clear()
        if self._newest:
            self._look(self._newest.scene, self._newest.bounds)
            self._fresh.set()
            self._thread = threading.Thread(target=self._draw_newest, name="softhand meshcat", daemon=True)
            self._thread.start()

    @property
    def address(self) -> str:
        """Of the page."""
        return str(self.vis.window.web_url)

    @property
    def notice(self) -> str:
        """Where the page is."""
        return f"meshcat at {self.address}"

    @property
    def unread(self) -> list[str]:
        """Meshes of the URDFs that cannot be read and are left out."""
        return self._unread

    def open(self) -> bool:
        """Show the page in the browser of this machine.

        Returns:
            Whether a browser was found.
        """
        return webbrowser.open(self.address)

    def show(self, observation: Observation) -> None:
        """Show what a simulation observes; never waits, and passes over what is younger than 1/30 s.

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
        """Play a recording, frame by frame by the clock, and return at its end; each frame is as recorded.

        Args:
            recording: an incomplete one plays as far as it goes.
            speed: times real time.
            once: or else again and again, until an interrupt.

        Raises:
            RecordingError: it lacks what a picture needs.
            SofthandError: the speed is not above 0, or meshcat's server is gone.
        """
        checked_speed(speed)
        self._must_be_free()
        scene = RecordedScene(recording)
        self.clear()
        self._look(scene, scene.bounds)
        drawing, times = Drawing(scene, self._base), scene.times
        while True:
            start, shown = clock.perf_counter(), -1
            while shown < len(times) - 1:
                now = times[0] + speed * (clock.perf_counter() - start)
                k = int(np.searchsorted(times, now + 1e-9, side="right")) - 1
                if k != shown:
                    self._wire.send(drawing.draw(scene.frame(k)))
                    shown = k
                clock.sleep(1.0 / _RATE)
            if once:
                return

    def animate(self, recording: Recording, speed: float = 1.0, play: bool = True, repetitions: float = math.inf) -> float:
        """Hand a recording to the page as an animation of meshcat, which plays, stops and winds there.

        meshcat has one animation at a time: this one takes the place of another. `vis.static_html()` makes a file of it.

        Args:
            recording: an incomplete one plays as far as it goes.
            speed: times real time.
            play: start at once.
            repetitions: how often it plays.

        Returns:
            How long it takes on the page [s].

        Raises:
            RecordingError: it lacks what a picture needs.
            SofthandError: the speed is not above 0, or meshcat's server is gone.
        """
        checked_speed(speed)
        self._must_be_free()
        take = Take(recording, self._base, speed)
        self.clear()
        self._unread = take.unread
        self._aim(take.bounds)
        self._wire.send(take.commands(play, repetitions))
        return take.duration

    def clear(self) -> None:
        """Remove all that softhand drew."""
        self._wire.send([remove(self._base)])

    def close(self) -> None:
        """Draw the last state and end; a server of our own ends too, and a page keeps its last picture."""
        if self._thread:
            self._ends = True
            self._fresh.set()
            self._thread.join()
            self._thread = None
        self._wire.close()
        if self._server:
            self.vis.window.zmq_socket.close(linger=0)
            self._server.close()

    def __enter__(self) -> MeshcatViewer:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def _repr_html_(self) -> str:
        """The page in a frame of a notebook."""
        return f'<iframe src="{self.address}" style="width: 100%; height: 560px; border: 0"></iframe>'

    def _draw_newest(self) -> None:
        """In a thread of its own: the newest moment, whenever there is one."""
        assert self._newest
        drawing, drawn = Drawing(self._newest.scene, self._base), -1
        try:
            while not self._ends or drawn != self._newest.count:
                self._fresh.wait()
                self._fresh.clear()
                drawn = self._newest.count
                self._wire.send(drawing.draw(self._newest.draw()[1]))
        except SofthandError as error:
            self._fault = error

    def _must_be_free(self) -> None:
        if self._newest:
            raise SofthandError("This viewer shows a simulation; make another without one for recordings.")

    def _look(self, scene: Scene, bounds: Bounds) -> None:
        self._unread = scene.unread
        self._aim(bounds)

    def _aim(self, bounds: Bounds) -> None:
        """In a meshcat of our own: gravity down, the camera at the grasp."""
        if self._server:
            self._wire.send(_views(self._base, bounds))


def _views(base: Path, bounds: Bounds) -> Iterable[Command]:
    """meshcat turns its camera about a point, in axes whose second is up."""
    yield place(base, pose(bounds.upright))
    yield place(_CAMERA, pose(np.eye(3), bounds.upright @ bounds.whole.centre))
    away: Array = np.array([math.cos(bounds.azimuth), math.sin(bounds.azimuth), 0.5])
    x, y, z = _DISTANCE * bounds.whole.radius * away / np.linalg.norm(away)
    yield tell(_CAMERA.append("rotated").append("<object>"), "position", [x, z, -y])


def _visualizer(zmq_url: str) -> Visualizer:
    with contextlib.redirect_stdout(io.StringIO()):  # it prints where it is; so do we, if asked
        return Visualizer(zmq_url)


def _check(simulation: object, vis: object, prefix: str) -> None:
    if not isinstance(simulation, Simulation | None):
        raise SofthandError(
            f"MeshcatViewer takes a simulation first, as `build` gives it, not a {type(simulation).__name__}; "
            "name the other: MeshcatViewer(vis=...)."
        )
    if not isinstance(vis, Visualizer | None):
        raise SofthandError(f"vis: a {type(vis).__name__} is no meshcat.Visualizer.", value=vis)
    if not prefix.strip("/") or prefix.startswith("/"):
        raise SofthandError(f"prefix: {prefix!r} is no path below that of vis; take one such as 'softhand'.", value=prefix)
