"""LuGre and elasto-plastic bristles: what creeps and what does not, and the ellipse that couples force and torsion."""

from __future__ import annotations

import math

import numpy as np
import pytest

from softhand import Bristles, SofthandError

STIFFNESS, LIMIT, LEVER = 2000.0, 3.0, 0.004  # [N/m], [N], [m]
DRIFT = LIMIT / STIFFNESS


def bristles(breakaway: float | None = None) -> Bristles:
    return Bristles(STIFFNESS, LIMIT, LEVER, breakaway)


def shaken(model: Bristles, low: float, high: float, way: np.ndarray, times: int = 4) -> np.ndarray:
    """Displacements at the end of each cycle between two shares of the limit, in (x, y, lever spin)."""
    unit, places = way / np.linalg.norm(way) * LIMIT * (1.0, 1.0, LEVER), []
    for _ in range(times):
        model.load(*(high * unit))
        places.append(model.load(*(low * unit)).displacement * (1.0, 1.0, LEVER))
    return np.array(places)


@pytest.mark.parametrize(("low", "high"), [(0.3, 0.7), (0.5, 0.9), (-0.2, 0.6)])
@pytest.mark.parametrize("way", [(1.0, 0.0, 0.0), (0.0, 0.0, 1.0), (0.4, -0.5, 0.7)])
def test_lugre_drifts_below_the_limit(low: float, high: float, way: tuple[float, float, float]) -> None:
    """By ln((1 - low^2) / (1 - high^2)) mu f_z / sigma_0 a cycle, along the load: v is z' / (1 -+ |s|)."""
    unit = np.array(way) / np.linalg.norm(way)
    moved = np.diff(shaken(bristles(), low, high, unit), axis=0)
    expected = DRIFT * math.log((1.0 - low * low) / (1.0 - high * high))
    assert moved == pytest.approx(np.tile(expected * unit, (3, 1)), rel=1e-3, abs=1e-3 * expected)


def test_elasto_plastic_does_not_below_its_breakaway() -> None:
    """To the last digits; beyond it does, if less than LuGre."""
    way = np.array([0.4, -0.5, 0.7])
    assert np.abs(np.diff(shaken(bristles(0.75), 0.3, 0.7, way), axis=0)).max() < 1e-15
    beyond, lugre = (np.diff(shaken(bristles(b), 0.3, 0.9, way), axis=0) for b in (0.75, None))
    assert np.all(np.linalg.norm(beyond, axis=1) > 1e-3 * DRIFT)
    assert np.all(np.linalg.norm(beyond, axis=1) < 0.9 * np.linalg.norm(lugre, axis=1))


@pytest.mark.parametrize("breakaway", [None, 0.6])
def test_steady_sliding_is_on_the_ellipse_against_the_velocity(breakaway: float | None) -> None:
    """s = mu f_z v / |v| with the spin times the lever: the normal of the ellipse there is the way."""
    way = np.array([0.3, -0.4, 0.8])
    state = bristles(breakaway).move(*(50.0 * DRIFT * way / (1.0, 1.0, LEVER)))
    s = state.force / (1.0, 1.0, LEVER)
    assert np.linalg.norm(s) == pytest.approx(LIMIT, rel=1e-6)
    assert s / LIMIT == pytest.approx(way / np.linalg.norm(way), abs=1e-6)


@pytest.mark.parametrize("breakaway", [None, 0.6])
def test_a_load_needs_the_displacement_that_brings_it(breakaway: float | None) -> None:
    """`load` and `move` are one equation, solved for one or the other."""
    loaded, moved = bristles(breakaway), bristles(breakaway)
    for share in np.linspace(0.0, 0.95, 40)[1:]:
        place = loaded.load(share * LIMIT, 0.0, 0.0).displacement
        force = moved.move(*place).force
        assert force[0] == pytest.approx(share * LIMIT, abs=1e-3 * LIMIT)


def test_dahl() -> None:
    """LuGre at slow speed, moved one way: s = mu f_z (1 - exp(-sigma_0 x / (mu f_z)))."""
    model = bristles()
    for x in np.linspace(0.0, 4.0 * DRIFT, 9)[1:]:
        assert model.move(0.0, x, 0.0).force[1] == pytest.approx(LIMIT * (1.0 - math.exp(-x / DRIFT)), rel=1e-9)


def test_another_limit_and_lever_leave_the_place_where_it_is() -> None:
    model = bristles()
    before = model.load(0.5, 0.2, 0.002)
    model.press(2.0 * LIMIT, 2.0 * LEVER)
    after = model.move(*before.displacement)
    assert after.displacement == pytest.approx(before.displacement)
    assert after.force == pytest.approx(before.force * (1.0, 1.0, 4.0))  # a spring sigma_0 l^2 against the spin


def test_wrong_numbers_are_told() -> None:
    with pytest.raises(SofthandError, match="stiffness is 0"):
        Bristles(0.0, 1.0, 1.0)
    with pytest.raises(SofthandError, match="lever is -1"):
        Bristles(1.0, 1.0, -1.0)
    with pytest.raises(SofthandError, match=r"breakaway is 1; it is from 0 to below 1"):
        Bristles(1.0, 1.0, 1.0, 1.0)
    with pytest.raises(SofthandError, match=r"a load of 1\.2 of the limit"):
        bristles().load(1.2 * LIMIT, 0.0, 0.0)
    with pytest.raises(SofthandError, match="a load of nan"):
        bristles().load(math.nan, 0.0, 0.0)
    with pytest.raises(SofthandError, match="all three must be numbers"):
        bristles().move(math.inf, 0.0, 0.0)
