"""The limit of a viscoelastic tip over time: closed forms, and the contact of a run that creeps."""

from __future__ import annotations

import math

import numpy as np
import pytest

from softhand import SofthandError, limit_at_depth, limit_under_force
from softhand.dampings.fung import Fung
from softhand.dampings.kelvin_voigt import KelvinVoigt
from softhand.laws.conservative import Conservative
from softhand.laws.hertz import Hertz
from softhand.laws.nakashima import Nakashima
from softhand.laws.power import Power
from softhand.laws.radial import Radial
from softhand.patch.creep import depth_of
from softhand.steppers.midpoint import Midpoint
from softhand.validation.rigs import MU, RADIUS, pinch

ONE, TWO = Fung(shares=(0.3,), rates=(20.0,)), Fung(shares=(0.3, 0.2), rates=(20.0, 2.0))
NAKASHIMA = Nakashima(radius=RADIUS, k_r=0.377e6, k_phi=0.166e6, k_theta=0.0266e9, k_psi=0.0488e9)
TIMES = np.array([0.0, 0.01, 0.05, 0.2, 1.0, 10.0])


def test_one_relaxation_in_closed_form() -> None:
    """F_e = f_z + c w, w = f_z / c_0 (1 - exp(-c_0 nu t)); a depth with the force d^1.5 grows by its power."""
    law, normal, c, nu = Hertz(radius=RADIUS), 2.0, 0.3, 20.0
    elastic = normal * (1.0 + c / (1.0 - c) * (1.0 - np.exp(-(1.0 - c) * nu * TIMES)))
    found = limit_under_force(law, ONE, 0.5, normal, TIMES)
    assert found.depth == pytest.approx(depth_of(law, normal) * (elastic / normal) ** (2.0 / 3.0), rel=1e-9)
    assert np.all(found.shear == 0.5 * normal) and np.all(found.normal == normal)
    # a grows with the root of the depth, and the torsion with a
    assert found.torsion / found.torsion[0] == pytest.approx((elastic / normal) ** (1.0 / 3.0), rel=1e-9)
    assert found.torsion[0] == pytest.approx(3.0 * math.pi / 16.0 * 0.5 * normal * found.radius[0], rel=1e-9)


def test_it_ends_where_the_relaxed_law_bears_the_force() -> None:
    """F_e = f_z at first and f_z / c_0 at last; it only grows in between."""
    for law in (Radial(radius=RADIUS), Conservative(radius=RADIUS), NAKASHIMA, Power(radius=RADIUS)):
        found = limit_under_force(law, TWO, MU, 1.0, TIMES)
        assert found.depth[[0, -1]] == pytest.approx([depth_of(law, 1.0), depth_of(law, 2.0)], rel=1e-6)
        assert np.all(np.diff(found.torsion) > 0.0) and np.all(np.diff(found.radius) > 0.0)


def test_held_at_a_depth_both_limits_shrink_alike() -> None:
    """By the share that is left of the force."""
    found = limit_at_depth(Radial(radius=RADIUS), TWO, MU, 1e-3, TIMES)
    left = 0.5 + 0.3 * np.exp(-20.0 * TIMES) + 0.2 * np.exp(-2.0 * TIMES)
    for values in (found.normal, found.shear, found.torsion):
        assert values / values[0] == pytest.approx(left, rel=1e-12)


def test_without_relaxation_nothing_changes() -> None:
    found = limit_under_force(Radial(radius=RADIUS), KelvinVoigt(), MU, 1.0, TIMES)
    assert np.ptp(found.torsion) == 0.0


def test_the_contact_of_a_run_creeps_so() -> None:
    """A box pinched with 6 N: the lever of the limit surface in the contact grows so, and the force is held."""
    law, rig = Radial(radius=RADIUS), pinch(6.0, damping=ONE)
    seen: list[tuple[float, float, float]] = []
    rig.run(
        Midpoint(step=1e-3),
        0.4,
        lambda time: seen.append((time, float(rig.contact["lever"]), float(rig.contact["force"][2]))),
    )
    times, levers, forces = np.array(seen).T
    late = times > 0.05  # the tips swing in at first
    told = limit_under_force(law, ONE, MU, 6.0, times[late])
    assert forces[late] == pytest.approx(6.0, rel=0.02)
    assert levers[late] == pytest.approx(told.torsion / (MU * 6.0), rel=0.005)
    assert levers[-1] > 1.04 * levers[0]


def test_wrong_numbers_are_told() -> None:
    with pytest.raises(SofthandError, match="friction is 0"):
        limit_under_force(Radial(radius=RADIUS), ONE, 0.0, 1.0, TIMES)
    with pytest.raises(SofthandError, match="depth is nan"):
        limit_at_depth(Radial(radius=RADIUS), ONE, MU, math.nan, TIMES)
    with pytest.raises(SofthandError, match="give times from 0 on"):
        limit_at_depth(Radial(radius=RADIUS), ONE, MU, 1e-3, [-1.0])
    with pytest.raises(SofthandError, match="does not press with 1e"):
        limit_under_force(Radial(radius=RADIUS), ONE, MU, 1e6, TIMES)
