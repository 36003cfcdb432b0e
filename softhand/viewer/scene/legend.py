"""What the colours of a picture mean."""

from __future__ import annotations

from typing import NamedTuple

from softhand.viewer.scene import palette
from softhand.viewer.scene.palette import Colour
from softhand.viewer.scene.scales import Scales


class Entry(NamedTuple):
    """A line of the legend: text with one colour, or with the colours of a ramp from its start to its end."""

    text: str
    colours: tuple[Colour, ...]
    layer: str
    ends: tuple[str, str] = ("", "")
    """What the start and the end of a ramp stand for."""
    ring: bool = False
    """Whether it is drawn as a broken ring, and not as a patch of colour."""


def make_legend(scales: Scales, slip_hold: float | None) -> list[Entry]:
    """What the colours mean, and how large the largest of each kind is."""
    entries = [
        Entry(
            f"Force on the object, longest {scales.force:.2g}\u00a0N; colour: friction use |f_t| / (μ f_z)",
            palette.RAMP,
            "forces",
            ("0", "1"),
        ),
        Entry(
            f"Force of a support, own scale, longest {scales.support_force:.2g}\u00a0N",
            (palette.SUPPORT,),
            "supports",
        ),
        Entry(
            f"Torsion on the object, longest arc {1e3 * scales.torsion:.2g}\u00a0N\u00a0mm",
            (palette.TORSION,),
            "torsion",
        ),
        Entry(f"Internal force, thickest {scales.internal_force:.2g} N", (palette.INTERNAL,), "internal"),
        Entry("Contact disc, radius √(r² - R²)", (palette.DISC,), "tips"),
        Entry("Where the contact has been", (palette.TRAIL,), "trails"),
        Entry("Where the object is wanted", (palette.DESIRED,), "desired"),
        Entry("How it gives way to a force, longest softest", (palette.GIVES,), "stiffness"),
        Entry("How a couple turns it, longest softest", (palette.TURNS,), "stiffness"),
    ]
    if scales.taxel:
        felt = Entry(
            "Taxel, normal force", tuple(palette.pressure_colours(3)), "taxels", ("0", f"{scales.taxel:.2g}\u00a0N")
        )
        entries.insert(5, felt)
    if slip_hold is None:
        beyond = Entry("Friction use above 1: a real tip would slip", (palette.SLIPPING,), "forces")
    else:
        beyond = Entry(f"Slipping, now or in the last {slip_hold:.2g}\u00a0s", (palette.SLIP,), "slip", ring=True)
    entries.insert(1, beyond)
    return entries
