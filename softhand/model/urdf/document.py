"""XML as elements that know their line. Document types and entities are refused, so that nothing can expand."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path
from typing import Any
from xml.etree import ElementTree
from xml.parsers import expat

from softhand.errors import ModelError
from softhand.files import read_regular

LARGEST = 8_000_000
"""Bytes of a URDF."""

_DEEPEST = 64


class Element(ElementTree.Element):
    """An element with its place in the file.

    Attributes:
        line: of its start tag, from 1.
        place: what it is and of what, such as `<mass> of link 'palm'`.
        start: where its start tag begins in the text, in bytes of UTF-8.
        end: where its end tag begins in the text, in bytes of UTF-8.
    """

    line: int
    place: str
    start: int
    end: int


def read_text(file: Path) -> str:
    """The text of a URDF file.

    Raises:
        ModelError: there is no such file, it is too long, or it cannot be read.
    """
    try:
        return read_regular(file, LARGEST).decode("utf-8-sig")
    except FileNotFoundError as error:
        raise ModelError(f"{file}: there is no such URDF file.", file=str(file)) from error
    except (OSError, UnicodeDecodeError) as error:
        raise ModelError(f"{file}: cannot read this URDF file: {error}.", file=str(file)) from error
    except ValueError as error:
        raise ModelError(f"{file}: this {error}; a .urdf file is needed.", file=str(file)) from error


def as_bytes(text: str) -> bytes:
    """The bytes in which places are counted."""
    return text.encode("utf-8", "replace")


def read_document(text: str, file: Any) -> Element:
    """The root element of an XML text.

    Args:
        text: the file's text.
        file: its name, for messages.

    Raises:
        ModelError: no well-formed XML, too long or nested too deeply, or with a document type. Carries `.file` and
            `.line`.
    """

    def refuse(line: int, why: str) -> ModelError:
        return ModelError(f"{file}, line {line}: {why}.", file=str(file), line=line)

    if len(text) > LARGEST:
        raise refuse(1, f"the URDF has {len(text)} characters, at most {LARGEST} are read; is it a mesh?")
    parser = expat.ParserCreate("utf-8")
    root: list[Element] = []
    stack: list[Element] = []

    def start(tag: str, attributes: dict[str, str]) -> None:
        element = Element(tag, attributes)
        element.line, element.start = parser.CurrentLineNumber, parser.CurrentByteIndex
        element.place = _place(element, stack)
        if len(stack) >= _DEEPEST:
            raise refuse(element.line, f"<{tag}> is nested {_DEEPEST} elements deep; a URDF needs 6")
        (stack[-1] if stack else root).append(element)
        stack.append(element)

    def end(_tag: str) -> None:
        stack.pop().end = parser.CurrentByteIndex

    def doctype(*_: Any) -> None:
        raise refuse(
            parser.CurrentLineNumber,
            "<!DOCTYPE> is refused, as its entities can expand without end or read other files; "
            "remove it and write each value out",
        )

    parser.StartElementHandler, parser.EndElementHandler = start, end
    parser.StartDoctypeDeclHandler = doctype
    try:
        parser.Parse(as_bytes(text), True)
    except expat.ExpatError as error:
        still = f"; <{stack[-1].tag}> of line {stack[-1].line} is still open there" if stack else ""
        why = f"not XML: {expat.ErrorString(error.code)} at column {error.offset + 1}{still}"
        raise refuse(error.lineno, f"{why}; mend the tags and quotes there") from error
    return root[0]


def extended(root: Element, parts: Iterable[Element], longer: int) -> Element:
    """The root element with further elements at its end, by which the text is so many bytes longer."""
    other = Element(root.tag, root.attrib)
    other.line, other.place, other.start, other.end = root.line, root.place, root.start, root.end + longer
    other.extend([*root, *parts])
    return other


def owner_of(element: Element) -> str:
    """The name of the link or joint that an element is of."""
    _, quote, name = element.place.partition("'")
    return name[:-1] if quote else element.place


def _place(element: Element, stack: list[Element]) -> str:
    if len(stack) >= 2 and stack[1].tag in ("link", "joint"):
        return f"<{element.tag}> of {stack[1].tag} '{stack[1].get('name', '')}'"
    name = element.get("name")
    return f"<{element.tag}>" + (f" '{name}'" if name is not None else "")
