"""The console: text of files and paths is printed as it is, and what cannot be written is told before the work."""

from __future__ import annotations

import ast
from pathlib import Path
from typing import Any

import pytest
from commands import run_command

import softhand
from softhand.commands import console as printing

ODD = "o[/x] [red]b[/] :bug: \x1b[31m\x9b1m\u202e\udc80"
SHOWN = r"o[/x] [red]b[/] :bug: \x1b[31m\x9b1m\u202e\udc80"
FOLDER = "o[/x] [b] :bug: $\\frac \x1b[31m"
FOLDER_SHOWN = FOLDER.replace("\x1b", r"\x1b")
SHORT = ("--duration", "0.01", "--set", "reference.duration=0.01")


@pytest.fixture(scope="module")
def recording(tmp_path_factory: pytest.TempPathFactory) -> softhand.Recording:
    """A short run."""
    return softhand.simulate("target-a", duration=0.01, overrides={"reference.duration": 0.01})


@pytest.mark.parametrize("mark", ["", "error", "warning", "note"])
def test_text_is_printed_as_it_is(mark: str, capsys: pytest.CaptureFixture[str]) -> None:
    """Brackets and colons mean nothing, and nothing reaches the terminal that it would obey or hide."""
    printing.say(ODD, mark)
    assert capsys.readouterr().out == (f"{mark}: " if mark else "") + SHOWN + "\n"


def test_tables_print_text_as_it_is(capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch) -> None:
    """Title and cells likewise."""
    monkeypatch.setenv("COLUMNS", "200")
    printing.print_table(ODD, [(ODD, ODD)])
    assert capsys.readouterr().out.count(SHOWN) == 3


def test_commands_print_through_the_console_alone() -> None:
    """What is handed to `print` of a console is a table, whose cells went through `plain`; all else is said."""
    folder = Path(printing.__file__).parent
    for file in sorted(folder.glob("*.py")):
        source = file.read_text()
        if file.name == "console.py":
            continue
        for call in (node for node in ast.walk(ast.parse(source)) if isinstance(node, ast.Call)):
            if ast.unparse(call.func).endswith(".print"):
                assert [ast.unparse(argument) for argument in call.args] == ["table"], f"{file.name}: {call.lineno}"
            if ast.unparse(call.func).endswith((".add_row", ".add_column")):
                words, place = [ast.unparse(argument) for argument in call.args], f"{file.name}, line {call.lineno}"
                assert all("plain" in word or word in ("column", "'run'") for word in words), place


@pytest.mark.parametrize("command", ["plot", "energy", "report", "check"])
def test_a_folder_of_any_name(command: str, recording: softhand.Recording, tmp_path: Path) -> None:
    """Commands that read a recording and write beside it."""
    folder = tmp_path / FOLDER
    folder.mkdir(parents=True)
    recording.save(folder / "run.nc")
    result = run_command(command, f"{FOLDER}/run.nc", folder=tmp_path)
    assert result.returncode == 0, result.stderr
    assert FOLDER_SHOWN in result.stdout.splitlines()[-1] and "\x1b[31" not in result.stdout + result.stderr


def test_results_and_scenarios_of_any_name(tmp_path: Path) -> None:
    """A scenario whose name and description have all of it, run into such a folder."""
    text = (Path(softhand.__file__).parent / "scenarios/target-a.toml").read_text()
    words = 'description = "costs $5, $\\\\frac [/b] \\u001b[31m"'
    scenario = tmp_path / "[s] $x\\foo.toml"
    scenario.write_text("\n".join([words, *text.splitlines()[1:]]))
    result = run_command("simulate", "./" + scenario.name, *SHORT, "--out", FOLDER, folder=tmp_path)
    assert result.returncode == 0, result.stderr
    assert result.stdout.splitlines()[-1] == f"wrote scenario.toml, run.nc, figure.png in {FOLDER_SHOWN}/"
    result = run_command("check", "./[/s].toml", folder=tmp_path)
    assert result.returncode == 1 and "[/s].toml does not exist" in result.stderr and "Traceback" not in result.stderr


FIGURE, FOLDERED = "no-folder/x.png", "file/x"
OUTS: list[tuple[str, ...]] = [
    ("plot", "run.nc", "--out", FIGURE),
    ("energy", "run.nc", "--out", FIGURE),
    ("lyapunov", "run.nc", "--out", FIGURE),
    ("report", "run.nc", "--out", "no-folder/x.html"),
    ("film", "run.nc", "no-folder/x.mp4"),
    ("export", "run.nc", "--csv", "--out", "no-folder/x.csv"),
    ("remark3", "--out", FIGURE),
    ("grasp", "--out", FIGURE),
    ("stability", "--out", FIGURE),
    ("workspace", "--out", FIGURE),
    ("validate", "--out", "no-folder/x.md"),
    ("simulate", "--out", FOLDERED),
    ("compare", "--out", FOLDERED),
    ("reproduce", "--out", FOLDERED),
    ("identify", "--example", "--out", FOLDERED),
]


@pytest.mark.parametrize("command", OUTS, ids=lambda command: command[0])
def test_what_cannot_be_written_is_told_before_the_work(
    command: tuple[str, ...], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Each command with a place for results; nothing is read, built or compiled for it."""

    def work(*_: Any, **__: Any) -> None:
        raise AssertionError("the work began")

    monkeypatch.setattr("softhand.recording.recording.Recording.load", work)
    monkeypatch.setattr("softhand.scenario.scenario.load_scenario", work)
    monkeypatch.setattr("softhand.identification.identify.identify", work)
    monkeypatch.setattr("softhand.studies.reproduce.reproduce", work)
    monkeypatch.setattr("softhand.validation.table.run_checks", work)
    (tmp_path / "file").touch()
    result = run_command(*command, folder=tmp_path)
    assert result.returncode == 1 and result.stderr.startswith("error: "), result.stderr
    assert "no folder" in result.stderr and "choose another" in result.stderr
    assert [path.name for path in tmp_path.iterdir()] == ["file"]


def test_all_commands_that_write_are_asked() -> None:
    """The list above has each command with --out, and the film."""
    from softhand.commands.main import app

    with_out = {
        info.name or info.callback.__name__
        for info in app.registered_commands
        if info.callback is not None and "out" in info.callback.__annotations__
    }
    assert with_out == {command[0] for command in OUTS}


def test_a_missing_recording_is_told_as_such(tmp_path: Path) -> None:
    """Not as a folder that is missing for the figure beside it."""
    result = run_command("energy", "nowhere/run.nc", folder=tmp_path)
    assert result.returncode == 1 and "nowhere/run.nc: cannot be read as a recording: there is no such" in result.stderr


def test_a_target_out_of_reach_is_told_before_the_run(tmp_path: Path) -> None:
    """As `softhand check` does; not where nothing shall be printed."""
    far = ("--set", "reference.object_position=[0.0, 0.3, 0.1]")
    result = run_command("simulate", *SHORT, *far, "--no-plot", "--out", "out", folder=tmp_path)
    assert "warning: reference: at the target, finger_" in result.stderr and "out of reach by" in result.stderr
    result = run_command("simulate", *SHORT, *far, "--no-plot", "-q", "--out", "out", folder=tmp_path)
    assert "warning" not in result.stderr
