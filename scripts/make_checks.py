"""Refresh the list of messages in docs/checks.md from the broken files of the tests.

Example: python scripts/make_checks.py
"""

from __future__ import annotations

import re
from pathlib import Path

from softhand.settings.toml import tomllib

ROOT = Path(__file__).parent.parent
PAGE = ROOT / "docs/checks.md"
BLOCK = re.compile(r"<!-- messages -->\n```text\n.*?```", re.DOTALL)


def messages() -> str:
    """The block of all messages, one broken file a line."""
    expected = tomllib.loads((ROOT / "tests/data/broken/expected.toml").read_text())
    lines = [f"{name}.urdf, {message}" for name, message in expected.items()]
    return "<!-- messages -->\n```text\n" + "\n".join(lines) + "\n```"


def main() -> None:
    """Write the block."""
    PAGE.write_text(BLOCK.sub(lambda _: messages(), PAGE.read_text()))


if __name__ == "__main__":
    main()
