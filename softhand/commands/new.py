"""softhand new: a scenario to begin from, with comments; of a hand of one's own all of it is found."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import ExitStack
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from softhand.commands.app import command
from softhand.commands.console import Printer, progress, say_compiling
from softhand.commands.options import Json, Quiet, complete_scenarios
from softhand.commands.places import check_new, write_text
from softhand.commands.view import HOST, PORT, OpenPage, show_page
from softhand.errors import ScenarioError

if TYPE_CHECKING:
    from softhand.scenario.scenario import Scenario


@command(
    "softhand new my_hand.urdf --view; softhand new my_hand.urdf --tip thumb --tip index; "
    "softhand new my.toml --like pinch"
)
def new(
    file: Annotated[
        Path,
        typer.Argument(
            metavar="HAND.urdf|FILE.toml",
            help="A hand of your own, for which everything is found; or a scenario to write. One that is there stays.",
        ),
    ],
    like: Annotated[
        str | None,
        typer.Option(
            metavar="SCENARIO",
            autocompletion=complete_scenarios,
            help="A scenario that ships, of which FILE.toml is a copy; target-a if there is no --hand.",
        ),
    ] = None,
    hand: Annotated[
        Path | None,
        typer.Option(
            metavar="FILE.urdf",
            help="A hand of your own, for which FILE.toml has the ends as fingertips and the grasp is left open.",
        ),
    ] = None,
    tip: Annotated[
        list[str],
        typer.Option(
            "--tip", metavar="LINK", help="Of HAND.urdf: a link of a finger that shall hold; may be repeated."
        ),
    ] = [],  # noqa: B006  typer copies it
    friction: Annotated[
        float | None,
        typer.Option(metavar="MU", min=1e-3, help="Of HAND.urdf: coefficient of friction; 0.8 if not given."),
    ] = None,
    wrong_sign: Annotated[
        str,
        typer.Option(
            "--wrong-sign",
            metavar="limits|multiplier",
            help="Of HAND.urdf, if it is refused for it: what of joints that follow by <mimic> has the wrong sign.",
        ),
    ] = "",
    out: Annotated[
        Path | None,
        typer.Option(
            "--out", metavar="FILE.toml", help="Of HAND.urdf: the scenario to write; by default HAND.toml here."
        ),
    ] = None,
    view: Annotated[bool, typer.Option("--view", help="Of HAND.urdf: show a run in 3-D on a page.")] = False,
    open_page: OpenPage = True,
    as_json: Json = False,
    quiet: Quiet = False,
) -> None:
    """Write a scenario to begin from, with comments.

    Of HAND.urdf everything is found: fingertips, an object and where it is held, contacts, squeeze and gains. What is
    written has been run. FILE.toml is a copy of a scenario that ships, or, with --hand, has the grasp left open for
    softhand grasp.
    """
    printer = Printer(quiet, as_json)
    if file.suffix.lower() == ".urdf":
        for name, value in (("--like", like), ("--hand", hand)):
            if value is not None:
                raise ScenarioError(
                    f"{name}: is for softhand new FILE.toml; of {file} everything is found. Leave it out.",
                    key=name[2:], value=str(value),
                )  # fmt: skip
        _of_hand(file, tip, friction, wrong_sign, out, view, open_page, printer)
        return
    for name, given in (
        ("--tip", tip),
        ("--friction", friction),
        ("--wrong-sign", wrong_sign),
        ("--out", out),
        ("--view", view),
        ("--json", as_json),
    ):
        if given:
            raise ScenarioError(
                f"{name}: is for softhand new HAND.urdf; got {file}. Leave it out.", key=name[2:], value=str(given)
            )
    _blank(file, like, hand, printer)


def _of_hand(
    urdf: Path,
    tips: list[str],
    friction: float | None,
    wrong_sign: str,
    out: Path | None,
    view: bool,
    open_page: bool,
    printer: Printer,
) -> None:
    """All of it for a hand: found, run, written, shown."""
    file = out or Path(f"{urdf.stem}.toml")
    if file.suffix.lower() != ".toml":
        raise ScenarioError(f"--out: got {file}; the name of a scenario ends with .toml.", key="out", value=str(file))
    picture = file.with_suffix(".png")
    for new_one in (file, file.with_name(f"{file.stem}-box.urdf"), picture):
        check_new(new_one)
    say_compiling(printer.quiet)
    from softhand.assistant.new_scenario import FRICTION, new_scenario
    from softhand.checks.scenario import check_scenario
    from softhand.plots.grasp import draw_grasp
    from softhand.plots.style import save_figure

    with ExitStack() as stack:
        told: dict[str, Callable[[float], None]] = {}

        def report(what: str, share: float) -> None:
            if what not in told:
                stack.close()
                told[what] = stack.enter_context(progress(what, 1.0, printer.quiet))
            told[what](share)

        found = new_scenario(
            urdf, file, tips=tips, friction=friction or FRICTION, wrong_sign=wrong_sign, progress=report
        )
    printer.json(found)
    for line in found.remedies:
        key, _, why = line.partition("#")
        printer.say(f"{urdf}: hand.{key.strip()}: {why.strip()}", "warning")
    printer.table(f"{urdf} holds a box", found.rows())
    for doubt in check_scenario(found.scenario).warnings:
        printer.say(doubt, "warning")
    save_figure(draw_grasp(found.quality, f"{urdf.stem} holds a box"), picture)
    printer.say(f"wrote {file}, {found.files[1]} and {picture}; now: softhand simulate {file} --view")
    if view:
        _show(found.scenario, open_page, printer)


def _show(scenario: Scenario, open_page: bool, printer: Printer) -> None:
    """A run on a page, again and again until Ctrl-C."""
    from softhand.assembly.build import simulate
    from softhand.viewer.live.replay import Replay

    with Replay(simulate(scenario), 1.0, False, HOST, PORT, ()) as replay:
        show_page(replay, open_page, printer.quiet)
        replay.play()
        try:
            replay.wait()
        except KeyboardInterrupt:
            printer.say("viewer closed")


def _blank(file: Path, like: str | None, hand: Path | None, printer: Printer) -> None:
    """A copy of a scenario that ships, or one for a hand whose grasp is left open."""
    if file.suffix.lower() != ".toml":
        raise ScenarioError(
            f"{file}: give a hand, whose name ends with .urdf, or the name of a scenario, which ends with .toml.",
            key="scenario", value=str(file),
        )  # fmt: skip
    if like and hand:
        raise ScenarioError("--like and --hand: take one of them.", key="hand", value=str(hand))
    check_new(file)
    remedies: list[str] = []
    if hand is None:
        text, then = _copy(like or "target-a"), f"softhand simulate {file}"
    else:
        from softhand.scenario.blank import blank_scenario

        held = file.with_name(f"{file.stem}-held.toml")
        text, remedies = blank_scenario(hand, file)
        then = f"softhand grasp {file} --place --propose --write {held}"
        if "\n# contact_points = " in text:  # of coupled joints, for which nothing searches
            then = f"give [grasp] of {file} its points; then softhand check {file}. softhand new {hand} finds them"
    write_text(file, text)
    for line in remedies:
        key, _, why = line.partition("#")
        printer.say(f"{file}: hand.{key.strip()}: {why.strip()}", "warning")
    printer.say(f"wrote {file}; now: {then}")


def _copy(name: str) -> str:
    """The text of a scenario that ships."""
    from softhand.files import read_regular
    from softhand.scenario.file import find_scenario, scenario_names
    from softhand.settings.toml import LONGEST

    if name not in scenario_names():
        find_scenario(name)  # refuses what is no path, with the nearest name
        raise ScenarioError(f"--like: {name} is none that ships; copy the file itself.", key="scenario", value=name)
    text = read_regular(find_scenario(name), LONGEST).decode()
    return f"# As {name}, which ships with softhand; docs/scenario.md lists all keys.\n{text}"
