"""softhand identify: coefficients of a fingertip law from measurements."""

from __future__ import annotations

import math
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from softhand.commands.app import command
from softhand.commands.console import Printer, progress
from softhand.commands.options import FittedLaw, Json, OutFolder, Plugins, Quiet
from softhand.commands.places import check_folder, make_folder, new_folder, write_text
from softhand.errors import MeasurementError

if TYPE_CHECKING:
    from softhand.identification.identify import Identification


@command("softhand identify press.csv twist.csv --radius 10mm --law nakashima")
def identify(
    data: Annotated[
        list[Path] | None,
        typer.Argument(metavar="FILE.csv", help="Measurements; their headers name quantities and units."),
    ] = None,
    example: Annotated[
        bool, typer.Option("--example", help="Take the example file, and copy it beside the results.")
    ] = False,
    law: FittedLaw = "nakashima",
    radius: Annotated[
        str | None,
        typer.Option(metavar="LENGTH", help="Radius of the tip, such as 10mm; else that of the file."),
    ] = None,
    fix: Annotated[
        list[str], typer.Option(metavar="NAME=VALUE", help="Do not fit this coefficient; SI; may be repeated.")
    ] = [],  # noqa: B006  typer copies it
    friction: Annotated[
        float | None, typer.Option(metavar="MU", help="Coefficient of friction, written into fingertip.toml.")
    ] = None,
    level: Annotated[float, typer.Option(metavar="SHARE", help="Of the confidence intervals, 0 to 1.")] = 0.95,
    compare: Annotated[
        bool, typer.Option("--compare/--no-compare", help="Compare all laws by cross-validation.")
    ] = True,
    out: OutFolder = None,
    plugins: Plugins = [],  # noqa: B006  typer copies it
    as_json: Json = False,
    quiet: Quiet = False,
) -> None:
    """Fit a fingertip law to measured forces.

    Writes fit.png and fingertip.toml, and says which law foretells best.

    Columns: phi, dr, dtheta, dphi, dpsi and what was measured of Fr, Ftheta, Fphi, Fpsi, each with its unit in square
    brackets, such as "dr [mm],phi [deg],Fr [N]".
    """
    check_folder(out)
    from softhand.identification.identify import identify
    from softhand.identification.record import EXAMPLE
    from softhand.plots.identification import draw_fit
    from softhand.plots.style import save_figure
    from softhand.plugins import plugin_names

    if bool(data) == example:
        raise MeasurementError("Give CSV files, or --example to see how it goes.", column="", value=None)
    if not 0.0 < level < 1.0:
        raise MeasurementError(f"--level: got {level:g}; it must lie between 0 and 1.", column="level", value=level)
    printer = Printer(quiet, as_json)
    compare = compare and (as_json or not quiet)
    what = "comparing laws" if compare else f"fitting {law}"
    with progress(what, float(len(plugin_names("laws"))), quiet) as report:
        found = identify(
            [EXAMPLE] if example else data or [],
            law=law, radius=radius, fix=_read_fixed(fix), friction=friction, level=level,
            compare=compare, progress=report,
        )  # fmt: skip
    folder = out or new_folder("identify")
    make_folder(folder)
    save_figure(draw_fit(found.fit, law), folder / "fit.png")
    write_text(folder / "fingertip.toml", found.to_toml())
    if example:
        write_text(folder / "example.csv", EXAMPLE.read_text(encoding="utf-8"))
    printer.json(found)
    _print(found, printer)
    files = f"fit.png, fingertip.toml{', example.csv' * example}"
    printer.say(f"wrote {files} in {folder}/")


def _read_fixed(texts: list[str]) -> dict[str, float]:
    fixed = {}
    for text in texts:
        name, sign, value = (part.strip() for part in text.partition("="))
        if not (name and sign and value):
            raise MeasurementError(
                f"--fix {text[:60]}: must have the form NAME=VALUE, such as {name[:60] or 'k_r'}=3.77e5.",
                column=name,
                value=value,
            )
        try:
            fixed[name] = float(value)
        except ValueError:
            fixed[name] = math.nan
        if not math.isfinite(fixed[name]):
            raise MeasurementError(
                f"--fix {name[:60]}: got {value[:60]}; it must be a finite number.", column=name, value=value
            )
    return fixed


def _print(found: Identification, printer: Printer) -> None:
    fit = found.fit
    level = f"{100.0 * fit.level:g} %"
    printer.table(
        f"law {found.law_name}, radius {1e3 * fit.radius:g} mm, {len(fit.measurements)} rows",
        found.rows(), ("", "value", f"{level} from", "to", "unit", ""),
    )  # fmt: skip
    printer.table("standard deviations", found.scatter_rows(), ("", "of residuals", "of repeats", "unit"))
    for finding in found.findings:
        printer.say(finding.text, "warning" if finding.is_warning else "note")
    if found.scores:
        header = ("law", "fitted", "all", "Fr\n[N]", "Ftheta\n[N mm]", "Fphi\n[N mm]", "Fpsi\n[N mm]")
        printer.table("errors at settings that were not fitted (rms)", found.score_rows(), header)
    for score in found.scores:
        if score.failure:
            printer.say(f"{score.name} is left out: {score.failure}", "note")
    if found.not_compared:
        printer.say(found.not_compared, "note")
