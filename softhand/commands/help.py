"""Help of the commands: what they do, how they are called, options with what they take and their defaults."""

from __future__ import annotations

import os
import shutil
import textwrap
from collections.abc import Iterator, Mapping, Sequence
from typing import Any

import typer
from typer.core import TyperCommand, TyperGroup

_WIDEST = 100  # letters of a line that are read with ease
_LEFT = 26  # letters of a name; the text of a longer one begins below it


class Command(TyperCommand):
    """A command whose help is this page's."""

    def format_help(self, ctx: Any, formatter: Any) -> None:
        """Write the help."""
        formatter.write("\n".join(_command_lines(self, ctx)))


class Group(TyperGroup):
    """The program: its commands stand by what one does with them."""

    tasks: Mapping[str, Sequence[str]] = {}
    """What one does, and the commands for it, in the order of the help."""

    def format_help(self, ctx: Any, formatter: Any) -> None:
        """Write the help."""
        formatter.write("\n".join(_group_lines(self, ctx)))

    def list_commands(self, ctx: Any) -> list[str]:
        """The names of the commands in the order of the help."""
        return [name for names in self.tasks.values() for name in names]


def _group_lines(group: Group, ctx: Any) -> Iterator[str]:
    yield from _paragraphs(group.help or "")
    yield from ("", f"{_head('Usage:')} {ctx.command_path} COMMAND [OPTIONS]")
    for task, names in group.tasks.items():
        yield from ("", _head(task))
        yield from _table([(name, _first(group.commands[name].help or "")) for name in names], 11)
    yield from _options(group, ctx)
    yield from ("", f"{ctx.command_path} COMMAND --help tells more of a command.")
    yield from _epilog(group)


def _command_lines(command: Command, ctx: Any) -> Iterator[str]:
    yield from _paragraphs(command.help or "")
    arguments = [param for param in command.get_params(ctx) if param.param_type_name == "argument"]
    words = [ctx.command_path, *map(_place, arguments), "[OPTIONS]"]
    yield from ("", f"{_head('Usage:')} {' '.join(words)}")
    if arguments:
        yield from ("", _head("Arguments"))
        yield from _table([(_placeholder(one), _text(one)) for one in arguments], _LEFT)
    yield from _options(command, ctx)
    yield from _epilog(command)


def _options(command: Any, ctx: Any) -> Iterator[str]:
    options = [one for one in command.get_params(ctx) if one.param_type_name == "option" and not one.hidden]
    yield from ("", _head("Options"))
    yield from _table([(_names(one), _text(one)) for one in options], _LEFT)


def _epilog(command: Any) -> Iterator[str]:
    if command.epilog:
        yield ""
        for k, example in enumerate(command.epilog.removeprefix("Example: ").split("; ")):
            yield f"{_head('Example:') if k == 0 else ' ' * len('Example:')} {example}"


def _names(option: Any) -> str:
    """As on a command line: `-q, --quiet`, `--plot/--no-plot`, `--law NAME`."""
    names = ", ".join(sorted(option.opts, key=len))
    names += "".join(f"/{name}" for name in option.secondary_opts)
    return names if option.is_flag else f"{names} {_placeholder(option)}"


def _placeholder(param: Any) -> str:
    return param.metavar or (param.name or "").upper().rstrip("_")


def _place(argument: Any) -> str:
    word = _placeholder(argument) + ("..." if argument.nargs != 1 else "")
    return word if argument.required else f"[{word}]"


def _text(param: Any) -> str:
    default = "" if callable(param.default) else _default(param)
    return " ".join(filter(None, (param.help, default and f"[{default}]")))


def _default(param: Any) -> str:
    value = param.default
    if value is None or (value is False and not getattr(param, "secondary_opts", ())) or value in ([], (), ""):
        return ""
    if isinstance(value, bool):
        return (param.opts if value else param.secondary_opts)[0] if param.secondary_opts else ""
    return f"{value:g}" if isinstance(value, float) else str(value)


def _first(text: str) -> str:
    return " ".join(text.split("\n\n")[0].split())


def _paragraphs(text: str) -> Iterator[str]:
    for k, paragraph in enumerate(text.split("\n\n")):
        if k:
            yield ""
        yield from _wrap(" ".join(paragraph.split()), _width())


def _table(rows: Sequence[tuple[str, str]], widest: int) -> Iterator[str]:
    left = min(max(len(name) for name, _ in rows), widest) + 4
    for name, text in rows:
        lines = _wrap(text, _width() - left)
        label = _colour(f"  {name}")
        if len(name) + 4 > left:
            yield label
        elif lines:
            yield label + " " * (left - 2 - len(name)) + lines.pop(0)
        yield from (" " * left + line for line in lines)


def _wrap(text: str, width: int) -> list[str]:
    return textwrap.wrap(text, width, break_long_words=False, break_on_hyphens=False)


def _width() -> int:
    return min(shutil.get_terminal_size().columns, _WIDEST)


def _head(text: str) -> str:
    return text if os.environ.get("NO_COLOR") else typer.style(text, bold=True)


def _colour(text: str) -> str:
    return text if os.environ.get("NO_COLOR") else typer.style(text, fg=typer.colors.CYAN)
