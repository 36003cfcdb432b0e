"""Environments for Gymnasium: after `import softhand.envs`, `gymnasium.make("softhand/HoldBox-v0")` makes one"""

from __future__ import annotations

try:
    import gymnasium as _gymnasium
except ModuleNotFoundError as error:
    from softhand.errors import SofthandError

    raise SofthandError(
        "softhand.envs needs the package 'gymnasium', which is not installed; install it with: pip install "
        "'softhand[gym]'.",
        extra="gym",
    ) from error

from softhand.envs.registration import register_all

register_all(_gymnasium.register, _gymnasium.registry)
