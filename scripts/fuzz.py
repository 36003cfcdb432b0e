"""Inputs of strangers by the thousand, as tests/fuzz makes them: counts how they end, and tells what must not be.

python scripts/fuzz.py --minutes 10 --kind urdf
python scripts/fuzz.py --kind csv --seed 1234     one input, with all that it says
"""

from __future__ import annotations

import argparse
import random
import resource
import sys
import tempfile
import time
from collections import Counter
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[1] / "tests"))

from fuzz.code import short_run
from fuzz.kinds import KINDS
from fuzz.watch import watched

_MOST_MEMORY = 8 * 2**30  # bytes of address space, so that the machine survives


def main() -> None:
    """Read the options, run, count."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--minutes", type=float, default=1.0, help="for each kind")
    parser.add_argument("--count", type=int, default=1_000_000, help="inputs of each kind at most")
    parser.add_argument("--kind", action="append", choices=[*KINDS], help="may be repeated; all without")
    parser.add_argument("--first", type=int, default=0, help="seed of the first input")
    parser.add_argument("--seed", type=int, help="of the only input")
    asked = parser.parse_args()
    resource.setrlimit(resource.RLIMIT_AS, (_MOST_MEMORY, _MOST_MEMORY))
    short_run()  # compiles the kernels, which no input shall be blamed for
    failed = 0
    for kind in asked.kind or KINDS:
        ends: Counter[str] = Counter()
        start = time.monotonic()
        seeds = range(asked.first, asked.first + asked.count) if asked.seed is None else [asked.seed]
        for seed in seeds:
            if time.monotonic() - start > 60.0 * asked.minutes:
                break
            with tempfile.TemporaryDirectory(prefix="fuzz-") as folder:
                rng = random.Random(f"{kind} {seed}")
                end, said = watched(lambda: KINDS[kind](rng, Path(folder)))  # noqa: B023  called at once
            ends[end] += 1
            if end not in ("taken", "refused") or asked.seed is not None:
                print(f"--- {kind} {seed}: {end}\n{said}", flush=True)
        bad = sum(count for end, count in ends.items() if end not in ("taken", "refused"))
        failed += bad
        print(f"{kind}: {sum(ends.values())} inputs in {time.monotonic() - start:.0f} s: {dict(ends)}", flush=True)
    sys.exit(1 if failed else 0)


if __name__ == "__main__":
    main()
