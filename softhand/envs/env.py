"""One world as an environment of Gymnasium."""

from __future__ import annotations

from importlib import import_module
from typing import Any

import gymnasium
import numpy as np

from softhand.envs import goals
from softhand.envs.episodes import Episodes
from softhand.envs.rendering import Renderer
from softhand.envs.spaces import action_space, observation_space, observed, of_world
from softhand.errors import ScenarioError
from softhand.numerics.arrays import AnyArray, Array

RENDER_FPS = 100
"""Actions a second, as long as one takes 0.01 s."""

MODES = {"human": "softhand.envs.shown:Shown", "rgb_array": "softhand.envs.pictures:Pictures"}
"""Render modes, and what draws in them, which is imported when it is asked for."""


class HandEnv(gymnasium.Env[dict[str, Any], AnyArray]):
    """A hand with soft fingertips, and an object with a pose that it shall have.

        import gymnasium
        import softhand.envs

        env = gymnasium.make("softhand/ReorientBox-v0", action="set-point", reward="sparse")

    Observation, goals and `compute_reward` are those of Gymnasium-Robotics. `info` has `is_success`, the `cost` that
    the reward has in it, of an episode that ends early why it `ended`, after `reset` what was drawn for the `world`.

    Args:
        task: `HoldBox`, `ReorientBox` or `GraspAndLift`.
        render_mode: `human` shows the world in meshcat, `rgb_array` gives pictures; None does neither.
        options: see `Options`.

    Raises:
        SofthandError: an option is wrong, or its world has no start.
    """

    metadata = {"render_modes": list(MODES), "render_fps": RENDER_FPS}  # noqa: RUF012  not annotated, as in gymnasium

    def __init__(self, task: str = "HoldBox", render_mode: str | None = None, **options: Any) -> None:
        self.episodes = Episodes(task, options)
        self.render_mode = render_mode
        self._renderer = _renderer(render_mode, self.episodes)
        self.action_space = action_space(self.episodes)
        self.observation_space = observation_space(self.episodes)
        self._begun = False

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[dict[str, Array], dict[str, Any]]:
        """Begin an episode; the same seed gives the same episodes, to the last bit.

        Args:
            seed: of all that is drawn from here on; what was drawn before goes on if None.
            options: none are known.
        """
        super().reset(seed=seed)
        self.episodes.begin([0], [self.np_random], anew=seed is not None)
        self._begun = True
        if self.render_mode == "human":
            self.render()
        achieved = self.episodes.achieved()[0]
        success = bool(goals.reached(achieved, self.episodes.goals[0], self.episodes.measure))
        return self._observed(), {"is_success": success, "cost": 0.0, "world": dict(self.episodes.values[0])}

    def step(self, action: Any) -> tuple[dict[str, Array], float, bool, bool, dict[str, Any]]:
        """One action.

        Raises:
            ScenarioError: it is not as the action space has it, or `reset` was not called before.
        """
        if not self._begun:
            raise ScenarioError("step: call reset before the first action.", key="step")
        outcome = self.episodes.step(_one(action, self.episodes.acting.size), np.ones(1, bool))
        terminated = bool(outcome.terminated[0])
        info: dict[str, Any] = {"is_success": bool(outcome.is_success[0]), "cost": float(outcome.cost[0])}
        if terminated:
            info["ended"] = self.episodes.why(0)
        if self.render_mode == "human":
            self.render()
        return self._observed(), float(outcome.reward[0]), terminated, False, info

    def compute_reward(self, achieved_goal: Array, desired_goal: Array, info: Any) -> Any:
        """The reward for other goals, one or many: shape (7,), or (..., 7) with one info each."""
        found = goals.reward(achieved_goal, desired_goal, self.episodes.measure, goals.costs(info))
        return float(found) if np.ndim(found) == 0 else found

    def compute_terminated(self, achieved_goal: Array, desired_goal: Array, info: Any) -> bool:
        """Whatever the goal is, an episode ends where the object is lost."""
        return bool("ended" in info)

    def compute_truncated(self, achieved_goal: Array, desired_goal: Array, info: Any) -> bool:
        """Time alone does that, outside."""
        return False

    def render(self) -> Any:
        """A picture, uint8, shape (height, width, 3), in the mode `rgb_array`; None in `human`, which shows it.

        Raises:
            SofthandError: there is no Chromium, or meshcat's server is gone.
        """
        if self._renderer is None:
            gymnasium.logger.warn("render does nothing: the environment was made without a render_mode.")
            return None
        return self._renderer.draw()

    def close(self) -> None:
        """End viewers and threads."""
        if self._renderer is not None:
            self._renderer.close()
        self.episodes.close()

    def _observed(self) -> dict[str, Array]:
        return of_world(observed(self.episodes), 0)


def _renderer(mode: str | None, episodes: Episodes) -> Renderer | None:
    if mode is None:
        return None
    if mode not in MODES:
        raise ScenarioError(
            f"render_mode: got {mode!r}; choose {' or '.join(MODES)}, or None.", key="render_mode", value=mode
        )
    module, _, name = MODES[mode].partition(":")
    renderer: Renderer = getattr(import_module(module), name)(episodes)
    return renderer


def _one(action: Any, size: int) -> Any:
    """The action of one world as that of many; what is no such thing is told of as it is."""
    try:
        numbers = np.asarray(action, dtype=float)
    except (TypeError, ValueError):
        return action
    if numbers.shape != (size,):
        raise ScenarioError(
            f"action: got shape {numbers.shape}; give {size} numbers from -1 to 1, shape ({size},).",
            key="action", value=action,
        )  # fmt: skip
    return numbers[None]
