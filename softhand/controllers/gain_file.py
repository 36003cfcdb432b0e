"""Gain files: a state feedback about a rest as TOML, numbers and names alone."""

from __future__ import annotations

from dataclasses import dataclass, fields
from functools import lru_cache
from pathlib import Path
from typing import Any

import numpy as np
import tomli_w

from softhand.errors import ScenarioError
from softhand.files import read_regular
from softhand.numerics.arrays import Array, as_numbers
from softhand.recording.whole_file import write_whole
from softhand.settings.toml import LONGEST, parse_toml
from softhand.settings.wording import show

FORMAT = "softhand state feedback 1"
POSE = ("object x", "object y", "object z", "object turn about x", "object turn about y", "object turn about z")
_KEY = "controller.gain_file"


@dataclass(frozen=True, eq=False)
class GainFile:
    """A state feedback, tau = u0 - K x - K_integral i; n joints, np internal forces, w = 6 + np values asked for.

    Attributes:
        period: between samples [s].
        joints: names.
        tips: names.
        joint_position: at the designed rest [rad or m], shape (n,).
        object_position: likewise, of the origin in the world [m], shape (3,).
        object_rotation: axes of the object as columns, shape (3, 3).
        internal_force: [N], shape (np,).
        torque: at rest there [N m, N], shape (n,).
        joint_follow: how joints go with what is asked for, displacement of the object in its axes at rest, then
            internal forces, shape (n, w).
        torque_follow: how torques do, shape (n, w).
        K: by displacements of joints and object and then their rates, shape (n, 2 (n + 6)).
        integrals: which of the w errors are summed over time, numbers from 0.
        K_integral: by these sums, shape (n, number of them).
    """

    period: float
    joints: tuple[str, ...]
    tips: tuple[str, ...]
    joint_position: Array
    object_position: Array
    object_rotation: Array
    internal_force: Array
    torque: Array
    joint_follow: Array
    torque_follow: Array
    K: Array
    integrals: tuple[int, ...]
    K_integral: Array

    def write(self, file: Path) -> None:
        """Write it, whole or not at all.

        Raises:
            RecordingError: that cannot be.
        """
        table = {name: _plain(getattr(self, name)) for name in _NAMES}
        text = tomli_w.dumps({"format": FORMAT, **table}, multiline_strings=False)
        write_whole(file, text.encode)


_NAMES = tuple(field.name for field in fields(GainFile))
_TEXTS = ("joints", "tips")


def _plain(value: Any) -> Any:
    return value.tolist() if isinstance(value, np.ndarray) else list(value) if isinstance(value, tuple) else value


def read_gain_file(file: str | Path) -> GainFile:
    """A gain file, checked: everything is there, finite, and of the shape that the names of joints and tips ask for.

    Raises:
        ScenarioError: it cannot be read, or is none.
    """
    path = Path(file)
    try:
        status = path.stat()
    except OSError as error:
        raise _wrong(path, f"cannot be read: {error.strerror or error}; softhand design lqr writes one") from error
    except ValueError as error:
        raise _wrong(path, f"cannot be read: {error}") from error
    return _read(path, status.st_mtime_ns, status.st_size)


@lru_cache(maxsize=32)
def _read(path: Path, _time: int, _size: int) -> GainFile:
    """Read once as long as it stays the same: many runs ask for it."""
    try:
        table = parse_toml(read_regular(path, LONGEST).decode())
    except (OSError, ValueError) as error:
        raise _wrong(path, f"cannot be read: {error}; give a file that softhand design lqr has written") from error
    if table.pop("format", None) != FORMAT:
        raise _wrong(path, f'is no gain file: its first line has to be format = "{FORMAT}"')
    missing, unknown = [name for name in _NAMES if name not in table], [name for name in table if name not in _NAMES]
    if missing or unknown:
        raise _wrong(path, f"has no key {missing[0]}" if missing else f"has an unknown key {show(unknown[0])}")
    names = {key: _texts(path, key, table[key]) for key in _TEXTS}
    n, pairs = len(names["joints"]), len(names["tips"]) * (len(names["tips"]) - 1) // 2
    integrals = _numbers(path, "integrals", table["integrals"], None)
    if np.any((integrals % 1 != 0) | (integrals < 0) | (integrals >= 6 + pairs)):
        raise _wrong(path, f"integrals: got {table['integrals']}; these are whole numbers from 0 to {5 + pairs}")
    shapes = {
        "joint_position": (n,), "object_position": (3,), "object_rotation": (3, 3), "internal_force": (pairs,),
        "torque": (n,), "joint_follow": (n, 6 + pairs), "torque_follow": (n, 6 + pairs), "K": (n, 2 * (n + 6)),
        "K_integral": (n, len(integrals)),
    }  # fmt: skip
    arrays = {name: _numbers(path, name, table[name], shape) for name, shape in shapes.items()}
    period = float(_numbers(path, "period", table["period"], ()))
    R = arrays["object_rotation"]
    if not period > 0.0:
        raise _wrong(path, f"period: got {period:g}; it has to be above 0 s")
    if np.max(np.abs(R.T @ R - np.eye(3))) > 1e-6 or np.linalg.det(R) < 0.0:
        raise _wrong(path, "object_rotation: is no rotation: its columns have to be unit vectors at right angles")
    found: dict[str, Any] = {**names, **arrays, "period": period, "integrals": tuple(integrals.astype(int).tolist())}
    return GainFile(**found)


def check_fit(found: GainFile, file: str, joints: tuple[str, ...], tips: tuple[str, ...]) -> None:
    """Refuse the gains of another hand.

    Raises:
        ScenarioError: joints or tips have other names, or there are others.
    """
    for what, own, given in (("joints", found.joints, joints), ("tips", found.tips, tips)):
        if len(own) != len(given):
            raise _wrong(
                Path(file), f"is for a hand with {len(own)} {what}, and this hand has {len(given)}; design gains for it"
            )
        for mine, other in zip(own, given, strict=True):
            if mine != other:
                raise _wrong(
                    Path(file),
                    f"is for another hand: it has {show(mine)} among its {what} where this one has {show(other)}; "
                    "design gains for it",
                )


def _texts(path: Path, key: str, value: Any) -> tuple[str, ...]:
    if not isinstance(value, list) or not all(isinstance(name, str) for name in value):
        raise _wrong(path, f"{key}: got {show(value)}; these are names")
    return tuple(value)


def _numbers(path: Path, key: str, value: Any, shape: tuple[int, ...] | None) -> Array:
    numbers = None if isinstance(value, str | bool) else as_numbers(value)
    if numbers is not None and shape is not None and numbers.size == 0 and 0 in shape:
        numbers = numbers.reshape(shape)
    if numbers is None or not np.all(np.isfinite(numbers)):
        raise _wrong(path, f"{key}: has something that is no finite number")
    if (numbers.ndim != 1) if shape is None else (numbers.shape != shape):
        asked = "a list" if shape is None else f"shape {shape}"
        raise _wrong(path, f"{key}: has shape {numbers.shape}; by its joints and tips it has to be {asked}")
    return numbers


def _wrong(path: Path, why: str) -> ScenarioError:
    return ScenarioError(f"{_KEY}: {path} {why}.", key=_KEY, value=str(path))
