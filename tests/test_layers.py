"""Imports point down the list of layers in docs/architecture.md."""

import ast
import re
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parent.parent
PACKAGE = ROOT / "softhand"
BLOCK = re.search(r"```layers\n(.*?)```", (ROOT / "docs/architecture.md").read_text(), re.DOTALL).group(1)
LAYER = {name: level for level, line in enumerate(BLOCK.splitlines()) for name in line.split()}
FILES = sorted(file for file in PACKAGE.rglob("*.py") if file != PACKAGE / "__init__.py")


def part_of(file):
    """The module or sub-package of softhand that a file belongs to."""
    return file.relative_to(PACKAGE).with_suffix("").parts[0]


def imported(file):
    """Parts of softhand that a file imports anywhere in it."""
    for node in ast.walk(ast.parse(file.read_text())):
        if isinstance(node, ast.ImportFrom) and (node.module or "").startswith("softhand"):
            parts = node.module.split(".")[1:]
            yield from [parts[0]] if parts else [alias.name for alias in node.names]
        elif isinstance(node, ast.Import):
            yield from (alias.name.split(".")[1] for alias in node.names if alias.name.startswith("softhand."))


def test_every_module_has_a_layer():
    """The list names each module and package once, and nothing that is not there."""
    assert {part_of(file) for file in FILES} == set(LAYER)
    assert len(LAYER) == len(BLOCK.split())


@pytest.mark.parametrize("file", FILES, ids=lambda file: str(file.relative_to(PACKAGE)))
def test_imports_point_down(file):
    """A file imports from lower layers and from its own package only."""
    own = part_of(file)
    for other in imported(file):
        assert other == own or LAYER[other] < LAYER[own], f"{file} imports {other}"


def test_the_public_face_pulls_in_nothing_heavy():
    """`import softhand` alone loads neither numba, Pinocchio, matplotlib nor pydantic."""
    heavy = "('numba', 'pinocchio', 'matplotlib', 'pydantic')"
    program = f"import softhand, sys; print([name for name in {heavy} if name in sys.modules])"
    result = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=True)
    assert result.stdout.strip() == "[]"
