"""Learning wants a thousand grasps to begin from, and each must hold. How is such a store made?

Usually hand and object are put somewhere, fall together, and what has not dropped is kept. softhand solves the start:
the torques, the depths of the tips and their shear are such that nothing moves from the first step on. Mass, place and
attitude of a box are drawn at random; what has a grasp at rest within the friction is kept, as rows of a JSON file;
what is read back stays where it is, and a knock moves it a little. The hand is the Allegro with the extra `robots`,
else the hand of three fingers. In MuJoCo, the gripper that has closed on its box before, the box moves as its weight
comes on, and creeps.

Example: python examples/threads/stable_starts.py
"""

import json
from importlib.util import find_spec
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
from peer import Gripper, mujoco, show

import softhand

ALLEGRO = find_spec("example_robot_data") is not None
NAME, PLACE = ("allegro-box", [0.025, 0.075, 0.010]) if ALLEGRO else ("hold", [0.0, 0.010, 0.142])
HOLD = {"reference": {"kind": "hold"}, "duration": 0.2, "fingertip.contact": "coulomb"}
KNOCK = {"force": [0.0, 0.0, -0.5], "start": 0.0, "duration": 0.01}


def draw(count, seed):
    """Starts at random: of each the keys of its scenario."""
    rng = np.random.default_rng(seed)
    return [
        {
            "object.mass": rng.uniform(0.1, 0.4),
            "object.position": (np.array(PLACE) + rng.uniform(-0.006, 0.006, 3)).tolist(),
            "object.rpy": rng.uniform(-0.12, 0.12, 3).tolist(),
        }
        for _ in range(count)
    ]


def held(rows, changes):
    """How far the box moves [m], how far a tip slips [m], and whether there is a grasp, of each of `rows`."""
    scenario = softhand.load_scenario(NAME, {**HOLD, **changes})
    runs = softhand.rollout(scenario, rows, variables=("object_position", "slip_travel"))
    moved = np.linalg.norm(runs.object_position - runs.object_position[:, :1], axis=2).max(axis=1)
    return moved, runs.slip_travel[:, -1].max(axis=1), runs.finished


def main(count=24, seed=1):
    """Returns how many are kept, how far these move [m], and how far they move and slip after a knock [m]."""
    drawn = draw(count, seed)
    kept = [row for row, is_held in zip(drawn, held(drawn, {})[2], strict=True) if is_held]
    with TemporaryDirectory() as folder:
        file = Path(folder, "starts.json")
        file.write_text(json.dumps(kept, indent=1))
        again = json.loads(file.read_text())
    moved, (knocked, slipped, _) = held(again, {})[0], held(again, {"push": [KNOCK]})
    gripper = Gripper() if mujoco else None
    peer = gripper and gripper.run(0.2).slid
    rows = [
        (f"starts that have a grasp, of {count}", f"{len(kept)}", None),
        ("the box moves in 0.2 s by", f"{1e6 * moved.max():.1e} um", peer and f"{1e6 * peer:.1f} um"),
        ("after a knock by", f"{1e6 * knocked.max():.0f} um", None),
        ("and its tips slip by", f"{1e6 * slipped.max():.1f} um", None),
    ]
    show(f"Does a stored start hold? {NAME}", rows)
    return len(kept), moved, knocked, slipped, peer


if __name__ == "__main__":
    main()
