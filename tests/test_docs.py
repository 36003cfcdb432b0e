"""What scripts/make_docs.py prints into the pages is what they have."""

from __future__ import annotations

import importlib.util
import re
from pathlib import Path
from types import ModuleType

import pytest

from softhand.plugins import SHIPPED
from softhand.settings.settings import Settings

ROOT = Path(__file__).parent.parent


def load_script() -> ModuleType:
    spec = importlib.util.spec_from_file_location("make_docs", ROOT / "scripts/make_docs.py")
    assert spec is not None and spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


SCRIPT = load_script()


@pytest.mark.parametrize("page", list(SCRIPT.PAGES))
def test_the_page_is_current(page: str) -> None:
    """No part of the page is stale; if one is: python scripts/make_docs.py."""
    _, stale = SCRIPT.printed(page, (ROOT / page).read_text(), SCRIPT.PAGES[page])
    assert stale == [], f"{page}: run python scripts/make_docs.py"


def test_a_stale_page_is_named_and_written(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """With --check it is named and left alone, exit code 1; without, its parts are printed and nothing else changes."""
    page, pages = tmp_path / "page.md", {"page.md": {"one": lambda: "1", "two": lambda: "2\n2"}}
    page.write_text("Before.\n<!-- one -->\nold\n<!-- end -->\nBetween.\n<!-- two -->\n2\n2\n<!-- end -->\nAfter.\n")
    old = page.read_text()
    assert SCRIPT.main(["--check"], tmp_path, pages) == 1
    assert capsys.readouterr().out == "page.md: stale: one\n" and page.read_text() == old
    assert SCRIPT.main([], tmp_path, pages) == 0 and page.read_text() == old.replace("old", "1")
    assert SCRIPT.main(["--check"], tmp_path, pages) == 0


def test_a_page_without_room_for_a_part_is_named() -> None:
    """A new kind of plugins needs a place for its table."""
    with pytest.raises(SystemExit, match=r"scenario\.md: write <!-- muscles --> and <!-- end -->"):
        SCRIPT.printed("docs/scenario.md", "# Scenarios\n", {"muscles": lambda: ""})


class Inner(Settings):
    """A table in the table."""

    weight: float = 2e-5
    """Weight | of it [N]."""


class Outer(Settings):
    """A section."""

    rods: tuple[Inner, ...] = ()
    """Rods."""
    by_name: dict[str, Inner] | None = None
    plain: tuple[float, float]
    """Two of them [m or rad]; any will do."""


def test_rows_of_a_section() -> None:
    """Type, unit, default and meaning of a key; tables in tables by dotted keys; no description is no meaning."""
    assert list(SCRIPT._rows(Outer, "outer.")) == [
        "| `outer.rods` | list of tables |  |  | Rods |",
        "| `outer.rods.weight` | number | N | `2e-05` | Weight \\| of it |",
        "| `outer.by_name` | table |  |  |  |",
        "| `outer.by_name.NAME.weight` | number | N | `2e-05` | Weight \\| of it |",
        "| `outer.plain` | list of 2 numbers | m or rad | needed | Two of them; any will do |",
    ]


@pytest.mark.parametrize("kind", list(SHIPPED))
def test_every_plugin_has_its_keys_in_the_table(kind: str) -> None:
    """Once those that all of the kind have, the others below the name of each."""
    table = SCRIPT.plugins(kind)
    assert all(f"| **`{name}`** |" in table for name in SHIPPED[kind])
    assert table.count("| `radius` |") == (kind == "laws") and table.count("| `K_v` |") == 9 * (kind == "controllers")


def test_every_file_that_the_page_of_architecture_names_is_there() -> None:
    """Paths in its text, from the root, from softhand, or the end of such a path."""
    text = (ROOT / "docs/architecture.md").read_text().partition("<!-- end -->")[2]
    named = set(re.findall(r"`([\w/.-]+(?:\.(?:py|md|toml)|/))`", text))
    there = {f"/{path.relative_to(ROOT)}{'/' * path.is_dir()}" for path in ROOT.glob("[!.]*/**/*")}
    assert {"scenario/agreement.py", "studies/", "docs/checks.md"} <= named
    assert [name for name in named if not any(path.endswith(f"/{name}") for path in there)] == []


def test_the_tree_has_every_module() -> None:
    """Each once, packages below their own line."""
    lines = SCRIPT.tree().splitlines()
    modules = [file.name for file in (ROOT / "softhand").rglob("*.py") if file.name != "__init__.py"]
    assert sorted(word for line in lines for word in line.split()[:1] if word.endswith(".py")) == sorted(modules)
    assert [line for line in lines if len(line.split()) < 2] == ["```text", "```"]
