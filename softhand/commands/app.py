"""The typer application that the commands add themselves to."""

from __future__ import annotations

from collections.abc import Callable
from typing import Annotated, Any

import typer

from softhand.commands.help import Command, Group

Group.tasks = {
    "Begin": ("list", "hands", "new", "check", "schema"),
    "Run": ("simulate", "compare", "sweep", "reproduce"),
    "Look at a run": ("plot", "view", "report", "film", "export", "energy", "lyapunov"),
    "Study a grasp": ("grasp", "grasps", "equilibrium", "workspace", "squeeze", "push", "stability", "design",
                      "gradient", "tune"),
    "Study a fingertip": ("identify", "calibrate", "material", "remark3"),
    "Trust": ("validate",),
}  # fmt: skip

app = typer.Typer(
    name="softhand",
    cls=Group,
    help="Simulate and control robot hands with soft fingertips.",
    epilog="Example: softhand simulate target-b --set fingertip.friction=0.6",
    invoke_without_command=True,
    rich_markup_mode=None,  # help and errors are written here, which spares the import of half of rich
    pretty_exceptions_enable=False,
    context_settings={"help_option_names": ["-h", "--help"]},
)


def command(example: str, name: str | None = None) -> Callable[[Any], Any]:
    """Add a command, with an example that its help ends with; several are divided by `; `."""
    return app.command(name, cls=Command, epilog=f"Example: {example}")


def _print_version(asked: bool) -> None:
    if asked:
        from softhand.version import __version__

        typer.echo(f"softhand {__version__}")
        raise typer.Exit


@app.callback()
def program(
    context: typer.Context,
    version: Annotated[
        bool, typer.Option("--version", callback=_print_version, is_eager=True, help="Print the version and end.")
    ] = False,
) -> None:
    """Simulate and control robot hands with soft fingertips."""
    if context.invoked_subcommand is None:
        typer.echo(context.get_help())
