"""The commands of the analyses: each prints what its call from Python returns."""

from __future__ import annotations

import json
from importlib import import_module
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from commands import Outcome, run_command

import softhand
from softhand import load_scenario, simulate
from softhand.grasping import workspace as workspace_module
from softhand.margins import stability as stability_module
from softhand.plots import workspace as workspace_figure
from softhand.scenario.file import resolve_path


@pytest.fixture(scope="session")
def run_file(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A short run of the paper's step."""
    file = tmp_path_factory.mktemp("run") / "run.nc"
    simulate(load_scenario("target-a", {"duration": 0.06, "reference.kind": "step"})).save(file)
    return file


@pytest.fixture
def watch(monkeypatch: pytest.MonkeyPatch):
    """Function that notes what a public call returns while a command makes it; makes sure that it is public."""

    def note(home: str, name: str) -> list[Any]:
        module, results = import_module(f"softhand.{home}"), []
        call = getattr(module, name)
        assert getattr(softhand, name) is call
        monkeypatch.setattr(
            module, name, lambda *args, **options: results.append(call(*args, **options)) or results[-1]
        )
        return results

    return note


def assert_prints(result: Outcome, rows: list[tuple[str, ...]]) -> None:
    """Each row stands in one line of the output, in this order."""
    assert result.returncode == 0, result.stderr
    lines = iter([" ".join(line.split()) for line in result.stdout.splitlines()])
    for row in rows:
        wanted = " ".join(" ".join(row).split())
        assert any(line == wanted for line in lines), wanted


@pytest.mark.slow
def test_identify_runs_on_the_example(tmp_path):
    """`softhand identify --example` prints coefficients and the comparison, and leaves figure, section and data."""
    result = run_command("identify", "--example", "--out", "fit", folder=tmp_path)
    assert result.returncode == 0, result.stderr
    for word in ("k_theta", "95 %", "nakashima", "best", "of repeats"):
        assert word in result.stdout
    assert {file.name for file in (tmp_path / "fit").iterdir()} == {"fit.png", "fingertip.toml", "example.csv"}
    again = run_command("identify", "fit/example.csv", "--no-compare", "--quiet", "--out", "again", folder=tmp_path)
    assert (again.returncode, again.stdout) == (0, "")
    assert (tmp_path / "again/fingertip.toml").read_text() == (tmp_path / "fit/fingertip.toml").read_text()


def test_remark_3_writes_its_figure(tmp_path):
    """`softhand remark3` draws the tip of a scenario."""
    assert run_command("remark3", "--out", "angle.svg", folder=tmp_path).returncode == 0
    assert "<svg" in (tmp_path / "angle.svg").read_text()


def test_lyapunov_says_where_V_rises(tmp_path, run_file, watch):
    """The rows and the notes of the call; the figure beside the recording."""
    (tmp_path / "run.nc").write_bytes(run_file.read_bytes())
    found = watch("closed_loop.lyapunov", "lyapunov")
    result = run_command("lyapunov", "run.nc", folder=tmp_path)
    notes = [(f"note: {note}",) for note in found[0].notes()]
    assert_prints(result, [*found[0].rows(), *notes, ("wrote lyapunov.png",)])
    assert len(notes) > 1 and "V rises by" in notes[0][0] and (tmp_path / "lyapunov.png").is_file()


def test_energy_prints_the_ledger(tmp_path, run_file, watch):
    """The rows of the call; the figure where it is asked for."""
    found = watch("analysis.energy", "energy_ledger")
    result = run_command("energy", str(run_file), "--out", "energy.svg", folder=tmp_path)
    assert_prints(result, found[0].rows())
    assert "<svg" in (tmp_path / "energy.svg").read_text()


@pytest.fixture
def short_scan(monkeypatch: pytest.MonkeyPatch) -> None:
    """A scan of few points."""
    monkeypatch.setattr(stability_module, "STIFFNESS", np.array([0.8, 1.0, 1.3]))
    monkeypatch.setattr(stability_module, "GAIN", np.array([0.5, 1.0, 4.0]))


def test_stability_prints_growth_and_draws_the_scan(tmp_path, watch, short_scan):
    """The share of the contact stiffness and the growth rates of target-a, as docs/stability.md has them."""
    found = watch("margins.stability", "stability")
    result = run_command("stability", "--scan", folder=tmp_path)
    assert_prints(result, found[0].rows())
    rows = dict(found[0].rows())
    assert rows["share of the contact stiffness that K_O takes"] == "0.421"
    assert rows["growth with torques held for 1 ms"] == "+5.24 1/s (unstable)".replace(" (", "  (")
    folder = tmp_path / "runs/stability-target-a"
    assert sorted(file.name for file in folder.iterdir()) == ["stability-scan.png", "stability.png"]
    assert found[0].scan.growth.shape == (3, 3)


def test_stability_takes_any_controller(tmp_path, watch):
    """Growth rates and modes without a scan; JSON with the same numbers."""
    found = watch("margins.stability", "stability")
    result = run_command("stability", "object-impedance", "--out", "modes.svg", "--json", folder=tmp_path)
    assert json.loads(result.stdout) == json.loads(found[0].to_json())
    assert [label for label, _ in found[0].rows()][3:] == ["mode 1", "mode 2", "mode 3", "mode 4"]
    assert "<svg" in (tmp_path / "modes.svg").read_text()


def test_workspace_compares_with_the_paper(tmp_path, watch, monkeypatch):
    """The range of each coordinate beside the paper's."""
    draw = workspace_figure.draw_workspace
    monkeypatch.setattr(workspace_module, "POSES", 1024)
    monkeypatch.setattr(workspace_figure, "draw_workspace", lambda poses, title: draw(poses, title, count=21))
    found = watch("grasping.workspace", "workspace")
    result = run_command("workspace", folder=tmp_path)
    assert_prints(result, found[0].rows())
    rows = dict(found[0].rows())
    assert rows["+roll alone"] == "+22.7 deg  (finger_3_tip at its apex, less than the paper's)"
    assert "held within ±20 mm, ±30 deg" in rows and (tmp_path / "runs/workspace-target-a/workspace.png").is_file()


@pytest.mark.parametrize("target", ["target-a", "run", "hand"])
def test_check_prints_what_it_found(tmp_path, run_file, watch, target):
    """Tables and warnings of a scenario, a recording and a URDF."""
    hand = resolve_path("package://softhand/urdf/three_finger_hand.urdf")
    name = {"target-a": "target-a", "run": str(run_file), "hand": str(hand)}[target]
    found = watch("checks.check", "check")
    result = run_command("check", name, folder=tmp_path)
    rows = [row for title, rows in found[0].tables(name) for row in [(title,), *rows]]
    assert_prints(result, rows)
    assert f"{name}: no errors, {len(found[0].warnings)} warning" in result.stdout
    assert result.stdout.count("warning: ") == len(found[0].warnings)


def test_check_takes_what_is_loaded(run_file):
    """A scenario and a recording in place of their names, with the same findings."""
    by_name, loaded = (
        softhand.check("target-a", {"object.mass": 0.21}),
        load_scenario("target-a", {"object.mass": 0.21}),
    )
    assert softhand.check(loaded) == by_name == softhand.check(load_scenario("target-a"), {"object.mass": 0.21})
    assert ("object.mass", "0.21", "kg") in by_name.values
    assert softhand.check(softhand.load_recording(run_file)) == softhand.check(run_file)
    with pytest.raises(softhand.ScenarioError, match="changes are for a scenario, and this is a recording"):
        softhand.check(run_file, {"object.mass": 1.0})


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["identify"], ["CSV", "--example"]),
        (["identify", "missing.csv"], ["missing.csv", "No such file"]),
        (["identify", "--example", "--law", "nakasima"], ["law", "Did you mean", "nakashima"]),
        (["identify", "--example", "--fix", "k_q=1"], ["k_q", "k_r"]),
        (["identify", "--example", "--fix", "k_r=soft"], ["k_r", "soft", "number"]),
        (["identify", "--example", "--level", "95"], ["--level", "95"]),
        (["lyapunov", "missing.nc"], ["missing.nc", "no such file"]),
        (["stability", "--set", 'controller={name = "regulatoin"}'], ["regulatoin", "regulation"]),
        (["workspace", "--phi-min", "80", "--phi-max", "20"], ["--phi-min", "80", "20"]),
        (["workspace", "--set", "object.position=[0, 0, 1]"], ["finger_1_tip", "misses"]),
    ],
)
def test_a_mistake_gives_one_message_and_no_traceback(tmp_path, arguments, words):
    """A user's mistake: the thing, its value, the remedy; nothing on stdout; exit code 1."""
    result = run_command(*arguments, folder=tmp_path)
    assert result.returncode == 1
    assert result.errors.startswith("error:") and "Traceback" not in result.stderr and result.stdout == ""
    for word in words:
        assert word in result.stderr
