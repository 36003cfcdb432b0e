"""Print the parts of the documentation that come from the code: tree, tables of keys, variables, messages, a summary.

In a page such a part stands between `<!-- NAME -->` and `<!-- end -->`.

Examples:
    python scripts/make_docs.py             # writes the pages
    python scripts/make_docs.py --check     # names those that are stale; exit code 1 if there are any
"""

from __future__ import annotations

import argparse
import ast
import re
import sys
from collections.abc import Callable, Iterable, Iterator, Mapping
from functools import lru_cache, partial
from pathlib import Path
from typing import Any, get_args

from pydantic.fields import FieldInfo

import softhand
from softhand.plugins import SHIPPED, describe_plugin, find_plugin
from softhand.recording.variables import COMPONENTS, VARIABLES
from softhand.scenario.scenario import Scenario
from softhand.settings.settings import Gain, Settings
from softhand.settings.toml import tomllib
from softhand.settings.wording import describe, is_table, show, unit_of

ROOT = Path(__file__).parent.parent
Blocks = Mapping[str, Callable[[], str]]

# ---------------------------------------------------------------------------------------------------------- the tree

TOP = {
    "pyproject.toml": "what is installed, and the settings of the tools",
    "mkdocs.yml": "the site of docs/",
    "urdf/": "the reference hand, a planar hand of two fingers, grippers, coupled fingers; boxes, can, prism, ball",
    "docs/": "a page a subject, and tutorials that run",
    "examples/": "short programs to begin from, each run by a test",
    "scripts/": "make_docs.py, what makes the figures of docs/ anew, and the pages of the site that are generated",
    "benchmarks/": "time and precision of a step, beside MuJoCo; random runs",
    "tests/": "one file a module or a property; hands.py makes the hands that they use",
}
FOLDERS = {
    "softhand/scenarios": "The scenarios that ship.",
    "softhand/viewer/page": "The pages: HTML, style, JavaScript.",
}
"""What has no docstring."""


def tree() -> str:
    """Every module with the first line of its docstring, packages in the order of the layers."""
    lines = [_branch(0, name, text) for name, text in TOP.items() if (ROOT / name).exists()]
    return "\n".join(["```text", *lines, *_branches(ROOT / "softhand", 0), "```"])


def _branches(folder: Path, depth: int) -> Iterator[str]:
    name = folder.relative_to(ROOT).as_posix()
    yield _branch(depth, f"{folder.name}/", FOLDERS.get(name) or _first_line(folder / "__init__.py"))
    for file in sorted(folder.glob("*.py")):
        if file.name != "__init__.py":
            yield _branch(depth + 1, file.name, _first_line(file))
    for inner in sorted(filter(_is_told, folder.iterdir()), key=_layer):
        yield from _branches(inner, depth + 1)


def _is_told(folder: Path) -> bool:
    return (folder / "__init__.py").is_file() or folder.relative_to(ROOT).as_posix() in FOLDERS


def _layer(folder: Path) -> tuple[int, str]:
    """From bottom to top; what is in no layer comes last."""
    block = (ROOT / "docs/architecture.md").read_text().partition("```layers\n")[2].partition("```")[0].split()
    return block.index(folder.name) if folder.name in block else len(block), folder.name


def _branch(depth: int, name: str, text: str) -> str:
    return f"{'  ' * depth + name:<30} {text.removesuffix('.')}"


def _first_line(file: Path) -> str:
    return (ast.get_docstring(ast.parse(file.read_text())) or "").partition("\n")[0]


# ------------------------------------------------------------------------------------------------ the keys of scenarios


def section(name: str) -> str:
    """The keys of one section, those of the tables in it too; "scenario" for those outside of sections."""
    if name == "scenario":
        fields = {key: field for key, field in Scenario.model_fields.items() if not _tables(field.annotation)}
        return _table(_key_row(key, field) for key, field in fields.items())
    return _table(row for cls in _tables(Scenario.model_fields[name].annotation) for row in _rows(cls, f"{name}."))


def _rows(cls: type[Settings], path: str) -> Iterator[str]:
    kinds = [str(field.annotation) for field in cls.model_fields.values()]
    alike: dict[type[Settings], None] = {}  # tables that several keys have in the same way: told once for all of them
    for key, field in cls.model_fields.items():
        yield _key_row(path + key, field)
        inner = f"{path}{key}.NAME." if "dict" in str(field.annotation) else f"{path}{key}."
        for table in _tables(field.annotation):
            if kinds.count(str(field.annotation)) > 1:
                alike[table] = None
            else:
                yield from _rows(table, inner)
    for table in alike:
        yield from _rows(table, f"{path}NAME.")


def _tables(annotation: Any) -> list[type[Settings]]:
    """The classes of settings in a type."""
    if is_table(annotation):
        return [annotation]
    return [table for part in get_args(annotation) for table in _tables(part)]


def plugins(kind: str) -> str:
    """The keys of the plugins of one kind: those that all have alike, then those of each."""
    classes = {name: find_plugin(kind, name, kind) for name in SHIPPED[kind]}
    keys = {name: list(_rows(cls, "")) if is_table(cls) else [] for name, cls in classes.items()}
    shared = [row for row in next(iter(keys.values())) if all(row in rows for rows in keys.values())]
    own = {name: [row for row in rows if row not in shared] for name, rows in keys.items()}
    names = {name: _row(f"**`{name}`**", "", "", "", _cell(describe_plugin(kind, name))) for name in keys}
    return _table([*shared, *(row for name in keys for row in (names[name], *own[name]))])


def _table(rows: Iterable[str]) -> str:
    return "\n".join([_row("Key", "Type", "Unit", "Default", "Meaning"), _row(*["---"] * 5), *rows])


def _key_row(key: str, field: FieldInfo) -> str:
    meaning = re.sub(r" \[[^\]]*\]", "", field.description or "", count=1)
    return _row(f"`{key}`", _type(field), unit_of(field.description), _default(field), _cell(meaning))


def _type(field: FieldInfo) -> str:
    if field.annotation == Gain:
        return "gain"
    words = describe(field.annotation, field.metadata).partition(" with the keys ")[0]
    return _cell(words.removeprefix("a ").replace("of a table", "of tables"))


def _default(field: FieldInfo) -> str:
    if field.is_required():
        return "needed"
    return "" if field.default in (None, ()) else f"`{_short(field.default)}`"


def _short(value: Any) -> str:
    """As a TOML file may have it, in six digits."""
    if isinstance(value, tuple):
        return f"[{', '.join(map(_short, value))}]"
    return f"{value:g}" if isinstance(value, float) else show(value)


def _cell(text: str) -> str:
    return " ".join(text.split()).removesuffix(".").replace("|", "\\|")


def _row(*cells: str) -> str:
    return f"| {' | '.join(cells)} |"


# ------------------------------------------------------------------------------------- recordings, messages, a summary


def components() -> str:
    """The dimensions whose labels are the same in every recording."""
    rows = [_row(f"`{name}`", ", ".join(f"`{label}`" for label in labels)) for name, labels in COMPONENTS.items()]
    return "\n".join([_row("Dimension", "Labels"), _row("---", "---"), *rows])


def variables() -> str:
    """What a recording can hold."""
    rows = [
        _row(f"`{name}`", ", ".join(variable.dims), variable.units, variable.dtype.__name__, _cell(variable.long_name))
        for name, variable in VARIABLES.items()
    ]
    return "\n".join([_row("Variable", "Dimensions", "Unit", "Type", "Meaning"), _row(*["---"] * 5), *rows])


def messages() -> str:
    """What is said of the broken URDFs of the tests, one a line."""
    expected = tomllib.loads((ROOT / "tests/data/broken/expected.toml").read_text())
    return "\n".join(["```text", *(f"{name}.urdf, {message}" for name, message in expected.items()), "```"])


@lru_cache(1)
def target_a() -> softhand.Recording:
    """The run of the README."""
    return softhand.simulate(softhand.load_scenario("target-a"))


def summary() -> str:
    """All figures of a run of target A that do not depend on the machine."""
    rows = [row for row in softhand.summarize(target_a()).rows() if "factor" not in row[0] and "second" not in row[0]]
    return "\n".join(["```text", *(f"{label:<28}{value}" for label, value in rows), "```"])


# ---------------------------------------------------------------------------------------------------------- the pages

_SECTIONS = ["scenario", *(name for name, field in Scenario.model_fields.items() if _tables(field.annotation))]

PAGES: Mapping[str, Blocks] = {
    "docs/architecture.md": {"tree": tree},
    "docs/scenario.md": {name: partial(section, name) for name in _SECTIONS}
    | {kind: partial(plugins, kind) for kind in SHIPPED},
    "docs/recording.md": {"components": components, "variables": variables},
    "docs/checks.md": {"messages": messages},
    "README.md": {"summary": summary},
}


def printed(page: str, text: str, blocks: Blocks) -> tuple[str, list[str]]:
    """The text of a page with its blocks as they are now, and the names of those that were stale.

    Raises:
        SystemExit: the page has no place for a block.
    """
    stale = []
    for name, make in blocks.items():
        head, start, rest = text.partition(f"<!-- {name} -->\n")
        old, end, tail = rest.partition("<!-- end -->")
        if not (start and end):
            raise SystemExit(f"{page}: write <!-- {name} --> and <!-- end --> where {name} shall stand.")
        new = make() + "\n"
        if new != old:
            stale.append(name)
        text = head + start + new + end + tail
    return text, stale


def main(arguments: list[str], folder: Path = ROOT, pages: Mapping[str, Blocks] = PAGES) -> int:
    """Write the pages of a folder, or with `--check` only name those that are stale; the exit code."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--check", action="store_true", help="write nothing; exit code 1 if a page is stale")
    only_check, found = parser.parse_args(arguments).check, 0
    for page, blocks in pages.items():
        text, stale = printed(page, (folder / page).read_text(), blocks)
        if not stale:
            continue
        found += 1
        print(f"{page}: {'stale' if only_check else 'written'}: {', '.join(stale)}")
        if not only_check:
            (folder / page).write_text(text)
            if "summary" in stale:
                softhand.save_figure(softhand.draw_run(target_a()), folder / "docs/images/target-a.png")
    return int(only_check and found > 0)


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
