"""CONTRIBUTING.md: what it shows works as it stands, from one file and one line in the table of plugins."""

from __future__ import annotations

import importlib.util
import re
from pathlib import Path

import pytest

from softhand import load_scenario, simulate
from softhand.plugins import SHIPPED, plugin_names
from softhand.scenario.schema import scenario_schema

ROOT = Path(__file__).parent.parent
PAGE = (ROOT / "CONTRIBUTING.md").read_text()
RECIPES = dict(re.findall(r"### A (?:fingertip )?(\w+)\n\n```python\n(.*?)```", PAGE, re.DOTALL))
NAMES = {"laws": "linear", "dampings": "dashpot", "controllers": "hold", "references": "circle",
         "steppers": "explicit-midpoint"}  # fmt: skip


@pytest.fixture
def added(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A package with a file for each recipe, and a line for each in the table."""
    (tmp_path / "further").mkdir()
    (tmp_path / "further/__init__.py").touch()
    for kind, name in NAMES.items():
        (tmp_path / f"further/{kind}.py").write_text(RECIPES[kind[:-1]])
        monkeypatch.setitem(SHIPPED[kind], name, f"further.{kind}:{name.title().replace('-', '')}")
    monkeypatch.syspath_prepend(str(tmp_path))


def test_there_is_a_recipe_for_each_kind() -> None:
    """Law, damping, controller, reference, stepper."""
    assert set(SHIPPED) == {f"{kind}s" for kind in RECIPES} == set(NAMES)


@pytest.mark.usefixtures("added")
def test_a_file_and_a_line_add_one_of_each() -> None:
    """By their names in a scenario they run the reference task; lists, schema and tables of keys have them too."""
    values = {
        "fingertip": {"law": "linear", "radius": 0.010, "friction": 0.5, "damping": {"name": "dashpot", "c": 2.0}},
        "controller": {"name": "hold"},
        "reference": {"kind": "circle", "radius": 0.001},
        "stepper": {"name": "explicit-midpoint", "step": 0.0005},
        "duration": 0.02,
    }
    recording = simulate(load_scenario("target-a", values))
    assert recording.complete and all(name in recording.scenario for name in NAMES.values())
    schema, script = str(scenario_schema()), load_script()
    for kind, name in NAMES.items():
        assert name in plugin_names(kind) and f"'const': '{name}'" in schema
        assert f"| **`{name}`** |" in script.plugins(kind)
    assert "| `k_turn` | number > 0 | N m/rad | `0.02` | Stiffness of the torsion |" in script.plugins("laws")


def load_script():
    spec = importlib.util.spec_from_file_location("make_docs", ROOT / "scripts/make_docs.py")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module
