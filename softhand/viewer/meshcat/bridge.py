"""The process behind a meshcat of our own: meshcat's server, but for this machine alone, and not longer than its owner.

Started by itself, meshcat's server listens on every interface and may outlive the program that started it.
"""

from __future__ import annotations

import os
import sys
import threading
from socket import socket
from typing import Any

from meshcat.servers.zmqserver import ZMQWebSocketBridge
from tornado.httpserver import HTTPServer
from tornado.netutil import bind_sockets
from tornado.web import Application

LOOPBACK = "127.0.0.1"
_TRIES = 100


class LocalBridge(ZMQWebSocketBridge):
    """meshcat's server on sockets that are there already."""

    def __init__(self, sockets: list[socket]) -> None:
        self._sockets = sockets
        super().__init__(host=LOOPBACK, port=sockets[0].getsockname()[1])

    def make_app(self) -> Application:
        """Its pages; told to listen, they do so on our sockets."""
        app = super().make_app()
        app.listen = lambda port, **options: HTTPServer(app, **options).add_sockets(self._sockets)
        return app


def sockets_from(port: int) -> list[socket]:
    """Sockets at the first free port of this machine."""
    for candidate in range(port, min(port + _TRIES, 65536)):
        try:
            return bind_sockets(candidate, LOOPBACK)
        except OSError as error:
            last = error
    raise last


def main(arguments: list[str]) -> None:
    """Say both addresses on the output, or why not, and serve until the input ends."""
    try:
        bridge: Any = LocalBridge(sockets_from(int(arguments[0])))
    except Exception as error:
        print(f"error={error}", flush=True)
        return
    print(f"zmq_url={bridge.zmq_url}\nweb_url={bridge.web_url}", flush=True)
    os.dup2(os.open(os.devnull, os.O_WRONLY), 1)  # nobody reads it any longer
    threading.Thread(target=_end_with_input, daemon=True).start()
    bridge.run()


def _end_with_input() -> None:
    """The owner holds the other end, and where it ends in any way, so does this process."""
    sys.stdin.buffer.read()
    os._exit(0)


if __name__ == "__main__":
    main(sys.argv[1:])
