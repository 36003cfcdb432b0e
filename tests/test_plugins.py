"""Plugins: one table of names, open to other packages."""

import pytest
from commands import run_command

from softhand import Controller, Law, Reference, ScenarioError, Stepper, load_scenario, plugins, simulate
from softhand.dampings.damping import Damping
from softhand.plugins import SHIPPED, describe_plugin, find_plugin, plugin_name, plugin_names
from softhand.settings.toml import tomllib

BASES = {"laws": Law, "dampings": Damping, "controllers": Controller, "references": Reference, "steppers": Stepper}
ALL = [(kind, name) for kind, names in SHIPPED.items() for name in names]


@pytest.mark.parametrize(("kind", "name"), ALL)
def test_every_shipped_plugin_has_its_base_and_a_line(kind, name):
    """Each name stands for a subclass of the base, and its docstring starts with a line for listings."""
    assert issubclass(find_plugin(kind, name, "key"), BASES[kind])
    assert len(describe_plugin(kind, name)) > 20


@pytest.mark.parametrize("name", list(SHIPPED["steppers"]))
def test_every_stepper_runs_the_reference_task(name):
    """Each shipped stepper carries target A for 20 ms."""
    values = {"stepper": {"name": name, "step": 0.0005}, "duration": 0.02}
    assert simulate(load_scenario("target-a", values)).complete


def install(folder, monkeypatch, target):
    """A package with an entry point, as an installer leaves it."""
    package = folder / "gel_package"
    package.mkdir()
    (package / "__init__.py").write_text(
        "from math import pi\n"
        "from softhand import Law\n"
        "class Gel(Law):\n"
        '    """Linear gel: three springs that do not depend on the angle."""\n'
        "    k: float\n"
        "    @staticmethod\n"
        "    def force(dr, dtheta, dphi, dpsi, phi, radius, k):\n"
        "        return k * dr, k * radius**2 * dtheta, k * radius**2 * dphi, 1e-2 * k * radius**2 * dpsi\n"
    )
    info = folder / "gel_package-1.0.dist-info"
    info.mkdir()
    (info / "METADATA").write_text("Metadata-Version: 2.1\nName: gel-package\nVersion: 1.0\n")
    (info / "entry_points.txt").write_text(f"[softhand.laws]\ngel = {target}\n")
    monkeypatch.syspath_prepend(str(folder))


def test_another_package_adds_a_law_by_entry_point(tmp_path, monkeypatch):
    """A law of an installed package is listed, found by its name, and runs."""
    install(tmp_path, monkeypatch, "gel_package:Gel")
    assert "gel" in plugin_names("laws")
    fingertip = {"law": "gel", "friction": 0.5, "radius": 0.01, "k": 3000.0}
    assert simulate(load_scenario("target-a", {"fingertip": fingertip, "duration": 0.02})).complete


@pytest.mark.parametrize(
    ("target", "words"),
    [("gel_package:Missing", "cannot be imported"), ("gel_package:pi", "no subclass of softhand.Law")],
)
def test_a_broken_entry_point_is_named(tmp_path, monkeypatch, target, words):
    """An entry point that cannot be imported, or is no law, is an error with its name."""
    install(tmp_path, monkeypatch, target)
    with pytest.raises(ScenarioError, match=words):
        find_plugin("laws", "gel", "fingertip.law")


@pytest.mark.parametrize(("kind", "name"), ALL)
def test_a_class_has_the_name_that_finds_it(kind, name):
    """`plugin_name` is the inverse of `find_plugin`."""
    assert plugin_name(kind, find_plugin(kind, name, "key")) == name


def test_what_is_handed_over_is_recorded_by_its_name(tmp_path, monkeypatch):
    """That of the plugin if it is one, so that the run can be repeated from its scenario; else that of the class."""

    class Unknown(find_plugin("laws", "radial", "key")):
        """A law that nobody has told of."""

    install(tmp_path, monkeypatch, "gel_package:Gel")
    gel = find_plugin("laws", "gel", "key")
    assert (plugin_name("laws", gel), plugin_name("laws", Unknown)) == ("gel", "Unknown")
    blind = find_plugin("controllers", "blind", "key")
    recording = simulate("target-a", blind(), gel(radius=0.01, k=3000.0), duration=0.005)
    kept = tomllib.loads(recording.scenario)
    assert (kept["controller"]["name"], kept["fingertip"]["law"], kept["fingertip"]["k"]) == ("blind", "gel", 3000.0)
    assert "k_r" not in kept["fingertip"]


def test_an_unknown_name_gives_the_nearest(tmp_path):
    """The message of an unknown name lists what there is and the nearest."""
    with pytest.raises(ScenarioError, match='Did you mean "midpoint"') as caught:
        find_plugin("steppers", "midpont", "stepper.name")
    assert caught.value.key == "stepper.name" and "rk4" in str(caught.value)


SPRING = '''"""A law and a controller of one's own."""

from pathlib import Path

from softhand import Controller, Law
from softhand.laws.radial import Radial

Path(__file__).with_suffix(".run").touch()


class SoftGel(Law):
    """Linear gel."""

    k: float = 3000.0

    @staticmethod
    def force(dr, dtheta, dphi, dpsi, phi, radius, k):
        return k * dr, k * radius**2 * dtheta, k * radius**2 * dphi, 1e-2 * k * radius**2 * dpsi


class Still(Controller):
    """Hold the start."""

    def start(self, observation):
        return observation.f_C

    def torque(self, observation, memory):
        return observation.N_F + observation.J_CF_f.T @ memory, memory
'''


@pytest.fixture
def forget(monkeypatch):
    """A function after which what files have added is gone, as after a command; called before and after the test."""

    def call():
        monkeypatch.setattr(plugins, "_files", [])
        monkeypatch.setattr(plugins, "_from_files", {kind: {} for kind in SHIPPED})

    call()
    return call


def test_a_file_adds_plugins_for_one_command(tmp_path, forget):
    """`--plugin FILE.py` makes the classes of the file known by name; also in further processes."""
    (tmp_path / "mine.py").write_text(SPRING)
    short = ("--plugin", "mine.py", "--duration", "0.01", "-q", "--out", "out")
    result = run_command("simulate", "--law", "soft-gel", "--controller", "still", "--no-plot", *short, folder=tmp_path)
    assert result.returncode == 0, result.stderr
    assert 'law = "soft-gel"' in (tmp_path / "out/scenario.toml").read_text()
    forget()
    result = run_command("compare", "--law", "nakashima,soft-gel", "--jobs", "2", *short, folder=tmp_path)
    assert result.returncode == 0, result.stderr
    assert "soft-gel" in (tmp_path / "out/comparison.csv").read_text()


@pytest.mark.usefixtures("forget")
def test_a_scenario_cannot_load_a_file(tmp_path):
    """Without the flag the file is not run, whatever a scenario says, and its law is unknown."""
    (tmp_path / "mine.py").write_text(SPRING)
    for law in ("soft-gel", "mine.py", "mine:SoftGel", "./mine.py:SoftGel"):
        result = run_command("simulate", "--set", f"fingertip.law={law}", folder=tmp_path)
        assert result.returncode == 1 and "no law is called" in result.stderr
    assert not (tmp_path / "mine.run").exists()


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("import nothing_there", "cannot be run"),
        ("x = 1", "no subclass of Law, Damping, Controller, Reference, Stepper"),
        ("from softhand.laws.radial import Radial as R\nclass Radial(R): pass", 'there is a law "radial" already'),
        (None, "no Python file"),
    ],
)
@pytest.mark.usefixtures("forget")
def test_a_broken_plugin_file_is_one_message(tmp_path, text, words):
    """A file that cannot be run, has nothing, or a name that is taken."""
    if text is not None:
        (tmp_path / "mine.py").write_text(text)
    result = run_command("simulate", "--plugin", "mine.py", folder=tmp_path)
    assert result.returncode == 1 and words in result.stderr and "Traceback" not in result.stderr
