"""The console: text of files and paths is printed as it is, and what cannot be written is told before the work."""

from __future__ import annotations

import ast
import json
import subprocess
import sys
from functools import partial
from pathlib import Path
from typing import Any

import pytest
from commands import run_command

import softhand
from softhand.commands import console as printing
from softhand.grasping import proposals
from softhand.scenario.file import resolve_path

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
    """But for the help and the version, which are texts of softhand."""
    folder = Path(printing.__file__).parent
    for file in sorted(folder.glob("*.py")):
        if file.name in ("console.py", "app.py"):
            continue
        for call in (node for node in ast.walk(ast.parse(file.read_text())) if isinstance(node, ast.Call)):
            name = ast.unparse(call.func)
            assert name not in ("print", "typer.echo"), f"{file.name}: {call.lineno}"


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
    ("film", "run.nc", "--out", "no-folder/x.mp4"),
    ("export", "run.nc", "--csv", "--out", "no-folder/x.csv"),
    ("remark3", "--out", FIGURE),
    ("grasp", "--out", FIGURE),
    ("squeeze", "--out", FIGURE),
    ("push", "--out", FIGURE),
    ("stability", "--out", FIGURE),
    ("gradient", "--out", FIGURE),
    ("design", "lqr", "--out", FIGURE),
    ("design", "gains", "--out", FIGURE),
    ("workspace", "--out", FIGURE),
    ("validate", "--out", "no-folder/x.md"),
    ("simulate", "--out", FOLDERED),
    ("compare", "--out", FOLDERED),
    ("sweep", "study.toml", "--out", FOLDERED),
    ("reproduce", "--out", FOLDERED),
    ("identify", "--example", "--out", FOLDERED),
    ("calibrate", "run.nc", "--fit", "mass", "--out", FOLDERED),
    ("new", "hand.urdf", "--out", "no-folder/my.toml"),
    ("material", "--radius", "10mm", "--shear", "60kPa", "--out", FOLDERED),
    ("tune", "study.toml", "--out", FOLDERED),
    ("grasps", "--out", "no-folder/x.nc"),
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
    """The list above has each command with --out."""
    from softhand.commands.main import app

    with_out = {
        name or info.name or info.callback.__name__
        for name, one in (
            ("", app),
            *((group.typer_instance.info.name, group.typer_instance) for group in app.registered_groups),
        )
        for info in one.registered_commands
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


def test_a_table_fits_a_narrow_console(tmp_path: Path) -> None:
    """80 letters, but for a name that is longer; and names are whole."""
    shown = run_command("hands", folder=tmp_path, width=80).stdout
    assert [line for line in shown.splitlines() if len(line) > 80 and len(line.split()) > 1] == []
    assert "package://softhand/urdf/three_finger_hand.urdf" in shown.split()


def test_a_folder_stands_for_its_run(recording: softhand.Recording, tmp_path: Path) -> None:
    """And pictures go there, beside what is there already."""
    recording.save(tmp_path / "run.nc")
    (tmp_path / "figure.png").write_text("mine")
    for command, files in (("plot", {"figure-2.png"}), ("energy", {"energy.png"}), ("check", set())):
        before = set(tmp_path.iterdir())
        result = run_command(command, str(tmp_path), folder=tmp_path.parent)
        assert result.returncode == 0, result.stderr
        assert {file.name for file in set(tmp_path.iterdir()) - before} == files
    assert (tmp_path / "figure.png").read_text() == "mine"
    (tmp_path / "scenario.toml").write_text(recording.scenario)
    result = run_command("remark3", tmp_path.name, folder=tmp_path.parent)
    assert result.returncode == 0 and (tmp_path / "remark3.png").is_file(), result.stderr


def test_what_changes_a_scenario_is_refused_for_a_run(recording: softhand.Recording, tmp_path: Path) -> None:
    """By the name of the option."""
    recording.save(tmp_path / "run.nc")
    for option, value in (("--set", "duration=1"), ("--law", "hertz"), ("--controller", "blind")):
        result = run_command("check", ".", option, value, folder=tmp_path)
        assert result.returncode == 1 and f"{option} changes a scenario; . is none" in result.stderr


JSON: dict[tuple[str, ...], str] = {
    ("list", "laws"): "laws",
    ("energy", "run.nc"): "units",
    ("check", "run.nc"): "warnings",
    ("simulate", *SHORT, "--no-plot"): "summary",
}
"""Commands, and a key of what they print."""


@pytest.mark.parametrize("command", JSON, ids=lambda command: command[0])
def test_json_is_all_that_is_printed(command: tuple[str, ...], recording: softhand.Recording, tmp_path: Path) -> None:
    """One document; all else goes elsewhere, or nowhere with --quiet."""
    recording.save(tmp_path / "run.nc")
    result = run_command(*command, "--json", folder=tmp_path)
    assert result.returncode == 0 and JSON[command] in json.loads(result.stdout), result.stderr
    if command[0] != "list":
        quiet = run_command(*command, "--json", "--quiet", folder=tmp_path)
        assert quiet.stderr == "" and json.loads(quiet.stdout).keys() == json.loads(result.stdout).keys()


def test_numbers_of_a_list_stand_on_one_line(capsys: pytest.CaptureFixture[str]) -> None:
    """And texts stay as they are."""
    value = {"a": [1.0, 2.5], "b": [[1, 2], [3]], "c": "[\n  1\n]", "d": []}
    printing.Printer(as_json=True).json(value)
    shown = capsys.readouterr().out
    assert json.loads(shown) == value and '"a": [1.0, 2.5]' in shown and "    [1, 2],\n" in shown


def test_what_begins_is_said_at_once(capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch) -> None:
    """And now and then how far it is and how long it will take, in lines of plain text; nothing with --quiet."""
    clock = iter([10.0, 50.0, 90.0, 130.0, 170.0])
    monkeypatch.setattr(printing.time, "monotonic", lambda: next(clock))
    with printing.progress("doing it", 4.0, quiet=False) as tell:
        assert capsys.readouterr().err == "doing it ...\n"
        for done in (1.0, 3.0, 0.0, 4.0):
            tell(done)
    lines = "doing it: 25 %, 2 min left\ndoing it: 75 %, 27 s left\ndoing it: 0 %\ndoing it: 100 %\n"
    assert capsys.readouterr() == ("", lines)
    with printing.progress("doing it", 4.0, quiet=True) as tell:
        tell(1.0)
    assert capsys.readouterr() == ("", "")


def test_a_reader_that_leaves_is_no_error(tmp_path: Path) -> None:
    """As `| head -1` does."""
    program = f"{sys.executable} -m softhand"
    found = subprocess.run(
        f"{program} list steppers | head -1", shell=True, cwd=tmp_path, capture_output=True, text=True, timeout=120
    )
    assert (found.stdout, found.stderr) == ("steppers\n", "")


def test_simulate_warns_of_the_start(tmp_path: Path) -> None:
    """In the words of check."""
    weak = ("--set", "fingertip.friction=0.39")
    result = run_command("simulate", *SHORT, *weak, "--no-plot", "--out", "out", folder=tmp_path)
    told = [line for line in result.stderr.splitlines() if line.startswith("warning: ")]
    assert "warning: finger_1_tip: friction use is 0.91 at the start" in told[0], result.stderr
    checked = run_command("check", "target-a", *weak, folder=tmp_path).stdout.splitlines()
    assert all(line in checked for line in told if line.startswith("warning: finger"))


def test_a_new_scenario_runs(tmp_path: Path) -> None:
    """A copy with comments, which is not overwritten."""
    result = run_command("new", "mine.toml", "--like", "hold", folder=tmp_path)
    assert result.returncode == 0 and "softhand simulate mine.toml" in result.stdout
    assert softhand.load_scenario(tmp_path / "mine.toml") == softhand.load_scenario("hold")
    text = (tmp_path / "mine.toml").read_text()
    again = run_command("new", "mine.toml", folder=tmp_path)
    assert again.returncode == 1 and "mine.toml: is there already" in again.stderr
    assert (tmp_path / "mine.toml").read_text() == text and "#" in text


@pytest.mark.slow
def test_a_hand_of_ones_own_gets_a_scenario_and_a_grasp(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Its ends are the tips; a grasp is found and kept, and it stays at rest."""
    monkeypatch.setattr(proposals, "propose_grasps", partial(proposals.propose_grasps, points=80))
    urdf = resolve_path("package://softhand/urdf/three_finger_hand.urdf")
    (tmp_path / "hand.urdf").write_text(urdf.read_text())
    assert run_command("new", "mine.toml", "--hand", "hand.urdf", folder=tmp_path).returncode == 0
    assert 'urdf = "hand.urdf"' in (tmp_path / "mine.toml").read_text()
    missing = run_command("simulate", "mine.toml", folder=tmp_path)
    assert missing.returncode == 1 and "contact_points" in missing.stderr
    found = run_command("grasp", "mine.toml", "--place", "--propose", "--count", "1", "--write", "held.toml", "--json",
                        folder=tmp_path)  # fmt: skip
    assert found.returncode == 0 and json.loads(found.stdout)["proposals"], found.stderr
    scenario = softhand.load_scenario(tmp_path / "held.toml", {"duration": 0.05})
    assert scenario.hand.tips == ("finger_1_tip", "finger_2_tip", "finger_3_tip")
    assert softhand.summarize(softhand.simulate(scenario)).position_error < 1e-6  # [mm]


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (("new", "mine.txt"), "ends with .toml"),
        (("new", "mine.toml", "--like", "hodl"), "Did you mean hold?"),
        (("new", "mine.toml", "--like", "other.toml"), "copy the file itself"),
        (("new", "mine.toml", "--like", "hold", "--hand", "hand.urdf"), "take one of them"),
        (("new", "mine.toml", "--hand", "hand.urdf"), "hand.urdf"),
        (("grasp", "--write", "held.toml"), "--propose or --place"),
        (("grasp", "--propose", "--write", "held.txt"), "ends with .toml"),
    ],
)
def test_a_scenario_that_cannot_be_written(arguments: tuple[str, ...], words: str, tmp_path: Path) -> None:
    """One line, and no file."""
    result = run_command(*arguments, folder=tmp_path)
    assert result.returncode == 1 and words in result.stderr and result.stderr.count("\n") == 1, result.stderr
    assert list(tmp_path.iterdir()) == []
