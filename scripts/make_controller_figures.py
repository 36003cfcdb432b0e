"""Refresh the pictures and tables of docs/controllers.md.

Example: python scripts/make_controller_figures.py
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from pathlib import Path

import softhand
from softhand.studies.compare import COLUMNS, Row, draw, labels

ROOT = Path(__file__).parent.parent
PAGE = ROOT / "docs/controllers.md"
COMPARISONS = {
    "target-a": ("controllers", None),
    "pinch-angle-feedback": ("pinch", ("regulation", "angle-feedback", "two-phase", "opposing")),
}
"""Scenario: name of the picture, and the controllers; None for what `softhand compare` alone runs."""


def table(rows: Sequence[Row]) -> str:
    """The rows as a table in Markdown."""
    headings = ("run", *(name.replace("\n", " ") for name in COLUMNS))
    lines = [
        headings,
        ["---"] * len(headings),
        *((f"`{name}`", *row.cells()) for name, row in zip(labels(rows), rows, strict=True)),
    ]
    return "\n".join("| " + " | ".join(line) + " |" for line in lines)


def main() -> None:
    """Run all, draw, write the tables."""
    text = PAGE.read_text()
    for scenario, (picture, controllers) in COMPARISONS.items():
        rows = softhand.compare(scenario, controllers=controllers)
        title = softhand.load_scenario(scenario).description
        softhand.save_figure(draw(rows, title), ROOT / f"docs/images/{picture}.png")
        mark, new = rf"(<!-- table {scenario} -->\n).*?(<!-- end -->)", table(rows)
        text = re.sub(mark, lambda found, new=new: f"{found[1]}{new}\n{found[2]}", text, flags=re.DOTALL)
    PAGE.write_text(text)


if __name__ == "__main__":
    main()
