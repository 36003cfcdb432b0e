"""Energy of a grasp that rings between lossless springs: kept with the conservative law, not with the paper's."""

from __future__ import annotations

import numpy as np
import pytest
from energy import ring, task_with
from hands import STEPPERS, make_law

from softhand.laws.conservative import Conservative
from softhand.laws.hemisphere import Hemisphere
from softhand.laws.hertz import Hertz
from softhand.laws.radial import Radial

R = 0.010  # [m]


def drifts(law: object, stepper: str, steps: tuple[float, ...], duration: float) -> np.ndarray:
    """Drift over the exchanged energy at each step."""
    task = task_with(law)  # type: ignore[arg-type]
    return np.array([ring(task, STEPPERS[stepper](step=step), duration).drift for step in steps])


@pytest.mark.parametrize("duration", [0.4, pytest.param(2.0, marks=pytest.mark.slow)])
def test_conservative_law_keeps_the_energy(duration: float) -> None:
    """Also over 2 s the drift is below 1e-6 of the exchanged energy, and half the step makes it 2^5 times smaller."""
    coarse, fine = drifts(Conservative(radius=R), "rk4", (2.5e-4, 1.25e-4), duration)
    assert fine < 1e-6
    assert coarse / fine == pytest.approx(32.0, rel=0.15)


def test_conservative_law_keeps_the_energy_with_growing_shear_stiffness() -> None:
    """The same with the growth that finite elements have."""
    coarse, fine = drifts(Conservative(radius=R, growth=5.1), "rk4", (2.5e-4, 1.25e-4), 0.2)
    assert fine < 1e-6
    assert coarse / fine > 20.0


def test_a_law_whose_energy_depends_on_the_lean_keeps_it() -> None:
    """With `hemisphere` likewise, for contacts transmit the moments of its lean: without them a third would be lost."""
    coarse, fine = drifts(Hemisphere(radius=R), "rk4", (4e-4, 2e-4), 0.2)
    assert fine < 1e-6
    assert coarse / fine == pytest.approx(32.0, rel=0.15)


def test_midpoint_keeps_the_energy_to_second_order() -> None:
    """The energy of the default stepper swings by an amount that falls with the square of the step and does not grow"""
    coarse, fine = drifts(Conservative(radius=R), "midpoint", (2.5e-4, 1.25e-4), 0.5)
    (early,) = drifts(Conservative(radius=R), "midpoint", (1.25e-4,), 0.15)
    assert fine < 1.2e-4
    assert coarse / fine == pytest.approx(4.0, rel=0.1)
    assert fine < 1.2 * early


@pytest.mark.parametrize("step", [5e-4, 2.5e-4])
def test_the_papers_law_does_not_keep_energy(step: float) -> None:
    """The paper's law gains or loses a tenth of the exchanged energy and more, at any step: it is no spring."""
    assert ring(task_with(make_law()), STEPPERS["rk4"](step=step), 0.3).drift > 0.1


def test_radial_law_keeps_the_energy_and_hertz_does_not() -> None:
    """Constant stand-ins have an energy; a tangential stiffness that depends on the depth alone has none."""
    kept, lost = (drifts(law, "rk4", (1.25e-4,), 0.25)[0] for law in (Radial(radius=R), Hertz(radius=R)))
    assert kept < 1e-6
    assert lost > 1e3 * kept


def test_energy_is_kept_through_the_apex() -> None:
    """Two tips ring to and fro over Phi = 90 deg: no jump of a force, no gain, no loss."""
    task = task_with(Conservative(radius=R), height=0.1113)
    rings = [ring(task, STEPPERS["rk4"](step=step), 0.25, speed=1.0, every=5e-4) for step in (2.5e-4, 1.25e-4)]
    for found in rings:
        assert np.degrees(np.max(found.Phi[:, :2])) > 89.9
        assert np.min(np.degrees(found.Phi[:, :2])) < 89.3
        change = np.abs(np.diff(found.force, axis=0))
        assert np.max(change) < 0.06 * np.max(np.abs(found.force))
    assert rings[1].drift < 1e-6
    assert rings[0].drift / rings[1].drift > 20.0
