"""Worlds in meshcat, for people."""

from __future__ import annotations

from softhand.envs.rendering import Renderer
from softhand.viewer.meshcat.viewer import MeshcatViewer


class Shown(Renderer):
    """In meshcat."""

    _viewer: MeshcatViewer | None = None

    def draw(self) -> None:
        """The page is opened at the first time, where there is a screen."""
        seen = self._mirror.look()
        if self._viewer is None:
            self._viewer = MeshcatViewer(self._mirror.simulation)
            if not self._viewer.open():
                print(self._viewer.notice)
        self._viewer.show(seen)

    def close(self) -> None:
        """The page keeps its last picture."""
        if self._viewer is not None:
            self._viewer.close()
            self._viewer = None
