"""Predictive control, DDP and iLQR want the derivatives of a step. Through contact, how good are they?

`softhand.Linearizer` follows the machine code of a step: A and B of x' = A x + B u, with what the contacts store among
x, have no size of difference to choose. They are held against differences of the same step that are extrapolated from
two sizes, in stick and in slip. MuJoCo's `mjd_transitionFD` differences its step, and is held against the same
extrapolation of its own: centred with 1e-6 it is good too; the size is for its user to choose, and matters.

Example: python examples/threads/derivatives.py
"""

import numpy as np
from peer import Gripper, mujoco, show

import softhand

LOADS = {"stick": 0.0, "slip": -9.0}  # [N] on the box
SIZES = (1e-3, 1e-6)


def error(found, wanted):
    """Largest difference, by the largest of each row of the wanted."""
    rows = np.abs(wanted).max(axis=1, keepdims=True)
    return float((np.abs(found - wanted) / np.where(rows > 0.0, rows, 1.0)).max())


def ours(load):
    """Errors of A and B after 20 ms under a load [N]."""
    push = [{"force": [0.0, 0.0, load], "start": 0.0, "duration": 0.05}]
    scenario = softhand.load_scenario("gripper", {"reference": {"kind": "hold"}, "push": push})
    simulation = softhand.build(scenario)
    for _ in range(20):
        simulation.sample()
        simulation.step()
    simulation.sample()
    exact = softhand.Linearizer(scenario).at(simulation.state, simulation.torque)
    differenced = softhand.linearize(scenario, state=simulation.state, torque=simulation.torque)
    return error(exact.A, differenced.A), error(exact.B, differenced.B)


def transition(gripper, size):
    """MuJoCo's A by centred differences."""
    n = 2 * gripper.model.nv
    A = np.zeros((n, n))
    mujoco.mjd_transitionFD(gripper.model, gripper.data, size, True, A, None, None, None)
    return A


def theirs(load):
    """Errors of A by the size of the difference."""
    gripper = Gripper().run(0.02, load=load)
    wanted = (4.0 * transition(gripper, 1e-5) - transition(gripper, 2e-5)) / 3.0
    return [error(transition(gripper, size), wanted) for size in SIZES]


def main():
    """Returns the errors of both in stick and in slip."""
    found = {name: ours(load) for name, load in LOADS.items()}
    peer = {name: theirs(load) for name, load in LOADS.items()} if mujoco else {}
    rows = []
    for name, (A, B) in found.items():
        rows += [(f"{name}: error of A, exact", f"{A:.0e}", None), (f"{name}: error of B, exact", f"{B:.0e}", None)]
        for size, value in zip(SIZES, peer.get(name, []), strict=False):
            rows.append((f"{name}: error of A, differences of {size:.0e}", "", f"{value:.0e}"))
    show("How good are the derivatives of a step through contact?", rows)
    return found, peer


if __name__ == "__main__":
    main()
