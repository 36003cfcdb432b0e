"""The worst runs of a sweep as scenario files that repeat them, and all runs as a table."""

from __future__ import annotations

import csv
import io
import json
from pathlib import Path
from typing import Any

from softhand.errors import StudyError
from softhand.recording.whole_file import write_whole
from softhand.studies.sweeps.result import Sweep

FOLDER = "worst"


def write_worst(sweep: Sweep, most: int = 5) -> dict[int, Path]:
    """Write the scenarios of the worst runs as worst/1.toml and so on, in the place of older ones.

    Returns:
        The file of each run, the worst first; none of a run whose values make no scenario.

    Raises:
        RecordingError: a file cannot be written.
    """
    folder = sweep.folder / FOLDER
    folder.mkdir(exist_ok=True)
    for old in folder.glob("*.toml"):
        old.unlink()
    found = {}
    for number, run in enumerate(sweep.worst(most), 1):
        try:
            text = sweep.scenario(run).to_toml().encode()
        except StudyError:
            continue
        found[run] = folder / f"{number}.toml"
        write_whole(found[run], lambda text=text: text)  # type: ignore[misc]
    return found


def to_csv(sweep: Sweep) -> str:
    """A row a run, with all digits: what was varied, how it ended, its outcomes."""
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    outcomes = sweep.numbers
    writer.writerow(["run", *sweep.values, "outcome", "stop_time", "success", *outcomes, "message"])
    for run in range(len(sweep)):
        writer.writerow([
            run, *(_cell(column[run]) for column in sweep.values.values()), sweep.outcome[run], sweep.stop_time[run],
            int(sweep.success[run]), *(numbers[run] for numbers in outcomes.values()), sweep.message[run],
        ])  # fmt: skip
    return text.getvalue()


def _cell(value: Any) -> Any:
    return json.dumps(value) if isinstance(value, tuple | dict | bool) else value
