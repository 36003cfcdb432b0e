"""What was computed is kept: whatever asks the program to end, and when; whatever becomes of the disk."""

from __future__ import annotations

import errno
import shutil
import signal
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from commands import Outcome, run_command

from softhand import Controller, ControllerError, Recording, RecordingError, Simulation, load_scenario, simulate
from softhand.plots import style
from softhand.references.goal import Goal
from softhand.simulation import samples
from softhand.simulation.interrupts import SIGNALS, interruptible, interrupts_held

DURATION = 0.05


@pytest.fixture(autouse=True)
def ctrl_c() -> Iterator[None]:
    """It is ignored where tests run in the background."""
    before = {number: signal.signal(number, signal.default_int_handler) for number in SIGNALS}
    yield
    for number, handler in before.items():
        signal.signal(number, handler)


def run(tmp_path: Path, *more: str) -> Outcome:
    """`softhand simulate` into a folder named out."""
    short = ["--duration", str(DURATION), "--set", "reference.duration=0.02", "--out", "out"]
    return run_command("simulate", *short, *more, folder=tmp_path)


def after(function: Callable[..., Any], act: Callable[[], Any], calls: int = 1) -> Callable[..., Any]:
    """The function, and something that happens before it returns for the so-manyth time."""
    count = iter(range(1, 1_000_000))

    def both(*args: Any, **named: Any) -> Any:
        answer = function(*args, **named)
        if next(count) == calls:
            act()
        return answer

    return both


# ------------------------------------------------------------------------------------------------------------- signals


@pytest.mark.parametrize("number", SIGNALS, ids=lambda number: number.name)
def test_a_signal_in_the_loop_ends_the_run_and_keeps_it(
    number: signal.Signals, tmp_path: Path, monkeypatch: Any
) -> None:
    """Ctrl-C, a request to end, a closed terminal."""
    monkeypatch.setattr(Simulation, "step", after(Simulation.step, lambda: signal.raise_signal(number), 20))
    outcome = run(tmp_path, "--no-plot")
    found = Recording.load(tmp_path / "out/run.nc")
    assert outcome.returncode == 130 and "interrupted at t = 0.019 s" in outcome.stderr
    assert not found.complete and len(found) == 20


PLACES = {
    "while the samples are made a recording": (samples, "find_events"),
    "between the run and its file": (Simulation, "run"),
    "while the file is written": (Recording, "save"),
    "while the figure is drawn": (style, "save_figure"),
}


@pytest.mark.parametrize("place", PLACES.values(), ids=list(PLACES))
@pytest.mark.parametrize("times", [1, 2])
def test_a_signal_after_the_last_sample_loses_nothing(place: Any, times: int, tmp_path: Path, monkeypatch: Any) -> None:
    """Wherever it comes, and if it comes twice: the run is complete, the program says that it was interrupted."""
    owner, name = place
    act = lambda: [signal.raise_signal(signal.SIGINT) for _ in range(times)]  # noqa: E731
    monkeypatch.setattr(owner, name, after(getattr(owner, name), act))
    has_figure = owner is style
    outcome = run(tmp_path) if has_figure else run(tmp_path, "--no-plot")
    assert outcome.returncode == 130 and "interrupted" in outcome.stderr
    assert Recording.load(tmp_path / "out/run.nc").complete
    assert (tmp_path / "out/figure.png").is_file() == has_figure


def test_a_second_signal_while_the_first_is_answered_loses_nothing(tmp_path: Path, monkeypatch: Any) -> None:
    """As of somebody who presses Ctrl-C until the prompt is back."""
    again = lambda: signal.raise_signal(signal.SIGINT)  # noqa: E731
    monkeypatch.setattr(Simulation, "step", after(Simulation.step, again, 20))
    monkeypatch.setattr(samples, "find_events", after(samples.find_events, again))
    monkeypatch.setattr(Recording, "save", after(Recording.save, again))
    assert run(tmp_path).returncode == 130
    assert len(Recording.load(tmp_path / "out/run.nc")) == 20 and (tmp_path / "out/figure.png").is_file()


def test_a_run_in_python_keeps_what_it_has(monkeypatch: Any) -> None:
    """Where nobody holds signals, too: in the last line of the loop, and while the samples are made a recording."""
    scenario = load_scenario("target-a", {"duration": DURATION})
    for owner, name, calls in ((Simulation, "step", 50), (samples, "find_events", 1)):
        with monkeypatch.context() as patch:
            act = lambda: signal.raise_signal(signal.SIGINT)  # noqa: E731
            patch.setattr(owner, name, after(getattr(owner, name), act, calls))
            with pytest.raises(Exception, match="interrupted") as caught:
                simulate(scenario)
            assert len(caught.value.recording) >= 50  # type: ignore[attr-defined]


def test_what_is_held_is_answered_inside_alone() -> None:
    """Also what came before; afterwards it is held again, and then it is as it was."""
    with interrupts_held() as held:
        signal.raise_signal(signal.SIGINT)
        with pytest.raises(KeyboardInterrupt), interruptible():
            pytest.fail("the loop began")
        signal.raise_signal(signal.SIGTERM)
    assert held.came and signal.getsignal(signal.SIGINT) is signal.default_int_handler
    with interruptible(), pytest.raises(KeyboardInterrupt):
        signal.raise_signal(signal.SIGHUP)


# ------------------------------------------------------------------------------------------------------------ the disk


def full(*_: object) -> None:
    raise OSError(errno.ENOSPC, "No space left on device")


def test_a_folder_that_is_gone_at_the_end_is_no_loss(tmp_path: Path, monkeypatch: Any) -> None:
    """The results are elsewhere, and it is said where."""
    gone = lambda: shutil.rmtree(tmp_path / "out")  # noqa: E731
    monkeypatch.setattr(Simulation, "run", after(Simulation.run, gone))
    monkeypatch.setattr("tempfile.tempdir", str(tmp_path))
    outcome = run(tmp_path, "-q")
    (other,) = tmp_path.glob("softhand-out-*")
    assert outcome.returncode == 0 and str(other) in outcome.stderr and "No such file" in outcome.stderr
    assert {file.name for file in other.iterdir()} == {"run.nc", "figure.png", "scenario.toml"}
    assert Recording.load(other / "run.nc").complete


def test_a_figure_that_finds_no_room_is_no_error_of_the_run(tmp_path: Path, monkeypatch: Any) -> None:
    """The recording is there, and the figure can be drawn again."""

    def refuse(*_: object) -> None:
        raise RecordingError("out/figure.png: cannot be written: No space left on device")

    monkeypatch.setattr(style, "save_figure", refuse)
    outcome = run(tmp_path)
    assert outcome.returncode == 0 and "The recording is whole" in outcome.stderr
    assert "wrote scenario.toml, run.nc in out/" in outcome.stdout and Recording.load(tmp_path / "out/run.nc").complete


@pytest.mark.parametrize(
    ("command", "name"), [("simulate", "scenario.toml"), ("compare", "comparison.csv")], ids=lambda text: text
)
def test_no_empty_file_under_its_final_name(command: str, name: str, tmp_path: Path, monkeypatch: Any) -> None:
    """On a full disk: what was there before stays, and nothing half written comes to it."""
    (tmp_path / "out").mkdir()
    (tmp_path / "out" / name).write_text("older")
    monkeypatch.setattr(Path, "write_bytes", full)
    short = ["--duration", "0.002", "--out", "out", "-q"]
    more = ["--controller", "regulation"] if command == "compare" else ["--no-plot"]
    outcome = run_command(command, *short, *more, folder=tmp_path)
    assert outcome.returncode == 1 and f"{name}: cannot be written: No space left" in outcome.stderr
    assert [file.name for file in (tmp_path / "out").iterdir()] == [name]
    assert (tmp_path / "out" / name).read_text() == "older"


def test_results_of_an_older_run_do_not_stay_beside_a_new_scenario(tmp_path: Path, monkeypatch: Any) -> None:
    """Of a run that is lost nothing is left that could be taken for it."""
    assert run(tmp_path).returncode == 0
    monkeypatch.setattr(Simulation, "run", lambda *_: pytest.exit("killed"))  # no error that is answered
    with pytest.raises(pytest.exit.Exception):
        run(tmp_path, "--set", "object.mass=0.3")
    assert [file.name for file in (tmp_path / "out").iterdir()] == ["scenario.toml"]


def test_a_result_that_cannot_be_replaced_is_named(tmp_path: Path) -> None:
    """A folder of the name of the recording."""
    (tmp_path / "out/run.nc").mkdir(parents=True)
    outcome = run(tmp_path)
    assert outcome.returncode == 1 and "out/run.nc: cannot be replaced" in outcome.stderr
    assert "Traceback" not in outcome.stderr


# ---------------------------------------------------------------------------------------------------- code of the user


class Leaves(Controller):
    """Ends the program in the middle of a run."""

    def torque(self, observation: Any, memory: Any) -> Any:
        if observation.time > 0.0195:
            raise SystemExit("enough")
        return observation.gravity_torque, None


class Rotates(Controller):
    """Its torque has an imaginary part."""

    kind: str = "array"

    def torque(self, observation: Any, memory: Any) -> Any:
        torque = observation.gravity_torque + 1j
        return (torque if self.kind == "array" else torque.tolist()), None


def test_a_controller_that_ends_the_program_ends_the_run() -> None:
    """Its recording is kept, as with any error of a controller."""
    with pytest.raises(ControllerError, match="'Leaves' raised SystemExit: enough") as caught:
        simulate(load_scenario("target-a", {"duration": DURATION}), Leaves())
    assert len(caught.value.recording) == 20


@pytest.mark.parametrize("kind", ["array", "list"])
def test_a_complex_torque_is_refused_by_name(kind: str) -> None:
    """No half of it is taken without a word."""
    with pytest.raises(ControllerError, match=r"(?s)'Rotates' returned .*j.* as torque, which is no array of real"):
        simulate(load_scenario("target-a", {"duration": DURATION}), Rotates(kind=kind))


@pytest.mark.parametrize("name", ["coordinates", "internal_force", "rate", "acceleration"])
def test_a_complex_goal_is_refused_by_name(name: str) -> None:
    """As a reference of one's own may return it."""
    values = {"coordinates": np.zeros(6), "internal_force": np.ones(3), name: np.full(6, 1j)}
    with pytest.raises(ValueError, match=f"as {name}, which is no array of real numbers"):
        Goal(**values)
