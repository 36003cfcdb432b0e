"""softhand hands: which hands there are."""

from __future__ import annotations

from softhand.commands.app import app
from softhand.commands.console import print_table


@app.command(epilog="Example: softhand hands")
def hands() -> None:
    """List the hands of the scenarios that ship: joints, fingertips, mass, scenarios, and what to install for them."""
    from softhand.scenario.hands import known_hands

    for hand in known_hands():
        print_table(hand.name, hand.rows())
