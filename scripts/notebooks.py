"""Text notebooks, in the percent format of jupytext, as pages: what a cell prints and draws goes below it.

Example:
    python scripts/notebooks.py docs/tutorials/first_grasp.py       # prints the page
"""

from __future__ import annotations

import ast
import io
import os
import re
import sys
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager, redirect_stdout
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import matplotlib

matplotlib.use("agg")
import matplotlib.pyplot as plt
from matplotlib.figure import Figure

CELL = re.compile(r"^# %%(.*)$", re.MULTILINE)


@dataclass(frozen=True)
class Cell:
    """A piece of a notebook: text in Markdown, or code, and the line of the file at which it begins."""

    is_text: bool
    source: str
    line: int


@dataclass
class Page:
    """What a notebook becomes: Markdown, and its pictures by file name."""

    markdown: str = ""
    pictures: dict[str, bytes] = field(default_factory=dict)


def cells_of(text: str) -> list[Cell]:
    """The cells of a notebook in their order."""
    marks = [*CELL.finditer(text)]
    ends = [mark.start() for mark in marks[1:]] + [len(text)]
    found = []
    for mark, end in zip(marks, ends, strict=True):
        is_text, source = "[markdown]" in mark[1], text[mark.end() : end]
        begin = mark.end() + len(source) - len(source.lstrip("\n"))
        if is_text:
            source = re.sub(r"^# ?", "", source, flags=re.MULTILINE)
        found.append(Cell(is_text, source.strip("\n"), text.count("\n", 0, begin) + 1))
    return found


def run_notebook(file: Path) -> Page:
    """Run all cells in an empty folder, one after the other; an exception of one of them is raised.

    Links to other notebooks lead to their pages.
    """
    page, names, cells = Page(), {"__name__": file.stem}, cells_of(file.read_text(encoding="utf-8"))
    with _empty_folder():
        for cell in cells:
            if cell.is_text:
                page.markdown += re.sub(r"(\]\((?!http)[\w./-]+)\.py\)", r"\1.md)", cell.source) + "\n\n"
                continue
            page.markdown += f"```python\n{cell.source}\n```\n\n"
            printed, figures = _run(cell, file, names)
            if printed:
                page.markdown += f'```text title="prints"\n{printed.rstrip()}\n```\n\n'
            for figure in figures:
                name = f"{file.stem}-{len(page.pictures) + 1}.png"
                page.pictures[name] = _png(figure)
                page.markdown += f"![What the code above draws]({name})\n\n"
    return page


@contextmanager
def _empty_folder() -> Iterator[None]:
    before = Path.cwd()
    with tempfile.TemporaryDirectory() as folder:
        os.chdir(folder)
        try:
            yield
        finally:
            os.chdir(before)


def _run(cell: Cell, file: Path, names: dict[str, Any]) -> tuple[str, list[Figure]]:
    """What a cell prints and draws; a figure that its last line is, is drawn too."""
    tree = ast.parse("\n" * (cell.line - 1) + cell.source, str(file))
    last = tree.body.pop() if tree.body and isinstance(tree.body[-1], ast.Expr) else None
    value, out = None, io.StringIO()
    with redirect_stdout(out):
        exec(compile(tree, str(file), "exec"), names)
        if last is not None:
            value = eval(compile(ast.Expression(last.value), str(file), "eval"), names)
    figures = [plt.figure(number) for number in plt.get_fignums()]
    if isinstance(value, Figure) and value not in figures:
        figures.append(value)
    return out.getvalue(), figures


def _png(figure: Figure) -> bytes:
    data = io.BytesIO()
    figure.savefig(data, format="png", dpi=110)
    plt.close(figure)
    return data.getvalue()


if __name__ == "__main__":
    print(run_notebook(Path(sys.argv[1])).markdown)
