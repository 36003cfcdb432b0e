"""Words in rows, as a table that a notebook shows: HTML without scripts or styles of its own, all text escaped."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from html import escape

_LEFT = ' style="text-align: left"'  # notebooks set tables to the right


def html_table(title: str, head: Sequence[str], rows: Iterable[Sequence[str]], notes: Iterable[str] = ()) -> str:
    """A title, a table, and sentences below it.

    Args:
        title: one line of text, or none.
        head: of each column; none of a table that needs no words above it.
        rows: texts, one a column.
        notes: sentences.
    """
    above = f"<p><b>{escape(title)}</b></p>" if title else ""
    top = f"<thead>{_row('th', head)}</thead>" if head else ""
    body = "".join(_row("td", row) for row in rows)
    below = "".join(f"<p>{escape(note)}</p>" for note in notes)
    return f"<div>{above}<table>{top}<tbody>{body}</tbody></table>{below}</div>"


def folded(title: str, inside: str) -> str:
    """A line that opens to what is inside, which is HTML."""
    return f"<details><summary>{escape(title)}</summary>{inside}</details>"


def _row(tag: str, cells: Iterable[str]) -> str:
    return f"<tr>{''.join(f'<{tag}{_LEFT}>{escape(cell)}</{tag}>' for cell in cells)}</tr>"
