"""A loop for python-control."""

from __future__ import annotations

from typing import Any

import numpy as np

from softhand.errors import SofthandError
from softhand.margins.loop import Loop


def to_control(loop: Loop) -> Any:
    """The closed loop as a `control.StateSpace`, see `Stability.to_control`.

    Raises:
        SofthandError: python-control is not installed.
    """
    try:
        import control
    except ImportError as error:
        raise SofthandError(
            "to_control: the package control is not installed; pip install 'softhand[control]'."
        ) from error
    push = np.vstack([loop.B, np.zeros((len(loop.N), len(loop.inputs)))])
    moved = np.zeros_like(push)
    for step in loop.steps:
        moved = step @ moved + push
    return control.StateSpace(
        loop.step, moved, loop.C, np.zeros((len(loop.C), len(loop.inputs))), loop.cycle,
        states=[_plain(name) for name in loop.states],
        inputs=[_plain(f"torque of {name}") for name in loop.inputs],
        outputs=[_plain(name) for name in loop.outputs],
        name="loop", remove_useless_states=False,
    )  # fmt: skip


def _plain(name: str) -> str:
    """python-control takes a dot for the end of the name of a system."""
    return name.replace(".", "_")
