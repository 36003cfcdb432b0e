"""A policy learns from nothing to carry a box to any pose nearby: evolution of a matrix in worlds side by side.

The matrix maps how far the goal is, how far the set point is and how the box moves to the next move of the set point.
Each generation of CMA-ES tries some matrices, each in a few worlds of their own mass, friction and stiffness, and in
between the mean of them is tested in other worlds. It takes some minutes of two cores.

Needs: pip install "softhand[rl]"

Example: python examples/learning.py --seed 0 --out policy.json
"""

import argparse
import json
import time
from pathlib import Path

import cma
import gymnasium
import numpy as np

import softhand

STEPS = 100  # actions in an episode: 1 s
SHAPE = softhand.LinearSetPoint.shape


class Arena:
    """Worlds in which some policies are tried, each policy in as many.

    Policy by policy the worlds are the same, and the goals as long as no box is lost, so that luck is the same for all.
    """

    def __init__(self, policies, worlds, seed):
        self.policies, self.worlds = policies, worlds
        self.envs = gymnasium.make_vec(
            "softhand.envs:softhand/ReorientBox-v0", num_envs=policies * worlds, max_episode_steps=STEPS,
            episodes_per_world=10**6,
        )  # fmt: skip
        self.envs.reset(seed=[seed + world for world in range(worlds)] * policies)

    def play(self, policies):
        """Mean reward of a step, and share of episodes that end at their goal, of each policy."""
        weights = np.repeat(np.reshape(policies, (self.policies, *SHAPE)), self.worlds, axis=0)
        observation, _ = self.envs.reset()
        total, goes = np.zeros(len(weights)), np.ones(len(weights), bool)
        for _ in range(STEPS):
            actions = softhand.LinearSetPoint.actions(weights, observation)
            observation, reward, terminated, _, info = self.envs.step(actions)
            total += reward * goes
            goes &= ~terminated
        success = goes & info["is_success"]
        shape = self.policies, self.worlds
        return total.reshape(shape).mean(1) / STEPS, success.reshape(shape).mean(1)


def learn(seed=0, generations=80, population=16, worlds=3, tests=32, every=10, show=print):
    """The matrix, and the learning curve: generation, processor time [s], mean reward and success of the tests."""
    begin = time.process_time()
    arena, test = Arena(population, worlds, 10_000 * seed), Arena(1, tests, 10_000 * seed + 5_000)
    start, settings = np.zeros(SHAPE[0] * SHAPE[1]), {"CMA_diagonal": True, "seed": seed + 1, "verbose": -9}
    search, curve = cma.CMAEvolutionStrategy(start, 0.3, {"popsize": population, **settings}), []
    for generation in range(generations + 1):
        if generation % every == 0 or generation == generations:
            reward, success = test.play(search.mean)
            curve.append((generation, time.process_time() - begin, float(reward[0]), float(success[0])))
            show(f"generation {generation:4d}, {curve[-1][1]:6.1f} s: reward {reward[0]:.3f}, success {success[0]:.0%}")
        if generation < generations:
            tried = search.ask()
            search.tell(tried, (-arena.play(tried)[0]).tolist())
    for one in (arena, test):
        one.envs.close()
    return search.mean.reshape(SHAPE), curve


def main(arguments=None):
    """Learn, print the curve, write the policy; returns the success at the end."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--generations", type=int, default=80)
    parser.add_argument("--out", type=Path, help="JSON file for the matrix and the curve")
    chosen = parser.parse_args(arguments)
    weights, curve = learn(chosen.seed, chosen.generations)
    if chosen.out:
        chosen.out.write_text(json.dumps({"weights": weights.tolist(), "curve": curve}, indent=1))
    return curve[-1][-1]


if __name__ == "__main__":
    main()
