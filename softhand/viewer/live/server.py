"""The server behind the live page: it listens where it is told, on this machine alone unless told otherwise.

It serves one page, the 3-D library that meshcat brings, and a stream of frames. A page asks for each frame when it has
drawn the last: a slow one gets fewer, and nobody waits for it.
"""

from __future__ import annotations

import asyncio
import errno
import json
import socket
import threading
from collections.abc import Callable
from typing import Any

from tornado.ioloop import PeriodicCallback
from tornado.netutil import bind_sockets

from softhand.errors import SofthandError
from softhand.viewer.live.admission import EVERYWHERE, Names
from softhand.viewer.live.bounded import BoundedServer
from softhand.viewer.live.handlers import Audience, application

LOOPBACK = "127.0.0.1"
DEFAULT_PORT = 7000
_TRIES = 100
_LAST = 3.0  # [s] that pages have to take the last frame
_TICK = 15  # [ms] between two looks for a new frame

Render = Callable[[], tuple[int, bytes]]
Command = Callable[[dict[str, Any]], None]


class PageServer:
    """Serves one scene from a thread of its own, until `close`.

    Attributes:
        opened: set once a page has asked for a frame.
        port: that it listens on.
        asked_port: that was asked for; `port` is another if this one was busy.
        address: of the page.

    Args:
        description: what `stream.describe` says.
        render: gives a number that is another for each frame, and the newest frame as bytes; called in the server's
            thread, only if a page waits.
        command: takes what a page asks for, in the server's thread.
        host: name or address of the interface to listen on.
        port: the first to try; busy ones are passed over.

    Raises:
        SofthandError: it cannot listen there.
    """

    def __init__(
        self,
        description: dict[str, Any],
        render: Render,
        command: Command,
        host: str = LOOPBACK,
        port: int = DEFAULT_PORT,
    ) -> None:
        self._description = json.dumps(description)
        self._render = render
        self.opened = threading.Event()
        self._audience = Audience(self._asked, command)
        self.asked_port = port
        sockets = _listen(host, port)
        self._names = Names.of(host)
        self.port = sockets[0].getsockname()[1]
        self.address = f"http://{_shown(host)}:{self.port}/"
        self._loop = asyncio.new_event_loop()
        self._ended = False
        self._thread = threading.Thread(target=self._serve, args=(sockets,), name="softhand viewer", daemon=True)
        self._thread.start()

    def close(self, message: str = "") -> None:
        """Send the last frame and a message to the pages, and stop listening."""
        if not self._ended:
            self._ended = True
            asyncio.run_coroutine_threadsafe(self._finish(message), self._loop).result(2.0 * _LAST)
            self._loop.call_soon_threadsafe(self._loop.stop)
            self._thread.join(5.0)

    def _serve(self, sockets: list[socket.socket]) -> None:
        asyncio.set_event_loop(self._loop)
        self._http = BoundedServer(application(self._description, self._audience, self._names))

        async def start() -> None:
            self._http.add_sockets(sockets)
            PeriodicCallback(self._send, _TICK).start()

        self._loop.run_until_complete(start())
        self._loop.run_forever()
        self._loop.close()

    def _asked(self) -> None:
        """A page asks for a frame."""
        self.opened.set()
        self._send()

    def _send(self) -> None:
        """The newest frame to every page that waits for one."""
        waiting = [page for page in self._audience.pages if page.waits]
        if waiting:
            newest = self._render()
            for page in waiting:
                page.offer(*newest)

    async def _finish(self, message: str) -> None:
        """The last frame and a message to all pages, then the end."""
        pages = self._audience.pages
        newest = self._render() if pages else None
        for page in list(pages):
            if newest is not None:
                page.offer(*newest)
            page.say(message)
            page.close()
        end = self._loop.time() + _LAST
        while pages and self._loop.time() < end:  # each page answers when it has got all
            await asyncio.sleep(0.01)
        self._http.stop()
        await self._http.close_all_connections()


def _listen(host: str, port: int) -> list[socket.socket]:
    last = min(port + _TRIES, 65536)
    for candidate in range(port, last):
        try:
            return bind_sockets(candidate, host)
        except OSError as error:
            if not isinstance(error, socket.gaierror) and error.errno == errno.EADDRINUSE:
                continue
            raise SofthandError(
                f"The viewer cannot listen on {host} port {candidate}: {error.strerror or error}; "
                f"give another --host or --port, or leave --host out for {LOOPBACK}.",
                value=host,
            ) from error
    raise SofthandError(f"All ports from {port} to {last - 1} on {host} are busy; give another --port.", value=port)


def _shown(host: str) -> str:
    """The host as a browser is told: the name of this machine where it listens on every interface."""
    if host in EVERYWHERE:
        return socket.gethostname()
    return f"[{host}]" if ":" in host else host
