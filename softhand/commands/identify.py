"""softhand identify: coefficients of a fingertip law from measurements."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from softhand.commands.app import app
from softhand.commands.console import Out, Quiet, console, escape, make_folder, new_folder, progress, write_text
from softhand.errors import MeasurementError

if TYPE_CHECKING:
    from softhand.identification.fit import Fit
    from softhand.identification.measurements import Measurements


@app.command(epilog="Example: softhand identify press.csv twist.csv --radius 10mm --law nakashima")
def identify(
    data: Annotated[
        list[Path] | None, typer.Argument(help="CSV files; their headers name quantities and units.")
    ] = None,
    example: Annotated[
        bool, typer.Option("--example", help="Take the example file, and copy it beside the results.")
    ] = False,
    law: Annotated[str, typer.Option(help="Law to fit (see: softhand list laws).")] = "nakashima",
    radius: Annotated[str | None, typer.Option(help="Radius of the tip, such as 10mm; else that of the file.")] = None,
    fix: Annotated[
        list[str], typer.Option(metavar="NAME=VALUE", help="Do not fit this coefficient; SI; may be repeated.")
    ] = [],  # noqa: B006  typer copies it
    friction: Annotated[float | None, typer.Option(help="Coefficient mu, written into fingertip.toml.")] = None,
    level: Annotated[float, typer.Option(help="Of the confidence intervals, 0 to 1.")] = 0.95,
    compare: Annotated[bool, typer.Option(help="Print all laws compared by cross-validation.")] = True,
    out: Out = None,
    quiet: Quiet = False,
) -> None:
    r"""Fit a fingertip law to measured forces; writes fit.png and fingertip.toml, and says which law foretells best.

    Columns: phi, dr, dtheta, dphi, dpsi and what was measured of Fr, Ftheta, Fphi, Fpsi, each with its unit in square
    brackets, such as "dr \[mm],phi \[deg],Fr \[N]".
    """
    from softhand.identification.fit import fit_law
    from softhand.identification.measurements import EXAMPLE, read_length, read_measurements
    from softhand.identification.report import toml_snippet
    from softhand.plots.identification import draw_fit
    from softhand.plots.style import save_figure
    from softhand.plugins import find_plugin

    if bool(data) == example:
        raise MeasurementError("Give CSV files, or --example to see how it goes.", column="", value=None)
    if not 0.0 < level < 1.0:
        raise MeasurementError(f"--level: got {level:g}; it must lie between 0 and 1.", column="level", value=level)
    measurements = read_measurements([EXAMPLE] if example else data or [])
    tip = measurements.radius if radius is None else read_length(radius, "--radius")
    if tip is None:
        raise MeasurementError(
            "The radius of the tip is not known: give --radius 10mm, or write the line # radius [mm] = 10 into a file.",
            column="radius", value=None,
        )  # fmt: skip
    fixed = _read_fixed(fix)
    fit = fit_law(measurements, find_plugin("laws", law, "--law"), tip, fixed, level)
    folder = out or new_folder("identify")
    make_folder(folder)
    save_figure(draw_fit(fit, law), folder / "fit.png")
    write_text(folder / "fingertip.toml", toml_snippet(fit, law, friction))
    files = "fit.png, fingertip.toml"
    if example:
        write_text(folder / "example.csv", EXAMPLE.read_text(encoding="utf-8"))
        files += ", example.csv"
    if not quiet:
        _print_fit(fit, law)
        if compare:
            _print_comparison(measurements, tip, law, fixed)
        console().print(f"wrote {files} in {folder}/", highlight=False)


def _read_fixed(texts: list[str]) -> dict[str, float]:
    from softhand.scenario.file import parse_override

    fixed = {}
    for name, value in map(parse_override, texts):
        if isinstance(value, bool) or not isinstance(value, int | float):
            raise MeasurementError(f"--fix {name}: got {value!r}; it must be a number.", column=name, value=value)
        fixed[name] = float(value)
    return fixed


def _print_fit(fit: Fit, law: str) -> None:
    from softhand.identification.report import coefficient_rows, residual_rows

    level = f"{100.0 * fit.level:g} %"
    _print_rows(f"law {law}, radius {1e3 * fit.radius:g} mm, {len(fit.measurements)} rows",
                ("", "value", f"{level} from", "to", "unit", ""), coefficient_rows(fit))  # fmt: skip
    _print_rows("standard deviations", ("", "of residuals", "of repeats", "unit"), residual_rows(fit))
    for estimate in fit.estimates:
        if estimate.note and estimate.note != "fixed":
            console().print(
                f"[yellow]warning:[/] {estimate.coefficient.name}: {escape(estimate.note)}", highlight=False
            )


def _print_comparison(measurements: Measurements, radius: float, law: str, fixed: dict[str, float]) -> None:
    from softhand.identification.comparison import compare_laws
    from softhand.identification.report import score_rows
    from softhand.plugins import find_plugin, plugin_names

    laws = {name: find_plugin("laws", name, "laws") for name in plugin_names("laws")}
    try:
        with progress("comparing laws", float(len(laws)), False) as report:
            scores = compare_laws(measurements, laws, radius, {law: fixed}, progress=report)
    except MeasurementError as error:
        console().print(f"[yellow]note:[/] {escape(str(error))}", highlight=False)
        return
    header = ("law", "fitted", "all", "Fr\n[N]", "Ftheta\n[N mm]", "Fphi\n[N mm]", "Fpsi\n[N mm]")
    _print_rows("errors at settings that were not fitted (rms)", header, score_rows(scores))
    for score in scores:
        if score.failure:
            console().print(
                f"[yellow]note:[/] {escape(score.name)} is left out: {escape(score.failure)}", highlight=False
            )


def _print_rows(title: str, header: tuple[str, ...], rows: list[tuple[str, ...]]) -> None:
    from rich import box
    from rich.table import Table

    table = Table(title=title, title_justify="left", title_style="bold", box=box.SIMPLE_HEAD)
    for k, name in enumerate(header):
        table.add_column(escape(name), no_wrap=k + 1 < len(header) or bool(name))
    for row in rows:
        table.add_row(*map(escape, row))
    console().print(table)
