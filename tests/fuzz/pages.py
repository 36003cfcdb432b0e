"""Requests to the live page: bytes, addresses, messages of strangers. It answers the next honest one all the same."""

from __future__ import annotations

import base64
import json
import logging
import random
import socket
from functools import cache
from pathlib import Path
from typing import Any

from fuzz.code import short_run
from fuzz.mutation import NUMBERS, WORDS, mutated_bytes
from fuzz.watch import Fault
from softhand.viewer.live.replay import Replay

_HELLO = b"GET / HTTP/1.1\r\nHost: 127.0.0.1\r\nConnection: close\r\n\r\n"
_WAIT = 5.0  # [s]


class _Log(logging.Handler):
    """What the server complains of: a traceback is a fault of it, a warning is not."""

    def __init__(self) -> None:
        super().__init__(logging.ERROR)
        self.lines: list[str] = []

    def emit(self, record: logging.LogRecord) -> None:
        self.lines.append(self.format(record))


@cache
def _server() -> tuple[Replay, _Log]:
    log = _Log()
    for name in ("tornado.application", "tornado.general", "asyncio"):
        logging.getLogger(name).addHandler(log)
        logging.getLogger(name).propagate = False
    return Replay(short_run()), log


def try_page(rng: random.Random, folder: Path) -> str:
    """One connection to the server of a replay."""
    server, log = _server()
    log.lines.clear()
    port = int(server.address.rsplit(":", 1)[1].strip("/"))
    with socket.create_connection(("127.0.0.1", port), _WAIT) as stranger:
        stranger.settimeout(_WAIT)
        _attempt(rng, stranger, port)
    with socket.create_connection(("127.0.0.1", port), _WAIT) as honest:
        honest.settimeout(_WAIT)
        honest.sendall(_HELLO.replace(b"127.0.0.1", f"127.0.0.1:{port}".encode()))
        answer = honest.recv(64)
    if b"200 OK" not in answer:
        raise Fault(f"an honest request is answered by {answer!r}")
    if log.lines:
        raise Fault(f"the server says {log.lines[0][-1500:]}")
    return "taken"


def _attempt(rng: random.Random, stranger: socket.socket, port: int) -> None:
    """A request that may be cut short, or a stream with messages."""
    try:
        if rng.random() < 0.5:
            stranger.sendall(_request(rng, port))
            if rng.random() < 0.8:
                stranger.recv(4096)
            return
        key = base64.b64encode(bytes(16)).decode()
        stranger.sendall(
            f"GET /stream HTTP/1.1\r\nHost: 127.0.0.1:{port}\r\nOrigin: http://127.0.0.1:{port}\r\n"
            f"Upgrade: websocket\r\nConnection: Upgrade\r\nSec-WebSocket-Key: {key}\r\n"
            "Sec-WebSocket-Version: 13\r\n\r\n".encode()
        )
        stranger.recv(4096)
        for _ in range(rng.randint(1, 5)):
            stranger.sendall(_frame(rng, _message(rng)))
        stranger.sendall(_frame(rng, b"", 8))
        stranger.recv(4096)
    except OSError:  # the server may hang up
        return


def _request(rng: random.Random, port: int) -> bytes:
    path = rng.choice(["/", "/live.js", "/../../etc/passwd", "/%2e%2e/x", "/scene.json", "/stream", "/\0",
                       "/?" + "a" * 70000])  # fmt: skip
    method = rng.choice(["GET"] * 5 + ["POST", "HEAD", "PUT", "X" * 3000, ""])
    host = rng.choice([f"127.0.0.1:{port}", "evil.example", "", "[::1", "a" * 5000, "127.0.0.1:99999999"])
    more = rng.choice(["", "Content-Length: 5\r\n\r\nabc", "Content-Length: -1\r\n",
                       "Transfer-Encoding: chunked\r\n\r\nzz\r\n"])  # fmt: skip
    whole = f"{method} {path} HTTP/1.1\r\nHost: {host}\r\n{more}\r\n\r\n".encode()
    return mutated_bytes(rng, whole) if rng.random() < 0.4 else whole


def _message(rng: random.Random) -> bytes:
    values: list[Any] = [True, None, [], {}, "x", 1e308, -1, 0, 10**400, *WORDS[:6]]
    key = rng.choice(["time", "speed", "playing", "unknown", "view"])
    plain = json.dumps({key: rng.choice(values)})
    chosen = rng.choice(["next", plain, f'{{"{key}": {rng.choice(NUMBERS)}}}', f'{{"{key}": NaN}}',
                         f'{{"{key}": -Infinity}}', "[" * 50000, "", "{", "[1]", "5", "null", '"next"',
                         '{"time": "1"}', "x" * 100000])  # fmt: skip
    return mutated_bytes(rng, chosen.encode()) if chosen and rng.random() < 0.2 else chosen.encode()


def _frame(rng: random.Random, payload: bytes, code: int | None = None) -> bytes:
    """A frame of a websocket, masked with zeros, at times with a wrong head."""
    code = rng.choice([1] * 8 + [2, 9, 0, 3, 15]) if code is None else code
    size = len(payload)
    length = bytes([0x80 | size]) if size < 126 else b"\xfe" + size.to_bytes(2, "big") if size < 65536 else (
        b"\xff" + size.to_bytes(8, "big"))  # fmt: skip
    frame = bytes([0x80 | code]) + length + bytes(4) + payload
    return mutated_bytes(rng, frame) if rng.random() < 0.1 else frame
