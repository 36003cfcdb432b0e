"""What a branch of a kernel is like, for `straight`; to all others these are the conditions themselves."""

from __future__ import annotations

from softhand.numerics.compiled import compiled


@compiled
def seldom(condition):
    """A condition that straight code leaves alone: where it holds, the kernel itself has to run."""
    return condition


@compiled
def usually(condition):
    """One that straight code takes for granted, likewise."""
    return condition


@compiled
def spared(condition):
    """Where it holds there is nothing to do but work on zeros, which straight code does all the same."""
    return condition
