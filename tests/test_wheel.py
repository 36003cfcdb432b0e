"""The wheel holds all that a run needs."""

import os
import subprocess
import sys
import zipfile
from pathlib import Path

import pytest
from hatchling.builders.wheel import WheelBuilder

ROOT = Path(__file__).parent.parent


def build(folder):
    """The wheel of the checkout."""
    (file,) = WheelBuilder(str(ROOT)).build(directory=str(folder), versions=["standard"])
    return zipfile.ZipFile(file)


@pytest.fixture(scope="module")
def wheel(tmp_path_factory):
    """Built once, without machine code."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("SOFTHAND_MACHINE_CODE", "0")
        return build(tmp_path_factory.mktemp("dist"))


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


@pytest.mark.slow  # compiles the main job, and what it does not hold
def test_a_wheel_runs_from_another_folder(tmp_path):
    """Unpacked and started far from the checkout, it finds its URDFs and scenarios; the main job compiles nothing."""
    site, away, kept = tmp_path / "site", tmp_path / "away", tmp_path / "kept"
    wheel = build(tmp_path / "dist")
    assert "-none-any" not in str(wheel.filename)
    wheel.extractall(site)
    away.mkdir()
    environment = {**os.environ, "PYTHONPATH": str(site), "SOFTHAND_CACHE_DIR": str(kept)}
    main = "import sys; from softhand.commands.main import main; sys.argv[1:] = ['simulate', '--quiet']; main()"
    subprocess.run([sys.executable, "-c", main], cwd=away, env=environment, check=True)
    assert (away / "runs/target-a/figure.png").is_file() and not list(kept.rglob("*.nbc"))
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
    result = subprocess.run([sys.executable, "-c", program], cwd=away, env=environment, capture_output=True, text=True,
                            check=False)  # fmt: skip
    assert result.returncode == 0, result.stderr
    package, urdf, complete = result.stdout.split()
    assert package.startswith(str(site)) and urdf.startswith(str(site)) and complete == "True"
