"""What the server behind the live page answers: the page and its parts, the scene, the stream of frames."""

from __future__ import annotations

import json
from collections.abc import Callable
from typing import Any

from tornado.web import RequestHandler
from tornado.websocket import WebSocketClosedError, WebSocketHandler

from softhand.viewer.page.assets import page_file, three_file

_FILES = {"live.html": "text/html", "live.css": "text/css", "stage.js": "text/javascript", "live.js": "text/javascript"}
_POLICY = "default-src 'self'; style-src 'self' 'unsafe-inline'; img-src 'self' data: blob:"


class Audience:
    """The pages that watch.

    Attributes:
        pages: whose streams are open.

    Args:
        asked: is called when a page asks for a frame.
        command: takes what else a page asks for.
    """

    def __init__(self, asked: Callable[[], None], command: Callable[[dict[str, Any]], None]) -> None:
        self.pages: set[Stream] = set()
        self.asked, self.command = asked, command


def routes(description: str, audience: Audience) -> list[Any]:
    """Addresses and who answers there, for an `Application` of tornado."""
    return [
        (r"/()", _File),
        (r"/(live\.css|stage\.js|live\.js)", _File),
        (r"/meshcat\.js", _Three),
        (r"/scene\.json", _Description, {"text": description}),
        (r"/stream", Stream, {"audience": audience}),
    ]


class Stream(WebSocketHandler):
    """One page. It says "next" when it can draw another frame, all else it says is a command."""

    def initialize(self, audience: Audience) -> None:
        """Called by tornado, as the others here."""
        self._audience = audience
        self._shown = -1
        self.waits = False

    def open(self, *args: str, **kwargs: str) -> None:
        """The page listens."""
        self._audience.pages.add(self)

    def on_close(self) -> None:
        """The page has gone."""
        self._audience.pages.discard(self)

    def on_message(self, message: str | bytes) -> None:
        """The page asks."""
        if message == "next":
            self.waits = True
            self._audience.asked()
        else:
            self._audience.command(json.loads(message))

    def offer(self, number: int, frame: bytes) -> None:
        """Send a frame, unless the page has it."""
        if number != self._shown:
            self._shown, self.waits = number, False
            self._write(frame, binary=True)

    def say(self, message: str) -> None:
        """Send a sentence for the page to show."""
        if message:
            self._write(json.dumps({"message": message}))

    def _write(self, message: str | bytes, binary: bool = False) -> None:
        try:
            self.write_message(message, binary)
        except WebSocketClosedError:
            self._audience.pages.discard(self)


class _File(RequestHandler):
    def get(self, name: str) -> None:
        name = name or "live.html"
        self.set_header("Content-Type", f"{_FILES[name]}; charset=utf-8")
        self.set_header("Content-Security-Policy", _POLICY)
        self.set_header("Cache-Control", "no-store")
        self.finish(page_file(name))


class _Three(RequestHandler):
    def get(self) -> None:
        self.set_header("Content-Type", "text/javascript; charset=utf-8")
        self.finish(three_file())


class _Description(RequestHandler):
    def initialize(self, text: str) -> None:
        self._text = text

    def get(self) -> None:
        self.set_header("Content-Type", "application/json; charset=utf-8")
        self.set_header("Cache-Control", "no-store")
        self.finish(self._text)
