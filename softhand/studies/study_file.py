"""The file of a study: TOML whose mistakes are told with their line."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple, TypeVar

from pydantic import ValidationError

from softhand.errors import ScenarioError, StudyError
from softhand.scenario.file import read_toml
from softhand.settings.lines import line_of
from softhand.settings.problems import list_problems
from softhand.settings.settings import Settings
from softhand.settings.wording import describe, show

_SettingsT = TypeVar("_SettingsT", bound=Settings)


class StudyFile(NamedTuple):
    """The text of a study and where it is from.

    Attributes:
        path: of the file; "study" for one that was made in Python.
        text: TOML; "" likewise.
        table: what it says.
    """

    path: Path
    text: str
    table: dict[str, Any]

    @classmethod
    def read(cls, source: str | Path) -> StudyFile:
        """Read a file.

        Raises:
            StudyError: it cannot be read, or is no TOML; says where.
        """
        path = Path(source)
        try:
            table = read_toml(path)
        except ScenarioError as error:
            told = str(error).replace("Scenario file", "Study file", 1).split(" Shipped scenarios:")[0]
            raise StudyError(told, file=path, key="study", value=str(path)) from error
        return cls(path, path.read_text(encoding="utf-8-sig"), table)

    def error(self, message: str, keys: Sequence[str], value: Any = None) -> StudyError:
        """The error for a key: its file and line, and what is wrong."""
        line = line_of(self.text, keys) if self.text else 0
        where = f"{self.path}, line {line}: " if line else f"{self.path}: "
        return StudyError(f"{where}{message}", file=self.path, line=line, key=".".join(keys), value=value)

    def section(self, cls: type[_SettingsT], table: Any, keys: Sequence[str]) -> _SettingsT:
        """Settings of a class from a table of the file.

        Args:
            cls: the class.
            table: names and values.
            keys: of the table in the file.

        Raises:
            StudyError: with a line for each key that is wrong.
        """
        path = ".".join(keys)
        if not isinstance(table, Mapping):
            raise self.error(f"{path}: got {show(table)}, but it must be {describe(cls)}.", keys, table)
        try:
            return cls.model_validate(dict(table))
        except ValidationError as error:
            found = []
            for key, value, message in list_problems(cls, table, path, error):
                below = key.removeprefix(path).strip(".")
                found.append(self.error(message, [*keys, *filter(None, below.split("."))], value))
            text = "\n".join(map(str, found))
            first = found[0]
            raise StudyError(text, file=self.path, line=first.line, key=first.key, value=first.value) from error
