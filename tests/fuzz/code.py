"""Laws and controllers of users: sources put together at random, of parts that are wrong more often than right."""

from __future__ import annotations

import random
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np

from fuzz.watch import Fault
from softhand import build, load_scenario
from softhand.laws.law import compile_law
from softhand.plugins import find_plugin, load_plugin_file
from softhand.recording.recording import Recording

_VALUES = (
    "1e3 * dr", "0.0", "-1e3 * dr", "float('nan')", "1e308 * 1e308", "'text'", "None", "1j", "dr ** 0.5", "dr / 0.0",
    "[dr]", "(dr, dr)", "math.sqrt(-1.0)", "unknown", "True", "10", "dr.real", "print(dr)", "k_r * dr", "dr[0]",
)  # fmt: skip
_BODIES = (
    "", "    while dr > 1e-5:\n        pass\n", "    for k in range(10):\n        dr = 0.5 * (dr + dr)\n",
    "    raise ValueError('no')\n", "    raise SystemExit(3)\n", "    return\n", "    return force(dr)\n",
    "    if dr > 1e-3:\n        return 1.0\n", "    dr = [dr] * 3\n    dr = dr[0]\n",
    "    import os\n", "    dr = {}[dr]\n",
)  # fmt: skip
_RETURNS = ("return {0}, {1}, {2}, {3}", "return {0}", "return {0}, {1}, {2}", "return [{0}, {1}, {2}, {3}]", "pass",
            "return {0}, {1}, {2}, {3}, {0}", "yield {0}", "return '{0}'")  # fmt: skip
_COUNT = [0]  # of plugins, each of which needs a name of its own


@cache
def short_run() -> Recording:
    """A run of 30 ms."""
    return build(load_scenario("target-a", {"duration": 0.03, "reference.duration": 0.03})).run()


def try_law(rng: random.Random, folder: Path) -> str:
    """A law in a file of a user, compiled."""
    names = ("dr", "dtheta", "dphi", "dpsi")
    values = [rng.choice(_VALUES) if rng.random() < 0.15 else f"1e3 * {name}" for name in names]
    body = rng.choice(_BODIES) if rng.random() < 0.5 else ""
    last = rng.choice(_RETURNS) if rng.random() < 0.3 else _RETURNS[0]
    arguments = rng.choice(["dr, dtheta, dphi, dpsi, phi, radius, k_r"] * 5 + ["dr", "*args", "self, dr", "dr, **more"])
    field = rng.choice(["k_r: float = 1e3"] * 8 + ["k_r: str = 'x'", "k_r = 5", "k_r: list = []"])
    static = rng.choice(["@staticmethod"] * 9 + ["@classmethod", "@property", "@numba.njit", "# nothing"])
    coordinates = rng.choice(["polar"] * 4 + ["surface", "round"])
    indented = "".join(f"    {line}\n" for line in (body + "    " + last.format(*values)).splitlines())
    name = _name("Law")
    source = (f"import math\nimport numba\nfrom softhand.laws.law import Law\n\nclass {name}(Law):\n"
              f"    coordinates = '{coordinates}'\n    {field}\n\n    {static}\n"
              f"    def force({arguments}):\n{indented}")  # fmt: skip
    law = _plugin("laws", source, folder, name)
    made = compile_law(law(radius=0.01))
    return "taken" if made else "refused"


def try_controller(rng: random.Random, folder: Path) -> str:
    """A controller in a file of a user, asked for some torques."""
    torque = rng.choice(["np.zeros(9)"] * 3 + [
        "np.zeros(8)", "np.full(9, np.nan)", "1.0", "None", "'text'", "np.zeros((9, 1))", "[0.0] * 9",
        "1j * np.ones(9)",
        "np.full(9, 1e308)", "['a'] * 9", "[None] * 9", "observation.joint_position * 1e200", "np.zeros(9, bool)",
    ])  # fmt: skip
    body = rng.choice(["pass"] * 3 + [
        "observation.joint_position[:] = np.nan", "raise ValueError('no')", "raise SystemExit(3)", "memory.x", "1 / 0",
        "observation.unknown", "raise StopIteration",
    ])  # fmt: skip
    given = rng.choice(["torque, memory"] * 5 + ["torque", "torque, memory, 1", "(torque,)", "None"])
    start = rng.choice(["return None"] * 4 + ["return 5", "raise RuntimeError('x')", "return np.zeros(3)"])
    signature = rng.choice(["self, observation, memory"] * 6 + ["self, observation", "observation", "self, a, b, c"])
    name = _name("Controller")
    source = (f"import numpy as np\nfrom softhand import Controller\n\nclass {name}(Controller):\n"
              f"    def start(self, observation):\n        {start}\n\n    def torque({signature}):\n        {body}\n"
              f"        torque = {torque}\n        return {given}\n")  # fmt: skip
    controller = _plugin("controllers", source, folder, name)
    scenario = load_scenario("target-a", {"duration": 0.004, "reference.duration": 0.004})
    recording = build(scenario, controller()).run()
    for array in (recording.joint_position, recording.joint_torque, recording.object_position):
        if not np.isfinite(array).all():
            raise Fault("a run of no numbers")
    return "taken"


def _name(kind: str) -> str:
    _COUNT[0] += 1
    return f"{kind}{_COUNT[0]}"


def _plugin(kind: str, source: str, folder: Path, name: str) -> Any:
    file = folder / f"{name.lower()}.py"
    file.write_text(source)
    found = load_plugin_file(file)
    return find_plugin(kind, found[0], kind)
