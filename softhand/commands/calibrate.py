"""softhand calibrate: numbers of a scenario from the log of a whole run."""

from __future__ import annotations

import math
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from softhand.commands.app import command
from softhand.commands.console import Printer, progress
from softhand.commands.options import Json, OutFolder, Plugins, Quiet, Set, complete_scenarios
from softhand.commands.places import check_folder, make_folder, new_folder, write_text
from softhand.commands.scenarios import parse_changes, scenario_file
from softhand.errors import MeasurementError, ScenarioError

if TYPE_CHECKING:
    from softhand.calibration.record import Calibration

_STEPS = 40.0  # a start takes at most


@command("softhand calibrate runs/target-a --fit k_r --fit mass --fit sensing.object_position.delay")
def calibrate(
    log: Annotated[
        Path, typer.Argument(metavar="LOG", help="run.nc or its folder, an MCAP log of one, or CSV with units.")
    ],
    fit: Annotated[
        list[str],
        typer.Option(
            "--fit",
            metavar="KEY[=LOW..HIGH]",
            help="A number of the scenario by its key or the last part of it, or sensing.QUANTITY.bias or .delay; with "
            "bounds if they are known. May be repeated.",
        ),
    ] = [],  # noqa: B006  typer copies it
    scenario: Annotated[
        str | None,
        typer.Option(
            "--scenario",
            metavar="SCENARIO",
            autocompletion=complete_scenarios,
            help="The hand that was logged, with values to begin from; that of a recording if not given.",
        ),
    ] = None,
    changes: Set = [],  # noqa: B006
    held_out: Annotated[
        float,
        typer.Option("--held-out", metavar="SHARE", help="Of the log, at its end, that is predicted, not fitted."),
    ] = 0.2,
    starts: Annotated[int, typer.Option(metavar="COUNT", help="How many values the fit begins from.")] = 1,
    seed: Annotated[int, typer.Option(metavar="SEED", help="Of all starts but the first.")] = 0,
    level: Annotated[float, typer.Option(metavar="SHARE", help="Of the confidence intervals, 0 to 1.")] = 0.95,
    piece: Annotated[float, typer.Option(metavar="SECONDS", help="Length of the pieces of the run [s].")] = 0.04,
    untold: Annotated[
        str, typer.Option(metavar="refuse|hold", help="What becomes of parameters that the log does not tell.")
    ] = "refuse",
    out: OutFolder = None,
    plugins: Plugins = [],  # noqa: B006
    as_json: Json = False,
    quiet: Quiet = False,
) -> None:
    """Fit law, damping, masses and instruments to a log.

    The run is computed anew under the logged torques. Writes calibration.png and fitted.toml. A log needs time, joint
    positions and torques; CSV columns: time, q.JOINT, tau.JOINT, and object.x, object.roll, force.TIP.x if they are
    there, each with its unit in square brackets, such as "q.finger_1_joint_1 [deg]".
    """
    check_folder(out)
    from softhand.calibration.calibrate import calibrate
    from softhand.plots.calibration import draw_calibration
    from softhand.plots.style import save_figure

    if not fit:
        raise ScenarioError(
            "--fit: nothing is to be fitted; name keys of the scenario, such as --fit k_r --fit object.mass.",
            key="fit", value=None,
        )  # fmt: skip
    keys, bounds = _wanted(fit)
    source = None if scenario is None else scenario_file(scenario)
    printer = Printer(quiet, as_json)
    with progress("fitting", _STEPS * starts, quiet) as report:
        done = [0.0]

        def note(what: str) -> None:
            done[0] += 1.0
            report(min(done[0], _STEPS * starts))

        try:
            found = calibrate(
                log, keys, source, bounds=bounds, held_out=held_out, starts=starts, seed=seed, level=level, piece=piece,
                untold=untold, overrides=parse_changes(changes) or None, progress=note,
            )  # fmt: skip
        except MeasurementError as error:
            motion = error.__dict__.get("motion")
            if motion is None:
                raise
            folder = out or new_folder("calibrate")
            make_folder(folder)
            write_text(folder / "motion.toml", motion.to_toml())
            error.say_more(f" Its scenario is {folder / 'motion.toml'}.")
            raise
    folder = out or new_folder("calibrate")
    make_folder(folder)
    save_figure(draw_calibration(found), folder / "calibration.png")
    write_text(folder / "fitted.toml", found.to_toml())
    printer.json(found)
    _print(found, printer)
    printer.say(f"wrote calibration.png, fitted.toml in {folder}/")


def _wanted(texts: list[str]) -> tuple[list[str], dict[str, tuple[float, float]]]:
    keys, bounds = [], {}
    for text in texts:
        name, sign, values = (part.strip() for part in text.partition("="))
        keys.append(name)
        if not sign:
            continue
        low, dots, high = values.partition("..")
        try:
            bounds[name] = float(low), float(high)
        except ValueError:
            bounds[name] = math.nan, math.nan
        if not dots or not all(map(math.isfinite, bounds[name])):
            raise ScenarioError(
                f"--fit {text[:80]}: bounds have the form KEY=LOW..HIGH, such as object.mass=0.1..0.3.",
                key="fit", value=text,
            )  # fmt: skip
    return keys, bounds


def _print(found: Calibration, printer: Printer) -> None:
    level = f"{100.0 * found.level:g} %"
    printer.table(
        f"{found.source}, {found.duration:.3g} s",
        found.rows(), ("", "value", f"{level} from", "to", "unit", "began at", ""),
    )  # fmt: skip
    printer.table(
        "residuals", found.residual_rows(), ("", "standard deviation", "held out, over it", "correlation of neighbours")
    )
    for finding in found.findings:
        printer.say(finding, "warning")
