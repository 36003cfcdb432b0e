"""Machine code of the main job, made while a wheel is built, so that the first run need not compile.

The code fits the processor and the versions of Python and numba that it was made with; with others a run makes its own.
`SOFTHAND_MACHINE_CODE=0` leaves it out, and so does an editable installation, whose sources change.
"""

from __future__ import annotations

import os
import subprocess
import sys
import tempfile
from pathlib import Path
from typing import Any

from hatchling.builders.hooks.plugin.interface import BuildHookInterface

PROGRAM = """
import sys
from softhand.commands.main import main

sys.argv = ["softhand", "simulate", "--duration", "0.05", "--out", "run"]
main()
"""


VIEWERS = ("meshcat", "tornado")
"""Dependencies that the main job does without."""


def is_wanted() -> bool:
    """Whether wheels are to have machine code."""
    return os.environ.get("SOFTHAND_MACHINE_CODE") != "0"


class MachineCodeHook(BuildHookInterface):
    """Runs the main job in a folder of its own and packs what that has compiled."""

    def dependencies(self) -> list[str]:
        """What the main job needs while the wheel is built."""
        needed = [name for name in self.metadata.core.dependencies if not name.startswith(VIEWERS)]
        return needed if is_wanted() else []

    def initialize(self, version: str, build_data: dict[str, Any]) -> None:
        """Called before the wheel is written."""
        if version == "editable" or not is_wanted():
            return
        self._folder = tempfile.TemporaryDirectory()
        kept = Path(self._folder.name, "kept")
        path = os.pathsep.join([self.root, *filter(None, [os.environ.get("PYTHONPATH")])])
        environment = {**os.environ, "PYTHONPATH": path, "SOFTHAND_CACHE_DIR": str(kept)}
        done = subprocess.run([sys.executable, "-c", PROGRAM], env=environment, cwd=self._folder.name,
                              capture_output=True, text=True, check=False)  # fmt: skip
        if done.returncode != 0:
            self.app.display_warning(f"No machine code in this wheel; the first run compiles. {done.stderr[-2000:]}")
            return
        build_data["force_include"][str(kept)] = "softhand/machine_code"
        build_data.update(pure_python=False, infer_tag=True)

    def finalize(self, version: str, build_data: dict[str, Any], artifact_path: str) -> None:
        """Called when it is written."""
        if hasattr(self, "_folder"):
            self._folder.cleanup()
