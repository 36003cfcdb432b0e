"""A headless Chromium, driven by its DevTools protocol.

The messages go through a pair of pipes (`--remote-debugging-pipe`): no port is opened, no websocket library is needed,
and Chromium ends by itself when the pipe closes, even where this process is killed.
"""

from __future__ import annotations

import json
import time
from collections.abc import Callable
from typing import Any

from softhand.errors import BrowserError
from softhand.viewer.browser.chromium import Chromium, find_chromium
from softhand.viewer.browser.page import Page


class Browser:
    """A Chromium of our own with an empty profile, for the length of a `with` block.

        with Browser() as browser:
            page = browser.page(900, 600)
            page.open("file:///home/me/report.html")

    Args:
        timeout: longest wait for any answer [s].

    Raises:
        BrowserError: there is no Chromium, it does not start, or it does not answer in time.
    """

    def __init__(self, timeout: float = 60.0) -> None:
        self.timeout = timeout
        self._path = find_chromium()
        self._answers: dict[int, dict[str, Any]] = {}
        self._pages: dict[str, Page] = {}
        self._count = 0
        self._received = b""

    def __enter__(self) -> Browser:
        self._chromium = Chromium(self._path)
        try:
            self.call("Browser.getVersion")
        except BaseException:
            self.close()
            raise
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def page(self, width: int = 1400, height: int = 900) -> Page:
        """A new empty page of this size [px]."""
        target = self.call("Target.createTarget", url="about:blank")["targetId"]
        session = self.call("Target.attachToTarget", targetId=target, flatten=True)["sessionId"]
        page = self._pages[session] = Page(self, target, session)
        for domain in ("Page", "Runtime", "Log", "Network"):
            page.call(f"{domain}.enable")
        page.resize(width, height)
        return page

    def call(self, method: str, session: str = "", **parameters: Any) -> dict[str, Any]:
        """Ask for one thing of the DevTools protocol; returns the answer.

        Raises:
            BrowserError: refused, or no answer in time.
        """
        self._count += 1
        number = self._count
        message = {"id": number, "method": method, "params": parameters, **({"sessionId": session} if session else {})}
        try:
            self._chromium.write(json.dumps(message).encode() + b"\0")
        except OSError as error:
            raise BrowserError(
                f"Chromium ({self._path}) ended before {method}.{self._chromium.last_words()}"
            ) from error
        self.wait(method, lambda: number in self._answers)
        answer = self._answers.pop(number)
        if "error" in answer:
            raise BrowserError(f"Chromium refused {method}: {answer['error'].get('message')}.")
        result: dict[str, Any] = answer["result"]
        return result

    def wait(self, what: str, done: Callable[[], bool]) -> None:
        """Take messages until `done()`.

        Raises:
            BrowserError: that took longer than the timeout, or Chromium ended.
        """
        end = time.monotonic() + self.timeout
        while not done():
            left = end - time.monotonic()
            block = self._chromium.read(left) if left > 0.0 else None
            if block is None:
                raise BrowserError(f"Chromium ({self._path}) gave no answer in {self.timeout:g} s to {what}.")
            if not block:
                raise BrowserError(f"Chromium ({self._path}) ended during {what}.{self._chromium.last_words()}")
            self._take(block)

    def close(self) -> None:
        """End Chromium with all its processes and remove its profile; may be called twice."""
        self._chromium.end()

    def _take(self, block: bytes) -> None:
        *messages, self._received = (self._received + block).split(b"\0")
        for message in map(json.loads, messages):
            if "id" in message:
                self._answers[message["id"]] = message
            elif message.get("sessionId") in self._pages:
                self._pages[message["sessionId"]].take(message["method"], message["params"])
