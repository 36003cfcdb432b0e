"""Predictive control at 100 Hz: the box goes to random targets, and no fingertip may use more than its friction.

Each 10 ms the hand is linearised where it is, the next 120 ms follow from x' = drift + A x + B u, and a quadratic
program finds the torques that keep nearest to the way, the use of friction below 95 % and the torques within limits.
The whole state is taken as measured, shear of the tips with it, and the model is exact: no estimator, no error.

Example: OMP_NUM_THREADS=1 OPENBLAS_NUM_THREADS=1 python examples/predictive_control.py --targets 100
"""

import argparse
import time

import numpy as np
from scipy.linalg import cho_solve, solve_triangular
from scipy.optimize import nnls
from scipy.spatial.transform import Rotation

import softhand

PERIOD = 0.01  # [s]
STAGES = 12  # periods ahead
BLOCKS = np.array([0, 1, 2, 4, 7])  # stages at which the torques may change
USE = 0.95  # of friction, at most
UNIT = 0.02  # [N m], of the unknowns
PRICE = 1e10  # of what is beyond a limit, squared
WAY, REST = 1.0, 0.5  # [s]
POSITION, ROTATION, FORCE = 1e-3, 0.01, 0.3  # [m], [rad], [N], errors that weigh alike
VELOCITY, SPIN, CHANGE = 0.05, 0.5, 0.01  # [m/s], [rad/s], [N m] from one block to the next


def error_rows(model, seen, target):
    """Weighted errors of the object, its velocity and the internal forces as G x + g."""
    position, rotation, force = target
    R, n = seen.object_rotation, len(model.inputs)
    moving, squeeze = n + 6, [name.startswith("internal_force") for name in model.outputs]
    turn = Rotation.from_matrix(rotation.T @ R).as_rotvec()
    twist = np.concatenate([R.T @ seen.object_twist[:3], R.T @ seen.object_twist[3:]])
    x = np.eye(len(model.states))
    G = np.vstack([x[n:moving], x[moving + n : 2 * moving], model.C[squeeze]])
    g = np.concatenate([R.T @ (seen.object_position - position), turn, twist, model.output[squeeze] - force])
    weight = 1.0 / np.repeat([POSITION, ROTATION, VELOCITY, SPIN, FORCE], 3)
    return weight[:, None] * G, weight * g


def ahead(model):
    """The states at the end of each stage as X U + x, U the changes of the torques in each block."""
    s, n = model.B.shape
    short = np.eye(s + n + 1)  # of (x, u, 1) in 1 ms; torques are held for ten of them
    short[:s] = np.hstack([model.A, model.B, model.drift[:, None]])
    A, B, drift = np.split(np.linalg.matrix_power(short, round(PERIOD / model.period))[:s], [s, s + n], axis=1)
    X, x = np.zeros((STAGES + 1, s, n * len(BLOCKS))), np.zeros((STAGES + 1, s))
    for stage in range(STAGES):
        block = np.searchsorted(BLOCKS, stage, side="right") - 1
        X[stage + 1], x[stage + 1] = A @ X[stage], A @ x[stage] + drift[:, 0]
        X[stage + 1, :, block * n : (block + 1) * n] += B
    return X[1:], x[1:]


def best_change(model, seen, torque, target):
    """Change of the torques now [N m]: least squares under limits."""
    G, g = error_rows(model, seen, target)
    friction = [name.startswith("limit_surface_use") for name in model.outputs]
    C, left = model.C[friction], USE - model.output[friction]
    n, size = len(torque), len(torque) * len(BLOCKS)
    X, x = ahead(model)
    last = np.sqrt([*[1.0] * (STAGES - 1), 5.0])  # more weight at the end of the horizon
    change = (np.eye(size) - np.eye(size, k=-n)) / CHANGE
    M = UNIT * np.vstack([(last[:, None, None] * (G @ X)).reshape(-1, size), change])
    m = np.concatenate([(last[:, None] * (x @ G.T + g)).ravel(), np.zeros(size)])
    slips, box = UNIT * (C @ X).reshape(-1, size), UNIT * np.eye(size)
    limits = [np.tile(seen.effort_limit + sign * torque, len(BLOCKS)) for sign in (-1.0, 1.0)]
    rows, room = np.vstack([slips, box, -box]), np.concatenate([(left - x @ C.T).ravel(), *limits])
    return UNIT * minimum(M, m, rows, room)[:n]


def minimum(M, m, rows, room):
    """The x with the least |M x + m|^2 / 2 + PRICE |e|^2 / 2 for which rows x <= room + e, by its dual."""
    L = np.linalg.cholesky(M.T @ M)
    free, Y = -cho_solve((L, True), M.T @ m), solve_triangular(L, rows.T, lower=True)
    beyond = rows @ free - room
    if np.all(beyond <= 0.0):
        return free
    A = np.linalg.cholesky(Y.T @ Y + np.eye(len(room)) / PRICE)
    multipliers, _ = nnls(A.T, solve_triangular(A, beyond, lower=True))
    return free - solve_triangular(L, Y @ multipliers, lower=True, trans="T")


def way_to(scenario, start):
    """Minimum jerk from the start to the target of a scenario: pose and internal forces at a time [s]."""
    goal, p, R = scenario.reference, start.object_position.copy(), Rotation.from_matrix(start.object_rotation)
    turn = (R.inv() * Rotation.from_euler("xyz", goal.object_rpy)).as_rotvec()
    force = start.internal_force.copy()

    def at(now):
        a = min(now / WAY, 1.0)
        s = a**3 * (10.0 - 15.0 * a + 6.0 * a * a)
        rotation = (R * Rotation.from_rotvec(s * turn)).as_matrix()
        return p + s * (goal.object_position - p), rotation, force + s * (goal.internal_force - force)

    return at


def predictive(scenario, latency):
    """One run under predictive control; the time and processor time of each answer go into `latency` [s]."""
    simulation = softhand.build(scenario)
    linearizer = softhand.Linearizer(scenario, outputs=["internal_force", "limit_surface_use"])
    seen = simulation.sample()
    torque, way, largest = simulation.torque.copy(), way_to(scenario, seen), 0.0
    linearizer.at(simulation.state, torque)  # machine code is made here
    for k in range(round((WAY + REST) / PERIOD)):
        began = time.perf_counter(), time.process_time()
        model = linearizer.at(simulation.state, torque)
        torque += best_change(model, seen, torque, way((k + STAGES / 2) * PERIOD))
        latency.append((time.perf_counter() - began[0], time.process_time() - began[1]))
        for _ in range(round(PERIOD / scenario.control_period)):
            simulation.step(torque)
            seen = simulation.sample()
            largest = max(largest, seen.limit_surface_use.max())
    return seen, largest


def random_target(rng):
    """The task with a target up to 15 mm and 10 deg from the start along and about each axis, and a firmer grip."""
    start = np.array([0.0, 0.010, 0.142])
    reference = {
        "kind": "minimum-jerk",
        "duration": WAY,
        "object_position": (start + rng.uniform(-0.015, 0.015, 3)).tolist(),
        "object_rpy": np.radians(rng.uniform(-10.0, 10.0, 3)).tolist(),
        "internal_force": rng.uniform(6.0, 8.0, 3).tolist(),
    }
    return softhand.load_scenario(
        "target-a", {"fingertip.contact": "coulomb", "duration": WAY + REST, "reference": reference}
    )


def regulation(scenario):
    """The same task under the paper's law, asked each 1 ms."""
    simulation, largest = softhand.build(scenario), 0.0
    for _ in range(round(scenario.duration / scenario.control_period)):
        seen = simulation.sample()
        largest = max(largest, seen.limit_surface_use.max())
        simulation.step()
    return simulation.sample(), largest


def outcome(run, scenario):
    """How a run ended: position error [mm], largest use of friction, longest slip of a tip [mm]; None if lost."""
    try:
        seen, largest = run(scenario)
    except softhand.SimulationStopped:
        return None
    error = np.linalg.norm(seen.object_position - scenario.reference.object_position)
    return 1e3 * error, largest, 1e3 * seen.slip_travel.max()


def told(found):
    """One outcome in words."""
    return "lost".ljust(36) if found is None else "{:6.3f} mm, use {:5.3f}, slip {:6.3f} mm ".format(*found)


def main(arguments=None):
    """Return the outcomes of both controllers, and time and processor time of each answer [s]."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--targets", type=int, default=5, help="how many (%(default)s)")
    parser.add_argument("--seed", type=int, default=0, help="of the targets (%(default)s)")
    asked = parser.parse_args(arguments)
    rng, latency, rows = np.random.default_rng(asked.seed), [], []
    for k in range(asked.targets):
        scenario = random_target(rng)
        rows.append((outcome(lambda task: predictive(task, latency), scenario), outcome(regulation, scenario)))
        print(f"{k + 1:3d}  predictive {told(rows[-1][0])} regulation {told(rows[-1][1])}", flush=True)
    for name, found in zip(("predictive", "regulation"), zip(*rows, strict=True), strict=True):
        kept = [one for one in found if one is not None]
        slipped = sum(slip > 0.0 for _, _, slip in kept)
        print(
            f"{name}: {len(found) - len(kept)} lost, {slipped} slipped of {len(found)}; largest error "
            f"{max((error for error, _, _ in kept), default=np.nan):.3f} mm, "
            f"largest use {max((use for _, use, _ in kept), default=np.nan):.3f}"
        )
    for name, took in zip(("latency", "processor"), 1e3 * np.array(latency).T, strict=True):
        median, most, longest = np.quantile(took, [0.5, 0.99, 1.0])
        print(
            f"{name} {median:.2f} ms (median), {most:.2f} ms (99 %), {longest:.2f} ms (largest); "
            f"{np.sum(took > 1e3 * PERIOD)} of {len(took)} answers beyond {1e3 * PERIOD:.0f} ms"
        )
    return rows, np.array(latency)


if __name__ == "__main__":
    main()
