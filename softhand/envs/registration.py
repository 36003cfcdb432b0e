"""The names of the environments in the registry of Gymnasium."""

from __future__ import annotations

from collections.abc import Callable, Container
from typing import Any

from softhand.envs.tasks import TASKS


def register_all(register: Callable[..., None], known: Container[str]) -> None:
    """Register `softhand/NAME-v0`, `softhand/NAMETouch-v0` with what the tips feel, `...Tactile-v0` with taxels.

    Args:
        register: of gymnasium.
        known: names that are there already.
    """
    for name, task in TASKS.items():
        for suffix, own in (("", {}), ("Touch", {"touch": True}), ("Tactile", {"tactile": True})):
            environment = f"softhand/{name}{suffix}-v0"
            options: dict[str, Any] = {"task": name, **own}
            if environment not in known:
                register(
                    environment,
                    entry_point="softhand.envs.env:HandEnv",
                    vector_entry_point="softhand.envs.vector_env:HandVectorEnv",
                    max_episode_steps=task.steps,
                    kwargs=options,
                )
