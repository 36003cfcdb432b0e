"""A server of pages that nobody can hold up: so many connections, so long idle, and no more."""

from __future__ import annotations

from typing import Any

from tornado.httpserver import HTTPServer
from tornado.iostream import IOStream

MOST_CONNECTIONS = 64
IDLE = 20.0  # [s] that a connection may take to say what it wants
_BODY = 1024  # bytes; nothing is asked for with one


class BoundedServer(HTTPServer):
    """An HTTP server that closes connections beyond `MOST_CONNECTIONS`, and those that are idle for `IDLE` seconds.

    Streams of frames are not among them: they are as many as there are pages.
    """

    def initialize(self, answers: Any) -> None:  # type: ignore[override]
        """Called by tornado."""
        self._count = 0
        super().initialize(answers, idle_connection_timeout=IDLE, body_timeout=IDLE, max_body_size=_BODY)

    def handle_stream(self, stream: IOStream, address: tuple[Any, ...]) -> None:
        """A new connection."""
        if self._count >= MOST_CONNECTIONS:
            stream.close()
            return
        self._count += 1
        super().handle_stream(stream, address)

    def on_close(self, server_conn: object) -> None:
        """A connection has ended, or become a stream of frames."""
        self._count -= 1
        super().on_close(server_conn)
