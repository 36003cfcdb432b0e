"""Contacts of elements that slip by themselves: Cattaneo and Mindlin on the way, the limit of a whole at its end."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

import softhand
from softhand import Recording, ScenarioError, build, incipient_slip, load_scenario, simulate
from softhand.analysis.energy import tip_energy
from softhand.contact.elements import BEFORE, DISPLACEMENT, ELASTIC, FORCE, SLIP, share_of
from softhand.dampings.fung import Fung
from softhand.dampings.kelvin_voigt import KelvinVoigt
from softhand.laws.hertz import Hertz
from softhand.laws.law import Law
from softhand.laws.radial import Radial
from softhand.patch.mindlin import CattaneoMindlin
from softhand.scenario.scenario import with_law
from softhand.steppers.midpoint import Midpoint
from softhand.validation.every_law import LAWS, name_of
from softhand.validation.flow import drag, leaning, misalignment
from softhand.validation.rigs import MU, RADIUS, Rig, block
from softhand.validation.sliding import STEPPERS

DEPTH, LEAN = 8e-4, math.radians(60.0)
HERTZ = Hertz(radius=RADIUS, nu=0.0)
RADIAL = Radial(radius=RADIUS)
BY_NAME = {name_of(law): law for law in LAWS}
PLAIN = ("Nakashima", "Hertz", "Radial", "Planar", "Power")
"""Laws whose normal force does not depend on the shear."""
COULOMB = {"fingertip.contact": "coulomb", "fingertip.slip_elements": 8}


def leaning_on(law: Law, elements: int, **options: Any) -> Rig:
    """A tip that leans, its face turned about its normal, pressed to a given depth."""
    rig = leaning(law, DEPTH, LEAN, elements=elements, **options)
    rig.update()
    return rig


def ball(rig: Rig) -> CattaneoMindlin:
    """The ball that is as stiff in shear as the tip, under the same normal force: G = k (2 - nu) / (8 a)."""
    rig.plant.touch(rig.state.v, rig.state.z, with_stiffness=True)
    k, a = float(rig.contact["stiffness"][0, 0]), math.sqrt(RADIUS * DEPTH)
    return CattaneoMindlin(MU, float(rig.contact["force"][2]), a, 2.0 * k / (8.0 * a))


def moved(rig: Rig, way: np.ndarray, ends: list[float], steps: int, step: float = 1e-3) -> tuple[np.ndarray, ...]:
    """Drag the face to and fro by midpoint steps: places along the way, forces along it, and what has been lost."""
    place, rows = 0.0, [(0.0, 0.0, 0.0)]
    for end in ends:
        speed = (end - place) / (steps * step)
        drag(rig, abs(speed), math.atan2(way[1], way[0]) + (math.pi if speed < 0.0 else 0.0))

        def note(time: float, begin: float = place, speed: float = speed) -> None:
            force = rig.contact["force"]
            assert abs(force[0] * way[1] - force[1] * way[0]) < 1e-7 * force[2]
            rows.append((begin + speed * time, float(force[:2] @ way), float(rig.contact["slip_loss"])))

        rig.run(Midpoint(step=step), steps * step, note)
        place = end
    return tuple(np.array(rows).T)


def displace(rig: Rig, x: float, y: float, twist: float = 0.0) -> None:
    """All elements by a displacement of the surfaces in the contact frame [m, m, rad]; what slips is final."""
    contact, block = rig.contact, int(rig.plant.pads[0]["block"])
    step = contact["theta_per_x"] * x, contact["phi_per_y"] * y, twist + contact["psi_per_x"] * x
    for element in range(int(rig.plant.pads[0]["elements"])):
        rig.state.z[0, element * block : element * block + 3] += step
    rig.update()
    rig.plant.note_slip(rig.state.z)


# ---------------------------------------------------------------------------------------- Cattaneo and Mindlin


@pytest.mark.parametrize("n", [1, 2, 3, 8, 64])
def test_the_shares_of_the_elements_are_means_of_the_law(n: int) -> None:
    """(3/2) (1 - b^2) over each cell; their mean is 1."""
    b = np.linspace(0.0, 1.0, n + 1)
    exact = 1.5 * n * (np.diff(b) - np.diff(b**3) / 3.0)
    shares = [share_of(element, n) for element in range(n)]
    np.testing.assert_allclose(shares, exact, rtol=1e-12)
    assert np.mean(shares) == pytest.approx(1.0, rel=1e-15)


@pytest.mark.parametrize("direction", [20.0, 135.0, -70.0])
@pytest.mark.parametrize("law", [HERTZ, RADIAL], ids=name_of)
def test_sixteen_elements_load_and_unload_as_cattaneo_and_mindlin(law: Law, direction: float) -> None:
    """Dragged to 0.8 of the limit, to -0.8 and back by a stepper, at an angle: places and loss within 2 %."""
    rig = leaning_on(law, 16)
    exact = ball(rig)
    turn = 0.8 * exact.most
    end = float(exact.loading(turn))
    way = np.array([math.cos(math.radians(direction)), math.sin(math.radians(direction))])
    x, f, lost = moved(rig, way, [end, -end, end], 80)
    top = f[80]
    assert top == pytest.approx(turn, rel=0.01)
    assert x[:81] == pytest.approx(exact.loading(f[:81]), abs=0.02 * end)
    assert x[81:161] == pytest.approx(exact.unloading(f[81:161], top), abs=0.02 * end)
    assert x[161:] == pytest.approx(-exact.unloading(-f[161:], top), abs=0.02 * end)
    assert f[240] == pytest.approx(top, rel=1e-6), "the loop closes"
    assert lost[240] - lost[80] == pytest.approx(exact.loss(turn), rel=0.02)
    assert rig.contact["is_slipping"] == 0 and rig.contact["slip_travel"] == 0.0


def test_the_error_falls_with_the_square_of_the_elements() -> None:
    """Largest gap to Cattaneo and Mindlin on the way to the limit, over the limit: 2 %, 0.5 %, 0.13 % with 4, 8, 16."""
    gaps = []
    for n in (4, 8, 16):
        rig = leaning_on(HERTZ, n)
        exact = ball(rig)
        x, f, _ = moved(rig, np.array([0.6, -0.8]), [0.995 * exact.reach], 200)
        gaps.append(np.max(np.abs(f - exact.most * (1.0 - (1.0 - x / exact.reach) ** 1.5))) / exact.most)
    assert gaps[0] < 0.025 and gaps[0] / gaps[1] > 3.0 and gaps[1] / gaps[2] > 3.0


def test_little_cycles_lose_the_cube_of_their_amplitude() -> None:
    """0.2 and 0.4 of the limit, to and fro: as exact, and not nothing."""
    lost = []
    for q in (0.2, 0.4):
        rig = leaning_on(HERTZ, 64)
        exact = ball(rig)
        end = float(exact.loading(q * exact.most))
        _, _, loss = moved(rig, np.array([0.6, 0.8]), [end, -end, end], 60)
        lost.append(loss[180] - loss[60])
        assert lost[-1] == pytest.approx(exact.loss(q * exact.most), rel=0.02)
    assert 3.0 < math.log2(lost[1] / lost[0]) < 3.3, "3.26; 3 in the limit of no amplitude"


def test_the_share_that_slips_is_the_area_beyond_the_stick_radius() -> None:
    """1 - (c / a)^2 of Cattaneo, within the width of a ring."""
    for use in (0.3, 0.6, 0.9):
        rig = leaning_on(HERTZ, 32)
        exact = ball(rig)
        moved(rig, np.array([1.0, 0.0]), [float(exact.loading(use * exact.most))], 50)
        stuck = math.sqrt(1.0 - rig.contact["slipped_share"])
        assert stuck == pytest.approx(float(exact.stick_radius(use * exact.most)) / exact.radius, abs=1.5 / 32)


def test_spin_is_near_lubkin() -> None:
    """Right at little spin, then stiffer by up to 20 % of the largest torsion: the elements have one curve for both."""
    rig = leaning_on(HERTZ, 32)
    exact, (K, length) = ball(rig), (float(rig.contact["stiffness"][3, 3]), float(rig.contact["lever"]))
    most, twist, gaps = exact.most * length, 0.0, []
    assert pytest.approx(16.0 / 3.0 * exact.G * exact.radius**3, rel=1e-6) == K
    for stick in np.linspace(0.95, 0.15, 17):
        angle = float(exact.spin(stick * exact.radius))
        displace(rig, 0.0, 0.0, angle - twist)
        twist = angle
        gaps.append(float(rig.contact["force"][3]) / most - lubkin(stick))
    assert 0.0 < gaps[0] < 0.01 and min(gaps) > 0.0
    assert max(gaps) == pytest.approx(0.2, abs=0.01)


def lubkin(stick: float) -> float:
    """Torsion over the largest, of a ball that sticks within this share of its radius.

    What slips already has its traction; so dT / dbeta = 16 G c^3 / 3, the stiffness of the disc that still sticks.
    """
    c = np.linspace(1.0, stick, 4001)
    spin = CattaneoMindlin(1.0, 1.0, 1.0, 1.0)
    beta = np.asarray(spin.spin(c))
    torsion = np.sum(16.0 / 3.0 * (0.5 * (c[1:] + c[:-1])) ** 3 * np.diff(beta))
    return float(torsion / (3.0 * math.pi / 16.0))


# ------------------------------------------------------------------------------------------------ as a whole


@pytest.mark.parametrize("name", BY_NAME)
def test_slid_far_it_is_a_contact_that_slips_as_a_whole(name: str) -> None:
    """The whole limit, against the velocity, for every law; all elements slip.

    The same force too, but where the law presses more as it is sheared: the elements are not all sheared alike.
    """
    rigs = [leaning_on(BY_NAME[name], n) for n in (1, 8)]
    for rig in rigs:
        drag(rig, 0.04, math.radians(20.0))
        rig.run(Midpoint(step=1e-3), 0.3)
    whole, parts = (rig.contact for rig in rigs)
    use = parts["force"] / parts["force"][2], whole["force"] / whole["force"][2]
    np.testing.assert_allclose(*use, rtol=1e-5, atol=1e-8)
    assert parts["force"][2] == pytest.approx(whole["force"][2], rel=1e-9 if name in PLAIN else 0.15)
    found, power = misalignment(rigs[1])
    assert abs(found) < 0.5 and power == pytest.approx(1.0, abs=1e-3)
    assert parts["is_slipping"] == 1 and parts["slipped_share"] == 1.0
    assert parts["limit_surface_use"] == pytest.approx(1.0, abs=1e-3)


@pytest.mark.parametrize("ratio", [0.0, 0.5, 2.0])
def test_slid_and_spun_it_shares_as_a_whole_does(ratio: float) -> None:
    """v = ratio l w after 10 mm: force and torsion are those of one element."""
    found = []
    for n in (1, 8):
        rig = leaning_on(RADIAL, n)
        length = float(rig.contact["lever"])
        twist = -2.5e-5 / (length * math.hypot(1.0, ratio))
        for _ in range(400):
            displace(rig, 0.6 * ratio * length * abs(twist), 0.8 * ratio * length * abs(twist), twist)
        found.append(rig.contact["force"].copy())
    np.testing.assert_allclose(found[1], found[0], rtol=1e-6, atol=1e-9)


def test_the_static_coefficient_holds_until_all_slip() -> None:
    """The rim slips at its share of the static limit; once all slip the kinetic one holds."""
    rig = leaning_on(RADIAL, 8, static_friction=0.7)
    exact, forces = ball(rig), []
    for _ in range(100):
        displace(rig, 0.05 * exact.reach, 0.0)
        forces.append(float(rig.contact["force"][0]) / exact.normal)
    assert 0.66 < max(forces) <= 0.7 + 1e-12
    assert forces[-1] == pytest.approx(MU, rel=1e-9)
    assert rig.state.z[0, -1] == 1.0
    displace(rig, 0.0, 0.0)
    assert rig.contact["is_slipping"] == 0 and rig.state.z[0, -1] == 0.0


# ------------------------------------------------------------------------------------------------- energy


@pytest.mark.parametrize("law", [RADIAL, BY_NAME["Conservative"], BY_NAME["Hemisphere"]], ids=name_of)
def test_what_is_done_is_stored_or_lost(law: Law) -> None:
    """A way with turns and spin at a given depth, in small steps: work = U + loss, and no step gives anything back."""
    rig = leaning_on(law, 6)
    rng, work, last, lost = np.random.default_rng(4), 0.0, rig.contact["force"].copy(), 0.0
    turns = rng.normal(size=(6, 3))
    begin = stored(rig)
    for turn in turns:
        for _ in range(300):
            x, y, twist = 4e-6 * turn[0], 4e-6 * turn[1], 2e-3 * turn[2]
            displace(rig, x, y, twist)
            force = rig.contact["force"]
            work += 0.5 * float((force + last)[[0, 1, 3]] @ (x, y, twist))
            last = force.copy()
            assert rig.contact["slip_loss"] >= lost - 1e-15
            lost = float(rig.contact["slip_loss"])
    assert lost > 0.2 * work
    assert work == pytest.approx(stored(rig) - begin + lost, rel=2e-4)


def stored(rig: Rig) -> float:
    """The mean energy of the elements [J]."""
    n, found = int(rig.plant.pads[0]["elements"]), 0.0
    for row in rig.plant.elements[0, :n]:
        one = rig.contact.copy()
        one["deformation"][1:] = row[DISPLACEMENT : DISPLACEMENT + 3]
        found += tip_energy(rig.plant.fingertips[0], one) / n
    return found


@pytest.mark.parametrize("options", [{}, {"damping": KelvinVoigt()}, {"damping": Fung()}], ids=["plain", "kv", "fung"])
def test_each_element_is_within_its_own_limit(options: dict[str, Any]) -> None:
    """Whatever is done to them, damped too; the force of the contact is the mean of theirs."""
    rig = leaning_on(BY_NAME["Nakashima"], 5, **options)
    rng = np.random.default_rng(1)
    for _ in range(12):
        drag(rig, 0.02, float(rng.uniform(0.0, 6.0)))
        rig.run(Midpoint(step=1e-3), 0.01)
        rows, contact = rig.plant.elements[0, :5], rig.contact
        for k, row in enumerate(rows):
            assert math.hypot(row[FORCE], row[FORCE + 1]) <= MU * share_of(k, 5) * contact["pressed"] * (1.0 + 1e-9)
        assert contact["pressed"] == pytest.approx(contact["force"][2], rel=1e-9)
        np.testing.assert_allclose(contact["force"], rows[:, FORCE : FORCE + 4].mean(axis=0), rtol=1e-12)
        np.testing.assert_allclose(contact["elastic"], rows[:, ELASTIC : ELASTIC + 4].mean(axis=0), rtol=1e-12)
    assert contact["slip_loss"] > 0.0


def test_what_sticks_stays_to_the_bit() -> None:
    """A loaded contact, some elements at their limit, that nothing moves: no slip, no loss, the same displacements."""
    rig = leaning_on(HERTZ, 8)
    exact = ball(rig)
    moved(rig, np.array([0.6, 0.8]), [float(exact.loading(0.5 * exact.most))], 40)
    displace(rig, 0.0, 0.0)
    z, lost = rig.state.z.copy(), float(rig.contact["slip_loss"])
    for _ in range(100):
        displace(rig, 0.0, 0.0)
    np.testing.assert_array_equal(rig.state.z, z)
    assert rig.contact["slip_loss"] == lost and np.all(rig.plant.elements[0, :8, SLIP : SLIP + 3] == 0.0)


def test_a_tip_that_lets_go_touches_again_with_nothing_stored() -> None:
    """And what its elements had stored is lost."""
    rig = leaning_on(RADIAL, 4)
    displace(rig, 2e-5, -1e-5, 1e-3)
    kept = stored(rig) - RADIAL.energy(DEPTH, 0.0, 0.0, 0.0, 0.0, 0.0, RADIUS, *list(RADIAL.model_dump().values())[1:])
    before = float(rig.contact["slip_loss"])
    normal = rig.contact["rotation"][:, 2].copy()
    rig.position[:] += 2.0 * DEPTH * normal
    rig.update()
    rig.plant.note_slip(rig.state.z)
    assert np.all(rig.state.z == 0.0) and np.all(rig.contact["force"] == 0.0)
    assert rig.contact["slip_loss"] - before == pytest.approx(kept, rel=1e-9)
    rig.position[:] -= 2.0 * DEPTH * normal
    rig.update()
    assert rig.contact["force"][2] > 0.0 and np.hypot(*rig.contact["force"][:2]) == 0.0
    assert np.all(rig.plant.elements[0, :4, BEFORE : BEFORE + 3] == 0.0)


def test_turned_it_is_the_same() -> None:
    """The tip leans another way in the world and in its face: the forces in the contact frame are alike."""
    found = []
    for bearing in (1.1, -2.3):
        rig = leaning(HERTZ, DEPTH, LEAN, bearing, elements=8)
        rig.update()
        moved(rig, np.array([-0.28, 0.96]), [1.5e-4, 2e-5], 30)
        found.append((rig.contact["force"].copy(), rig.state.z.copy()))
    np.testing.assert_allclose(found[0][0], found[1][0], rtol=1e-9, atol=1e-12)
    np.testing.assert_allclose(found[0][1], found[1][1], rtol=1e-7, atol=1e-13)


@pytest.mark.parametrize("damping", [None, Fung()], ids=["plain", "fung"])
def test_every_stepper_finds_the_same_contact(damping: Any) -> None:
    """To and fro within the limit, in small steps."""
    forces = {}
    for name, stepper in STEPPERS.items():
        rig = leaning_on(HERTZ, 4, **({} if damping is None else {"damping": damping}))
        for speed in (7.5e-3, -1e-2, 5e-3):
            drag(rig, abs(speed), 0.4 + (math.pi if speed < 0.0 else 0.0))
            rig.run(stepper(step=1e-4), 0.02)
        forces[name] = rig.contact["force"].copy(), float(rig.contact["slip_loss"])
    exact, lost = forces["midpoint"]
    for force, loss in forces.values():
        np.testing.assert_allclose(force, exact, atol=4e-3 * exact[2])
        assert loss == pytest.approx(lost, rel=0.03)


def test_smaller_steps_come_nearer() -> None:
    """Round a corner within the limit, where the direction of slip turns: at least of first order in the step."""
    forces = []
    for step in (4e-3, 2e-3, 1e-3, 1.25e-4):
        rig = leaning_on(HERTZ, 8)
        for direction in (0.3, 2.0):
            drag(rig, 3e-3, direction)
            rig.run(Midpoint(step=step), 0.04)
        forces.append(rig.contact["force"][:2].copy())
    errors = np.linalg.norm(np.array(forces[:3]) - forces[3], axis=1)
    assert errors[0] < 0.01 * rig.contact["force"][2]
    assert errors[0] > 1.7 * errors[1] > 1.7**2 * errors[2] > 0.0


# --------------------------------------------------------------------------------------------------- runs


@pytest.mark.parametrize("law", ["nakashima", "conservative", "hemisphere", "hertz"])
@pytest.mark.parametrize("damping", [None, "fung"])
def test_a_run_starts_in_balance(law: str, damping: str | None) -> None:
    """No acceleration with joints held, some elements at their limit; the elements stay where they are."""
    values = {**COULOMB, **({"fingertip.damping": {"name": damping}} if damping else {})}
    scenario = load_scenario("target-a")
    run = build((scenario if law == "nakashima" else with_law(scenario, law)).with_values(values))
    plant, state = run.plant, run.state
    z = state.z.copy()
    plant.update(state.q, state.v, z)
    plant.note_slip(z)
    np.testing.assert_allclose(z, state.z, rtol=1e-6, atol=1e-9)
    assert np.all((plant.contacts["slipped_share"] > 0.0) & (plant.contacts["slipped_share"] < 1.0))
    n, out = plant.world.n_joints, np.zeros(plant.world.nv)
    torque = -(plant.rigid.mass_matrix(state.q) @ plant.acceleration(np.zeros(n), out))[:n]
    acceleration = plant.acceleration(torque, out)
    assert np.max(np.abs(acceleration)) < 1e-6


def test_a_run_says_which_share_slips() -> None:
    """Only where there are elements; the diagnostic of a recording goes on to work, and so does what is on file."""
    plain = simulate("target-a", overrides={"fingertip.contact": "coulomb", "duration": 0.02})
    assert "slipped_share" not in plain.variables and "element_deformation" not in plain.variables
    run = simulate("target-a", overrides={**COULOMB, "duration": 0.02, "fingertip.tips": {
        "finger_2_tip": {"slip_elements": 1}}})  # fmt: skip
    share, mean = run.slipped_share, run.element_deformation.mean(axis=2)
    assert np.all((share >= 0.0) & (share <= 1.0)) and share[0, 0] > 0.0 and np.all(share[:, 1] == 0.0)
    np.testing.assert_allclose(mean[:, [0, 2]], run.deformation[:, [0, 2], 1:], rtol=1e-12, atol=1e-15)
    np.testing.assert_array_equal(run.element_deformation[:, 1, 0], run.deformation[:, 1, 1:])
    found = incipient_slip(run)
    assert found.slipped_share.shape == share.shape and "microslip_loss" in found.variables


def test_a_recording_is_the_same_from_its_file(tmp_path: Any) -> None:
    run = simulate("target-a", overrides={**COULOMB, "duration": 0.01})
    run.save(tmp_path / "run.nc")
    again = Recording.load(tmp_path / "run.nc")
    np.testing.assert_array_equal(again.element_deformation, run.element_deformation)
    assert again.units("element_deformation") == ("rad",) and again.labels["element"] == tuple("12345678")


def test_shaken_it_does_not_creep() -> None:
    """A box on a tip under a side force between -0.1 and 0.7 of the limit: its loop closes, and takes energy."""
    rig = block(DEPTH, HERTZ, elements=16, damping=KelvinVoigt(radial=20.0, tangential=5.0))
    rig.update()
    most, begin, period = MU * float(rig.contact["force"][2]), rig.position.copy(), 0.2
    ends: list[tuple[float, ...]] = []

    def shake(time: float) -> None:
        share = min(1.0, time / period) * (0.3 - 0.4 * math.cos(2.0 * math.pi * time / period))
        rig.plant.external[-6:-4] = 0.6 * share * most, -0.8 * share * most
        if round(time / 1e-3) % 100 == 0:
            ends.append((*(rig.position - begin)[:2], float(rig.contact["slip_loss"])))

    rig.run(Midpoint(step=1e-3), 2.0, shake)
    x, y, lost = np.array(ends).T
    low, high = x[11::2], x[12::2]
    assert np.ptp(low) < 1e-4 * np.ptp(x[10:]) and np.ptp(high) < 1e-4 * np.ptp(x[10:])
    assert np.ptp(x[10:]) > 1e-5 and y[10:] == pytest.approx(-4.0 / 3.0 * x[10:], rel=1e-6)
    assert np.all(np.diff(lost) > 0.0) and rig.contact["is_slipping"] == 0 and rig.contact["slip_travel"] == 0.0


@pytest.mark.parametrize(
    ("values", "told"),
    [
        ({"fingertip.slip_elements": 4}, r'slip_elements 4 needs contact = "coulomb"'),
        ({**COULOMB, "fingertip.slip_elements": 65}, r"fingertip\.slip_elements"),
        ({**COULOMB, "fingertip.slip_elements": 0}, r"fingertip\.slip_elements"),
        ({"fingertip.tips": {"finger_1_tip": {"slip_elements": 4}}}, r'needs contact = "coulomb"'),
        ({"record.variables": ["element_deformation"]}, r"under slip elements alone"),
    ],
)
def test_what_cannot_be_is_told(values: dict[str, Any], told: str) -> None:
    with pytest.raises(ScenarioError, match=told):
        load_scenario("target-a", values)


@pytest.mark.parametrize(
    "tool",
    [
        lambda scenario, run: softhand.gradient(scenario, softhand.QuadraticCost("object_position"), ["mass"]),
        lambda scenario, run: softhand.linearize(scenario),
        lambda scenario, run: softhand.linearize_plant(build(scenario).plant, build(scenario).state, np.zeros(9)),
        lambda scenario, run: softhand.stability(scenario),
        lambda scenario, run: softhand.equilibrium(scenario),
        lambda scenario, run: softhand.grasp_stiffness(run),
        lambda scenario, run: softhand.lyapunov(run),
        lambda scenario, run: softhand.worst_push(scenario),
        lambda scenario, run: softhand.calibrate(run, ["mass"], scenario, threads=1),
    ],
    ids=["gradient", "linearize", "linearize_plant", "stability", "equilibrium", "stiffness", "lyapunov", "worst_push",
         "calibrate"],
)  # fmt: skip
def test_tools_that_know_whole_contacts_alone_say_so(tool: Any) -> None:
    scenario = load_scenario("target-a", {**COULOMB, "duration": 0.06})
    with pytest.raises(ScenarioError, match=r"contacts that slip as a whole, not by 8 elements; look at a run"):
        tool(scenario, simulate(scenario))
