"""All checks, and the table of what they found."""

from __future__ import annotations

from collections.abc import Iterator

from softhand.validation import sliding
from softhand.validation.check import Check, Experiment

EXPERIMENTS: tuple[Experiment, ...] = (*sliding.EXPERIMENTS,)
