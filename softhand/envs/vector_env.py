"""Many worlds as one environment of Gymnasium: their physics in one compiled loop, in threads."""

from __future__ import annotations

import os
from collections.abc import Sequence
from typing import Any

import numpy as np
from gymnasium.utils import seeding
from gymnasium.vector import AutoresetMode, VectorEnv
from gymnasium.vector.utils import batch_space

from softhand.envs import goals
from softhand.envs.env import RENDER_FPS
from softhand.envs.episodes import Episodes, Outcome
from softhand.envs.spaces import action_space, observation_space, observed, of_world
from softhand.errors import ScenarioError
from softhand.numerics.arrays import AnyArray, Array


class HandVectorEnv(VectorEnv[dict[str, Array], AnyArray, AnyArray]):
    """Worlds side by side, each as `HandEnv` has it, to the last bit.

        envs = gymnasium.make_vec("softhand/ReorientBox-v0", num_envs=1000)

    World i of `reset(seed=s)` is that of a single environment with the seed s + i.

    Args:
        num_envs: how many worlds.
        task: as for `HandEnv`.
        max_episode_steps: actions after which an episode is truncated; that of the task if None.
        autoreset_mode: whether a world begins anew in the step after its episode has ended, in the same, or only by
            `reset(options={"reset_mask": ...})`.
        threads: at work at the same time; as many as there are processors if None.
        render_mode: None; worlds side by side are not drawn.
        options: see `Options`.

    Raises:
        SofthandError: an option is wrong, or the world has no start.
    """

    metadata: dict[str, Any]

    def __init__(
        self,
        num_envs: int = 1,
        task: str = "HoldBox",
        max_episode_steps: int | None = None,
        autoreset_mode: AutoresetMode | str = AutoresetMode.NEXT_STEP,
        threads: int | None = None,
        render_mode: str | None = None,
        **options: Any,
    ) -> None:
        counts = {"num_envs": num_envs, "threads": threads, "max_episode_steps": max_episode_steps}
        for name, value in counts.items():
            is_count = isinstance(value, int) and not isinstance(value, bool) and value >= 1
            if not is_count and (value is not None or name == "num_envs"):
                raise ScenarioError(f"{name}: got {value!r}; give a whole number, at least 1.", key=name, value=value)
        if render_mode is not None:
            raise ScenarioError(
                f"render_mode: got {render_mode!r}; worlds side by side are not drawn. Make a single environment for "
                "pictures.",
                key="render_mode", value=render_mode,
            )  # fmt: skip
        self.episodes = Episodes(task, options, num_envs, threads or _processors())
        self.num_envs, self.render_mode = num_envs, None
        self._mode = _mode(autoreset_mode)
        self.metadata = {"render_modes": [], "render_fps": RENDER_FPS, "autoreset_mode": self._mode}
        self._longest = max_episode_steps or self.episodes.task.steps
        self.single_action_space = action_space(self.episodes)
        self.single_observation_space = observation_space(self.episodes)
        self.action_space = batch_space(self.single_action_space, num_envs)
        self.observation_space = batch_space(self.single_observation_space, num_envs)
        self._rngs: list[np.random.Generator] = []
        self._seeds: list[int] = []
        self._steps, self._is_over = np.zeros(num_envs, np.int64), np.zeros(num_envs, bool)

    @property  # type: ignore[misc]  # nothing to set: each world has its own
    def np_random(self) -> Any:
        """What draws for each world."""
        return tuple(self._rngs)

    @property
    def np_random_seed(self) -> Any:
        """The seed of each world."""
        return tuple(self._seeds)

    def reset(
        self, *, seed: int | Sequence[int | None] | None = None, options: dict[str, Any] | None = None
    ) -> tuple[dict[str, Array], dict[str, Any]]:
        """Begin episodes.

        Args:
            seed: of the first world, the others have the next ones; or one for each. What was drawn before goes on
                where it is None.
            options: `reset_mask` says which worlds begin, shape (num_envs,).

        Raises:
            ScenarioError: seeds or mask do not fit.
        """
        begins = self._mask(options)
        anew = self._seed(seed, begins)
        for fresh in (True, False):
            self._begin(np.flatnonzero(begins & (anew == fresh)), fresh)
        return observed(self.episodes), self._told_at_start(begins)

    def step(self, actions: AnyArray) -> tuple[dict[str, Array], Array, AnyArray, AnyArray, dict[str, Any]]:
        """One action in each world.

        Raises:
            ScenarioError: actions are not as the action space has them, or `reset` was not called before.
        """
        if not self._rngs:
            raise ScenarioError("step: call reset before the first action.", key="step")
        if self._mode == AutoresetMode.DISABLED and self._is_over.any():
            over = np.flatnonzero(self._is_over).tolist()
            raise ScenarioError(
                f"step: the episodes of the worlds {over[:10]} are over; reset them first.", key="step", value=over
            )
        goes = ~self._is_over
        outcome = self.episodes.step(actions, goes)
        self._steps += goes
        truncated = goes & (self._steps >= self._longest)
        info = self._told(outcome, goes)
        if not goes.all():
            begins = ~goes
            self._begin(np.flatnonzero(begins), False)
            info |= _merged(info, self._told_at_start(begins))
        self._is_over = outcome.terminated | truncated
        if self._mode == AutoresetMode.SAME_STEP and self._is_over.any():
            info = self._begin_in_the_same_step(info)
        return observed(self.episodes), np.where(goes, outcome.reward, 0.0), outcome.terminated, truncated, info

    def compute_reward(self, achieved_goal: Array, desired_goal: Array, info: Any) -> Any:
        """As that of `HandEnv`."""
        return goals.reward(achieved_goal, desired_goal, self.episodes.measure, goals.costs(info))

    def close_extras(self, **kwargs: Any) -> None:
        """End the threads."""
        self.episodes.close()

    def _begin(self, indices: AnyArray, anew: bool) -> None:
        if len(indices):
            self.episodes.begin(indices.tolist(), [self._rngs[i] for i in indices], anew)
            self._steps[indices], self._is_over[indices] = 0, False

    def _begin_in_the_same_step(self, info: dict[str, Any]) -> dict[str, Any]:
        """Observation and info of the end are handed on beside those of the new begin."""
        over, last = self._is_over.copy(), observed(self.episodes)
        final = np.empty(self.num_envs, object)
        for index in np.flatnonzero(over):
            final[index] = of_world(last, int(index))
        ended = {name: _where(over, info[name]) for name in info}
        told = {name: _where(~over, info[name]) for name in info if name.removeprefix("_") in ("is_success", "cost")}
        self._begin(np.flatnonzero(over), False)
        fresh = _merged(told, self._told_at_start(over))
        return {"final_obs": final, "_final_obs": over, "final_info": ended, "_final_info": over.copy(), **fresh}

    def _seed(self, seed: int | Sequence[int | None] | None, begins: AnyArray) -> AnyArray:
        """Make the generators; which of them are new."""
        seeds: list[int | None] = [None] * self.num_envs
        if isinstance(seed, int):
            seeds = [seed + i for i in range(self.num_envs)]
        elif seed is not None:
            seeds = list(seed)
        if len(seeds) != self.num_envs:
            raise ScenarioError(
                f"seed: got {len(seeds)} seeds for {self.num_envs} worlds; give one each.", key="seed", value=seed
            )
        if not self._rngs:
            self._rngs, self._seeds = [np.random.default_rng(0)] * self.num_envs, [-1] * self.num_envs
            if not begins.all():
                raise ScenarioError("reset_mask: the first reset is of all worlds.", key="reset_mask")
        anew = np.zeros(self.num_envs, bool)
        for index in np.flatnonzero(begins):
            if seeds[index] is not None or self._seeds[index] < 0:
                self._rngs[index], self._seeds[index] = seeding.np_random(seeds[index])
                anew[index] = seeds[index] is not None
        return anew

    def _mask(self, options: dict[str, Any] | None) -> AnyArray:
        mask = (options or {}).get("reset_mask")
        if mask is None:
            return np.ones(self.num_envs, bool)
        if not isinstance(mask, np.ndarray) or mask.shape != (self.num_envs,) or mask.dtype != bool or not mask.any():
            raise ScenarioError(
                f"reset_mask: got {mask!r}; give an array of {self.num_envs} booleans, one of them true at least.",
                key="reset_mask", value=mask,
            )  # fmt: skip
        return mask

    def _told(self, outcome: Outcome, goes: AnyArray) -> dict[str, Any]:
        told: dict[str, Any] = {
            "is_success": outcome.is_success & goes, "_is_success": goes.copy(),
            "cost": np.where(goes, outcome.cost, 0.0), "_cost": goes.copy(),
        }  # fmt: skip
        if outcome.terminated.any():
            told["ended"] = np.full(self.num_envs, None, object)
            told["_ended"] = outcome.terminated.copy()
            for index in np.flatnonzero(outcome.terminated):
                told["ended"][index] = self.episodes.why(int(index))
        return told

    def _told_at_start(self, begins: AnyArray) -> dict[str, Any]:
        episodes = self.episodes
        success = goals.reached(episodes.achieved(), episodes.goals, episodes.measure)
        world: dict[str, Any] = {}
        for key in {key for index in np.flatnonzero(begins) for key in episodes.values[index]}:
            world[key] = np.array([values.get(key, 0.0) for values in episodes.values]) * begins
            world[f"_{key}"] = begins.copy()
        return {
            "is_success": success & begins, "_is_success": begins.copy(), "cost": np.zeros(self.num_envs),
            "_cost": begins.copy(), "world": world, "_world": begins.copy(),
        }  # fmt: skip


def _mode(mode: AutoresetMode | str) -> AutoresetMode:
    try:
        return AutoresetMode(mode)
    except ValueError as error:
        raise ScenarioError(
            f"autoreset_mode: got {mode!r}; choose {', '.join(one.value for one in AutoresetMode)}.",
            key="autoreset_mode", value=mode,
        ) from error  # fmt: skip


def _where(kept: AnyArray, told: AnyArray) -> AnyArray:
    """What is told of some worlds, and nothing of the others."""
    nothing: Any = None if told.dtype == object else told.dtype.type(0)
    return np.where(kept, told, nothing)


def _merged(told: dict[str, Any], at_start: dict[str, Any]) -> dict[str, Any]:
    """What is told of worlds that went on, and of those that began, which are others."""
    both = {name: told[name] + at_start[name] for name in told if name in at_start}
    return {**told, **at_start, **both}


def _processors() -> int:
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1
