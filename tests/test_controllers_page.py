"""docs/controllers.md: every section is of a controller, every link leads somewhere, the tables are current."""

import importlib.util
import re
from pathlib import Path

import pytest

import softhand
from softhand.plugins import SHIPPED

ROOT = Path(__file__).parent.parent
PAGE = (ROOT / "docs/controllers.md").read_text()


def script():
    spec = importlib.util.spec_from_file_location("make", ROOT / "scripts/make_controller_figures.py")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def test_every_section_is_of_a_controller_that_ships():
    """And has its row in the table; a new controller may, but need not have a section."""
    sections = set(re.findall(r"^## ([a-z-]+)$", PAGE, re.MULTILINE))
    assert {"regulation", "two-phase"} <= sections <= set(SHIPPED["controllers"])
    assert all(f"[`{name}`](#{name})" in PAGE for name in sections)


def test_every_link_leads_to_a_file():
    """Pictures and pages are there."""
    for target in re.findall(r"\]\(([^)#]+)\)", PAGE):
        assert (ROOT / "docs" / target).exists(), target


@pytest.mark.parametrize("scenario", ["target-a", "pinch-angle-feedback"])
def test_the_tables_are_current(scenario):
    """What the script prints now, to 2 %; of errors below 0.01 the size only."""
    made = script()
    written = PAGE.split(f"<!-- table {scenario} -->\n")[1].split("\n<!-- end -->")[0].splitlines()
    printed = made.table(softhand.compare(scenario, controllers=made.COMPARISONS[scenario][1])).splitlines()
    assert printed[:2] == written[:2] and len(printed) == len(written)
    for one, other in zip(printed[2:], written[2:], strict=True):
        for now, then in zip(one.split(" | "), other.split(" | "), strict=True):
            numbers = [float(cell.strip("<| ")) for cell in (now, then) if re.fullmatch(r"[<\-.\de| ]+", cell)]
            if numbers:
                assert numbers[0] == pytest.approx(numbers[1], rel=0.02, abs=0.005)
            else:
                assert now == then


def test_the_example_runs(capsys):
    """The example in Python prints a line a row."""
    code = re.search(r"```python\n(.*?)```", PAGE, re.DOTALL).group(1)
    exec(code, {})
    assert len(capsys.readouterr().out.splitlines()) == 2
