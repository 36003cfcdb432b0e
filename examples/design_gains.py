"""Which gains hold the grasp best? How fast the slowest small motion dies out, for a grid of gains.

Example: python examples/design_gains.py
"""

import softhand

STIFFNESSES = (50.0, 100.0, 200.0)  # [N/m], K_O of the position; that of the orientation goes with it
FORCE_GAINS = (0.5, 1.0, 1.5)  # [1], K_N of the internal force; the paper has 1.5


def growth(stiffness, force_gain):
    """Growth rate of small motions about the start of target A, the torque held for 1 ms [1/s]."""
    gains = {"K_O_position": stiffness, "K_O_orientation": 0.003 * stiffness, "K_v": 0.005, "K_N": force_gain}
    scenario = softhand.load_scenario("target-a", {"controller": {"name": "regulation", **gains}})
    return softhand.stability(scenario).held_growth


def main():
    """Print the table, and return the best gains, stiffness [N/m] and force gain, with their growth rate [1/s]."""
    print("growth [1/s]   " + "".join(f"{f'K_N = {gain:g}':>12}" for gain in FORCE_GAINS))
    found = {}
    for stiffness in STIFFNESSES:
        for gain in FORCE_GAINS:
            found[stiffness, gain] = growth(stiffness, gain)
        print(f"K_O = {stiffness:3g} N/m  " + "".join(f"{found[stiffness, gain]:>+12.2f}" for gain in FORCE_GAINS))
    stiffness, gain = best = min(found, key=found.__getitem__)
    print(f"Where it is below zero all motions die out: the fastest with K_O = {stiffness:g} N/m and K_N = {gain:g},")
    print(f"within {-1.0 / found[best]:.1f} s to a third. The paper's K_N = 1.5 rings at this sampling.")
    return stiffness, gain, found[best]


if __name__ == "__main__":
    main()
