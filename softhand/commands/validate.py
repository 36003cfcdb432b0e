"""softhand validate: systems with known answers."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from softhand.commands.app import command
from softhand.commands.console import Printer, progress, say_compiling
from softhand.commands.options import Json, Quiet
from softhand.commands.places import check_file, write_text

if TYPE_CHECKING:
    from softhand.validation.check import Check


@command("softhand validate --out validation.md")
def validate(
    show_all: Annotated[bool, typer.Option("--all", help="Print every check, not only those that fail.")] = False,
    out: Annotated[
        Path | None, typer.Option("--out", metavar="FILE", help="Where to write all checks, as a table in Markdown.")
    ] = None,
    as_json: Json = False,
    quiet: Quiet = False,
) -> None:
    """Measure small systems with known answers.

    Friction, contact, material and motion. Printed is how many checks passed of each kind, and those that fail; exit
    code 1 if one does.
    """
    if out is not None:
        check_file(out)
    say_compiling(quiet)
    from softhand.errors import SofthandError
    from softhand.validation.table import COLUMNS, EXPERIMENTS, kind_of, row_of, run_checks, to_markdown

    printer = Printer(quiet, as_json)
    kinds: dict[str, list[Check]] = {}
    with progress(f"running {len(EXPERIMENTS)} experiments", float(len(EXPERIMENTS)), quiet) as report:
        for done, check in run_checks():
            kinds.setdefault(kind_of(EXPERIMENTS[done]), []).append(check)
            report(float(done))
    checks = [check for found in kinds.values() for check in found]
    failed = [check for check in checks if not check.passed]
    printer.json([_entries(check) for check in checks])
    printer.table("", [(kind, _share(found)) for kind, found in kinds.items()])
    if show_all or failed:
        title, shown = ("all checks", checks) if show_all else ("failed", failed)
        printer.table(title, list(map(row_of, shown)), COLUMNS)
    hint = "" if show_all or as_json else "; --all shows them"
    printer.say(f"{_share(checks)} checks passed{hint}")
    if out is not None:
        write_text(out, to_markdown(checks))
        printer.say(f"wrote {out}")
    if failed:
        names = ", ".join(check.name for check in failed)
        raise SofthandError(f"{len(failed)} of {len(checks)} checks failed: {names}.")


def _share(checks: list[Check]) -> str:
    return f"{sum(check.passed for check in checks)} of {len(checks)}"


def _entries(check: Check) -> dict[str, object]:
    names = ("name", "measured", "exact", "allowed", "unit", "passed")
    return {name: getattr(check, name) for name in names}
