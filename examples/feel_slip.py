"""Slip told from taxels alone: noisy ones, of which some are dead, against what the simulation knows."""

import numpy as np

import softhand

MU = 0.42  # friction of the tips
SCENARIO = {
    "duration": 0.3,
    "reference.duration": 0.2,  # [s], so fast that the box slips in the fingers
    "fingertip.contact": "coulomb",
    "fingertip.friction": MU,
    "tactile.count": 100,
    "tactile.noise": 0.004,  # [N]
    "tactile.shear_noise": 0.002,  # [N]
    "tactile.dead_share": 0.05,
}
LOADED = 0.03  # [N], of a taxel that is listened to
TURNING = 0.85  # how far apart shear over pressure is in a tip that spins in its place, over the friction
USE = 0.95  # of the limit, from which a tip is said to slip


def friction_use(recording):
    """Use of the limit of friction: by the mean of shear over normal force, and, for torsion, by how far it spreads."""
    normal = np.where(recording.tactile_normal_force > LOADED, recording.tactile_normal_force, 0.0)[..., None]
    ratio = recording.tactile_shear_force / np.maximum(normal, LOADED)
    weight = normal / normal.sum(axis=2, keepdims=True)
    mean = np.sum(weight * ratio, axis=2, keepdims=True)
    spread = np.sum(weight * (ratio - mean) ** 2, axis=(2, 3))
    return np.sqrt(np.sum(mean[:, :, 0] ** 2, axis=2) + spread / TURNING**2) / MU


def main():
    """Of the samples at which a tip slips, the share that is felt; and the share of those felt in which none does."""
    recording = softhand.simulate("target-a", overrides=SCENARIO)
    slips, felt = recording.is_slipping.astype(bool), friction_use(recording) > USE
    found, wrong = (felt & slips).sum() / slips.sum(), (felt & ~slips).sum() / felt.sum()
    for k, tip in enumerate(recording.labels["contact"]):
        first = [1e3 * recording.time[told[:, k]][0] if told[:, k].any() else None for told in (slips, felt)]
        truth, told = ("never" if time is None else f"from {time:.0f} ms" for time in first)
        print(f"{tip} slips {truth}, felt {told}, by {1e3 * recording.slip_travel[-1, k]:.2f} mm")
    print(f"{found:.0%} of all samples with slip are felt, {wrong:.0%} of those felt are none")
    return found, wrong


if __name__ == "__main__":
    main()
