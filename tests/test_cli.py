"""The command line: what it writes, prints and says of mistakes. Once it is started as a user starts it."""

import re
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest
from commands import run_command
from typer.main import get_command

import softhand
from softhand import Recording
from softhand.commands.help import Group
from softhand.commands.main import app
from softhand.plugins import SHIPPED

COMMAND = str(Path(sys.executable).with_name("softhand"))


def test_simulate_writes_a_run_folder(tmp_path):
    """`softhand simulate`, as a program, prints the table and writes run.nc, figure.png and scenario.toml."""
    result = subprocess.run([COMMAND, "simulate", "--duration", "0.02"], cwd=tmp_path, capture_output=True, text=True,
                            timeout=300, check=False)  # fmt: skip
    assert result.returncode == 0, result.stderr
    assert {file.name for file in (tmp_path / "runs/target-a").iterdir()} == {"run.nc", "figure.png", "scenario.toml"}
    for words in ("position error", "mm", "orientation error", "deg", "internal-force error", "friction use",
                  "steps per second", "real-time factor"):  # fmt: skip
        assert words in result.stdout


def test_a_second_run_does_not_overwrite_the_first(tmp_path):
    """Without --out each run gets a new folder."""
    for _ in range(2):
        assert run_command("simulate", "--duration", "0.002", "--no-plot", "--quiet", folder=tmp_path).returncode == 0
    assert (tmp_path / "runs/target-a/run.nc").is_file() and (tmp_path / "runs/target-a-2/run.nc").is_file()


def test_quiet_prints_nothing(tmp_path):
    """--quiet leaves both outputs empty."""
    result = run_command("simulate", "-q", "--no-plot", "--duration", "0.002", "--out", "here", folder=tmp_path)
    assert (result.returncode, result.stdout, result.stderr) == (0, "", "")
    assert not (tmp_path / "here/figure.png").exists()


def test_values_and_plugins_can_be_set(tmp_path):
    """--set, --stepper, --controller and --duration end up in scenario.toml, and the run repeats from it."""
    first = run_command("simulate", "target-b", "--set", "object.mass=0.3", "--set", "reference.kind=step",
                        "--stepper", "rk4", "--controller", "regulation", "--duration", "0.01", "--out", "one", "-q",
                        "--no-plot", folder=tmp_path)  # fmt: skip
    assert first.returncode == 0, first.stderr
    text = (tmp_path / "one/scenario.toml").read_text()
    assert "mass = 0.3" in text and 'name = "rk4"' in text and 'kind = "step"' in text
    second = run_command("simulate", "one/scenario.toml", "--out", "two", "-q", "--no-plot", folder=tmp_path)
    assert second.returncode == 0, second.stderr
    one, two = (Recording.load(tmp_path / name / "run.nc") for name in ("one", "two"))
    assert (one.object_position == two.object_position).all()


def test_list_names_everything_with_a_line(tmp_path):
    """`softhand list` shows scenarios, laws, controllers and steppers."""
    result = run_command("list", folder=tmp_path)
    assert result.returncode == 0
    for name in (
        "target-a",
        "target-b",
        "nakashima",
        "regulation",
        "midpoint",
        "rk4",
        "semi-implicit-euler",
        "adaptive",
    ):
        assert name in result.stdout


def test_plot_draws_a_recording(tmp_path):
    """`softhand plot` writes the figure in the format of its name."""
    run_command("simulate", "--duration", "0.01", "--no-plot", "--out", "x", "-q", folder=tmp_path)
    assert run_command("plot", "x/run.nc", "--out", "x/figure.svg", folder=tmp_path).returncode == 0
    assert "<svg" in (tmp_path / "x/figure.svg").read_text()


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["simulate", "target-c"], ["target-c", "target-a", "target-b"]),
        (["simulate", "--set", "fingertip.kr=1"], ["fingertip.kr", "fingertip.k_r"]),
        (["simulate", "--set", "fingertip.k_r=-1"], ["fingertip.k_r", "-1", "> 0"]),
        (["simulate", "--set", "object.mass=nan"], ["object.mass", "nan"]),
        (["simulate", "--set", "nonsense"], ["nonsense", "key=value"]),
        (["simulate", "--controller", "regulatoin"], ["controller.name", "regulatoin", "regulation"]),
        (["simulate", "--stepper", "rk5"], ["stepper.name", "rk4"]),
        (["simulate", "--set", "object.position=[0, 0, 1]"], ["finger_1_tip", "out of reach", "mm"]),
        (["simulate", "--set", "hand.urdf=missing.urdf"], ["missing.urdf"]),
        (["plot", "missing.nc"], ["missing.nc", "no such file"]),
        (["list", "horses"], ["horses", "laws"]),
    ],
)
def test_a_mistake_gives_one_message_and_no_traceback(tmp_path, arguments, words):
    """A user's mistake: the thing, its value, the remedy; nothing on stdout; exit code 1."""
    result = run_command(*arguments, folder=tmp_path)
    assert result.returncode == 1
    assert result.errors.startswith("error:") and "Traceback" not in result.stderr and result.stdout == ""
    for word in words:
        assert word in result.stderr


def test_interrupt_keeps_what_was_computed(tmp_path):
    """Ctrl-C ends a long run with exit code 130 and a readable recording."""
    process = subprocess.Popen(
        [COMMAND, "simulate", "--duration", "600", "--stepper", "adaptive", "--no-plot", "--out", "long", "-q"],
        cwd=tmp_path, stderr=subprocess.PIPE, text=True,
        preexec_fn=lambda: signal.signal(signal.SIGINT, signal.SIG_DFL),  # ignored where tests run in the background
    )  # fmt: skip
    while not (tmp_path / "long/scenario.toml").exists():
        time.sleep(0.05)
        assert process.poll() is None
    time.sleep(1.0)
    process.send_signal(signal.SIGINT)
    _, errors = process.communicate(timeout=60)
    assert process.returncode == 130 and "interrupted" in errors and "Traceback" not in errors
    recording = Recording.load(tmp_path / "long/run.nc")
    assert not recording.complete and "interrupted" in recording.reason


def test_the_help_is_plain(tmp_path):
    """Units in brackets are seen, no type stands in for what an option takes, and lines fit a narrow terminal."""
    for command in get_command(app).commands:
        shown = run_command(command, "--help", folder=tmp_path, width=80).stdout
        text, _, _ = shown.partition("Example: ")
        assert not re.search(r"<(bool|str|int|float|path)|\\\[|\bTEXT\b", text), command
        assert max(map(len, text.splitlines())) <= 80, command
    assert "Simulated time [s]." in run_command("simulate", "--help", folder=tmp_path, width=80).stdout


def test_the_help_of_the_program_has_every_command_by_its_task(tmp_path):
    """Each in one line of 80 letters, and none is left out; the same without --help."""
    shown = run_command("--help", folder=tmp_path, width=80)
    for task, names in Group.tasks.items():
        assert f"\n{task}\n" in shown.stdout
        for name in names:
            assert re.search(rf"^  {name} +[A-Z].*\.$", shown.stdout, re.MULTILINE), name
    assert {name for names in Group.tasks.values() for name in names} == set(get_command(app).commands)
    assert run_command(folder=tmp_path, width=80) == shown


SHARED = {
    "--set": "simulate check compare grasp grasps equilibrium squeeze push workspace stability gradient remark3 "
    "calibrate",
    "--law": "simulate check compare grasp grasps equilibrium squeeze push workspace stability gradient remark3 "
    "identify",
    "--controller": "simulate check compare grasp equilibrium squeeze push stability gradient",
    "--stepper": "simulate check compare grasp",
    "--out": "simulate compare grasp squeeze push workspace stability gradient remark3 reproduce identify validate "
    "plot report film export energy lyapunov material new sweep tune grasps calibrate",
    "--plugin": "simulate check compare grasp equilibrium squeeze push workspace stability gradient remark3 identify "
    "list plot view report film export energy lyapunov sweep tune grasps calibrate",
    "--json": "simulate check compare grasp equilibrium squeeze push workspace stability gradient reproduce identify "
    "validate energy lyapunov list hands material new sweep tune grasps calibrate",
    "--quiet": "simulate check compare grasp equilibrium squeeze push workspace stability gradient remark3 reproduce "
    "identify validate new plot view report film export energy lyapunov material sweep tune grasps calibrate",
}
"""Options and the commands that have them."""


def test_shared_options_are_everywhere():
    """Where they make sense, and nowhere else."""
    commands = get_command(app).commands
    for option, names in SHARED.items():
        assert {name for name, one in commands.items() if any(option in param.opts for param in one.params)} == set(
            names.split()
        ), option


def test_the_version_and_the_module():
    """`python -m softhand --version`, as `softhand --version`."""
    for program in ([COMMAND], [sys.executable, "-m", "softhand"]):
        found = subprocess.run([*program, "--version"], capture_output=True, text=True, timeout=60, check=True)
        assert found.stdout == f"softhand {softhand.__version__}\n"


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["simulat"], ["'simulat'", "simulate", "See: softhand --help"]),
        (["simulate", "--sped", "2"], ["--sped", "--speed", "See: softhand simulate --help"]),
        (["view", "--speed", "fast", "run.nc"], ["--speed", "fast"]),
        (["check"], ["TARGET", "See: softhand check --help"]),
    ],
)
def test_a_wrong_command_line_is_one_line(tmp_path, arguments, words):
    """With what may have been meant, and where to read on; exit code 2."""
    result = run_command(*arguments, folder=tmp_path)
    assert result.returncode == 2 and result.stdout == "" and result.stderr.count("\n") == 1
    assert result.stderr.startswith("error: ") and all(word in result.stderr for word in words), result.stderr


@pytest.mark.parametrize("shell", ["bash", "zsh", "fish", "powershell", "pwsh"])
def test_shells_complete(shell, tmp_path, monkeypatch):
    """Each gets its script, which asks the program."""
    monkeypatch.setenv("_SOFTHAND_COMPLETE", f"source_{shell}")
    assert "complete_" in run_command(folder=tmp_path).stdout


@pytest.mark.parametrize(
    ("line", "words"),
    [
        ("softhand sta", {"stability"}),
        ("softhand simulate target-", {"target-a", "target-b"}),
        ("softhand simulate --law hert", {"hertz"}),
        ("softhand check --contr", {"--controller"}),
        ("softhand list step", {"steppers"}),
    ],
)
def test_names_are_completed(line, words, tmp_path, monkeypatch):
    """Commands, options, and the names of what there is."""
    monkeypatch.setenv("_SOFTHAND_COMPLETE", "complete_bash")
    monkeypatch.setenv("COMP_WORDS", line)
    monkeypatch.setenv("COMP_CWORD", str(len(line.split()) - 1))
    assert set(run_command(folder=tmp_path).stdout.split()) == words


def test_the_help_imports_no_more_than_it_needs():
    """Neither what computes nor what draws, nor what prints bars."""
    heavy = {"numpy", "numba", "pinocchio", "scipy", "pydantic", "matplotlib", "rich"}
    code = f"""
import sys
from softhand.commands.main import main
sys.argv = ["softhand", "--help"]
try:
    main()
except SystemExit:
    pass
print({heavy} & set(sys.modules))
"""
    found = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, timeout=60, check=True)
    assert found.stdout.splitlines()[-1] == "set()"


def test_every_list_is_named_in_the_help(tmp_path):
    """`softhand list --help` names each kind that it lists."""
    shown = run_command("list", "--help", folder=tmp_path, width=120).stdout
    assert all(kind in shown for kind in ("scenarios", *SHIPPED))


def test_every_command_has_help_with_an_example(tmp_path):
    """--help of the program and of every command ends with an example."""
    for command in ([], *([name] for name in get_command(app).commands)):
        result = run_command(*command, "--help", folder=tmp_path, width=120)
        assert result.returncode == 0 and "Example: softhand" in result.stdout, command
