"""softhand hands: which hands there are."""

from __future__ import annotations

from softhand.commands.app import command
from softhand.commands.console import Printer
from softhand.commands.options import Json


@command("softhand hands")
def hands(as_json: Json = False) -> None:
    """List the hands of the scenarios that ship, and what to install."""
    from dataclasses import asdict

    from softhand.scenario.hands import known_hands

    printer = Printer(as_json=as_json)
    found = known_hands()
    printer.json([{**asdict(hand), "units": {"mass": "kg"}} for hand in found])
    for hand in found:
        printer.table(hand.name, hand.rows())
