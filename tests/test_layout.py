"""Tables of the console: within the width, and no word cut."""

from __future__ import annotations

import pytest

from softhand.commands.layout import lay_out

ROWS = [("regulation", "0.02", "1.3"), ("regulation(torsion_compensation=false)", "<0.001", "never"), ("a b", "-3", "")]
HEADER = ("run", "settled\n[s]", "over\n[%]")


def test_columns_stand_side_by_side() -> None:
    """Headings at the bottom, numbers to the right, other text to the left."""
    assert lay_out([("a", "1.5", "m"), ("bcd", "10", "N m")], ("x", "value", "in\nSI")) == [
        "              in",
        "  x    value  SI",
        "  ---------------",
        "  a      1.5  m",
        "  bcd     10  N m",
    ]


@pytest.mark.parametrize("width", [80, 60, 45])
def test_no_word_is_cut(width: int) -> None:
    """Every word of every cell stands in the table as it is."""
    path = "package://softhand/urdf/three_finger_hand.urdf"
    for rows in (
        ROWS,
        [("urdf", path), ("tips", "finger_1_tip, finger_2_tip, finger_3_tip, finger_4_tip, finger_5_tip")],
    ):
        words = " ".join(lay_out(rows, (), width)).split()
        for cell in (cell for row in rows for cell in row):
            assert all(word in words for word in cell.split()), cell


@pytest.mark.parametrize("width", [80, 60, 45])
def test_lines_fit(width: int) -> None:
    """Where no word is longer than a line."""
    assert max(map(len, lay_out(ROWS, HEADER, width))) <= width


def test_what_is_too_long_stands_alone() -> None:
    """A name above its row, a path below its label; what stands beside it in other rows is not pressed together."""
    assert lay_out(ROWS[:2], (), 42) == [
        "  regulation                 0.02    1.3",
        "  regulation(torsion_compensation=false)",
        "                             <0.001  never",
    ]
    assert lay_out([("moving mass", "0.5 kg"), ("urdf", "x" * 30)], (), 34) == [
        "  moving mass  0.5 kg",
        "  urdf",
        "      " + "x" * 30,
    ]


def test_nothing_is_no_table() -> None:
    """No rows, no lines."""
    assert lay_out([]) == []
