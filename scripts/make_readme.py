"""Refresh the pictures in docs/images and the summary table in README.md.

Example: python scripts/make_readme.py
"""

from __future__ import annotations

import re
from pathlib import Path

import softhand

ROOT = Path(__file__).parent.parent


def summary_table(recording: softhand.Recording) -> str:
    """The lines of the README's table: all figures that do not depend on the machine."""
    rows = [row for row in softhand.summarize(recording).rows() if "factor" not in row[0] and "second" not in row[0]]
    return "\n".join(f"{label:<28}{value}" for label, value in rows)


def main() -> None:
    """Run target A, draw it, write the table."""
    recording = softhand.simulate(softhand.load_scenario("target-a"))
    (ROOT / "docs/images").mkdir(parents=True, exist_ok=True)
    softhand.save_figure(softhand.draw_run(recording), ROOT / "docs/images/target-a.png")
    readme = ROOT / "README.md"
    table = f"<!-- summary -->\n```text\n{summary_table(recording)}\n```"
    text = re.sub(r"<!-- summary -->\n```text\n.*?```", lambda _: table, readme.read_text(), flags=re.DOTALL)
    readme.write_text(text)


if __name__ == "__main__":
    main()
