"""Settings: what is taken, what is refused, and in which words."""

from __future__ import annotations

import math
import subprocess
import sys
from typing import Any, Literal

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from pydantic import model_validator

from softhand.errors import ScenarioError
from softhand.settings.settings import Gain, NonNegative, Positive, Settings, Vector, Vector3, read_settings
from softhand.settings.wording import nearest, show, unit_of


class Inner(Settings):
    """A nested table."""

    stiffness: Positive = 1.0
    """Of the spring [N/m]."""


class Law(Settings):
    """One field of each kind."""

    k_r: Positive = 1.0
    damping: NonNegative = 0.0
    K_v: Gain = 0.0
    axis: Vector3 = (0.0, 0.0, 1.0)
    weights: Vector = (1.0,)
    points: tuple[Vector3, ...] = ()
    names: list[str] = []  # noqa: RUF012 - pydantic copies defaults
    is_on: bool = True
    count: int = 1
    kind: Literal["a", "b"] = "a"
    mass: Positive | None = None
    inner: Inner = Inner()


class Ordered(Settings):
    """Two numbers that must be in order, the first of them required."""

    low: float
    high: float = 1.0

    @model_validator(mode="after")
    def _is_ordered(self) -> Ordered:
        if self.low > self.high:
            raise ValueError(f"low {self.low:g} must not be above high {self.high:g}.")
        return self


def refusal(table: Any, cls: type[Settings] = Law) -> ScenarioError:
    """Return the error that reading the table as `[fingertip]` raises."""
    with pytest.raises(ScenarioError) as caught:
        read_settings(cls, table, "fingertip")
    return caught.value


@pytest.mark.parametrize(
    ("key", "value", "allowed"),
    [
        ("k_r", 0, "a number > 0."),
        ("k_r", True, "a number > 0."),
        ("k_r", 10**400, "a number > 0."),
        ("damping", -1e-9, "a number >= 0."),
        ("damping", [1.0], "a number >= 0."),
        ("K_v", -1, "a number >= 0, or a list of one or more numbers >= 0."),
        ("K_v", [], "a number >= 0, or a list of one or more numbers >= 0."),
        ("K_v", False, "a number >= 0, or a list of one or more numbers >= 0."),
        ("K_v", "high", "a number >= 0, or a list of one or more numbers >= 0."),
        ("axis", [1.0, 2.0], "a list of 3 numbers."),
        ("axis", [1, 2, 3, 4], "a list of 3 numbers."),
        ("axis", 3, "a list of 3 numbers."),
        ("axis", "123", "a list of 3 numbers."),
        ("weights", [], "a list of one or more numbers."),
        ("is_on", 1, "true or false."),
        ("is_on", "true", "true or false."),
        ("count", 2.0, "a whole number."),
        ("count", True, "a whole number."),
        ("kind", "c", 'one of "a", "b".'),
        ("mass", -0.5, "a number > 0."),
        ("inner", 3, "a table with the keys stiffness."),
    ],
)
def test_refusal_names_path_value_and_what_is_allowed(key: str, value: Any, allowed: str) -> None:
    """A wrong value makes one line with the dotted key, the value as in TOML and what is allowed."""
    assert str(refusal({key: value})) == f"fingertip.{key}: got {show(value)}, but it must be {allowed}"


@pytest.mark.parametrize("value", [math.nan, math.inf, -math.inf])
@pytest.mark.parametrize("key", ["k_r", "damping", "K_v"])
def test_nan_and_infinity_are_refused(key: str, value: float) -> None:
    """NaN and infinities are refused in words of their own."""
    assert str(refusal({key: value})).endswith(", not NaN or infinite.")


@pytest.mark.parametrize(
    ("table", "item"),
    [
        ({"axis": [0, math.nan, 0]}, "(item 2 is nan)"),
        ({"K_v": [1, 2, -3]}, "(item 3 is -3)"),
        ({"points": [[0, 0, 0], [1, 2]]}, "(item 2 is [1, 2])"),
        ({"points": [[0, 0, "x"]]}, '(item 3 of item 1 is "x")'),
    ],
)
def test_refusal_names_the_item(table: dict[str, Any], item: str) -> None:
    """In a list, the item at fault is named, counted from 1."""
    assert item in str(refusal(table))


def test_error_carries_key_and_value() -> None:
    """A program can read key and value from the error."""
    error: Any = refusal({"k_r": -3.0})
    assert (error.key, error.value) == ("fingertip.k_r", -3.0)


def test_quoted_number_is_explained() -> None:
    """A number in quotes is refused with a hint how to write it."""
    assert str(refusal({"k_r": "3"})).endswith("a number > 0. Write 3.0, without quotes.")


def test_unknown_key_names_the_nearest_and_all() -> None:
    """An unknown key gives its value, the nearest valid key and the list of valid keys."""
    text = str(refusal({"inner": {"stifness": 2}}))
    assert text == (
        "fingertip.inner.stifness: unknown key (with value 2). "
        "Did you mean fingertip.inner.stiffness? Valid keys in fingertip.inner: stiffness."
    )


def test_nearest_key_ignores_capitals() -> None:
    """A key in the wrong case is recognised."""
    assert nearest("k_V", ["k_r", "K_v", "axis"]) == "K_v"


def test_nothing_near_is_no_suggestion() -> None:
    """Where no key is near, none is suggested."""
    assert "Did you mean" not in str(refusal({"zzz": 1}))


def test_key_of_an_inner_table_is_found() -> None:
    """A key that belongs to an inner table is suggested with its path."""
    assert "Did you mean fingertip.inner.stiffness?" in str(refusal({"stiffness": 1}))


def test_misspelt_required_key_makes_one_message() -> None:
    """A required key that is misspelt is reported as unknown, not as missing besides."""
    assert str(refusal({"lwo": 0.0}, Ordered)).count("\n") == 0


def test_missing_key_says_what_it_must_be() -> None:
    """A missing key is named, with what it must be."""
    assert str(refusal({}, Ordered)) == "fingertip.low: missing; it must be a number."


def test_several_mistakes_make_a_line_each() -> None:
    """Mistakes in two keys make two lines."""
    lines = str(refusal({"k_r": -1, "K_v": "x"})).splitlines()
    assert [line.split(":")[0] for line in lines] == ["fingertip.k_r", "fingertip.K_v"]


def test_sentence_of_a_validator_gets_the_path() -> None:
    """A ValueError raised by a class of settings is shown as it is, after the path of its table."""
    assert str(refusal({"low": 2.0}, Ordered)) == "fingertip: low 2 must not be above high 1."


@pytest.mark.parametrize("table", [3, [1], "text", None])
def test_no_table_is_refused(table: Any) -> None:
    """Something other than a table is refused with the keys that the table should have."""
    assert str(refusal(table, Inner)).endswith("but it must be a table with the keys stiffness.")


def test_long_values_are_cut() -> None:
    """A huge value does not flood the message."""
    assert len(str(refusal({"k_r": "x" * 10_000}))) < 250


def test_integers_are_fine_floats() -> None:
    """An integer is taken for a float, and becomes one."""
    assert isinstance(read_settings(Law, {"k_r": 3}, "").k_r, float)


def test_lists_become_tuples() -> None:
    """Lists are kept as tuples, at every depth."""
    assert read_settings(Law, {"points": [[1, 2, 3]]}, "").points == ((1.0, 2.0, 3.0),)


def test_numpy_values_are_taken() -> None:
    """NumPy arrays and scalars are as good as lists and numbers."""
    law = read_settings(Law, {"axis": np.ones(3), "k_r": np.float32(2.0), "count": np.int64(4)}, "")
    assert (law.axis, law.k_r, law.count) == ((1.0, 1.0, 1.0), 2.0, 4)


def test_declared_list_stays_a_list() -> None:
    """A class may declare a list, and gets one."""
    assert read_settings(Law, {"names": ["a"]}, "").names == ["a"]


def test_settings_are_frozen() -> None:
    """Settings cannot be changed after they were checked."""
    with pytest.raises(AttributeError, match=r"Law\.k_r cannot be set.* scenario\.replace\(k_r=\.\.\.\)"):
        Law().k_r = 2.0


class Described(Inner):
    """A field of its own, one described anew, one of the base."""

    weight: Positive
    """Weight [N], of all.

    And more.
    """
    plain: float = 0.0


def test_a_field_is_described_by_the_docstring_below_it() -> None:
    """Of the class itself and of its bases; without a docstring there is no description."""
    descriptions = {name: field.description for name, field in Described.model_fields.items()}
    assert descriptions == {
        "stiffness": "Of the spring [N/m].",
        "weight": "Weight [N], of all.\n\nAnd more.",
        "plain": None,
    }


def test_units_are_read_from_descriptions() -> None:
    """The first brackets; none without brackets, without their end, or without a description."""
    assert unit_of("Stiffness of the position [N/m], one number or three [1].") == "N/m"
    assert [unit_of(text) for text in ("A name.", "An end [m is missing.", "", None)] == [""] * 4


TYPED = """
from softhand.settings.settings import Settings, read_settings
class Typed(Settings):
    k: float
    '''Stiffness [N/m].'''

print(read_settings(Typed, {"k": 3}, "").k)
"""


@pytest.mark.parametrize("how", ["typed", "command", "exec", "exec in a function"])
def test_a_class_needs_no_source(how: str) -> None:
    """Classes typed into an interpreter, or run from a text, are settings like others."""
    nested = f"def make():\n    exec({TYPED!r}, {{'__name__': 'nowhere'}})\nmake()\n"
    text = {"exec": f"exec({TYPED!r})\n", "exec in a function": nested}.get(how, TYPED)
    arguments, given = (["-c", text], None) if how == "command" else (["-i", "-q"] if how == "typed" else ["-"], text)
    result = subprocess.run([sys.executable, *arguments], input=given, capture_output=True, text=True, check=True)
    assert result.stdout.split() == ["3.0"], result.stderr


json_values = st.recursive(
    st.none() | st.booleans() | st.integers() | st.floats() | st.text(max_size=5),
    lambda inner: st.lists(inner, max_size=3) | st.dictionaries(st.text(max_size=3), inner, max_size=2),
    max_leaves=5,
)


@settings(max_examples=200, deadline=None)
@given(st.dictionaries(st.sampled_from([*Law.model_fields, "k_rr", "", "two\nlines"]), json_values, max_size=4))
def test_any_table_is_read_or_refused_with_one_kind_of_error(table: dict[str, Any]) -> None:
    """Whatever a table holds, reading gives settings or a ScenarioError that names a key."""
    try:
        read_settings(Law, table, "fingertip")
    except ScenarioError as error:
        assert all(line.startswith("fingertip") for line in str(error).split("\n"))
