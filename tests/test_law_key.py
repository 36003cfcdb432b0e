"""The key of a formula: it changes with all that the machine code is made of, and with nothing else."""

from __future__ import annotations

import importlib
import sys
from pathlib import Path
from typing import Any

import pytest

from softhand.laws.key import makings_of

FORMULA = """
import math
from collections import namedtuple
import numpy as np
from numba import njit
import further_constants
from further_constants import near as close
FACTOR = 1.0
TABLE = np.linspace(0.0, 1.0, 2001)
ROWS = ((1.0, 2.0), [3.0])
NAMED = {"a": 1.0}
POINT = namedtuple("POINT", "x y")(1.0, 2.0)
@njit(error_model="numpy")
def by_numba(x):
    return 1.0 * x
def helper(x, scale=1.0):
    return FACTOR * scale * by_numba(x)
def formula(x):
    inner = [ROWS[0][0] * y for y in (x, 1.0)]
    return helper(x) + TABLE[3] + further_constants.STIFF * close(x) + math.sin(x) + inner[0] + NAMED["a"] + POINT.x
"""
CONSTANTS = "STIFF = 2.0\nUNUSED = 1.0\ndef near(x):\n    return 3.0 * x\n"


@pytest.fixture
def key(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Any:
    """Function from the two sources to the key of the formula and whether its code may be kept."""
    monkeypatch.syspath_prepend(str(tmp_path))
    count = iter(range(100))

    def make(formula: str = FORMULA, constants: str = CONSTANTS) -> tuple[str, bool]:
        folder = tmp_path / str(next(count))
        folder.mkdir()
        monkeypatch.syspath_prepend(str(folder))
        (folder / "further_formula.py").write_text(formula)
        (folder / "further_constants.py").write_text(constants)
        importlib.invalidate_caches()
        for name in ("further_formula", "further_constants"):
            sys.modules.pop(name, None)
        makings = makings_of(importlib.import_module("further_formula").formula)
        return makings.key, makings.can_be_kept

    return make


CHANGES = {
    "a constant": ("FACTOR = 1.0", "FACTOR = 1.5"),
    "the middle of a long table": ("2001)", "2001); TABLE[1000] = 7.0"),
    "an entry of nested rows": ("[3.0]", "[3.5]"),
    "an entry of a table by name": ('{"a": 1.0}', '{"a": 1.5}'),
    "the order of names": ('"x y"', '"y x"'),
    "how numba compiled a helper": ('"numpy"', '"python"'),
    "a helper": ("FACTOR * scale", "FACTOR + scale"),
    "a default": ("scale=1.0", "scale=2.0"),
    "a helper that numba compiled": ("return 1.0 * x", "return 1.5 * x"),
    "the formula": ("helper(x) +", "helper(x) -"),
    "code inside": ("for y in (x, 1.0)", "for y in (x, 2.0)"),
}


def test_the_same_sources_have_the_same_key(key: Any) -> None:
    """In another place, after another start."""
    first, second = key(), key()
    assert first == second and first[1]


@pytest.mark.parametrize("change", CHANGES.values(), ids=list(CHANGES))
def test_a_change_of_what_is_read_changes_the_key(key: Any, change: tuple[str, str]) -> None:
    """Wherever it is."""
    assert FORMULA.count(change[0]) == 1
    assert key(FORMULA.replace(*change))[0] != key()[0]


@pytest.mark.parametrize("change", [("STIFF = 2.0", "STIFF = 2.5"), ("3.0 * x", "3.5 * x")])
def test_a_change_in_another_module_changes_the_key(key: Any, change: tuple[str, str]) -> None:
    """A constant that is read as an attribute, and a function that was imported under another name."""
    assert key(constants=CONSTANTS.replace(*change))[0] != key()[0]


def test_what_is_not_read_does_not_count(key: Any) -> None:
    """Another constant of a module that the formula uses."""
    assert key(constants=CONSTANTS.replace("UNUSED = 1.0", "UNUSED = 2.0")) == key()


def test_what_cannot_be_told_apart_is_not_kept(key: Any) -> None:
    """An object of a class of one's own."""
    assert not key(FORMULA.replace('NAMED = {"a": 1.0}', 'NAMED = type("N", (), {"__getitem__": lambda s, k: 1.0})()'))[
        1
    ]
