"""Arguments and options that commands share, each defined once, and what the shell completes for them."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Annotated, Any

import typer


def complete_scenarios() -> list[str]:
    """The names of the scenarios that ship."""
    from softhand.scenario.file import scenario_names

    return scenario_names()


def _laws() -> list[str]:
    return _plugins("laws")


def _controllers() -> list[str]:
    return _plugins("controllers")


def _steppers() -> list[str]:
    return _plugins("steppers")


def _plugins(kind: str) -> list[str]:
    from softhand.plugins import plugin_names

    return plugin_names(kind)


def _load_plugins(files: Any) -> Any:  # on Python 3.10 typer takes list[Path] for a class
    if files:
        from softhand.plugins import load_plugin_files

        load_plugin_files(files)
    return files


ScenarioName = Annotated[
    str,
    typer.Argument(
        metavar="SCENARIO",
        autocompletion=complete_scenarios,
        help="A scenario that ships (see: softhand list), a .toml file, or the folder of a run.",
    ),
]
ScenarioOrRun = Annotated[
    str,
    typer.Argument(
        metavar="SCENARIO",
        autocompletion=complete_scenarios,
        help="A scenario that ships (see: softhand list), a .toml file, or a run.nc or its folder.",
    ),
]
Run = Annotated[Path, typer.Argument(metavar="RUN", help="A recording, run.nc, or the folder that it is in.")]

Set = Annotated[
    list[str],
    typer.Option("--set", metavar="KEY=VALUE", help="Change a value of the scenario, in TOML; may be repeated."),
]
Law = Annotated[
    str | None,
    typer.Option(
        metavar="NAME",
        autocompletion=_laws,
        help="Fingertip law, with its own defaults and the scenario's radius and friction.",
    ),
]
Controller = Annotated[
    str | None,
    typer.Option(metavar="NAME", autocompletion=_controllers, help="Controller, with its own defaults."),
]
Stepper = Annotated[
    str | None,
    typer.Option(
        metavar="NAME", autocompletion=_steppers, help="Stepper, with its own defaults and the scenario's step."
    ),
]
Laws = Annotated[
    list[str],
    typer.Option("--law", metavar="NAME,...", autocompletion=_laws, help="Fingertip laws, settings in brackets."),
]
Controllers = Annotated[
    list[str],
    typer.Option(
        "--controller", metavar="NAME,...", autocompletion=_controllers, help="Controllers, settings in brackets."
    ),
]
FittedLaw = Annotated[
    str,
    typer.Option("--law", metavar="NAME", autocompletion=_laws, help="Fingertip law to fit (see: softhand list laws)."),
]
Duration = Annotated[float | None, typer.Option(metavar="SECONDS", help="Simulated time [s].")]
Plugins = Annotated[
    list[Path],
    typer.Option(
        "--plugin",
        metavar="FILE.py",
        callback=_load_plugins,
        help="Python file with laws, controllers and other plugins of your own, by their names in small letters with "
        "hyphens; it is run. May be repeated.",
    ),
]

OutFolder = Annotated[
    Path | None, typer.Option("--out", metavar="FOLDER", help="Where to write; by default a new folder below runs/.")
]
OutFigure = Annotated[
    Path | None,
    typer.Option(
        "--out",
        metavar="FILE",
        help="Where to write: a figure, .png, .pdf or .svg, or a folder; by default a new folder below runs/.",
    ),
]
OutBesideRun = Annotated[
    Path | None,
    typer.Option(
        "--out",
        metavar="FILE",
        help="Where to write: a figure, .png, .pdf or .svg, or a folder; by default a new file beside the recording.",
    ),
]
OutFile = Annotated[
    Path | None,
    typer.Option("--out", metavar="FILE", help="Where to write; by default a new file beside the recording."),
]

Quiet = Annotated[bool, typer.Option("--quiet", "-q", help="Print nothing but errors, and JSON if it is asked for.")]
Json = Annotated[bool, typer.Option("--json", help="Print the result as JSON, with units, in place of tables.")]


def numbers(option: str, text: str, count: int, factor: float = 1.0) -> list[float]:
    """So many numbers with commas between them."""
    try:
        values = [factor * float(word) for word in text.split(",")]
    except ValueError:
        values = []
    if len(values) != count or not all(map(math.isfinite, values)):
        raise typer.BadParameter(f"got {text!r}; give {count} numbers with commas between them.", param_hint=option)
    return values
