"""docs/own-hand.md is true: its blocks run from top to bottom in an empty folder, and print what it says."""

import re
import shlex
from pathlib import Path

import pytest
from typer.testing import CliRunner

import softhand.commands.main
from softhand.commands.main import app
from softhand.margins import stability

PAGE = (Path(__file__).parent.parent / "docs/own-hand.md").read_text()
BLOCKS = re.findall(r"```(\w+)\n(.*?)```", PAGE, flags=re.DOTALL)

assert softhand.commands.main.main  # which adds the commands


@pytest.fixture(scope="module")
def printed(tmp_path_factory: pytest.TempPathFactory) -> str:
    """All that the commands print; a block that fails is an error here."""
    folder, texts = tmp_path_factory.mktemp("own"), []
    with pytest.MonkeyPatch.context() as patch:
        patch.chdir(folder)
        for name in ("STIFFNESS", "GAIN"):  # the page shows nothing of the scan
            patch.setattr(stability, name, getattr(stability, name)[::8])
        for language, block in BLOCKS:
            if language == "python":
                exec(compile(block, "own-hand.md", "exec"), {"__name__": "own_hand"})
            elif language == "toml":
                (folder / block.splitlines()[0].removeprefix("# ")).write_text(block)
            elif language == "sh":
                for line in block.splitlines():
                    name, *words = shlex.split(line)
                    result = CliRunner().invoke(app, words, catch_exceptions=False)
                    assert name == "softhand" and result.exit_code == 0, f"{line}: {result.output}"
                    texts.append(result.output)
    return "\n".join(texts)


def test_the_page_has_every_kind_of_block() -> None:
    """Otherwise nothing would be run."""
    assert {language for language, _ in BLOCKS} == {"python", "sh", "text", "toml"}


@pytest.mark.slow
def test_the_commands_print_what_the_page_says(printed: str) -> None:
    """Each line of a block of output, but for digits that come from rounding."""
    found = {_rough(line) for line in printed.splitlines()}
    for line in "".join(block for language, block in BLOCKS if language == "text").splitlines():
        assert _rough(line) in found, line


def test_more_friction_than_needed_changes_nothing(printed: str) -> None:
    """The run in which tips can slip ends with the same errors as that by hand before it."""
    errors = re.findall(r"final position error +(\S+) mm", printed)
    assert len(errors) == 3 and errors[1] == errors[2]


def _rough(line: str) -> str:
    """Words, and numbers to two digits."""
    return " ".join(map(_rounded, line.split()))


def _rounded(word: str) -> str:
    try:
        return f"{float(word):.2g}"
    except ValueError:
        return word
