"""The experiments see faults: each is run on physics that is a little wrong."""

from collections.abc import Callable

import pytest

from softhand.validation import pressing, rigs, rolling, sliding
from softhand.validation.check import Experiment


def _with_friction(factor: float) -> Callable[..., object]:
    plain = rigs.tip

    def tip(world, face, law=None, friction=rigs.MU, **options):  # type: ignore[no-untyped-def]
        return plain(world, face, law, factor * friction, **options)

    return tip


@pytest.mark.parametrize(
    "experiment", [sliding.incline, sliding.stopping_distance, sliding.spin_down, rolling.slide_to_roll]
)
def test_friction_off_by_one_percent(experiment: Experiment, monkeypatch: pytest.MonkeyPatch) -> None:
    """Tips that hold 1 % more than the answer assumes."""
    monkeypatch.setattr(rigs, "tip", _with_friction(1.01))
    assert not all(check.passed for check in experiment())


def test_gravity_off_by_one_percent(monkeypatch: pytest.MonkeyPatch) -> None:
    """A heavier world than the answer assumes."""
    plain = rigs.make_world

    def heavier(carriages, body, gravity=(0.0, 0.0, -rigs.G), *rest):  # type: ignore[no-untyped-def]
        return plain(carriages, body, [1.01 * value for value in gravity], *rest)

    monkeypatch.setattr(rigs, "make_world", heavier)
    assert not all(check.passed for check in pressing.resting_depth())
