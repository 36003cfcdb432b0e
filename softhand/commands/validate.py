"""softhand validate: systems with known answers."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from softhand.commands.app import app
from softhand.commands.console import Quiet, check_file, console, plain, progress, say, say_compiling, write_text


@app.command(epilog="Example: softhand validate --out validation.md")
def validate(
    out: Annotated[Path | None, typer.Option(help="Markdown file for the table.")] = None,
    quiet: Quiet = False,
) -> None:
    """Measure friction, contact and motion in small systems with known answers; exit code 1 if one is off."""
    if out is not None:
        check_file(out)
    say_compiling(quiet)
    from rich import box
    from rich.table import Table

    from softhand.errors import SofthandError
    from softhand.validation.table import COLUMNS, EXPERIMENTS, row_of, run_checks, to_markdown

    checks = []
    with progress("checking", float(len(EXPERIMENTS)), quiet) as report:
        for done, check in run_checks():
            checks.append(check)
            if report is not None:
                report(float(done))
    failed = [check.name for check in checks if not check.passed]
    if not quiet:
        table = Table(box=box.SIMPLE_HEAD)
        for column in COLUMNS:
            is_text = column in ("check", "unit", "pass")
            table.add_column(column, justify="left" if is_text else "right", no_wrap=column != "check")
        for check in checks:
            table.add_row(*map(plain, row_of(check)), style=None if check.passed else "bold red")
        console().print(table)
        say(f"{len(checks) - len(failed)} of {len(checks)} checks passed")
    if out is not None:
        write_text(out, to_markdown(checks))
        if not quiet:
            say(f"wrote {out}")
    if failed:
        raise SofthandError(f"{len(failed)} of {len(checks)} checks failed: {', '.join(failed)}.")
