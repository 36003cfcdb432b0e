"""Episodes of a task in worlds side by side, in plain arrays; what Gymnasium sees of them is made elsewhere."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np

from softhand.assembly.variations import Variations
from softhand.batch.worlds import IDLE, Worlds
from softhand.envs import goals
from softhand.envs.acting.acting import Acting
from softhand.envs.acting.kinds import KINDS
from softhand.envs.options import Options, read_options, scenario_of
from softhand.envs.randomising import Draw
from softhand.envs.tasks import TASKS
from softhand.errors import ScenarioError
from softhand.numerics.arrays import AnyArray, Array, as_numbers
from softhand.simulation.faults import HEALTHY

_ALWAYS = ("joint_position", "joint_velocity", "object_twist", "configuration", "contact_force", "internal_force")
TOUCH = ("deformation", "contact_force", "limit_surface_use", "is_slipping")
"""What the variants with touch see of each contact: four numbers of deformation [m, rad] and of force [N, N m], the use
of the limit of friction, and 1 where it slips."""

TACTILE = ("tactile_normal_force", "tactile_shear_force")
"""What they see of each taxel [N]."""

LARGEST = {
    "joint_position": 1e2, "joint_velocity": 1e3, "object_twist": 1e3, "deformation": 1e2, "contact_force": 1e4,
    "limit_surface_use": 1e3, "is_slipping": 1.0, "tactile_normal_force": 1e4, "tactile_shear_force": 1e4,
}  # fmt: skip
"""Bounds of what is observed, beyond which it is cut; far beyond whatever a hand does."""


class Outcome(NamedTuple):
    """What a step did in each world, shape (worlds,) each."""

    reward: Array
    terminated: AnyArray
    is_success: AnyArray
    cost: Array


class Episodes:
    """Worlds of a task, each in an episode of its own.

    Attributes:
        task: what is asked for.
        options: what was chosen.
        worlds: the physics.
        acting: what actions do.
        goals: pose that each world is asked for, shape (worlds, 7).
        values: what was drawn for each world, by dotted key.
        measure: how errors count.

    Args:
        task: a key of `TASKS`.
        given: the options, see `Options`.
        count: how many worlds.
        threads: at work at the same time.

    Raises:
        SofthandError: an option is wrong, or the scenario has no start.
    """

    def __init__(self, task: str, given: dict[str, Any], count: int = 1, threads: int = 1) -> None:
        self.options: Options = read_options(task, given)
        self.task, options = TASKS[task], self.options
        scenario = scenario_of(self.task, options)
        kind = KINDS[options.action]
        self._variations = Variations(scenario, kind.law)
        setup = self._variations.setup
        mass = float(setup.world.model.inertias[setup.world.object_joint].mass)
        self._draw = Draw(scenario, mass, options.randomise)
        felt = (*(TOUCH if options.touch else ()), *(TACTILE if options.tactile else ()))
        self.worlds = Worlds(
            setup, count, tuple(dict.fromkeys((*_ALWAYS, *felt))), kind.commands(setup.world.n_joints), threads
        )  # fmt: skip
        self.goals = np.zeros((count, goals.POSE))
        self.acting: Acting = kind(self.worlds, self.goals, self.task.begins_open)
        self.measure = goals.Measure(self.task.near, self.task.scale, options.reward == "dense")
        self._periods = round(options.action_period / scenario.control_period)
        gravity = np.array(scenario.gravity, dtype=float)
        self._up = -gravity / max(float(np.linalg.norm(gravity)), 1e-12)
        self.values: list[dict[str, float]] = [{} for _ in range(count)]
        self._left, self._starts = np.zeros(count, np.int64), np.zeros((count, goals.POSE))
        self._parts = ["joint_position", "joint_velocity", "object_twist", *felt]

    def __len__(self) -> int:
        return len(self.goals)

    @property
    def limits(self) -> Array:
        """Largest of each number of the observation."""
        own = [np.full(self.worlds.seen[name][0].size, LARGEST[name]) for name in self._parts]
        return np.concatenate([*own, self.acting.limits])

    def begin(self, indices: Sequence[int], rngs: Sequence[np.random.Generator], anew: bool = False) -> None:
        """Begin episodes.

        Args:
            indices: of the worlds.
            rngs: that draw for them.
            anew: whether they draw new worlds in any case, as after a new seed.
        """
        worlds = self.worlds
        for index, rng in zip(indices, rngs, strict=True):
            if self._draw.draws and (anew or not self._left[index]):
                setup, self.values[index] = self._draw.setup(rng, self._variations)
                worlds.become(index, setup)
                self._left[index] = self.options.episodes_per_world
            else:
                worlds.restart(index)
            self._left[index] -= 1
            self._starts[index] = worlds.runs[index].observation.configuration[-goals.POSE :]
            self.goals[index] = self.task.draw_goal(rng, self._starts[index], self._up)
            if self.task.pushes:
                worlds.push(index, self.task.draw_pushes(rng, self.task.steps * self.options.action_period))
            self.acting.begin(index)
        worlds.turns[:] = IDLE
        worlds.turns[list(indices)] = 0
        worlds.go_on()

    def step(self, actions: Any, goes: AnyArray) -> Outcome:
        """One action in each world that goes on.

        Args:
            actions: from -1 to 1, shape (worlds, size); cut to that.
            goes: which worlds go on, shape (worlds,).

        Raises:
            ScenarioError: the actions are no finite numbers of that shape.
        """
        self.acting.act(np.clip(self._checked(actions, goes), -1.0, 1.0), goes)
        self.worlds.turns[:] = np.where(goes, self._periods, IDLE)
        self.worlds.go_on()
        achieved = self.achieved()
        terminated = self._ended() != ""
        cost = self.options.squeeze_cost * self.worlds.seen["internal_force"].mean(axis=1)
        return Outcome(
            goals.reward(achieved, self.goals, self.measure, cost),
            terminated & goes,
            goals.reached(achieved, self.goals, self.measure) & ~terminated,
            cost,
        )

    def achieved(self) -> Array:
        """Pose of the object in each world, shape (worlds, 7); a copy."""
        return self.worlds.seen["configuration"][:, -goals.POSE :].copy()

    def observation(self) -> Array:
        """What each world observes, shape (worlds, numbers); a copy."""
        seen = [self.worlds.seen[name].reshape(len(self), -1) for name in self._parts]
        limits = self.limits
        return np.clip(np.hstack([*seen, self.acting.asked()]), -limits, limits)

    def why(self, index: int) -> str:
        """Why an episode ended before its time, in a word or two; "" if it did not."""
        return str(self._ended()[index])

    def close(self) -> None:
        """End the threads."""
        self.worlds.close()

    def _ended(self) -> AnyArray:
        """Why each world ended, "" where it did not."""
        seen = self.worlds.seen
        off = np.any(seen["contact_force"][:, :, 2] <= 0.0, axis=1) & (not self.task.begins_open)
        away = np.linalg.norm(seen["configuration"][:, -7:-4] - self._starts[:, :3], axis=1)
        found = np.where(away > self.task.lost, "lost", np.where(off, "slipped off", ""))
        for index in np.flatnonzero(self.worlds.faults[:, 0] != HEALTHY):
            found[index] = self.worlds.error(int(index)).reason[:11]
        return found

    def _checked(self, actions: Any, goes: AnyArray) -> Array:
        numbers, shape = as_numbers(actions), (len(self), self.acting.size)
        if numbers is None or numbers.shape != shape:
            got = f"shape {np.shape(actions)}" if numbers is not None else repr(actions)
            raise ScenarioError(
                f"action: got {got}; {type(self.acting).__name__} takes {shape[1]} numbers a world, shape {shape}.",
                key="action", value=actions,
            )  # fmt: skip
        if not np.isfinite(numbers[goes]).all():
            world = int(np.flatnonzero(goes & ~np.isfinite(numbers).all(axis=1))[0])
            raise ScenarioError(
                f"action: got {numbers[world].tolist()} in world {world}; give finite numbers from -1 to 1.",
                key="action", value=actions,
            )  # fmt: skip
        return np.where(goes[:, None], numbers, 0.0)
