"""A connection to a meshcat server: many commands at once, and an error where nobody answers.

meshcat's own connection waits for an answer to each command, for ever, and belongs to one thread.
"""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

import umsgpack
import zmq

from softhand.errors import SofthandError

Command = dict[str, Any]
_PATIENCE = 20.0  # [s]
_AT_ONCE = 100  # commands that are on their way before answers are taken


class Wire:
    """Sends commands to a meshcat server, from one thread.

    Args:
        zmq_url: of the server.
    """

    def __init__(self, zmq_url: str) -> None:
        self._url = zmq_url
        self._context = zmq.Context()
        socket = self._socket = self._context.socket(zmq.DEALER)
        socket.setsockopt(zmq.LINGER, 0)  # what is not sent when it closes is dropped
        socket.setsockopt(zmq.RCVTIMEO, round(1000 * _PATIENCE))
        socket.setsockopt(zmq.SNDTIMEO, round(1000 * _PATIENCE))
        socket.connect(zmq_url)

    def send(self, commands: Iterable[Command]) -> None:
        """Send all in their order and wait until the server has them.

        Raises:
            SofthandError: it does not answer, or refuses one.
        """
        waiting = 0
        try:
            for command in commands:
                frames = command["type"].encode(), command["path"].encode(), umsgpack.packb(command)
                self._socket.send_multipart([b"", *frames])
                waiting += 1
                if waiting >= _AT_ONCE:
                    self._take()
                    waiting -= 1
            for _ in range(waiting):
                self._take()
        except zmq.ZMQError as error:
            raise SofthandError(f"meshcat's server at {self._url} does not answer: {error}; is it running?") from error

    def close(self) -> None:
        """Give the connection up; may be called twice."""
        self._context.destroy(linger=0)

    def _take(self) -> None:
        answer = self._socket.recv_multipart()[-1]
        if answer != b"ok":
            raise SofthandError(f"meshcat's server at {self._url} refused a command: {answer.decode()}")
