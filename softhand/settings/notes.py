"""What the docstrings of settings say of each field."""

from __future__ import annotations

import inspect
import re

from pydantic import BaseModel


def field_notes(cls: type[BaseModel]) -> dict[str, str]:
    """What the docstrings of a class and its bases say of each field, below `Attributes:`; a line each."""
    notes = {name: " ".join(field.description.split()) for name, field in cls.model_fields.items() if field.description}
    for base in reversed(cls.__mro__):
        _, _, section = inspect.cleandoc(base.__doc__ or "").partition("Attributes:\n")
        block = re.match(r"(?:[ ]{4}.*\n?|\n)*", section)
        found = re.findall(r"^    (\w+): (.*(?:\n {8}.*)*)", block[0] if block else "", re.MULTILINE)
        notes |= {name: " ".join(text.split()) for name, text in found}
    return {name: notes[name] for name in cls.model_fields if name in notes}


def unit_of(note: str) -> str:
    """The unit in brackets in a note of `field_notes`; "" without one."""
    found = re.search(r"\[([^\]]+)\]", note)
    return found[1] if found else ""
