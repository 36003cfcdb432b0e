"""The wheel holds all that a run needs."""

import os
import subprocess
import sys
import zipfile
from pathlib import Path

import pytest
from hatchling.builders.wheel import WheelBuilder

ROOT = Path(__file__).parent.parent


@pytest.fixture(scope="module")
def wheel(tmp_path_factory):
    """Built once."""
    (file,) = WheelBuilder(str(ROOT)).build(directory=str(tmp_path_factory.mktemp("dist")), versions=["standard"])
    return zipfile.ZipFile(file)


def files_below(folder):
    """What lies below a folder of the checkout, but for what Python leaves there."""
    every = (file.relative_to(ROOT).as_posix() for file in (ROOT / folder).rglob("*") if file.is_file())
    return {name for name in every if "__pycache__" not in name}


def test_the_wheel_has_every_file_of_the_package_and_the_urdfs(wheel):
    """All of softhand/ as it is, scenarios and pages included, and urdf/ as softhand/urdf/; nothing else."""
    package, urdfs = files_below("softhand"), {f"softhand/{name}" for name in files_below("urdf")}
    packed = {name for name in wheel.namelist() if ".dist-info/" not in name}
    assert packed == package | urdfs
    for name in ("softhand/scenarios/target-a.toml", "softhand/urdf/box.urdf", "softhand/commands/main.py"):
        assert name in packed
    for name in package:
        assert wheel.read(name) == (ROOT / name).read_bytes(), name


def test_the_wheel_has_the_command(wheel):
    """`softhand` starts the function that the tests start."""
    (points,) = (name for name in wheel.namelist() if name.endswith("entry_points.txt"))
    assert "softhand = softhand.commands.main:main" in wheel.read(points).decode()


@pytest.mark.slow  # a package in another place compiles all its kernels anew
def test_a_wheel_runs_from_another_folder(wheel, tmp_path):
    """Unpacked and started far from the checkout, the wheel finds its URDFs and scenarios."""
    site, away = tmp_path / "site", tmp_path / "away"
    wheel.extractall(site)
    away.mkdir()
    program = (
        "import softhand\n"
        "from softhand.scenario.file import resolve_path\n"
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
