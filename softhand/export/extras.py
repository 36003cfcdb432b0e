"""Modules that need packages which softhand does not bring."""

from __future__ import annotations

from importlib import import_module
from types import ModuleType

from softhand.errors import SofthandError


def module_with(extra: str, name: str) -> ModuleType:
    """A module of softhand that needs the packages of an extra.

    Raises:
        SofthandError: they are not installed. Carries `.extra`.
    """
    try:
        return import_module(name)
    except ModuleNotFoundError as error:
        if (error.name or "").startswith("softhand"):
            raise
        raise SofthandError(
            f"The package {error.name!r} is not installed; install it with: pip install 'softhand[{extra}]'.",
            extra=extra,
        ) from error
