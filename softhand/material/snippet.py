"""The section `[fingertip]` of a tip as text."""

from __future__ import annotations

from collections.abc import Sequence

import tomli_w

from softhand.errors import SofthandError
from softhand.laws.law import Law
from softhand.plugins import plugin_name

Relaxation = tuple[float, float]
"""Share of the force that relaxes, and its time constant [s]."""


def snippet(law: Law, friction: float | None, relaxing: Sequence[Relaxation], remarks: Sequence[str]) -> str:
    """The section as TOML.

    Args:
        law: of the tip.
        friction: coefficient mu, a line of its own if given.
        relaxing: terms of a Prony series, written as the damping `fung`.
        remarks: lines above it.
    """
    table = {"law": plugin_name("laws", type(law)), **{name: _plain(value) for name, value in dict(law).items()}}
    if friction is not None:
        table["friction"] = friction
    if relaxing:
        shares, times = zip(*relaxing, strict=True)
        table["damping"] = {"name": "fung", "shares": list(shares), "rates": [1.0 / time for time in times]}
    lines = [f"# {remark}" for remark in remarks]
    if friction is None:
        lines.append("# the material does not tell the friction: keep the line of your scenario")
    return "\n".join([*lines, tomli_w.dumps({"fingertip": table})])


def read_relaxation(text: str) -> Relaxation:
    """A term of a Prony series from a text such as "0.2@50ms".

    Raises:
        SofthandError: it is none.
    """
    share, sign, time = text.partition("@")
    for unit, scale in (("ms", 1e-3), ("s", 1.0)):
        if time.endswith(unit):
            try:
                found = float(share), scale * float(time[: -len(unit)])
            except ValueError:
                break
            if sign and 0.0 < found[0] < 1.0 and 1e-6 <= found[1] <= 1e6:
                return found
            break
    raise SofthandError(f"--relaxes: got {text[:60]!r}; give a share between 0 and 1 and its time, such as 0.2@50ms.")


def stiffening(relaxing: Sequence[Relaxation]) -> float:
    """How many times a fast motion meets the force at rest, 1 / (1 - sum of the shares).

    Raises:
        SofthandError: nothing would be left at rest, or there are more terms than the damping takes.
    """
    left = 1.0 - sum(share for share, _ in relaxing)
    if left <= 0.0:
        raise SofthandError(f"--relaxes: the shares add up to {1.0 - left:g}; something must be left at rest, below 1.")
    if len(relaxing) > 4:
        raise SofthandError(f"--relaxes: got {len(relaxing)} terms; the damping takes up to 4.")
    return 1.0 / left


def _plain(value: object) -> object:
    return [float(f"{entry:.6g}") for entry in value] if isinstance(value, tuple) else value
