"""One page of a headless Chromium."""

from __future__ import annotations

import base64
from collections.abc import Callable
from typing import Any, Protocol

from softhand.errors import BrowserError


class Connection(Protocol):
    """What a page needs of its browser."""

    def call(self, method: str, session: str = "", **parameters: Any) -> dict[str, Any]:
        """Ask for one thing of the DevTools protocol."""

    def wait(self, what: str, done: Callable[[], bool]) -> None:
        """Take messages until `done()`."""


class Page:
    """A page of a browser; made by `Browser.page`.

    Args:
        connection: to its browser.
        target: its name there.
        session: the name of this way to talk to it.

    Attributes:
        console_errors: texts of errors, uncaught exceptions and failed loads since the page was made.
        requests: addresses that the page asked for, itself included; data inside the page is not asked for.
    """

    def __init__(self, connection: Connection, target: str, session: str) -> None:
        self.console_errors: list[str] = []
        self.requests: list[str] = []
        self._connection = connection
        self._target, self._session = target, session
        self._loaded = False

    def call(self, method: str, **parameters: Any) -> dict[str, Any]:
        """Ask for one thing of the DevTools protocol, for this page."""
        return self._connection.call(method, self._session, **parameters)

    def close(self) -> None:
        """Close it, whatever it shows; all pages are closed with their browser anyway."""
        self._connection.call("Target.closeTarget", targetId=self._target)

    def resize(self, width: int, height: int) -> None:
        """Set the size of the page [px]."""
        self.call("Emulation.setDeviceMetricsOverride", width=width, height=height, deviceScaleFactor=1, mobile=False)

    def open(self, url: str) -> None:
        """Load an address and wait until all of it is there.

        Raises:
            BrowserError: it cannot be loaded, or not in time.
        """
        self._loaded = False
        answer = self.call("Page.navigate", url=url)
        if answer.get("errorText"):
            raise BrowserError(f"{url}: Chromium cannot open it: {answer['errorText']}.")
        if "loaderId" in answer:  # not where only what follows "#" is new
            self._connection.wait(f"opening {url}", lambda: self._loaded)

    def evaluate(self, script: str) -> Any:
        """Value of a JavaScript expression, as plain data; a promise is awaited.

        Raises:
            BrowserError: it threw an exception.
        """
        answer = self.call("Runtime.evaluate", expression=script, returnByValue=True, awaitPromise=True)
        if "exceptionDetails" in answer:
            raise BrowserError(f"the page cannot evaluate {script[:80]!r}: {_exception(answer['exceptionDetails'])}")
        return answer["result"].get("value")

    def screenshot(self) -> bytes:
        """What the page shows, as PNG."""
        return base64.b64decode(self.call("Page.captureScreenshot", format="png", optimizeForSpeed=True)["data"])

    def take(self, event: str, parameters: dict[str, Any]) -> None:
        """Note an event that Chromium reports of this page."""
        if event == "Page.loadEventFired":
            self._loaded = True
        elif event == "Network.requestWillBeSent":
            url = parameters["request"]["url"]
            if not url.startswith("data:"):
                self.requests.append(url)
        elif event == "Runtime.exceptionThrown":
            self.console_errors.append(_exception(parameters["exceptionDetails"]))
        elif event == "Runtime.consoleAPICalled" and parameters["type"] in ("error", "assert"):
            texts = (str(part.get("value", part.get("description", ""))) for part in parameters["args"])
            self.console_errors.append(" ".join(texts))
        elif event == "Log.entryAdded" and parameters["entry"]["level"] == "error":
            self.console_errors.append(parameters["entry"]["text"])


def _exception(details: dict[str, Any]) -> str:
    text = details.get("exception", {}).get("description") or details.get("text", "")
    return str(text)
