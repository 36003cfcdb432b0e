"""Modes of closed loops: their names, shares and pictures, and the loop in the hands of others."""

from __future__ import annotations

import json
from dataclasses import replace
from functools import lru_cache

import numpy as np
import pytest
from commands import run_command
from numpy.testing import assert_allclose
from test_attitude import turned

import softhand
from softhand.errors import SofthandError
from softhand.margins.groups import Groups
from softhand.margins.loop import close_loop
from softhand.margins.mode_recording import beside
from softhand.margins.modes import find_modes
from softhand.margins.place import Place, find_place
from softhand.margins.stability import Stability
from softhand.numerics.spatial import rotation_of
from softhand.scenario.scenario import load_scenario


@lru_cache(1)
def of_hold() -> Stability:
    return softhand.stability("hold")


@lru_cache(1)
def holding() -> Place:
    return find_place(load_scenario("hold"))


def test_the_share_of_the_object_is_its_energy() -> None:
    """m |v|^2 of the centre of mass and w^T I w about it; a finger has what is left; they add up to 1."""
    place = holding()
    plant, q = place.plant, place.state.q
    groups, n = Groups(plant, q), plant.world.n_joints
    inertia = plant.world.model.inertias[plant.world.object_joint]
    motion = np.random.default_rng(0).normal(size=(n + 6, 2)) @ [1.0, 1j]
    shares = groups.shares(motion)
    M = plant.rigid.mass_matrix(q)
    whole = (motion.conj() @ (np.tril(M) + np.tril(M, -1).T) @ motion).real
    v, w = motion[n : n + 3], motion[n + 3 :]
    centre = v + np.cross(w, inertia.lever)
    for axis, one in zip("xyz", inertia.mass * np.abs(centre) ** 2 / whole, strict=True):
        assert shares[f"object shifts along {axis}"] == pytest.approx(one, rel=1e-9)
    turns = sum(shares[f"object turns about {axis}"] for axis in "xyz")
    assert turns == pytest.approx((w.conj() @ inertia.inertia @ w).real / whole, rel=1e-9)
    assert sum(shares.values()) == pytest.approx(1.0, abs=1e-12)
    only = np.zeros(n + 6)
    only[n + 5] = 0.1
    assert groups.name(only, groups.shares(only)) == "object turns about its z axis 100 %"


@pytest.mark.parametrize("name", ["hold", "pinch-two-phase", "allegro-box", "grasp-and-lift", "can"])
def test_shares_add_up_to_one(name: str) -> None:
    """Of all modes, those of memories among them; multiplier, growth, frequency and damping are of one another."""
    place = find_place(load_scenario(name))
    loop = close_loop(place)
    modes = find_modes(loop, Groups(place.plant, place.state.q))
    assert_allclose([sum(mode.shares.values()) for mode in modes], 1.0, atol=1e-9)
    assert len(loop.step) == sum(1 + (mode.multiplier[1] > 1e-12) for mode in modes)
    for mode in modes[:8]:
        rate = complex(mode.growth, 2.0 * np.pi * mode.frequency)
        assert np.exp(rate * loop.period) == pytest.approx(complex(*mode.multiplier), rel=1e-9)
        if abs(rate) > 1e-3:
            assert mode.damping == pytest.approx(-mode.growth / abs(rate), rel=1e-9)
    assert modes[0].growth == pytest.approx(loop.growth)


@pytest.mark.slow
def test_names_do_not_depend_on_the_order_of_the_fingers() -> None:
    """Tips, contact points and internal forces in another order: the same modes under the same names."""
    here = load_scenario("hold")
    order = [2, 0, 1]
    points, force = here.grasp.contact_points, here.grasp.internal_force
    assert points is not None and force is not None
    there = here.with_values({
        "hand.tips": [here.hand.tips[k] for k in order],
        "grasp.contact_points": [points[k] for k in order],
        "grasp.internal_force": [force[k] for k in order],
    })  # fmt: skip
    one, other = (softhand.stability(scenario) for scenario in (here, there))
    for mine, yours in zip(one.modes[:8], other.modes[:8], strict=True):
        assert yours.growth == pytest.approx(mine.growth, rel=1e-5)
        assert yours.shares.keys() == mine.shares.keys()
        assert_allclose([yours.shares[key] for key in mine.shares], list(mine.shares.values()), atol=1e-5)
    assert one.modes[0].name.split(" %")[0] == other.modes[0].name.split(" %")[0]


def test_names_do_not_depend_on_how_the_scene_is_turned() -> None:
    """Hand, object and gravity turned: names and shares are in the axes of the object."""
    here = load_scenario("target-a", {"controller.orientation_error": "rotation-vector"})
    one, other = (softhand.stability(scenario) for scenario in (here, turned(here, rotation_of((2.0, -1.1, 0.7)))))
    for mine, yours in zip(one.modes[:8], other.modes[:8], strict=True):
        assert yours.growth == pytest.approx(mine.growth, rel=1e-3, abs=1e-3)
        assert_allclose(list(yours.shares.values()), list(mine.shares.values()), atol=1e-4)
        assert yours.name == mine.name


def test_the_loop_goes_to_python_control() -> None:
    """Poles, names and sampling; a step response is the powers of the loop."""
    control = pytest.importorskip("control")
    found = of_hold()
    system = found.to_control()
    assert isinstance(system, control.StateSpace) and system.dt == found.period
    expected = np.sort_complex(np.linalg.eigvals(found.loop.step))
    assert_allclose(np.sort_complex(system.poles()), expected, atol=1e-9)
    assert system.input_labels[0] == "torque of finger_1_abduction" and "object turn z" in system.output_labels
    response = control.forced_response(system, inputs=np.eye(9)[:, :1] @ np.ones((1, 4)))
    x = np.zeros(len(found.loop.step))
    for _ in range(3):
        x = found.loop.step @ x + found.loop.B[:, 0]
    assert_allclose(response.outputs[:, 3], found.loop.C @ x, atol=1e-15)


def test_outputs_are_in_the_axes_of_the_world() -> None:
    """A run beside the start: object and internal forces move as C says, to first order."""
    found, size = of_hold(), 1e-7
    moved = found.place.situation()
    x = size * np.random.default_rng(3).normal(size=found.loop.moving)
    probe, plant = moved.probe, found.place.plant
    here, there = (probe.at(state, 0.0).copy() for state in (found.place.state, beside(found.place, x)))
    told = found.loop.C[:, : found.loop.moving] @ x
    n = plant.world.n_joints
    assert_allclose(there.object_position - here.object_position, told[n : n + 3], rtol=1e-4, atol=1e-12)
    assert_allclose(
        there.internal_force - here.internal_force, told[n + 6 :], atol=2e-3 * np.max(np.abs(told[n + 6 :]))
    )


@pytest.mark.parametrize("number", [1, 2])
def test_a_mode_to_look_at_moves_along_its_shape(number: int) -> None:
    """Joints move in the proportions of the mode, within bounds, about the state; no tip lets go."""
    found = of_hold()
    run, mode = found.mode_recording(number), found.modes[number - 1]
    moved = run.joint_position - found.place.state.q[:9]
    assert np.max(np.abs(moved)) <= 0.15 + 1e-9 and np.all(run.deformation[:, :, 0] > 0.0)
    span = np.linalg.matrix_rank(moved, tol=1e-9)
    assert span == (2 if mode.frequency else 1)
    along, _, _, _ = np.linalg.lstsq(mode.shape[:9, :span], moved.T, rcond=None)
    assert_allclose(mode.shape[:9, :span] @ along, moved.T, atol=1e-9)
    assert run.complete and str(mode) in run.attributes["mode"]
    size = np.linalg.norm(moved, axis=1)
    assert size[:25].max() > 1.5 * size[-25:].max() or number == 2  # a motion that dies out


def test_the_command_writes_figure_mode_and_json(tmp_path) -> None:
    """As its call in Python has them; along a run with its phases; a film or a page plays the mode."""
    result = run_command("stability", "hold", "--json", "--out", "m.svg", "--mode-out", "m.nc", folder=tmp_path)
    assert result.returncode == 0, result.stderr
    told = json.loads(result.stdout)
    assert told["margins"] is None and told["modes"][0]["name"] == of_hold().modes[0].name
    assert "<svg" in (tmp_path / "m.svg").read_text() and softhand.load_recording(tmp_path / "m.nc").complete
    result = run_command("export", "m.nc", "--csv", folder=tmp_path)
    assert result.returncode == 0, result.stderr
    softhand.simulate("target-a", duration=0.02).save(tmp_path / "run.nc")
    result = run_command("stability", "run.nc", "--along", folder=tmp_path)
    assert result.returncode == 0 and "largest growth" in result.stdout and (tmp_path / "stability.png").is_file()


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["--at", "99"], ["at: got 99", "0 to 10 s", "nearest is 10"]),
        (["--at", "soon"], ["at: got 'soon'", "start"]),
        (["--mode", "77", "--mode-out", "k.nc"], ["mode: got 77", "modes 1"]),
        (["--mode-out", "k.gif"], ["--mode-out", "k.gif", ".nc"]),
        (["--along", "--margins"], ["--along", "leave out --margins"]),
        (["--scan", "--controller", "object-impedance"], ["with_scan", "regulation"]),
    ],
)
def test_a_mistake_gives_one_message(tmp_path, arguments: list[str], words: list[str]) -> None:
    """The thing, its value, the remedy; nothing is written."""
    result = run_command("stability", "hold", *arguments, folder=tmp_path)
    assert result.returncode == 1 and result.errors.startswith("error:") and "Traceback" not in result.stderr
    assert all(word in result.stderr for word in words) and not list(tmp_path.rglob("*.n?"))


def test_without_python_control_the_extra_is_named(monkeypatch) -> None:
    """As an import that fails."""
    import sys

    monkeypatch.setitem(sys.modules, "control", None)
    with pytest.raises(SofthandError, match=r"softhand\[control\]"):
        of_hold().to_control()
    assert replace(of_hold(), scan=None).loop is of_hold().loop
