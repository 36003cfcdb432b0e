"""What the server behind the live page answers: the page and its parts, the scene, the stream of frames."""

from __future__ import annotations

import json
import re
from asyncio import Future
from collections.abc import Callable
from typing import Any

from tornado.web import Application, RequestHandler
from tornado.websocket import WebSocketClosedError, WebSocketHandler

from softhand.viewer.live.admission import Names, authority_of
from softhand.viewer.live.wishes import LONGEST, NEXT, read_wish
from softhand.viewer.page.assets import page_file, three_file

_STYLES, _SCRIPTS = ("chart.css", "live.css"), ("stage.js", "chart.js", "live.js")
_FILES = {"live.html": "text/html", **dict.fromkeys(_STYLES, "text/css"), **dict.fromkeys(_SCRIPTS, "text/javascript")}
_HEADERS = {
    "Content-Security-Policy": "default-src 'self'; style-src 'self' 'unsafe-inline'; img-src 'self' data: blob:; "
    "base-uri 'none'; form-action 'none'",
    "Cross-Origin-Resource-Policy": "same-origin",
    "X-Content-Type-Options": "nosniff",
    "Cache-Control": "no-store",
}
"""Of every answer, errors too."""

_MOST_PAGES = 16
_PING = 15.0  # [s] between two looks whether a page is still there


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


def application(description: str, audience: Audience, names: Names) -> Application:
    """What is at which address, for those who ask by one of the names."""
    return Application(
        [
            (r"/()", _File),
            (rf"/({'|'.join(map(re.escape, (*_STYLES, *_SCRIPTS)))})", _File),
            (r"/meshcat\.js", _Three),
            (r"/scene\.json", _Description, {"text": description}),
            (r"/stream", Stream, {"audience": audience}),
        ],
        default_handler_class=_Nothing,
        log_function=lambda handler: None,
        websocket_ping_interval=_PING,
        websocket_max_message_size=LONGEST,
        names=names,
    )


class _Answer(RequestHandler):
    """What all answers have in common: their headers, and that strangers get none."""

    def set_default_headers(self) -> None:
        for name, value in _HEADERS.items():
            self.set_header(name, value)

    def prepare(self) -> None:
        names, origin = self.settings["names"], self.request.headers.get("Origin")
        if not names.have(self.request.host) or (origin is not None and not names.have(authority_of(origin))):
            self._refuse(403, "This viewer answers on this machine, and by the name that it was given with --host.")

    def _refuse(self, status: int, why: str) -> None:
        self.set_status(status)
        self.set_header("Content-Type", "text/plain; charset=utf-8")
        self.finish(f"{why}\n")

    def write_error(self, status_code: int, **_: Any) -> None:
        self._refuse(status_code, self._reason)


class _Nothing(_Answer):
    def prepare(self) -> None:
        super().prepare()
        if not self._finished:
            self._refuse(404, "There is nothing here.")


class Stream(_Answer, WebSocketHandler):
    """One page. It says "next" when it can draw another frame, all else it says is a command."""

    def initialize(self, audience: Audience) -> None:
        """Called by tornado, as the others here."""
        self._audience = audience
        self._shown = -1
        self._sent: Future[None] | None = None
        self._wants = False

    def prepare(self) -> None:
        """Before the stream is opened."""
        super().prepare()
        if not self._finished and len(self._audience.pages) >= _MOST_PAGES:
            self._refuse(503, f"{_MOST_PAGES} pages watch already; close one.")

    @property
    def waits(self) -> bool:
        """Whether the page can draw another frame, and has taken the last one."""
        return self._wants and (self._sent is None or self._sent.done())

    def open(self, *args: str, **kwargs: str) -> None:
        """The page listens."""
        self._audience.pages.add(self)

    def on_close(self) -> None:
        """The page has gone."""
        self._audience.pages.discard(self)

    def on_message(self, message: str | bytes) -> None:
        """The page asks; what is no wish is dropped."""
        if message == NEXT:
            self._wants = True
            self._audience.asked()
        elif (wish := read_wish(message)) is not None:
            self._audience.command(wish)

    def offer(self, number: int, frame: bytes) -> None:
        """Send a frame, unless the page has it."""
        if number != self._shown:
            self._shown, self._wants = number, False
            self._write(frame, binary=True)

    def say(self, message: str) -> None:
        """Send a sentence for the page to show."""
        if message:
            self._write(json.dumps({"message": message}))

    def _write(self, message: str | bytes, binary: bool = False) -> None:
        try:
            self._sent = self.write_message(message, binary)
            self._sent.add_done_callback(lambda sent: sent.cancelled() or sent.exception())  # a page may go meanwhile
        except WebSocketClosedError:
            self._audience.pages.discard(self)


class _File(_Answer):
    def get(self, name: str) -> None:
        name = name or "live.html"
        self.set_header("Content-Type", f"{_FILES[name]}; charset=utf-8")
        self.finish(page_file(name))


class _Three(_Answer):
    def get(self) -> None:
        self.set_header("Content-Type", "text/javascript; charset=utf-8")
        self.finish(three_file())


class _Description(_Answer):
    def initialize(self, text: str) -> None:
        self._text = text

    def get(self) -> None:
        self.set_header("Content-Type", "application/json; charset=utf-8")
        self.finish(self._text)
