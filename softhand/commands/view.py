"""softhand view: replay a recording on a page, or in meshcat."""

from __future__ import annotations

import math
import threading
import time
from typing import TYPE_CHECKING, Annotated

import typer

from softhand.commands.app import command
from softhand.commands.console import Printer, say, say_compiling
from softhand.commands.options import Plugins, Quiet, Run
from softhand.commands.runs import load_run
from softhand.errors import SofthandError

if TYPE_CHECKING:
    from softhand.recording.recording import Recording
    from softhand.viewer.live.page import Page
    from softhand.viewer.meshcat.viewer import MeshcatViewer
    from softhand.viewer.scene.ellipsoids import Ellipsoids

Speed = Annotated[float, typer.Option(metavar="FACTOR", help="Times real time.")]
Host = Annotated[
    str,
    typer.Option(
        metavar="ADDRESS", help="Interface to listen on: 0.0.0.0 lets every machine of the network see the page."
    ),
]
Port = Annotated[int, typer.Option(metavar="N", min=1, max=65535, help="First port to try; a busy one is passed over.")]
OpenPage = Annotated[bool, typer.Option("--open/--no-open", help="Show the page in the browser.")]

HOST, PORT = "127.0.0.1", 7000
_OPENING = 10.0  # [s] that a browser may take to show meshcat's page


@command("softhand view runs/target-a --speed 0.25")
def view(
    recording: Run,
    speed: Speed = 1.0,
    once: Annotated[bool, typer.Option("--once", help="Stop at the end instead of starting again.")] = False,
    host: Host = HOST,
    port: Port = PORT,
    open_page: OpenPage = True,
    meshcat: Annotated[
        bool, typer.Option("--meshcat", help="Play it in meshcat, as an animation that can be stopped and wound there.")
    ] = False,
    stiffness: Annotated[
        bool, typer.Option("--stiffness", help="Also how the held object gives way, with locked joints, as ellipsoids.")
    ] = False,
    plugins: Plugins = [],  # noqa: B006  typer copies it
    quiet: Quiet = False,
) -> None:
    """Replay a recording in 3-D on a page.

    Again and again, until Ctrl-C ends it.
    """
    from softhand.viewer.live.replay import Replay

    printer = Printer(quiet)
    run = load_run(recording)
    if meshcat:
        refuse_host(host)
        if stiffness:
            raise SofthandError("--stiffness: is not drawn in meshcat; leave one of both out.", value="stiffness")
        _play_in_meshcat(run, speed, once, port, open_page, printer)
        return
    found = _ellipsoids(run, quiet) if stiffness else ()
    with Replay(run, speed, once, host, port, found) as replay:
        printer.incomplete(run)
        show_page(replay, open_page, quiet)
        replay.play()
        try:
            replay.wait()
        except KeyboardInterrupt:
            printer.say("viewer closed")


def _ellipsoids(run: Recording, quiet: bool) -> tuple[Ellipsoids, ...]:
    say_compiling(quiet)
    from softhand.viewer.scene.ellipsoids import ellipsoids_of

    return ellipsoids_of(run)


def refuse_host(host: str) -> None:
    """meshcat is shown on this machine alone."""
    if host != HOST:
        raise SofthandError(
            f"host: with meshcat this machine alone can see the page, not {host}; leave --host out, or leave out "
            "meshcat.",
            value=host,
        )


def _play_in_meshcat(run: Recording, speed: float, once: bool, port: int, open_page: bool, printer: Printer) -> None:
    from softhand.viewer.meshcat.viewer import MeshcatViewer

    with MeshcatViewer(port=port) as viewer:
        printer.incomplete(run)
        length = viewer.animate(run, speed, repetitions=1.0 if once else math.inf)
        is_open = show_page(viewer, open_page, printer.quiet)
        try:
            time.sleep(length + _OPENING * is_open if once else threading.TIMEOUT_MAX)
        except KeyboardInterrupt:
            printer.say("viewer closed")


def show_page(page: Page | MeshcatViewer, open_page: bool, quiet: bool = False) -> bool:
    """Say where a page is and what is left out of it; open it in the browser if there is one, and tell whether."""
    if not quiet:
        say(f"{page.notice}, Ctrl-C ends")
        for name in page.unread:
            say(f"the mesh {name} cannot be read and is left out", "note")
    return open_page and page.open()
