"""No kernel runs with old machine code: a change of any module that one reaches gives its code another folder."""

from __future__ import annotations

import ast
import importlib
import inspect
import json
import pkgutil
import shutil
import subprocess
import sys
from functools import cache
from pathlib import Path
from types import CodeType
from typing import Any

import pytest

import softhand
from softhand.laws.key import makings_of

PACKAGE = Path(softhand.__file__).parent
MAKERS = {"numerics.compiled", "numerics.inlined", "numerics.linking"}
"""What every kernel is compiled by."""
SCRIPT = """
import importlib, json, sys
from pathlib import Path
import softhand.numerics.compiled as compiled
package = Path(compiled.__file__).parents[1]
reached, unseen = json.loads(sys.argv[1]), []
before = {name: str(compiled.kernels_of(name)) for name in reached}
for changed in sorted({name for names in reached.values() for name in names}):
    file = package.joinpath(*changed.split(".")).with_suffix(".py")
    source = file.read_text()
    file.write_text(source + "# changed")
    importlib.reload(compiled)
    concerned = [name for name in reached if changed in reached[name]]
    unseen += [(name, changed) for name in concerned if str(compiled.kernels_of(name)) == before[name]]
    file.write_text(source)
importlib.reload(compiled)
assert before == {name: str(compiled.kernels_of(name)) for name in reached}
print(json.dumps(unseen))
"""


def kernels(module: Any) -> list[Any]:
    """The functions that a module compiles."""
    found = [getattr(value, "py_func", None) for value in vars(module).values()]
    return [function for function in found if function is not None and function.__module__ == module.__name__]


def inner(code: CodeType) -> list[CodeType]:
    return [code, *(part for constant in code.co_consts if inspect.iscode(constant) for part in inner(constant))]


def reached_by(functions: list[Any]) -> set[str]:
    """Modules of the package with the functions that these call, at any depth, and with the values that they read."""
    found: set[str] = set()
    for function in (one for kernel in functions for one in makings_of(kernel).functions):
        found.add(function.__module__)
        names = {name for code in inner(function.__code__) for name in code.co_names}
        for name in names & set(function.__globals__):
            value = function.__globals__[name]
            found |= {getattr(value, "__module__", None) or "", _imports(function.__module__).get(name, "")}
    return {name.removeprefix("softhand.") for name in found if name.startswith("softhand.")}


@cache
def _imports(module: str) -> dict[str, str]:
    """Each name that a module imports, and where from."""
    tree = ast.parse(inspect.getsource(importlib.import_module(module)))
    lines = [line for line in ast.walk(tree) if isinstance(line, ast.ImportFrom)]
    return {alias.asname or alias.name: line.module or "" for line in lines for alias in line.names}


@pytest.mark.slow
def test_every_change_that_a_kernel_sees_gives_it_another_folder(tmp_path: Path) -> None:
    """What is reached is found from the running code, what has an effect by changing a copy of each file in turn."""
    reached = {}
    for module in pkgutil.walk_packages([str(PACKAGE)], "softhand."):
        file = PACKAGE.parent.joinpath(*module.name.split(".")).with_suffix(".py")
        if file.is_file() and "@compiled" in file.read_text():
            functions = kernels(importlib.import_module(module.name))
            reached[module.name.removeprefix("softhand.")] = sorted(reached_by(functions) | MAKERS)
    assert {"contact.address", "contact.records"} <= set(reached["contact.layer"])
    assert "contact.friction" in reached["steppers.midpoint"]
    for file in PACKAGE.rglob("*.py"):
        copy = tmp_path / file.relative_to(PACKAGE.parent)
        copy.parent.mkdir(parents=True, exist_ok=True)
        shutil.copy(file, copy)
    environment = {"PYTHONPATH": str(tmp_path), "SOFTHAND_CACHE_DIR": str(tmp_path / "cache")}
    command = [sys.executable, "-B", "-c", SCRIPT, json.dumps(reached)]
    done = subprocess.run(command, cwd=tmp_path, env=environment, capture_output=True, text=True, timeout=300)
    assert done.returncode == 0, done.stderr
    assert json.loads(done.stdout) == []
