"""The wheel holds all that a run needs."""

import os
import subprocess
import sys
import zipfile
from pathlib import Path

ROOT = Path(__file__).parent.parent


def test_a_wheel_runs_from_another_folder(tmp_path):
    """Built, unpacked and started far from the checkout, the wheel finds its URDFs and scenarios."""
    subprocess.run(
        [sys.executable, "-m", "hatchling", "build", "-t", "wheel", "-d", tmp_path / "dist"],
        cwd=ROOT, check=True, capture_output=True,
    )  # fmt: skip
    (wheel,) = (tmp_path / "dist").glob("*.whl")
    site, away = tmp_path / "site", tmp_path / "away"
    zipfile.ZipFile(wheel).extractall(site)
    away.mkdir()
    program = (
        "import softhand\n"
        "from softhand.scenario_file import resolve_path\n"
        "print(softhand.__file__)\n"
        "print(resolve_path('package://softhand/urdf/box.urdf'))\n"
        "run = softhand.simulate(softhand.load_scenario('target-b', {'duration': 0.01}))\n"
        "run.to_html('report.html')\n"
        "softhand.simulate(softhand.load_scenario('prism', {'duration': 0.01}))\n"
        "print(run.complete)\n"
    )
    result = subprocess.run(
        [sys.executable, "-c", program], cwd=away, env={**os.environ, "PYTHONPATH": str(site)},
        capture_output=True, text=True, check=False,
    )  # fmt: skip
    assert result.returncode == 0, result.stderr
    package, urdf, complete = result.stdout.split()
    assert package.startswith(str(site)) and urdf.startswith(str(site)) and complete == "True"
