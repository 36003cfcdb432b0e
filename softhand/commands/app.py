"""The typer application that the commands add themselves to."""

from __future__ import annotations

import typer

app = typer.Typer(
    name="softhand",
    help="Simulate and control robot hands with soft fingertips.",
    epilog="Example: softhand simulate target-b --set fingertip.friction=0.6",
    no_args_is_help=True,
    add_completion=False,
    pretty_exceptions_enable=False,
    context_settings={"help_option_names": ["-h", "--help"]},
)
