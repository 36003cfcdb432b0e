"""What a live viewer and a replay share: a page at an address."""

from __future__ import annotations

import os
import sys
import webbrowser
from abc import ABC, abstractmethod
from typing import Any

from softhand.viewer.live.server import PageServer
from softhand.viewer.scene.scene import Scene

_OPENING = 10.0  # [s] that a browser may take to show the page


class Page(ABC):
    """A scene that is shown at an address, drawn when a page asks for it.

    Use it as a context manager, or call `close`.

    Args:
        scene: what is shown.
        description: of it, see `stream.describe`.
        host: interface to listen on.
        port: the first to try; busy ones are passed over.

    Raises:
        SofthandError: it cannot listen there.
    """

    def __init__(self, scene: Scene, description: dict[str, Any], host: str, port: int) -> None:
        self._scene = scene
        self._server = PageServer(description, self._render, self._obey, host, port)

    @abstractmethod
    def _render(self) -> tuple[int, bytes]:
        """The newest frame and its number; called in the server's thread."""

    def _obey(self, command: dict[str, Any]) -> None:  # noqa: B027  a page may ask in vain
        """Do what a page asks for; called in the server's thread."""

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
        return has_screen() and webbrowser.open(self.address) and self._server.opened.wait(_OPENING)

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


def has_screen() -> bool:
    """Whether a browser would show a window; without one, Python may start a browser for the terminal."""
    return sys.platform in ("darwin", "win32") or any(os.environ.get(name) for name in ("DISPLAY", "WAYLAND_DISPLAY"))
