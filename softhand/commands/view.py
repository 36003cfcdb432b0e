"""softhand view: replay a recording on a page."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from softhand.commands.app import app
from softhand.commands.console import note_incomplete, say
from softhand.commands.runs import load_run

if TYPE_CHECKING:
    from softhand.viewer.live.page import Page

Speed = Annotated[float, typer.Option(help="Times real time.")]
Host = Annotated[
    str, typer.Option(help="Interface to listen on: 0.0.0.0 lets every machine of the network see the page.")
]
Port = Annotated[int, typer.Option(min=1, max=65535, help="First port to try; a busy one is passed over.")]
OpenPage = Annotated[bool, typer.Option("--open/--no-open", help="Show the page in the browser.")]

HOST, PORT = "127.0.0.1", 7000


@app.command(epilog="Example: softhand view runs/target-a/run.nc --speed 0.25")
def view(
    recording: Annotated[Path, typer.Argument(help="A recording, run.nc.")],
    speed: Speed = 1.0,
    once: Annotated[bool, typer.Option("--once", help="Stop at the end instead of starting again.")] = False,
    host: Host = HOST,
    port: Port = PORT,
    open_page: OpenPage = True,
) -> None:
    """Replay a recording in 3-D on a page, again and again until Ctrl-C."""
    from softhand.viewer.live.replay import Replay

    run = load_run(recording)
    with Replay(run, speed, once, host, port) as replay:
        note_incomplete(run)
        show_page(replay, open_page)
        replay.play()
        try:
            replay.wait()
        except KeyboardInterrupt:
            say("viewer closed")


def show_page(page: Page, open_page: bool, quiet: bool = False) -> None:
    """Say where a page is and what is left out of it; open it in the browser if there is one."""
    if not quiet:
        say(f"{page.notice}, Ctrl-C ends")
        for name in page.unread:
            say(f"the mesh {name} cannot be read and is left out", "note")
    if open_page:
        page.open()
