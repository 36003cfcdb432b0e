"""A headless Chromium, driven by its DevTools protocol.

The messages go through a pair of pipes (`--remote-debugging-pipe`): no port is opened, no websocket library is needed,
and Chromium ends by itself when the pipe closes, even where this process is killed.
"""

from __future__ import annotations

import base64
import contextlib
import fcntl
import json
import os
import selectors
import shutil
import signal
import tempfile
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

from softhand.errors import BrowserError

NAMES = ("chromium", "chromium-browser", "google-chrome", "google-chrome-stable", "chrome")
VARIABLE = "SOFTHAND_CHROMIUM"
_APPLICATION = Path("/Applications/Google Chrome.app/Contents/MacOS/Google Chrome")

_FLAGS = (
    "--headless",
    "--no-sandbox",  # it shows files of ours alone, and in most containers there is no sandbox to be had
    "--use-angle=swiftshader",  # WebGL without a graphics card, with the same picture everywhere
    "--enable-unsafe-swiftshader",
    "--disable-dev-shm-usage",
    "--hide-scrollbars",
    "--mute-audio",
    "--no-first-run",
    "--no-default-browser-check",
    "--disable-background-networking",
    "--disable-component-update",
    "--disable-default-apps",
    "--disable-extensions",
    "--disable-sync",
    "--remote-debugging-pipe",
)
_READ_BY_CHROMIUM, _WRITTEN_BY_CHROMIUM = 3, 4  # file descriptors, fixed by --remote-debugging-pipe
_GRACE = 5.0  # [s] for Chromium to end by itself
_SHORT_FOLDER = "/tmp"
_LONGEST_FOLDER = 57  # characters; Chromium makes a socket 46 below it, and macOS takes 103 for the whole path


def find_chromium() -> str:
    """Path of the Chromium to use.

    Raises:
        BrowserError: there is none, or what SOFTHAND_CHROMIUM names is no program.
    """
    asked = os.environ.get(VARIABLE)
    if asked:
        found = shutil.which(asked)
        if found is None:
            raise BrowserError(f"{VARIABLE}: {asked!r} is no program; give the path of Chromium or unset it.")
        return found
    for name in (*NAMES, str(_APPLICATION)):
        found = shutil.which(name)
        if found is not None:
            return found
    raise BrowserError(
        "Chromium is not installed: install it, for instance with `apt install chromium`, "
        f"or give the path of Chromium or Chrome in {VARIABLE}."
    )


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
        self._chromium = find_chromium()
        self._answers: dict[int, dict[str, Any]] = {}
        self._pages: dict[str, Page] = {}
        self._count = 0
        self._received = b""

    def __enter__(self) -> Browser:
        self._folder = _new_folder()
        self._process = 0
        try:
            self._start()
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
        page = self._pages[session] = Page(self, session)
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
            self._to_chromium.write(json.dumps(message).encode() + b"\0")
            self._to_chromium.flush()
        except OSError as error:
            raise BrowserError(f"Chromium ({self._chromium}) ended before {method}.{self._complaint()}") from error
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
            if left <= 0.0 or not self._ready.select(left):
                raise BrowserError(f"Chromium ({self._chromium}) gave no answer in {self.timeout:g} s to {what}.")
            block = os.read(self._from_chromium, 1 << 20)
            if not block:
                raise BrowserError(f"Chromium ({self._chromium}) ended during {what}.{self._complaint()}")
            *messages, self._received = (self._received + block).split(b"\0")
            for message in map(json.loads, messages):
                if "id" in message:
                    self._answers[message["id"]] = message
                elif message.get("sessionId") in self._pages:
                    self._pages[message["sessionId"]].take(message["method"], message["params"])

    def close(self) -> None:
        """End Chromium with all its processes and remove its profile; may be called twice."""
        if self._process:
            self._ready.close()
            with contextlib.suppress(OSError):  # what is left to be written, when Chromium is gone
                self._to_chromium.close()
            os.close(self._from_chromium)
            _end(self._process)
            self._process = 0
        shutil.rmtree(self._folder, ignore_errors=True)

    def _start(self) -> None:
        """Start Chromium as the leader of a process group, out of reach of a Ctrl-C that is meant for us."""
        theirs = []
        read_end, write_end = os.pipe()
        self._to_chromium = os.fdopen(write_end, "wb")
        self._from_chromium, far_end = os.pipe()
        for end in (read_end, far_end):  # clear of the numbers that they get there
            theirs.append(fcntl.fcntl(end, fcntl.F_DUPFD_CLOEXEC, 10))
            os.close(end)
        self._ready = selectors.DefaultSelector()
        self._ready.register(self._from_chromium, selectors.EVENT_READ)
        log = os.path.join(self._folder, "log")
        try:
            self._process = os.posix_spawn(
                self._chromium,
                [self._chromium, *_FLAGS, f"--user-data-dir={self._folder}", "about:blank"],
                {**os.environ, "TMPDIR": self._folder},
                file_actions=[
                    (os.POSIX_SPAWN_OPEN, 0, os.devnull, os.O_RDONLY, 0),
                    (os.POSIX_SPAWN_OPEN, 1, log, os.O_WRONLY | os.O_CREAT | os.O_APPEND, 0o600),
                    (os.POSIX_SPAWN_DUP2, 1, 2),
                    (os.POSIX_SPAWN_DUP2, theirs[0], _READ_BY_CHROMIUM),
                    (os.POSIX_SPAWN_DUP2, theirs[1], _WRITTEN_BY_CHROMIUM),
                ],
                setpgroup=0,
            )
        except OSError as error:
            raise BrowserError(f"Chromium ({self._chromium}) cannot be started: {error.strerror}.") from error
        finally:
            for end in theirs:
                os.close(end)

    def _complaint(self) -> str:
        """The last line that Chromium wrote, as the end of a message."""
        with contextlib.suppress(OSError):
            lines = Path(self._folder, "log").read_text(errors="replace").strip().splitlines()
            return f" Its last words: {lines[-1].strip()}" if lines else ""
        return ""


class Page:
    """A page of a browser; made by `Browser.page`.

    Attributes:
        console_errors: texts of errors, uncaught exceptions and failed loads since the page was made.
        requests: addresses that the page asked for, itself included; data inside the page is not asked for.
    """

    def __init__(self, browser: Browser, session: str) -> None:
        self.console_errors: list[str] = []
        self.requests: list[str] = []
        self._browser = browser
        self._session = session
        self._loaded = False

    def call(self, method: str, **parameters: Any) -> dict[str, Any]:
        """Ask for one thing of the DevTools protocol, for this page."""
        return self._browser.call(method, self._session, **parameters)

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
            self._browser.wait(f"opening {url}", lambda: self._loaded)

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


def _new_folder() -> str:
    """For the profile and all else that Chromium leaves: among the temporary files, if that path is short enough."""
    longest = _LONGEST_FOLDER - len("/softhand-chromium-") - 8
    place = tempfile.gettempdir()
    if len(os.fsencode(place)) > longest:
        place = _SHORT_FOLDER
    try:
        return tempfile.mkdtemp(prefix="softhand-chromium-", dir=place)
    except OSError as error:
        raise BrowserError(
            f"{place}: cannot make a folder for Chromium here: {error.strerror}; "
            f"set TMPDIR to a folder that you may write to, of at most {longest} characters."
        ) from error


def _exception(details: dict[str, Any]) -> str:
    text = details.get("exception", {}).get("description") or details.get("text", "")
    return str(text)


def _end(process: int) -> None:
    """Wait for a process that was told to end, then kill what is left of its group."""
    end = time.monotonic() + _GRACE
    while os.waitpid(process, os.WNOHANG) == (0, 0):
        if time.monotonic() > end:
            os.killpg(process, signal.SIGKILL)
            os.waitpid(process, 0)
            return
        time.sleep(0.01)
    with contextlib.suppress(ProcessLookupError, PermissionError):  # macOS denies it where the group is gone
        os.killpg(process, signal.SIGKILL)
