"""Ctrl-C and its kind while something must not be lost."""

from __future__ import annotations

import signal
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass

SIGNALS = tuple(getattr(signal, name) for name in ("SIGINT", "SIGTERM", "SIGHUP") if hasattr(signal, name))
"""What asks a program to end, and can be answered later."""


@dataclass
class Held:
    """What came meanwhile."""

    came: bool = False

    def __call__(self, *_: object) -> None:
        """As a handler of signals."""
        self.came = True


@contextmanager
def interrupts_held() -> Iterator[Held]:
    """Inside this context Ctrl-C, a request to end and a closed terminal are noted, and no more.

    Only the main thread gets signals; elsewhere there is nothing to hold.
    """
    held = Held()
    if threading.current_thread() is not threading.main_thread():
        yield held
        return
    before = {number: signal.signal(number, held) for number in SIGNALS}
    try:
        yield held
    finally:
        for number, handler in before.items():
            signal.signal(number, handler if handler is not None else signal.SIG_DFL)


@contextmanager
def interruptible() -> Iterator[None]:
    """Inside this context what is held around it raises KeyboardInterrupt again, also what has come already.

    So a caller that holds all signals loses nothing between the end of the work in here and its own next line.
    """
    held = signal.getsignal(signal.SIGINT)
    if not isinstance(held, Held) or threading.current_thread() is not threading.main_thread():
        yield
        return
    try:
        for number in SIGNALS:
            signal.signal(number, signal.default_int_handler)
        if held.came:
            raise KeyboardInterrupt
        yield
    finally:
        for number in SIGNALS:
            signal.signal(number, held)
