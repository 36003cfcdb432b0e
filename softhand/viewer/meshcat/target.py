"""Where to draw in meshcat: below a path of a Visualizer, given or new."""

from __future__ import annotations

import contextlib
import io
import math
from typing import Any
from urllib.parse import urlsplit

import numpy as np
from meshcat import Visualizer
from meshcat.path import Path

from softhand.errors import SofthandError
from softhand.viewer.meshcat.objects import ANIMATION, place, remove, tell
from softhand.viewer.meshcat.server import MeshcatServer
from softhand.viewer.meshcat.wire import Wire
from softhand.viewer.scene.camera import Bounds
from softhand.viewer.scene.item import LAYERS
from softhand.viewer.scene.poses import pose

_CAMERA = Path(("Cameras", "default", "rotated", "<object>"))
_DISTANCE = 1.5  # of the camera from the middle of what it fits, in radii of that


class Target:
    """A path of meshcat, which is empty at first, and a connection of its own to the server.

    Attributes:
        vis: the `meshcat.Visualizer`.
        base: the path.
        wire: the connection; of one thread at a time.

    Args:
        vis: None starts a server of our own, on this machine alone.
        prefix: path below that of `vis`.
        port: of the page of our own server, the first to try.

    Raises:
        SofthandError: `vis` is no `meshcat.Visualizer`, or no server starts or answers.
    """

    def __init__(self, vis: Visualizer | None, prefix: str, port: int) -> None:
        if vis is not None and not isinstance(vis, Visualizer):
            raise SofthandError(f"vis: a {type(vis).__name__} is no meshcat.Visualizer.", value=vis)
        if not prefix.strip("/") or prefix.startswith("/"):
            raise SofthandError(f"prefix: {prefix!r} is no path below vis; take one such as 'softhand'.", value=prefix)
        self._port = port
        self._server = MeshcatServer(port) if vis is None else None
        self.vis: Any = vis or _visualizer(self._server.zmq_url if self._server else "")
        self.base = self.vis.path.append(prefix)
        self.wire = Wire(self.vis.window.zmq_url)
        self.clear()

    @property
    def address(self) -> str:
        """Of the page."""
        return str(self.vis.window.web_url)

    @property
    def notice(self) -> str:
        """Where the page is, and that another port was taken if the one asked for was busy."""
        is_other = self._server and urlsplit(self.address).port != self._port
        return f"meshcat at {self.address}" + (f" (port {self._port} is busy)" if is_other else "")

    def clear(self) -> None:
        """Remove all that is drawn; the path itself stays, with the transform that its user gave it."""
        self.wire.send([remove(self.base.append(name)) for name in (*LAYERS, ANIMATION)])

    def aim(self, bounds: Bounds) -> None:
        """In a meshcat of our own: gravity down, the hand around the origin, the camera near.

        meshcat's camera turns about the origin, in axes whose second is up.
        """
        if self._server:
            away = np.array([math.cos(bounds.azimuth), math.sin(bounds.azimuth), 0.4])
            x, y, z = (_DISTANCE * bounds.whole.radius * away / np.linalg.norm(away)).tolist()
            upright = place(self.base, pose(bounds.upright, -bounds.upright @ bounds.whole.centre))
            self.wire.send([upright, tell(_CAMERA, "position", [x, z, -y])])

    def close(self) -> None:
        """Give the connection up, and end a server of our own; may be called twice."""
        self.wire.close()
        if self._server:
            self.vis.window.zmq_socket.close(linger=0)
            self._server.close()


def _visualizer(zmq_url: str) -> Visualizer:
    with contextlib.redirect_stdout(io.StringIO()):  # it prints where it is; so do we, if asked
        return Visualizer(zmq_url)
