"""The elements of a URDF and their attributes: what may be there, what must be, and which are numbers."""

from __future__ import annotations

import difflib
import re
from collections.abc import Iterable
from dataclasses import dataclass
from xml.etree import ElementTree

from softhand.model.urdf.document import Element
from softhand.model.urdf.findings import Findings

_NUMBER = re.compile(r"[+-]?(\d+\.?\d*|\.\d+)([eE][+-]?\d+)?", re.ASCII)
_LARGEST = 1e9  # beyond any hand, in any unit


@dataclass(frozen=True)
class Attribute:
    """What an attribute may be: so many numbers, or a text if `count` is 0."""

    count: int = 0
    unit: str = ""
    needed: bool = False
    example: str = ""
    sign: str = ""
    """`> 0` or `>= 0` where it must be."""


_LENGTH = Attribute(1, "m", True, "0.010", "> 0")
_MOMENT = Attribute(1, "kg m^2", True, "2.0e-6")
_TEXT, _NAME = Attribute(), Attribute(needed=True)
_PLAIN = Attribute(1, "", False, "1.0")

MIRRORED = {"iyx": "ixy", "izx": "ixz", "izy": "iyz"}
"""Products of inertia that some programs write a second time."""
_MIRRORED = Attribute(1, "kg m^2", False, "0")

ATTRIBUTES: dict[str, dict[str, Attribute]] = {
    "robot": {"name": _NAME},
    "link": {"name": _NAME},
    "joint": {"name": _NAME, "type": _NAME},
    "origin": {"xyz": Attribute(3, "m", False, "0 0 0.05"), "rpy": Attribute(3, "rad", False, "0 0 1.5708")},
    "mass": {"value": Attribute(1, "kg", True, "0.05")},
    "inertia": dict.fromkeys(("ixx", "ixy", "ixz", "iyy", "iyz", "izz"), _MOMENT) | dict.fromkeys(MIRRORED, _MIRRORED),
    "parent": {"link": _NAME},
    "child": {"link": _NAME},
    "axis": {"xyz": Attribute(3, "", True, "0 0 1")},
    "limit": {
        "lower": Attribute(1, "rad or m", False, "-1.57"),
        "upper": Attribute(1, "rad or m", False, "1.57"),
        "effort": Attribute(1, "N m or N", True, "2.0", ">= 0"),
        "velocity": Attribute(1, "rad/s or m/s", True, "20.0", ">= 0"),
    },
    "dynamics": {
        "damping": Attribute(1, "N m s/rad or N s/m", False, "0.0", ">= 0"),
        "friction": Attribute(1, "N m or N", False, "0.0", ">= 0"),
    },
    "mimic": {"joint": _NAME, "multiplier": _PLAIN, "offset": _PLAIN},
    "safety_controller": {
        "k_velocity": Attribute(1, "N m s/rad or N s/m", True, "10.0"),
        "k_position": _PLAIN,
        "soft_lower_limit": _PLAIN,
        "soft_upper_limit": _PLAIN,
    },
    "calibration": {"rising": _PLAIN, "falling": _PLAIN, "reference_position": _PLAIN},
    "box": {"size": Attribute(3, "m", True, "0.05 0.03 0.06", "> 0")},
    "sphere": {"radius": _LENGTH},
    "cylinder": {"radius": _LENGTH, "length": _LENGTH},
    "capsule": {"radius": _LENGTH, "length": _LENGTH},
    "mesh": {"filename": _NAME, "scale": Attribute(3, "", False, "0.001 0.001 0.001")},
    "material": {"name": _TEXT},
    "color": {"rgba": Attribute(4, "", False, "0.7 0.7 0.7 1", ">= 0")},
}
"""Attributes of each element."""

_EXACT = {"origin", "mass", "inertia", "axis", "parent", "child", "box", "sphere", "cylinder", "capsule"}
# no other attribute may stand there: a reader would leave it out and move or change the body

SHAPES = ("box", "sphere", "cylinder", "capsule", "mesh")

_ONCE: dict[str, tuple[str, ...]] = {
    "link": ("inertial",),
    "inertial": ("origin", "mass", "inertia"),
    "visual": ("origin", "geometry", "material"),
    "collision": ("origin", "geometry"),
    "geometry": SHAPES,
    "joint": ("origin", "parent", "child", "axis", "limit", "dynamics", "mimic", "safety_controller", "calibration"),
    "material": ("color",),
}
_MANY: dict[str, tuple[str, ...]] = {"robot": ("link", "joint", "material"), "link": ("visual", "collision")}
_NEEDED: dict[str, tuple[str, ...]] = {
    "inertial": ("mass", "inertia"),
    "visual": ("geometry",),
    "collision": ("geometry",),
    "joint": ("parent", "child"),
}


def check_grammar(root: Element, findings: Findings) -> None:
    """Elements that are there twice, misspelt or missing; attributes likewise; numbers that are none."""
    waiting: list[ElementTree.Element] = [root]
    while waiting:
        element = waiting.pop()
        assert isinstance(element, Element)
        known = _ONCE.get(element.tag, ()) + _MANY.get(element.tag, ())
        _check_attributes(element, findings)
        _check_children(element, known, findings)
        waiting += [child for child in element if child.tag in known]


def numbers_of(element: ElementTree.Element | None, name: str, default: str) -> list[float] | None:
    """The numbers of an attribute, of the default if element or attribute is missing; None if they are none."""
    text = default if element is None else element.get(name, default)
    count = len(default.split())
    words = text.split()
    if len(words) != count or not all(map(_NUMBER.fullmatch, words)):
        return None
    values = [float(word) for word in words]
    return values if all(abs(value) <= _LARGEST for value in values) else None


def _check_attributes(element: Element, findings: Findings) -> None:
    table = ATTRIBUTES.get(element.tag, {})
    for name, value in element.items():
        if name in table:
            _check_value(element, name, value, table[name], findings)
            continue
        near = _near(name, (other for other in table if other not in element.attrib))
        if near or element.tag in _EXACT:
            hint = f"did you mean {near}?" if near else f"there are: {', '.join(table)}."
            findings.error(element, f'unknown attribute {name}="{_short(value)}"; {hint}', value)
    for name, attribute in table.items():
        if attribute.needed and not element.get(name, "").strip():
            given = f' such as {name}="{attribute.example}"' if attribute.example else ""
            unit = f" [{attribute.unit}]" if attribute.unit else ""
            findings.error(element, f"the attribute {name} is missing; write it{unit}{given}.", element.get(name, ""))


def _check_value(element: Element, name: str, text: str, attribute: Attribute, findings: Findings) -> None:
    if not attribute.count or not text.strip():
        if attribute.count and not attribute.needed:
            findings.error(element, f'{name}="{text}" is empty; leave it out or write {attribute.example}.', text)
        return
    words, shown = text.split(), f'{name}="{_short(text)}"'
    unit = f" in {attribute.unit}" if attribute.unit else ""
    example = f'{name}="{attribute.example}"'
    bad = next((word for word in words if not _NUMBER.fullmatch(word)), None)
    is_unit = bad is not None and bad != words[0] and bad.isalpha() and _NUMBER.fullmatch(words[0])
    numbers = "one number" if attribute.count == 1 else f"{attribute.count} numbers"
    if bad is not None:
        why = f"a number stands alone, without {_short(bad)}" if is_unit and len(words) > attribute.count else ""
        findings.error(
            element, f"{shown}: {why or _why_no_number(bad)}; write {numbers}{unit}, such as {example}.", text
        )
    elif len(words) != attribute.count:
        findings.error(element, f"{shown} has {len(words)} numbers; write {numbers}{unit}, such as {example}.", text)
    else:
        values = [float(word) for word in words]
        if any(abs(value) > _LARGEST for value in values):
            findings.error(element, f"{shown} is beyond reason; write {numbers}{unit}, such as {example}.", text)
        elif attribute.sign == "> 0" and min(values) <= 0.0:
            findings.error(element, f"{shown} must be > 0; write {numbers}{unit}, such as {example}.", text)
        elif attribute.sign == ">= 0" and min(values) < 0.0:
            findings.error(element, f"{shown} must not be negative; write {numbers}{unit}, such as {example}.", text)


def _why_no_number(word: str) -> str:
    """What is wrong with a word that should be a number."""
    if word.lower().lstrip("+-") in ("nan", "inf", "infinity"):
        return f"{word} is not finite"
    if re.fullmatch(r"[+-]?\d*,\d+([eE][+-]?\d+)?", word, re.ASCII):
        return f"{word} has a comma where a decimal point must be"
    if "${" in word:
        return f"{_short(word)} is a xacro expression: run xacro on the file first"
    if _NUMBER.match(word):
        return f"{_short(word)} is a number with something behind it"
    return f"{_short(word)} is no number"


def _check_children(element: Element, known: tuple[str, ...], findings: Findings) -> None:
    once = _ONCE.get(element.tag, ())
    seen: dict[str, Element] = {}
    for child in element:
        assert isinstance(child, Element)
        if child.tag in once and child.tag in seen:
            findings.error(
                child, f"<{child.tag}> is there twice, first in line {seen[child.tag].line}; keep one.", child.tag
            )
        seen.setdefault(child.tag, child)
        if child.tag.startswith("xacro:"):
            findings.error(child, "this is a xacro file; run xacro on it and give the URDF that it prints.", child.tag)
        elif known and child.tag not in known and (near := _near(child.tag, known)):
            findings.error(child, f"unknown element; did you mean <{near}>?", child.tag)
    for name in _NEEDED.get(element.tag, ()):
        if name not in seen:
            findings.error(element, f"<{name}> is missing in it; write one.")
    if element.tag == "geometry":
        shapes = [child.tag for child in element if child.tag in SHAPES]
        if len(shapes) != 1:
            found = ", ".join(f"<{child.tag}>" for child in element) or "nothing"
            findings.error(
                element, f"needs one of {', '.join(f'<{shape}>' for shape in SHAPES)}; it has {found}.", found
            )


def _near(word: str, words: Iterable[str]) -> str | None:
    """Which of the words is meant by a misspelt one, if any; strict, as a URDF may have elements of other programs."""
    by_lower = {other.lower(): other for other in words}
    found = difflib.get_close_matches(word.lower(), by_lower, n=1, cutoff=0.75)
    return by_lower[found[0]] if found else None


def _short(text: str) -> str:
    return text if len(text) <= 60 else text[:57] + "..."
