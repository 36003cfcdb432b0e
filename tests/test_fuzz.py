"""A few dozen inputs of strangers of each kind; `python scripts/fuzz.py --minutes 10` tries them by the thousand."""

from __future__ import annotations

import random
import time
from pathlib import Path

import pytest
from fuzz.code import short_run
from fuzz.kinds import KINDS
from fuzz.watch import watched

COUNTS = {"scenario": 15, "override": 25, "urdf": 25, "found": 40, "recording": 15, "csv": 15, "mesh": 60, "law": 15,
          "controller": 25, "page": 25}  # fmt: skip
LONGEST = 6.0  # [s] of a kind; the inputs that are left then are those of scripts/fuzz.py


@pytest.mark.parametrize("kind", KINDS)
def test_inputs_of_strangers_are_taken_or_refused_in_words(kind: str, tmp_path: Path) -> None:
    """No traceback, no hang, no gigabyte, no NaN for a result."""
    short_run()  # compiles what is not yet
    start = time.monotonic()
    for seed in range(COUNTS[kind]):
        if time.monotonic() - start > LONGEST:
            break
        rng = random.Random(f"{kind} {seed}")
        end, said = watched(lambda: KINDS[kind](rng, tmp_path))  # noqa: B023  called at once
        assert end in ("taken", "refused"), f"python scripts/fuzz.py --kind {kind} --seed {seed}: {end}\n{said}"


FAILED = [("recording", 16), ("recording", 160), ("recording", 307), ("scenario", 1500), ("urdf", 2338), ("urdf", 2747),
          ("csv", 30), ("found", 944)]  # fmt: skip
"""Kind and seed of inputs that once ended in another way."""


@pytest.mark.parametrize(("kind", "seed"), FAILED)
def test_what_once_failed(kind: str, seed: int, tmp_path: Path) -> None:
    """Seeds that scripts/fuzz.py found."""
    short_run()
    rng = random.Random(f"{kind} {seed}")
    end, said = watched(lambda: KINDS[kind](rng, tmp_path))
    assert end in ("taken", "refused"), said
