"""Mistakes in laws, dampings, controllers and steppers of one's own: one message with name, file and line."""

from __future__ import annotations

from pathlib import Path

import pytest
from commands import run_command

from softhand import plugins
from softhand.errors import LawError
from softhand.laws.law import Law, check_law, compile_law
from softhand.simulation.faults import diverged


@pytest.fixture(autouse=True)
def forget(monkeypatch: pytest.MonkeyPatch) -> None:
    """What files add is gone after each test, as after a command."""
    monkeypatch.setattr(plugins, "_files", [])
    monkeypatch.setattr(plugins, "_from_files", {kind: {} for kind in plugins.SHIPPED})


ARGUMENTS = "dr, dtheta, dphi, dpsi, phi, radius, k"
GOOD = "        return k * dr, k * radius**2 * dtheta, k * radius**2 * dphi, 0.0"


def law(body: str, arguments: str = ARGUMENTS, fields: str = "k: float = 4000.0", before: str = "") -> str:
    """The file of a law; its formula begins in line 6 with @staticmethod in line 5."""
    return f"import math, softhand\n{before}\nclass Gel(softhand.Law):\n    {fields}\n    @staticmethod\n" + (
        f"    def force({arguments}):\n{body}\n"
    )


IN_A_BRANCH = "        if dr > 0.005:\n            return {}\n" + GOOD
LAWS = {
    "three numbers": (law("        return k * dr, 0.0, 0.0"), "force must return 4 finite numbers, got [0.4, 0", 5),
    "a name": (law("        return k * dr, stiff, 0.0, 0.0"), "the name 'stiff' is not defined", 7),
    "a name in a branch": (law(IN_A_BRANCH.format("k * dr, stiff, 0.0, 0.0")), "the name 'stiff' is not defined", 8),
    "a name in a helper": (
        law("        return helper(dr), 0.0, 0.0, 0.0", before="def helper(x): return x * stiff"),
        "the name 'stiff' is not defined",
        2,
    ),
    "three in a branch": (law(IN_A_BRANCH.format("k * dr, 0.0, 0.0")), "3 numbers in one place and 4 in another", None),
    "math": (law(IN_A_BRANCH.format("math.sine(dr), 0.0, 0.0, 0.0")), "no attribute 'sine'", None),
    "no variable": (
        law("        if dr > 1.0:\n            b = 1.0\n        return k * dr, b, 0.0, 0.0"), "UnboundLocalError", 9
    ),
    "a file": (law(IN_A_BRANCH.format("dr, len(open('x').read()), 0.0, 0.0")), "'open'", 8),
    "text": (law("        return 'a', 0.0, 0.0, 0.0"), "force must return 4 finite numbers, got ('a'", 5),
    "order": (law(GOOD, "dr, dtheta, dphi, dpsi, phi, k, radius"), "radius, k (7 numbers) in this order", 5),
    "count": (law(GOOD, ARGUMENTS + ", c"), "missing a required argument: 'c'", 5),
    "field": (law(GOOD, fields="k: str = 'a'"), "its field k is 'a'", 5),
    "self": (law(GOOD, f"self, {ARGUMENTS}").replace("    @staticmethod\n", "\n"), "write @staticmethod above it", 6),
    "no formula": (law(GOOD).replace("def force", "def strength"), "has no formula; write the static method", 0),
}  # fmt: skip
"""A file, words of the message, and the line; None for a line of the formula."""


@pytest.mark.parametrize("name", LAWS)
def test_a_mistake_in_a_law(name: str, tmp_path: Path) -> None:
    """One line, exit code 1, before anything is solved with the law."""
    text, words, line = LAWS[name]
    (tmp_path / "gel.py").write_text(text)
    chosen = 'fingertip={law="gel", friction=0.5, radius=0.01}'
    result = run_command("check", "target-a", "--plugin", "gel.py", "--set", chosen, folder=tmp_path)
    message = result.stderr.removeprefix("Compiling kernels for this kind of hand, object and law, once ...\n")
    assert result.returncode == 1 and message.count("\n") == 1 and len(message) < 600, message
    assert message.startswith("error: law 'Gel'") and words in message, message
    if line != 0:
        assert f"({tmp_path}/gel.py, line {'' if line is None else line}" in message, message


def test_a_law_error_carries_its_place(tmp_path: Path) -> None:
    """For programs: law, file, line."""

    class Two(Law):
        """Two numbers."""

        @staticmethod
        def force(dr, dtheta, dphi, dpsi, phi, radius):
            return dr, dtheta

    for check in (check_law, compile_law):
        with pytest.raises(LawError) as caught:
            check(Two(radius=0.01))
        assert (caught.value.law, caught.value.file) == ("Two", __file__)
        assert caught.value.line == Two.force.__code__.co_firstlineno


OTHERS = {
    "syntax": ("class Gel(\n", (), "gel.py: this plugin cannot be run: SyntaxError: '(' was never closed", 1),
    "import": ("import softhand\nimport nothing_such\n", (), "ModuleNotFoundError: No module named 'nothing_such'", 2),
    "damping count": (
        "import softhand\nclass Oil(softhand.Damping):\n    def viscosity(self): return 1.0, 2.0\n",
        ('fingertip.damping={name="oil"}',), "damping 'Oil': viscosity must return 3 numbers >= 0, got [1.0, 2.0]", 0,
    ),
    "damping": (
        "import softhand\nclass Oil(softhand.Damping):\n    def relaxation(self): return thick\n",
        ('fingertip.damping={name="oil"}',), "damping 'Oil' raised NameError: name 'thick' is not defined", 3,
    ),
    "relaxation": (
        "import softhand\nclass Oil(softhand.Damping):\n    def relaxation(self): return ((1.2, 3.0),)\n",
        ('fingertip.damping={name="oil"}',), "the sum of the c_k below 1, got [[1.2, 3.0]]", 0,
    ),
    "controller": (
        "import softhand\nclass Mine(softhand.Controller):\n    def start(self, observation): pass\n"
        "    def torque(self, observation, memory): return missing, None\n",
        ('controller={name="mine"}',), "controller 'Mine' raised NameError: name 'missing' is not defined", 4,
    ),
    "stepper": (
        "from softhand.steppers.stepper import Stepper\nclass Leap(Stepper):\n"
        "    def start(self, plant): return plant.nothing\n",
        ('stepper={name="leap"}',), "stepper 'Leap' raised AttributeError: 'Plant' object has no attribute", 3,
    ),
}  # fmt: skip


@pytest.mark.parametrize("name", OTHERS)
def test_a_mistake_in_another_plugin(name: str, tmp_path: Path) -> None:
    """Likewise; a line 0 is not asked for."""
    text, settings, words, line = OTHERS[name]
    (tmp_path / "gel.py").write_text(text)
    values = [part for setting in settings for part in ("--set", setting)]
    result = run_command("check", "target-a", "--plugin", "gel.py", *values, folder=tmp_path)
    assert result.returncode == 1 and "Traceback" not in result.stderr and words in result.stderr, result.stderr
    assert not line or f"gel.py, line {line})" in result.stderr, result.stderr


def test_a_stepper_that_fails_on_the_way_leaves_its_samples(tmp_path: Path) -> None:
    """The run is kept up to there, and the message has the line."""
    (tmp_path / "leap.py").write_text(
        "from softhand.steppers.stepper import Integration, Stepper\n"
        "class Leap(Stepper):\n    def start(self, plant): return Leaping(plant)\n"
        "class Leaping(Integration):\n    count = 0\n    def advance(self, state, torque):\n"
        "        self.count += 1\n        if self.count > 5: raise KeyError('lost')\n"
    )
    chosen = ("--plugin", "leap.py", "--set", 'stepper={name="leap"}', "--no-plot", "--out", "out")
    result = run_command("simulate", "target-a", *chosen, folder=tmp_path)
    assert result.returncode == 1 and "raised KeyError: 'lost'" in result.stderr, result.stderr
    assert "leap.py, line 8) (at t = 0.004 s)" in result.stderr and (tmp_path / "out/run.nc").is_file(), result.stderr


@pytest.mark.parametrize("is_limited", [True, False])
def test_advice_is_no_stepper_that_would_not_help(is_limited: bool) -> None:
    """Midpoint is for steppers that are stable up to some step; it is not recommended to its own users."""
    assert ("midpoint" in str(diverged("a reason", 0.1, is_limited))) is is_limited
