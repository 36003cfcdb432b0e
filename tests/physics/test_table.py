"""What counts as passed, and the command that prints the table."""

import math
from pathlib import Path

import pytest
from typer.testing import CliRunner

import softhand.commands.main  # noqa: F401  adds the commands
from softhand.commands.main import app
from softhand.errors import SofthandError
from softhand.validation import table
from softhand.validation.check import Check

GOOD, BAD = Check("good", 1.0005, 1.0, 1e-3, "m"), Check("bad", 1.002, 1.0, 1e-3, "m")


@pytest.mark.parametrize(
    ("check", "passed"),
    [
        (GOOD, True),
        (BAD, False),
        (Check("share of a negative number", -1.0005, -1.0, 1e-3), True),
        (Check("absolute", 26.6, 26.5, 0.05, "deg", True), False),
        (Check("against zero", 2e-9, 0.0, 1e-9), False),
        (Check("not a number", math.nan, 1.0, 1e-3), False),
        (Check("exact to the bit", 0.0, 0.0, 0.0), True),
    ],
    ids=lambda value: value.name if isinstance(value, Check) else "",
)
def test_passed(check: Check, passed: bool) -> None:
    """A share of the exact number, an absolute difference, never NaN."""
    assert check.passed is passed


def test_the_command_writes_what_it_found(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    """A failed check is in the table, and the command ends with an error that names it."""
    monkeypatch.setattr(table, "run_checks", lambda: iter([(0, GOOD), (1, BAD)]))
    file = tmp_path / "table.md"
    result = CliRunner().invoke(app, ["validate", "--out", str(file)])
    assert isinstance(result.exception, SofthandError)
    assert "bad" in str(result.exception)
    assert "good" not in str(result.exception)
    rows = file.read_text().splitlines()
    assert rows[2] == "| good | 1.0005 | 1 | 0.001 | m | yes |"
    assert rows[3] == "| bad | 1.002 | 1 | 0.001 | m | NO |"


@pytest.mark.slow
def test_the_page_has_the_table_of_the_command() -> None:
    """Names, exact numbers, tolerances and units in docs/validation.md are those of a run now; all checks pass."""
    page = (Path(__file__).parents[2] / "docs" / "validation.md").read_text()
    lines = page[page.index("| check |") :].split("\n\n")[0].splitlines()[2:]
    written = [[cell.strip() for cell in line.strip("| ").split(" | ")] for line in lines]
    checks = [check for _, check in table.run_checks()]
    assert [row[0] for row in written] == [check.name for check in checks]
    for row, check in zip(written, checks, strict=True):
        name, measured, exact, allowed, unit, verdict = (*row[:4], "", row[4]) if len(row) == 5 else row
        assert (allowed, unit, verdict, check.passed) == (f"{check.allowed:.2g}", check.unit, "yes", True), name
        assert abs(float(exact) - check.exact) <= max(check.allowed, 1e-9 * abs(check.exact)), name
        assert abs(float(measured) - check.exact) <= check.allowed + 1e-9 * abs(check.exact), name


def test_every_theme_is_in_the_table() -> None:
    """No experiment is left out, none counts twice."""
    themes = (table.sliding, table.onset, table.flow, table.rolling, table.pressing, table.motion, table.holding)
    assert len(set(table.EXPERIMENTS)) == len(table.EXPERIMENTS) == sum(len(theme.EXPERIMENTS) for theme in themes)
