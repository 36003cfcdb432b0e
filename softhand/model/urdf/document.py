"""XML as elements that know their line. Document types and entities are refused, so that nothing can expand."""

from __future__ import annotations

from typing import Any
from xml.etree import ElementTree
from xml.parsers import expat

from softhand.errors import ModelError

LARGEST = 8_000_000
"""Characters of a URDF."""

_DEEPEST = 64


class Element(ElementTree.Element):
    """An element with its place in the file.

    Attributes:
        line: of its start tag, from 1.
        place: what it is and of what, such as `<mass> of link 'palm'`.
    """

    line: int
    place: str


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
        element.line = parser.CurrentLineNumber
        element.place = _place(element, stack)
        if len(stack) >= _DEEPEST:
            raise refuse(element.line, f"<{tag}> is nested {_DEEPEST} elements deep; a URDF needs 6")
        (stack[-1] if stack else root).append(element)
        stack.append(element)

    def end(_tag: str) -> None:
        stack.pop()

    def doctype(*_: Any) -> None:
        raise refuse(
            parser.CurrentLineNumber,
            "<!DOCTYPE> is refused, as its entities can expand without end or read other files; "
            "remove it and write each value out",
        )

    parser.StartElementHandler, parser.EndElementHandler = start, end
    parser.StartDoctypeDeclHandler = doctype
    try:
        parser.Parse(text.encode("utf-8", "replace"), True)
    except expat.ExpatError as error:
        still = f"; <{stack[-1].tag}> of line {stack[-1].line} is still open there" if stack else ""
        why = f"not XML: {expat.ErrorString(error.code)} at column {error.offset + 1}{still}"
        raise refuse(error.lineno, f"{why}; mend the tags and quotes there") from error
    return root[0]


def _place(element: Element, stack: list[Element]) -> str:
    if len(stack) >= 2 and stack[1].tag in ("link", "joint"):
        return f"<{element.tag}> of {stack[1].tag} '{stack[1].get('name', '')}'"
    name = element.get("name")
    return f"<{element.tag}>" + (f" '{name}'" if name is not None else "")
