"""What the pages name is there: commands and their options, scenarios, plugins, Python names, files, headings."""

from __future__ import annotations

import re
import runpy
import shlex
from collections.abc import Iterator
from importlib import import_module
from itertools import pairwise
from pathlib import Path
from typing import Any

import pytest
import typer

from softhand.commands.main import app
from softhand.plugins import plugin_names
from softhand.scenario.file import scenario_names

ROOT = Path(__file__).parent.parent
PAGES = [ROOT / "README.md", ROOT / "CONTRIBUTING.md", *sorted((ROOT / "docs").glob("*.md"))]
GROUP: Any = typer.main.get_command(app)

NAMED = {"--law": "laws", "--controller": "controllers", "--stepper": "steppers"}
"""Options whose value is the name of a plugin."""


def blocks(text: str, language: str) -> str:
    """What stands in the fenced blocks of a language."""
    return "\n".join(re.findall(rf"```{language}\n(.*?)```", text, re.DOTALL))


def commands(text: str) -> Iterator[str]:
    """Each command in a block, fenced or indented, or in the text."""
    for line in [*blocks(text, "sh").splitlines(), *re.findall(r"^ {4}(softhand .*)$", text, re.MULTILINE)]:
        yield from re.findall(r"(?<![\w-])softhand [^#|&]+", line)
    yield from re.findall(r"`(softhand [^`]+)`", text)


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.stem)
def test_every_command_is_there(page: Path) -> None:
    """With its options; so are the scenarios and the plugins that it names."""
    for line in commands(page.read_text()):
        name, *words = shlex.split(line)[1:]
        if not re.fullmatch("[a-z][a-z0-9]*", name):  # softhand --help, softhand NAME
            continue
        assert name in GROUP.commands, line
        command = GROUP.commands[name]
        if inner := getattr(command, "commands", None):
            command = inner[words.pop(0)]
        parameters = command.params
        options = {option for one in parameters for option in (*one.opts, *one.secondary_opts)} | {"--help"}
        assert [word for word in words if word.startswith("-") and word.partition("=")[0] not in options] == [], line
        if (
            words
            and any(one.name == "scenario" and one.param_type_name == "argument" for one in parameters)
            and re.fullmatch("[a-z][a-z-]*", words[0])
        ):
            assert words[0] in scenario_names(), line
        for option, value in pairwise(words):
            if option in NAMED and re.fullmatch("[a-z-]+", value) and "--plugin" not in words:
                assert value in plugin_names(NAMED[option]), line


def test_commands_are_found() -> None:
    """In a block, in the text, and without what stands behind them."""
    text = "Run `softhand plot run.nc`.\n\n    softhand list laws   # all\n\n```sh\nsofthand check a.toml && ls\n```\n"
    found = [line.strip() for line in commands(text)]
    assert found == ["softhand check a.toml", "softhand list laws", "softhand plot run.nc"]
    assert sum(len(list(commands(page.read_text()))) for page in PAGES) > 100


def resolves(name: str) -> bool:
    """Whether a dotted name is a module or something in one."""
    parts, found = name.split("."), import_module("softhand")
    for k, part in enumerate(parts[1:], start=1):
        try:
            found = getattr(found, part)
        except AttributeError:
            try:
                found = import_module(".".join(parts[: k + 1]))
            except ModuleNotFoundError:
                return False
    return True


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.stem)
def test_every_python_name_is_there(page: Path) -> None:
    """What is imported from softhand or taken from it, and dotted names in the text but for those of JavaScript."""
    text = page.read_text()
    python = blocks(text, "python")
    imported = re.findall(r"^from (softhand[\w.]*) import (.+)$", python, re.MULTILINE)
    names = [f"{module}.{name.strip()}" for module, listed in imported for name in listed.split(",")]
    names += re.findall(r"\bsofthand\.\w+", python)
    names += [] if "JavaScript" in text else re.findall(r"`(softhand(?:\.\w+)+)", text)
    assert [name for name in names if not resolves(name)] == []


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.stem)
def test_every_link_and_file_is_there(page: Path) -> None:
    """Links lead to files and to headings; scripts, benchmarks, tests and examples that are named can be run."""
    text = page.read_text()
    for target, place in re.findall(r"\]\(([^)#\s]*)#?([^)\s]*)\)", text):
        if target.startswith("http"):
            continue
        file = page.parent / target if target else page
        assert file.exists(), target
        assert not place or place in anchors(file), f"{target}#{place}"
    named = re.findall(r"\b((?:scripts|benchmarks|tests|examples)/\w+\.(?:py|md|toml))", text)
    assert [name for name in named if not (ROOT / name).exists()] == []


def anchors(page: Path) -> set[str]:
    """The names by which headings of a page are linked."""
    headings = re.findall(r"^#+ (.+)$", page.read_text(), re.MULTILINE)
    return {re.sub(r"[^\w\- ]", "", heading.lower()).replace(" ", "-") for heading in headings}


ELSEWHERE = {"README", "CONTRIBUTING", "controllers", "own-hand"}
"""Pages whose blocks other tests run."""

RUN = [page for page in PAGES if page.stem not in ELSEWHERE and blocks(page.read_text(), "python")]


@pytest.mark.parametrize("page", RUN, ids=lambda page: page.stem)
def test_every_python_block_runs(page: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """From top to bottom, in one folder, each as a file of its own."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("MPLBACKEND", "agg")
    for k, block in enumerate(re.findall(r"```python\n(.*?)```", page.read_text(), re.DOTALL)):
        file = tmp_path / f"block_{k}.py"
        file.write_text(block)
        runpy.run_path(str(file), run_name="__main__")
