"""A report: one HTML file with film, curves and numbers, that needs neither network nor server."""

from __future__ import annotations

import json
import os
import re
from collections.abc import Callable, Sequence
from dataclasses import asdict
from pathlib import Path
from typing import Any

from softhand.analysis.summary import summarize
from softhand.assembly.collisions import with_collisions
from softhand.errors import RecordingError, SofthandError
from softhand.plots.style import finger_color
from softhand.recording.events import phases_of
from softhand.recording.recorded import scenario_of
from softhand.recording.recording import Recording
from softhand.recording.whole_file import check_place, write_whole
from softhand.version import __version__
from softhand.viewer.page.assets import LICENCES, page_file, three_file
from softhand.viewer.report.curves import blocks_of, finger_names, samples_of
from softhand.viewer.report.packing import pack_film
from softhand.viewer.report.pads import pads_html
from softhand.viewer.report.store import Data, Store
from softhand.viewer.scene.scales import shared_scales

FRAME_RATE = 60.0  # frames a second of simulated time; between them the page interpolates
MOST_FRAMES = 600  # in all runs together: the file stays small enough to be mailed
_ENDINGS = (".html", ".htm")
MOST_RUNS = 4  # kinds of lines that an eye can tell apart

Progress = Callable[[float], None]


def write_report(path: str | os.PathLike[str], *recordings: Recording, progress: Progress = lambda done: None) -> None:
    """Write the report of one run, or of several with one clock, whole or not at all.

    Args:
        path: HTML file to write; an older one is replaced.
        recordings: one to four; an incomplete one plays as far as it goes, and the page says why.
        progress: is told what is done, 0 to 1.

    Raises:
        RecordingError: a recording lacks what the report shows, or the file cannot be written.
        SofthandError: the name of the file does not end in .html. Carries `.value`.
    """
    path = Path(path)
    check_report(path)
    html = report_page(recordings, progress=progress)
    write_whole(path, html.encode)


def check_report(path: Path) -> None:
    """Refuse the name of a report that could not be written; raises as `write_report`."""
    if path.suffix.lower() not in _ENDINGS:
        got = f"has the unknown ending {path.suffix!r}" if path.suffix else "has no ending"
        raise SofthandError(f"{path}: the name of the report {got}; choose .html.", value=path.suffix)
    check_place(path)


def report_page(
    recordings: Sequence[Recording],
    rate: float = FRAME_RATE,
    most: int = MOST_FRAMES,
    film_only: bool = False,
    progress: Progress = lambda done: None,
) -> str:
    """The report as HTML.

    Args:
        recordings: as in `write_report`.
        rate: frames a second of simulated time.
        most: frames at most, in all runs together.
        film_only: leave everything away but the film; for films.
        progress: is told what is done, 0 to 1.
    """
    if not 1 <= len(recordings) <= MOST_RUNS:
        raise RecordingError(f"A report shows 1 to {MOST_RUNS} runs, not {len(recordings)}.")
    for recording in recordings:
        if not len(recording):
            raise RecordingError("A report needs at least one sample, and this recording has none.")
    store = Store()
    blocks = [] if film_only else blocks_of(store, recordings)
    runs = _runs_of(store, recordings, rate, most, progress)
    most_fingers = max((finger_names(recording) for recording in recordings), key=len)
    data = {
        "version": __version__,
        "filmOnly": film_only,
        "end": max(float(recording.time[-1]) for recording in recordings) or 1e-3,
        "fingers": [{"text": name, "color": finger_color(k)} for k, name in enumerate(most_fingers)],
        "runs": runs,
        "blocks": blocks,
        "arrays": store.text(),
    }
    return _fill(data, "" if film_only else pads_html(recordings))


def _runs_of(store: Store, recordings: Sequence[Recording], rate: float, most: int, progress: Progress) -> list[Data]:
    """Film, words and times of each run."""
    count, scales = len(recordings), shared_scales(recordings)
    runs = []
    for k, recording in enumerate(recordings):
        film = pack_film(store, recording, scales, rate, most // count, lambda done, k=k: progress((k + done) / count))  # type: ignore[misc]
        times = store.add(recording.time[samples_of(recording)], "f4")
        runs.append({"label": "ABCD"[k], "film": film, **_text_of(recording), "times": times})
    return runs


def _text_of(recording: Recording) -> Data:
    """What the page says about a run."""
    scenario, summary = scenario_of(recording), summarize(recording)
    stop = "" if recording.complete else f"Incomplete, stopped at {recording.stop_time:g} s: {recording.reason}"
    return {
        "title": scenario.title,
        "subtitle": scenario.settings_line,
        "stop": stop,
        "facts": [("simulated time", f"{recording.stop_time:g} s"), *summary.rows()],
        "notes": summary.warnings(),
        "phases": phases_of(recording),
        "events": [asdict(event) for event in with_collisions(recording, summary.events)],
        "end": float(recording.time[-1]),
        "scenario": recording.scenario,
        "version": recording.version,
    }


def _fill(data: Data, pads: str) -> str:
    """The page with everything put into it."""
    parts = {name: page_file(name) for name in ("report.css", "chart.css", "stage.js", "chart.js", "report.js")}
    parts["pads"] = pads
    parts["three"] = three_file()
    parts["licences"] = _as_data(json.loads(three_file(LICENCES)))
    parts["data"] = _as_data(data)
    return re.sub(r"\{\{([a-z.]+)\}\}", lambda found: parts[found[1]], page_file("report.html"))


def _as_data(data: Any) -> str:
    """JSON that cannot end the element that holds it."""
    return json.dumps(data, separators=(",", ":"), allow_nan=False).replace("<", "\\u003c")
