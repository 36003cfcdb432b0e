"""The commands of the analyses, started as a user starts them."""

import subprocess
import sys
from pathlib import Path

import pytest

from softhand import load_scenario, simulate

COMMAND = str(Path(sys.executable).with_name("softhand"))


def run(*arguments, folder):
    return subprocess.run([COMMAND, *arguments], cwd=folder, capture_output=True, text=True, timeout=600, check=False)


def test_identify_runs_on_the_example(tmp_path):
    """`softhand identify --example` prints coefficients and the comparison, and leaves figure, section and data."""
    result = run("identify", "--example", "--out", "fit", folder=tmp_path)
    assert result.returncode == 0, result.stderr
    for word in ("k_theta", "95 %", "nakashima", "best", "of repeats"):
        assert word in result.stdout
    assert {file.name for file in (tmp_path / "fit").iterdir()} == {"fit.png", "fingertip.toml", "example.csv"}
    again = run("identify", "fit/example.csv", "--no-compare", "--quiet", "--out", "again", folder=tmp_path)
    assert (again.returncode, again.stdout) == (0, "")
    assert (tmp_path / "again/fingertip.toml").read_text() == (tmp_path / "fit/fingertip.toml").read_text()


def test_remark_3_writes_its_figure(tmp_path):
    """`softhand remark3` draws the tip of a scenario."""
    assert run("remark3", "--out", "angle.svg", folder=tmp_path).returncode == 0
    assert "<svg" in (tmp_path / "angle.svg").read_text()


def test_lyapunov_says_where_V_rises(tmp_path):
    """`softhand lyapunov` prints the terms and the stretches, and writes the figure beside the recording."""
    simulate(load_scenario("target-a", {"duration": 0.06, "reference.kind": "step"})).save(tmp_path / "run.nc")
    result = run("lyapunov", "run.nc", folder=tmp_path)
    assert result.returncode == 0, result.stderr
    for words in ("by the motion of f_d", "V rises by", "smallest singular value of L", "wrote lyapunov.png"):
        assert words in result.stdout
    assert (tmp_path / "lyapunov.png").is_file()


def test_stability_prints_growth(tmp_path):
    """`softhand stability` prints the share of the contact stiffness and the growth rates."""
    result = run("stability", folder=tmp_path)
    assert result.returncode == 0, result.stderr
    assert "0.421" in result.stdout and "unstable" in result.stdout and (tmp_path / "stability.png").is_file()


def test_workspace_compares_with_the_paper(tmp_path):
    """`softhand workspace` prints the range of each coordinate beside the paper's."""
    result = run("workspace", folder=tmp_path)
    assert result.returncode == 0, result.stderr
    for words in ("+roll alone", "+22.7 deg", "less than the paper's", "±20 mm, ±30 deg"):
        assert words in " ".join(result.stdout.split())
    assert (tmp_path / "workspace.png").is_file()


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["identify"], ["CSV", "--example"]),
        (["identify", "missing.csv"], ["missing.csv", "No such file"]),
        (["identify", "--example", "--law", "nakasima"], ["--law", "nakashima"]),
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
    result = run(*arguments, folder=tmp_path)
    assert result.returncode == 1
    assert result.stderr.startswith("error:") and "Traceback" not in result.stderr and result.stdout == ""
    for word in words:
        assert word in result.stderr
