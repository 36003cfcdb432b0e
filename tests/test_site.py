"""The site: tutorials run and keep to their time, the contents name pages that exist, the pages can be built."""

from __future__ import annotations

import importlib.util
import re
import subprocess
import sys
import time
from pathlib import Path

import pytest

import softhand

ROOT = Path(__file__).parent.parent
CONTENTS = (ROOT / "mkdocs.yml").read_text().partition("\nnav:\n")[2]
NAMED = re.findall(r": ([\w/-]+\.md)$", CONTENTS, re.MULTILINE)
TUTORIALS = sorted((ROOT / "docs/tutorials").glob("*.py"))
GENERATED = {"contributing.md": "CONTRIBUTING.md", "changelog.md": "CHANGELOG.md"}

sys.path.insert(0, str(ROOT / "scripts"))
from notebooks import Cell, cells_of, run_notebook  # noqa: E402

PRINTED = {
    "first_grasp": "the same numbers: True",
    "identify_a_tip": r"power +1\.995 ",
    "many_runs": r"\d N\n +0\.1 .*holds",
    "own_controller": "finished: 8 of 8 | compiled: True",
    "own_hand": r"lifted by 15\.\d+ mm",
    "own_law": r"finger_1_tip presses with \d\.\d\d N and is 2\.25 mm deep",
    "ten_minutes": r"rim 6\.4\d+\n(.*\n)*finished after 600 s.*\nfinished after 600 s",
    "stable_loop": r"K_N = 1\.5: \+5\.24 1/s\n(.*\n)*growth -1\.9",
}
"""A line that each tutorial prints."""


LONG = {"ten_minutes"}


@pytest.mark.parametrize(
    "file",
    [pytest.param(file, id=file.stem, marks=[pytest.mark.slow] if file.stem in LONG else []) for file in TUTORIALS],
)
def test_the_tutorial_runs(file: Path) -> None:
    """From top to bottom in an empty folder, in a few seconds of work, and prints what its text speaks of."""
    began = time.process_time()
    page = run_notebook(file)
    assert re.search(PRINTED[file.stem], page.markdown), page.markdown
    assert page.markdown.startswith("# ") and page.markdown.count("```") % 2 == 0
    assert all(f"]({name})" in page.markdown and data.startswith(b"\x89PNG") for name, data in page.pictures.items())
    assert time.process_time() - began < 60.0  # on a new machine kernels are compiled too


def test_every_page_is_in_the_contents_once() -> None:
    """Pages of docs/, tutorials, those of the reference and of the root; no other."""
    own = [file.name for file in (ROOT / "docs").glob("*.md")]
    tutorials = [f"tutorials/{file.stem}.md" for file in TUTORIALS]
    reference = [name for name in NAMED if name.startswith("api/")]
    assert sorted(NAMED) == sorted([*own, *tutorials, *reference, *GENERATED])
    assert all((ROOT / source).is_file() for source in GENERATED.values())


def test_cells_of_a_notebook() -> None:
    """Text without its marks, code as it stands, each with its line."""
    text = "# %% [markdown]\n# # Title\n#\n# Text.\n\n# %%\nx = 1\n\n# %%\nprint(x)\n"
    assert cells_of(text) == [Cell(True, "# Title\n\nText.", 2), Cell(False, "x = 1", 7), Cell(False, "print(x)", 10)]


def test_a_cell_that_fails_is_an_error(tmp_path: Path) -> None:
    """With the line of the file; what a cell printed before it belongs to its page."""
    file = tmp_path / "notebook.py"
    file.write_text("# %% [markdown]\n# # Title\n\n# %%\nprint(6 * 7)\n\n# %%\n\n1 / 0\n")
    with pytest.raises(ZeroDivisionError) as failure:
        run_notebook(file)
    assert failure.traceback[-1].lineno == 8  # counted from 0
    file.write_text(file.read_text().replace("1 / 0", "7"))
    assert run_notebook(file).markdown.endswith('```text title="prints"\n42\n```\n\n```python\n7\n```\n\n')


needs_mkdocs = pytest.mark.skipif(
    any(importlib.util.find_spec(name) is None for name in ("material", "mkdocstrings", "latex2mathml")),
    reason="needs the extra docs: pip install '.[docs]'",
)


@needs_mkdocs
def test_the_reference_has_every_public_name() -> None:
    """Each on one page, and no other names."""
    from site_pages import REFERENCE

    listed = [name for _, _, names in REFERENCE.values() for name in names]
    assert sorted(listed) == [name for name in softhand.__all__ if name != "__version__"]
    assert [f"api/{name}.md" in NAMED for name in REFERENCE] == [True] * len(REFERENCE)


@needs_mkdocs
@pytest.mark.slow
def test_the_site_is_built(tmp_path: Path) -> None:
    """Strictly; equations are typeset, nothing is loaded over the network, no formula is left as LaTeX."""
    command = [sys.executable, "-m", "mkdocs", "build", "--strict", "--quiet", "--site-dir", str(tmp_path)]
    done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr[-3000:]
    assert all((tmp_path / name.replace(".md", ".html")).is_file() for name in NAMED)
    assert (tmp_path / "theory.html").read_text().count("<math") > 10
    for page in tmp_path.rglob("*.html"):
        text = page.read_text()
        assert re.findall(r'<(?:script|img|iframe)[^>]+src="?(https?://[^">]+)', text) == [], page
        assert re.findall(r'<link[^>]+rel="?stylesheet[^>]+(https?://[^">]+)', text) == [], page
        assert re.findall(r'class="arithmatex"|<m[io]>&(?:amp;)?</m[io]>', text) == [], page
