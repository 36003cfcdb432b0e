"""Films: the 3-D view of a report, picture by picture from a headless browser, as MP4 or GIF."""

from __future__ import annotations

import os
import tempfile
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path

import numpy as np

from softhand.errors import SofthandError
from softhand.recording.recording import Recording
from softhand.recording.whole_file import check_place, write_whole
from softhand.viewer.browser.browser import Browser
from softhand.viewer.browser.chromium import find_chromium
from softhand.viewer.report.encoding import encode_gif, find_ffmpeg, mp4_encoder
from softhand.viewer.report.report import report_page

FORMATS = ("mp4", "gif")
_MOST_FRAMES = 600  # kept in the page; between them it interpolates
_PREPARING = 0.1  # share of the work
_FASTEST_GIF = 50.0  # [1/s] readers slow down what is faster
_LARGEST = 4096  # [px]


def write_film(
    recording: Recording | Sequence[Recording],
    path: str | os.PathLike[str],
    fps: float = 30.0,
    size: tuple[int, int] = (1280, 720),
    speed: float = 1.0,
    progress: Callable[[float], None] = lambda done: None,
) -> None:
    """Write the film of a run, or of several side by side, whole or not at all.

    Args:
        recording: one, or up to four with one clock, camera and scale; an incomplete one plays as far as it goes, and
            the film says why.
        path: file to write, its format by its ending: .mp4 or .gif; an older one is replaced.
        fps: pictures a second of film.
        size: width and height [px].
        speed: simulated time over time of the film; 0.1 is slow motion.
        progress: is told what is done, 0 to 1.

    Raises:
        BrowserError: there is no Chromium, or it failed.
        RecordingError: the recording lacks what a picture needs, or the file cannot be written.
        SofthandError: another ending, a value out of its range, or there is no ffmpeg. Carries `.value`.
    """
    path = Path(path)
    ending = path.suffix.lower().removeprefix(".")
    _check(path, ending, fps, size, speed)
    encode = encode_gif if ending == "gif" else mp4_encoder(find_ffmpeg())
    find_chromium()
    runs = [recording] if isinstance(recording, Recording) else list(recording)
    page = report_page(
        runs, fps / speed, _MOST_FRAMES, film_only=True, progress=lambda done: progress(_PREPARING * done)
    )
    with tempfile.TemporaryDirectory(prefix="softhand-film-") as folder:
        file = Path(folder, "film.html")
        write_whole(file, page.encode)
        content = encode(_pictures(file, size, _times(runs, fps, speed), progress), fps)
    write_whole(path, lambda: content)


def _check(path: Path, ending: str, fps: float, size: tuple[int, int], speed: float) -> None:
    if ending not in FORMATS:
        got = f"has the unknown ending {path.suffix!r}" if ending else "has no ending"
        raise SofthandError(f"{path}: the name of the film {got}; choose .mp4 or .gif.", value=path.suffix)
    check_place(path)
    fastest = _FASTEST_GIF if ending == "gif" else 240.0
    if not 1.0 <= fps <= fastest:
        raise SofthandError(f"fps: {fps:g} is out of range; a .{ending} takes 1 to {fastest:g}.", value=fps)
    if not 1e-4 <= speed <= 100.0:
        raise SofthandError(f"speed: {speed:g} is out of range; allowed are 0.0001 to 100.", value=speed)
    if not all(64 <= length <= _LARGEST and length % 2 == 0 for length in size):
        raise SofthandError(
            f"size: {size[0]}x{size[1]} cannot be filmed; take even numbers from 64 to {_LARGEST}.", value=size
        )


def _times(runs: Sequence[Recording], fps: float, speed: float) -> Iterator[tuple[float, float]]:
    """Simulated time of each picture, and what is done with it, 0 to 1; the last sample is among them."""
    first = min(float(recording.time[0]) for recording in runs)
    last = max(float(recording.time[-1]) for recording in runs)
    count = int(np.ceil((last - first) * fps / speed - 1e-9)) + 1
    for k in range(count):
        yield min(first + k * speed / fps, last), (k + 1) / count


def _pictures(
    file: Path, size: tuple[int, int], times: Iterator[tuple[float, float]], progress: Callable[[float], None]
) -> Iterator[bytes]:
    """What the page shows at each time, as PNG."""
    with Browser() as browser:
        page = browser.page(*size)
        page.open(file.as_uri())
        page.evaluate("softhand.ready.then(() => true)")
        for time, done in times:
            page.evaluate(f"softhand.setTime({time!r})")
            yield page.screenshot()
            progress(_PREPARING + (1.0 - _PREPARING) * done)
