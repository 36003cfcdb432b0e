"""Partial slip of a patch of columns: Cattaneo and Mindlin, limits, energy, symmetry, history."""

from __future__ import annotations

import math

import numpy as np
import pytest

from softhand import Patch, PatchState, SofthandError
from softhand.contact.limit import limit_use, set_limit, spin_length
from softhand.contact.records import CONTACT, OWN_PRESSURE, PAD
from softhand.laws.hemisphere import Hemisphere
from softhand.laws.hertz import Hertz
from softhand.laws.law import Law
from softhand.patch.disc import disc
from softhand.patch.mindlin import CattaneoMindlin
from softhand.patch.partial_slip import use_of
from softhand.patch.patch import stuck_stiffness
from softhand.patch.pressure import column_shares, exponent_of, power_shares
from softhand.patch.tip import contact_radius, material_of_law, ring_shares
from softhand.validation.every_law import LAWS
from softhand.validation.pressures import columns, limit_curve, power

G, A, N, MU = 60e3, 0.004, 3.0, 0.7  # [N/m^2], [m], [N], [1]
SPIN = 3.0 * math.pi / 16.0  # of Hertz's pressure, over mu N a


def pressed(nu: float = 0.5, normal: float = N, radius: float = A, **options: int) -> Patch:
    patch = Patch(A, G, nu, MU, **options)
    patch.press(normal, radius)
    return patch


def exact(nu: float) -> CattaneoMindlin:
    return CattaneoMindlin(MU, N, A, G, nu)


# ------------------------------------------------------------------------------------------ Cattaneo and Mindlin


def test_the_closed_forms_agree_with_each_other() -> None:
    """Unloading begins where loading ended, ends at its mirror image, and encloses the loss; D is where all slips."""
    ball = exact(0.3)
    turn = 0.8 * ball.most
    assert ball.unloading(turn, turn) == pytest.approx(ball.loading(turn))
    assert ball.unloading(-turn, turn) == pytest.approx(-ball.loading(turn))
    shear = np.linspace(turn, -turn, 20_001)
    assert 2.0 * np.trapezoid(shear, ball.unloading(shear, turn)) == pytest.approx(ball.loss(turn), rel=1e-6)
    assert ball.loading(ball.most) == pytest.approx(ball.reach) and ball.stick_radius(0.0) == pytest.approx(A)
    step = 1e-6 * ball.most
    assert step / ball.loading(step) == pytest.approx(8.0 * G * A / (2.0 - 0.3), rel=1e-5)


@pytest.mark.parametrize("nu", [0.0, 0.5])
def test_loading_unloading_and_the_loop_are_those_of_cattaneo_and_mindlin(nu: float) -> None:
    """Displacement and area within 2 %, at 80 % of the limit; the loop closes."""
    ball, patch = exact(nu), pressed(nu, rings=16)
    turn, up, down = 0.8 * ball.most, np.linspace(0.0, 1.0, 9)[1:], np.linspace(1.0, -1.0, 17)[1:]
    shear = turn * np.concatenate([up, down, -down])
    states = [patch.load(f, 0.0, 0.0) for f in shear]
    x = np.array([state.displacement[0] for state in states])
    assert x[:8] == pytest.approx(ball.loading(shear[:8]), rel=0.02)
    assert x[8:24] == pytest.approx(ball.unloading(shear[8:24], turn), abs=0.02 * x[7])
    assert x[-1] == pytest.approx(x[7], rel=1e-3)
    assert states[-1].lost - states[7].lost == pytest.approx(ball.loss(turn), rel=0.02)


@pytest.mark.parametrize("use", [0.3, 0.5, 0.8, 0.95])
def test_the_stick_radius_is_that_of_cattaneo(use: float) -> None:
    """Within 2 % of the contact radius; where it sticks 1 - q / (mu p) = sqrt((c^2 - rho^2) / (a^2 - rho^2)).

    So (1 - q / mu p)^2 (a^2 - rho^2) is a line in rho^2 that ends at c.
    """
    ball, patch = exact(0.0), pressed(0.0, rings=24)
    state = patch.load(use * ball.most, 0.0, 0.0)
    forces, rho = np.linalg.norm(patch.forces, axis=1)[::12], np.linalg.norm(patch.points, axis=1)[::12]
    share = forces / patch.limits[::12]
    stuck = np.flatnonzero(share < 1.0 - 1e-6)
    line = np.polyfit(rho[stuck] ** 2, (1.0 - share[stuck]) ** 2 * (A * A - rho[stuck] ** 2), 1)
    c = math.sqrt(-line[1] / line[0])
    assert c == pytest.approx(float(ball.stick_radius(use * ball.most)), abs=0.02 * A)
    assert state.slipped == pytest.approx(1.0 - (c / A) ** 2, abs=2.0 / 24)
    assert state.use == pytest.approx(use, abs=1e-9)


@pytest.mark.parametrize("stick", [0.9, 0.75, 0.5, 0.3])
def test_spun_it_sticks_within_the_radius_of_lubkin(stick: float) -> None:
    """Within half a ring; at little slip the closed form is that of a disc which sticks."""
    ball, patch = exact(0.5), pressed(0.5, rings=24)
    for share in (0.25, 0.5, 0.75, 1.0):
        state = patch.move(0.0, 0.0, share * float(ball.spin(stick * A)))
    assert math.sqrt(1.0 - state.slipped) == pytest.approx(stick, abs=0.51 / 24)
    little = float(ball.spin(0.9999 * A))
    assert 16.0 / 3.0 * G * A**3 * little == pytest.approx((1.0 - 0.9999**2) * MU * N * A, rel=1e-3)


@pytest.mark.parametrize("nu", [0.0, 0.3, 0.5])
def test_stuck_it_is_as_stiff_as_a_disc_on_a_half_space(nu: float) -> None:
    """Mindlin's 8 G a / (2 - nu), Reissner and Sagoci's 16 G a^3 / 3; so are the inner rings alone."""
    grid = disc(12, 12)
    for rings, close in ((12, 0.01), (6, 0.03)):
        a = A * rings / 12
        shear, spin = stuck_stiffness(A * grid.points, grid.compliance(nu) / (G * A), 12)[rings - 1]
        assert shear == pytest.approx(8.0 * G * a / (2.0 - nu), rel=close)
        assert spin == pytest.approx(16.0 / 3.0 * G * a**3, rel=close)


# ------------------------------------------------------------------------------------------ the whole limit


@pytest.mark.parametrize("way", [(1.0, 0.0, 0.0), (-0.6, 0.8, 0.0), (0.0, 0.0, 1.0), (0.0, 0.0, -1.0)])
def test_slid_far_it_holds_what_friction_holds(way: tuple[float, float, float]) -> None:
    """mu N along the way; 3 pi / 16 mu N a against a spin."""
    state = pressed().move(*(np.array(way) * (0.1, 0.1, 20.0)))
    assert state.force == pytest.approx(np.array(way) * MU * N * np.array([1.0, 1.0, SPIN * A]), abs=0.003 * MU * N * A)
    assert state.slipped == 1.0 and state.use == pytest.approx(1.0, abs=1e-6)


@pytest.mark.parametrize("centre", [0.1, 0.4, 0.8, 1.5, 4.0])
def test_the_limit_that_it_traces_is_the_exact_one(centre: float) -> None:
    """Slid about a centre, force and torsion are those of the quadrature of the pressure, whose curve they are on.

    The ellipse of the same ends is beyond it.
    """
    f_t, tau = limit_curve(power(2.0), [centre])[0]
    spin = 30.0
    state = pressed(rings=16).move(centre * A * spin, 0.0, -spin)
    F, T = state.force[0] / (MU * N), -state.force[2] / (MU * N * A)
    assert pytest.approx((f_t, tau / SPIN), abs=0.012) == (F, T / SPIN)
    contact = np.zeros(1, CONTACT)[0]
    pad = np.zeros(1, PAD)[0]
    pad["radius"], pad["torsion_share"], pad["limit"], pad["kappa"] = 0.01, SPIN, OWN_PRESSURE, SPIN
    contact["distance"] = 0.01 - A * A / 0.01
    set_limit(pad, contact)
    assert limit_use(contact, (F, 0.0, T * A / contact["lever"]), 1.0) == pytest.approx(1.0, abs=0.004)
    assert abs(state.force[1]) < 1e-6 * MU * N
    assert 0.94 < math.hypot(f_t, tau / SPIN) < 1.0


def test_use_of_a_load_is_that_of_the_exact_limit() -> None:
    """One over how far it can grow; the load of a slide about a centre is on the limit."""
    patch = pressed(rings=16)
    for centre in (0.0, 0.3, 1.0, 3.0):
        f_t, tau = MU * N * limit_curve(power(2.0), [centre])[0] * (1.0, A)
        for share in (0.2, 1.0, 1.7):
            load = share * np.array([-0.6 * f_t, 0.8 * f_t, tau])
            assert use_of(patch.points, patch.limits, load) == pytest.approx(share, rel=0.005)
    assert use_of(patch.points, patch.limits, np.zeros(3)) == 0.0
    assert use_of(patch.points, 0.0 * patch.limits, np.ones(3)) == math.inf


def test_a_load_beyond_the_limit_is_cut() -> None:
    """To 99.5 % of it, in proportion; the use tells how much was asked for."""
    state = pressed().load(2.0 * MU * N, 0.0, 0.0)
    assert state.force[:2] / (MU * N) == pytest.approx([0.995, 0.0], abs=1e-5)
    assert state.use == pytest.approx(2.0, rel=1e-6) and state.slipped == 1.0


# ------------------------------------------------------------------------------------------ energy and symmetry

WAYS = np.array([[3e-4, 1e-4, 0.05], [5e-4, -2e-4, 0.1], [2e-4, -4e-4, 0.02], [-3e-4, -1e-4, -0.1], [1e-4, 3e-4, 0.0]])
"""Displacements [m, m, rad], far enough that most of the patch slips."""


def run(patch: Patch, ways: np.ndarray = WAYS) -> list[PatchState]:
    return [patch.move(*way) for way in ways]


def test_the_ledger_closes() -> None:
    """Work is what is stored and what is lost, contacts may grow and shrink; at one pressure a loss is a loss."""
    patch, force, place = pressed(), np.zeros(3), np.zeros(3)
    work = lost = 0.0
    for k, way in enumerate(np.repeat(WAYS, 3, axis=0)):
        patch.press(N * (1.0 + 0.3 * math.sin(k)), A * (0.9 + 0.1 * math.sin(k)))
        state = patch.move(*way)
        work += float(0.5 * (force + state.force) @ (state.displacement - place))
        force, place = state.force, state.displacement
        assert work == pytest.approx(state.stored + state.lost, abs=2e-6 * MU * N * A)
    patch = pressed()
    for state in run(patch):
        assert state.lost > lost
        lost = state.lost


def test_it_has_no_direction() -> None:
    """Turned by a sector to the last digits, by any angle within 1 %; in a mirror."""
    plain = run(pressed())
    for angle, close in ((math.pi / 6.0, 1e-5), (0.6, 0.01)):
        c, s = math.cos(angle), math.sin(angle)
        turn = np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])
        for one, other in zip(plain, run(pressed(), WAYS @ turn.T), strict=True):
            scale = np.array([1.0, 1.0, A]) * MU * N
            assert turn @ one.force / scale == pytest.approx(other.force / scale, abs=close)
    mirror = np.array([1.0, -1.0, -1.0])
    for one, other in zip(plain, run(pressed(), WAYS * mirror), strict=True):
        assert mirror * one.force == pytest.approx(other.force, abs=1e-6 * MU * N)
        assert one.slipped == other.slipped and one.lost == pytest.approx(other.lost, rel=1e-5)


def test_spin_and_shear_take_from_each_other() -> None:
    """A patch that spins holds less shear, by the columns that slip already."""
    alone, spun = pressed(), pressed()
    spun.load(0.0, 0.0, 0.8 * SPIN * MU * N * A)
    assert spun.load(0.3 * MU * N, 0.0, 0.8 * SPIN * MU * N * A).displacement[0] > (
        1.3 * alone.load(0.3 * MU * N, 0.0, 0.0).displacement[0]
    )


def test_a_load_and_the_displacement_that_it_finds_are_one() -> None:
    """`move` to where `load` went needs the same force."""
    load, patch, other = (0.4 * MU * N, -0.3 * MU * N, 0.2 * MU * N * A), pressed(), pressed()
    state = patch.load(*load)
    assert state.force == pytest.approx(np.array(load), abs=1e-6 * MU * N)
    again = other.move(*state.displacement)
    assert again.force / (MU * N) == pytest.approx(state.force / (MU * N), abs=1e-5)
    assert again.lost == pytest.approx(state.lost, rel=1e-3)


# ------------------------------------------------------------------------------------------ history


def test_pressed_harder_it_sticks_anew() -> None:
    """Mindlin and Deresiewicz: under a steady shear more normal force lets nothing slip; as much again, less of it."""
    patch = pressed(radius=0.8 * A)
    slipped = patch.load(0.7 * MU * N, 0.0, 0.0).slipped
    patch.press(1.1 * N, 0.83 * A)
    harder = patch.load(0.7 * MU * N, 0.0, 0.0)
    assert slipped > 0.4 and harder.slipped == 0.0 and harder.use == pytest.approx(0.7 / 1.1, rel=1e-6)


def test_shaken_below_the_limit_it_comes_to_rest() -> None:
    """What each shake moves it on dies out, where it also turns; what each loses stays. LuGre would creep for ever."""
    patch, ends = pressed(), []
    there, back = np.array([0.8, 0.0, 0.05 * A]) * MU * N, np.array([0.2, 0.1, 0.0]) * MU * N
    for _ in range(6):
        for k in range(12):
            share = abs(k - 5) / 6
            state = patch.load(*(share * back + (1.0 - share) * there))
        ends.append(state)
    places = np.array([end.displacement for end in ends])
    moved = np.linalg.norm(np.diff(places, axis=0) / (1.0, 1.0, 1.0 / A), axis=1)
    assert np.all(moved[1:] < 0.75 * moved[:-1]) and moved[-1] < 2e-4 * np.linalg.norm(places[-1, :2])
    losses = np.diff([end.lost for end in ends])
    assert losses[2:] == pytest.approx(losses[-1], rel=0.02) and losses[-1] > 1e-3 * state.stored


def test_let_go_and_touched_again_it_remembers_nothing() -> None:
    patch, fresh = pressed(), pressed()
    patch.load(0.7 * MU * N, 0.0, 0.0)
    patch.press(0.0, 0.0)
    let_go = patch.load(0.0, 0.0, 0.0)
    assert np.all(let_go.force == 0.0) and let_go.stored == 0.0
    start = let_go.displacement
    patch.press(N, A)
    one, other = patch.move(*(start + np.array([2e-4, 0.0, 0.0]))), fresh.move(2e-4, 0.0, 0.0)
    assert one.force == pytest.approx(other.force, abs=1e-6 * MU * N)


def test_saved_and_restored_it_goes_on_to_the_bit() -> None:
    patch, other = pressed(), pressed()
    run(patch, WAYS[:2])
    other.restore(patch.save())
    for one, another in zip(run(patch, WAYS[2:]), run(other, WAYS[2:]), strict=True):
        assert np.array_equal(one.force, another.force) and one.lost == another.lost and one.stored == another.stored


# ------------------------------------------------------------------------------------------ pressure, material


def test_shares_of_rings_are_those_of_the_pressure() -> None:
    """Their sum is the whole; each is the integral of the pressure; the mean lever is that of the limit surface."""
    edges, depth, r = np.linspace(0.0, 1.2, 25), 0.0023, 0.010
    for shares, pressure in (
        (power_shares(edges, 2.0), power(2.0)),
        (power_shares(edges, 1.4), power(1.4)),
        (column_shares(edges, depth, r), columns(depth, r)),
    ):
        assert np.sum(shares) == pytest.approx(1.0) and np.all(shares[edges[:-1] >= 1.0] == 0.0)
        x = np.linspace(0.0, 1.0, 200_001)
        inside = np.cumsum(pressure(x) * x)
        expected = np.interp(np.minimum(edges, 1.0), x, inside / inside[-1])
        assert shares == pytest.approx(np.diff(expected), abs=1e-4)
    fine = np.linspace(0.0, 1.0, 2001)
    pad = np.zeros(1, PAD)
    pad["radius"] = r
    a = math.sqrt(r * r - (r - depth) ** 2)
    lever = a * np.sum(column_shares(fine, depth, r) * 0.5 * (fine[1:] + fine[:-1]))
    assert lever == pytest.approx(spin_length(pad[0], r - depth), rel=1e-4)


@pytest.mark.parametrize("law", LAWS, ids=lambda law: type(law).__name__)
def test_every_law_has_the_pressure_of_its_limit_surface(law: Law) -> None:
    """The mean lever of the ring shares is the lever in the contact; and there is a material."""
    depth = 0.15 * law.radius
    edges = np.linspace(0.0, contact_radius(law, depth), 2001)
    pad = np.zeros(1, PAD)
    pad["radius"], pad["torsion_share"] = law.radius, law.torsion_share or 0.0
    lever = np.sum(ring_shares(law, depth, edges) * 0.5 * (edges[1:] + edges[:-1]))
    assert lever == pytest.approx(spin_length(pad[0], law.radius - depth), rel=1e-6)
    G, nu = material_of_law(law)
    assert 0.0 < G < math.inf and 0.0 <= nu <= 0.5


def test_the_exponent_of_a_torsion_share() -> None:
    """Hertz's is 2, and the mean lever of the pressure is the share."""
    assert exponent_of(Hertz.torsion_share or 0.0) == pytest.approx(2.0, rel=1e-9)
    fine = np.linspace(0.0, 1.0, 4001)
    assert np.sum(power_shares(fine, exponent_of(0.55)) * 0.5 * (fine[1:] + fine[:-1])) == pytest.approx(0.55, rel=1e-4)


def test_the_material_of_a_law() -> None:
    """Its own, or that of the `hemisphere` that presses as hard."""
    assert material_of_law(Hemisphere(radius=0.01, G=5e4, nu=0.3)) == (5e4, 0.3)
    assert material_of_law(Hertz(radius=0.01, E=3e5, nu=0.5)) == (pytest.approx(1e5), 0.5)
    from softhand.laws.conservative import Conservative

    G, nu = material_of_law(Conservative(radius=0.01))
    force, up = Conservative(radius=0.01)((0.002, 0.0, 0.0, 0.0), 1.5)[0], 0.5 * math.pi
    assert Hemisphere(radius=0.01, G=G, nu=nu)((0.002, 0.0, 0.0, 0.0), up)[0] == pytest.approx(force)
    assert contact_radius(Conservative(radius=0.01), 0.002) == pytest.approx(0.006)
    assert contact_radius(Hertz(radius=0.01), 0.002) == pytest.approx(math.sqrt(2e-5))
    assert contact_radius(Hertz(radius=0.01), -0.001) == 0.0


@pytest.mark.parametrize(
    ("what", "message"),
    [
        ({"reach": 0.0, "G": G}, "reach is 0"),
        ({"reach": A, "G": -1.0}, "G is -1"),
        ({"reach": A, "G": G, "nu": 0.6}, "nu is 0.6"),
        ({"reach": A, "G": G, "friction": math.nan}, "friction is nan"),
        ({"reach": A, "G": G, "rings": 2}, "2 rings of 12"),
    ],
)
def test_wrong_numbers_are_told(what: dict[str, float], message: str) -> None:
    with pytest.raises(SofthandError, match=message):
        Patch(**what)  # type: ignore[arg-type]


def test_wrong_steps_are_told() -> None:
    patch = Patch(A, G)
    with pytest.raises(SofthandError, match="radius is from 0 to the reach"):
        patch.press(N, 2.0 * A)
    with pytest.raises(SofthandError, match="shares of shape"):
        patch.press(N, A, np.ones(3))
    with pytest.raises(SofthandError, match="exponent of the pressure is 0"):
        patch.press(N, A, 0.0)
    with pytest.raises(SofthandError, match="as many rings and sectors"):
        patch.restore(np.zeros(3))
    with pytest.raises(SofthandError, match="must be numbers"):
        patch.load(math.nan, 0.0, 0.0)
    with pytest.raises(SofthandError, match="must be numbers"):
        patch.move(math.inf, 0.0, 0.0)
