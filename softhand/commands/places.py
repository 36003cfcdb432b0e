"""Where results go: refused before the work if they could not be written after it, and nothing overwritten unasked."""

from __future__ import annotations

import itertools
import os
from pathlib import Path

from softhand.errors import SofthandError


def new_folder(name: str) -> Path:
    """runs/NAME, or the first of runs/NAME-2, runs/NAME-3, ... that is not there; made, so that nobody else takes it.

    Raises:
        SofthandError: it cannot be made.
    """
    make_folder(Path("runs"))
    for count in itertools.count(1):
        folder = Path("runs") / (name if count == 1 else f"{name}-{count}")
        try:
            folder.mkdir()
        except FileExistsError:
            continue
        except OSError as error:
            raise SofthandError(
                f"{folder}: cannot make this folder: {error.strerror}; choose one with --out."
            ) from error
        return folder
    raise AssertionError


def free_file(file: Path) -> Path:
    """The file, or the first of NAME-2, NAME-3, ... that is not there."""
    names = (file.with_stem(f"{file.stem}-{count}") for count in itertools.count(2))
    return next(name for name in itertools.chain([file], names) if not os.path.lexists(name))


def beside_run(run: Path, name: str, out: Path | None) -> Path:
    """The file to write of a recording: that of --out, which may be a folder, or a new one beside the recording.

    Raises:
        SofthandError: it cannot be written. Of a recording that is missing nothing is said: reading it does.
    """
    file = run / "run.nc" if run.is_dir() else run
    if out is None:
        target = free_file(file.parent / name)
        if file.exists():
            check_file(target)
        return target
    target = free_file(out / name) if out.is_dir() else out
    check_file(target)
    return target


def figure_of_run(run: Path, name: str, out: Path | None) -> Path:
    """Likewise a figure, whose ending must be that of one."""
    target = beside_run(run, name, out)
    _check_ending(target)
    return target


def check_figure(out: Path | None) -> None:
    """Refuse, before the work, a figure of `figure_of` that could not be written after it."""
    if out is None or out.is_dir():
        check_folder(out)
    else:
        _check_ending(out)
        check_file(out)


def figure_of(source: str, what: str, out: Path | None) -> Path:
    """The figure to write of a scenario: that of --out, which may be a folder, or a new one.

    Args:
        source: the scenario as it was named; a figure of that of a run goes into the folder of the run, one of another
            into a new folder below runs/.
        what: name of the command, and of the figure.
        out: as asked for.
    """
    if out is None and (Path(source) / "run.nc").is_file():
        out = Path(source)
    if out is None:
        return new_folder(f"{what}-{name_of(source)}") / f"{what}.png"
    return free_file(out / f"{what}.png") if out.is_dir() else out


def name_of(source: str) -> str:
    """The name of a scenario in the names of its results: that of its folder if it is the scenario of a run."""
    file = Path(source)
    is_of_run = file.name == "scenario.toml" and file.parent.name
    return file.parent.name if is_of_run else file.stem


def _check_ending(file: Path) -> None:
    from softhand.plots.style import figure_format

    figure_format(file)


def check_file(file: Path) -> None:
    """Refuse, before the work, a file that could not be written after it."""
    from softhand.recording.whole_file import check_place

    if not file.absolute().parent.is_dir():
        raise SofthandError(f"{file}: there is no folder {file.parent}; make it or choose another with --out.")
    check_place(file)


def check_new(file: Path) -> None:
    """Refuse, before the work, a file that is there already or could not be written."""
    if os.path.lexists(file):
        raise SofthandError(f"{file}: is there already, and is not overwritten; choose another name.", value=str(file))
    check_file(file)


def check_folder(out: Path | None) -> None:
    """Refuse, before the work, a folder of results that could not be made or written to; runs/ if not given."""
    folder = out or Path("runs")
    try:
        there = next(place for place in (folder.absolute(), *folder.absolute().parents) if place.exists())
        why = "" if there.is_dir() else f"{there} is no folder"
        why = why or ("" if os.access(there, os.W_OK | os.X_OK) else f"nothing can be written into {there}")
    except OSError as error:
        why = error.strerror or str(error)
    if why:
        raise SofthandError(f"{folder}: cannot make this folder: {why}; choose another with --out.")


def make_folder(folder: Path) -> None:
    """Make a folder with its parents; SofthandError if that cannot be."""
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise SofthandError(
            f"{folder}: cannot make this folder: {error.strerror}; choose another with --out."
        ) from error


def remove_old(folder: Path, *names: str) -> None:
    """Remove results of an older run, beside which those of a new one would be taken for theirs.

    Raises:
        SofthandError: one cannot be removed.
    """
    for name in names:
        try:
            (folder / name).unlink(missing_ok=True)
        except OSError as error:
            raise SofthandError(
                f"{folder / name}: cannot be replaced: {error.strerror}; choose another folder with --out."
            ) from error


def write_text(file: Path, text: str) -> None:
    """Write a text, whole or not at all; RecordingError if that cannot be."""
    from softhand.recording.whole_file import write_whole

    write_whole(file, lambda: text.encode())
