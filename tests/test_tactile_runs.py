"""Taxels in runs: recorded, seen by controllers, equal in both loops, and none of it where there are none."""

from __future__ import annotations

import numpy as np
import pytest

import softhand
from softhand.errors import ScenarioError
from softhand.scenario.tactile import FEWEST, MOST
from softhand.tactile import pattern

FIELDS = ("tactile_normal_force", "tactile_shear_force", "tactile_slip", "penetration_depth")
SLIPPING = {
    "fingertip.contact": "coulomb",
    "fingertip.friction": 0.42,
    "reference.duration": 0.2,
    "duration": 0.12,
    "tactile.count": 60,
}
ERRING = {"tactile.hysteresis": 0.3, "tactile.noise": 0.01, "tactile.shear_noise": 0.004, "tactile.dead": [3, 60],
          "tactile.dead_share": 0.05, "tactile.seed": 4}  # fmt: skip


@pytest.fixture(scope="module")
def run():
    """Of the main job with tips that slip, its taxels ideal."""
    return softhand.simulate("target-a", overrides=SLIPPING)


@pytest.fixture(scope="module")
def erring():
    """The same with taxels that err."""
    return softhand.simulate("target-a", overrides=SLIPPING | ERRING)


def test_a_recording_has_all_taxels_and_their_sums_are_the_contact_force(run):
    """Names, dimensions and units; the sums to 1e-12 at every sample; torsion about the contact point as well."""
    data = run.to_xarray()
    assert data.tactile_normal_force.dims == ("time", "contact", "taxel") and data.sizes["taxel"] == 60
    assert data.tactile_shear_force.dims == ("time", "contact", "taxel", "shear_component")
    assert [data[name].units for name in FIELDS] == ["N", "N", "m/s", "m"]
    np.testing.assert_allclose(run.tactile_normal_force.sum(axis=2), run.contact_force[..., 2], atol=1e-12)
    np.testing.assert_allclose(run.tactile_shear_force.sum(axis=2), run.contact_force[..., :2], atol=1e-12)
    assert run.tactile_normal_force.min() >= 0.0 and run.is_slipping.any()


def test_taxels_slip_where_the_contact_does(run):
    """None moves where the contact sticks; where it slips some do, about as fast as it."""
    fastest, slips = run.tactile_slip.max(axis=2), run.is_slipping.astype(bool)
    assert np.all(fastest[~slips] == 0.0) and np.all(fastest[slips] > 0.0)
    travelled = 1e-3 * fastest.sum(axis=0)  # [m], a sample a control period
    assert np.all(travelled >= 0.9 * run.slip_travel[-1])


def test_without_the_section_nothing_is_there_and_nothing_differs(run):
    """All other variables are the same to the last bit, and a recording has no taxels."""
    plain = softhand.simulate("target-a", overrides={k: v for k, v in SLIPPING.items() if not k.startswith("tactile")})
    assert not set(FIELDS) & set(plain.variables) and "taxel" not in plain.labels
    assert set(run.variables) - set(plain.variables) == set(FIELDS)
    assert all(np.array_equal(plain[name], run[name]) for name in plain.variables)


def test_a_recording_is_kept_with_its_taxels(run, tmp_path):
    """NetCDF and back, to the last bit."""
    run.save(tmp_path / "run.nc")
    again = softhand.load_recording(tmp_path / "run.nc")
    assert all(np.array_equal(again[name], run[name]) for name in FIELDS) and again.labels["taxel"][-1] == "60"


def test_dead_taxels_read_nothing_and_the_others_err_as_they_are_told(run, erring):
    """Dead ones by number and by share; noise of that size; hysteresis between 1 and 1.3 times the truth."""
    dead = np.all(erring.tactile_normal_force == 0.0, axis=0)
    assert dead[:, [2, 59]].all() and dead.sum() in range(6, 6 + round(0.05 * 180) + 1)
    for name in FIELDS:
        assert not np.any(erring[name][:, dead])
    unloaded = (run.tactile_normal_force == 0.0) & ~dead
    assert np.std(erring.tactile_normal_force[unloaded]) == pytest.approx(0.01, rel=0.03)
    assert np.std(erring.tactile_shear_force[unloaded]) == pytest.approx(0.004, rel=0.03)
    assert np.array_equal(erring.contact_force, run.contact_force)  # nobody reads them: the run is the same


def test_a_taxel_that_is_let_go_holds_on():
    """Exact while its load grows, then what it read, until that is more than its share too high."""
    low = softhand.simulate("target-a", overrides=SLIPPING | {"tactile.hysteresis": 0.2})
    high = softhand.simulate("target-a", overrides=SLIPPING)
    x, y = high.tactile_normal_force, low.tactile_normal_force
    assert np.all(y >= x) and np.all(y <= 1.2 * x + 1e-15)
    grows = np.all(np.diff(x, axis=0) >= 0.0, axis=0)
    assert np.array_equal(y[:, grows], x[:, grows]) and (y > 1.05 * x).any()
    held = (y[1:] < 1.2 * x[1:] - 1e-12) & (y[1:] > x[1:])
    np.testing.assert_array_equal(y[1:][held], y[:-1][held])
    loaded = x > 1e-6
    share = (low.tactile_shear_force / high.tactile_shear_force.clip(1e-300))[..., 0]
    assert np.allclose(
        share[loaded & (high.tactile_shear_force[..., 0] > 1e-9)],
        (y / x.clip(1e-300))[loaded & (high.tactile_shear_force[..., 0] > 1e-9)],
    )


@pytest.mark.parametrize(
    "more", [{}, ERRING, {"sensing.joint_position.noise": 1e-5, **ERRING}], ids=["ideal", "erring", "seen"]
)
def test_the_compiled_loop_feels_the_same(more):
    """`rollout` and `simulate`, samples further apart too: within 1e-10."""
    scenario = softhand.load_scenario("target-a", SLIPPING | more)
    recording = softhand.simulate(scenario)
    runs = softhand.rollout(scenario, {"tactile.seed": [scenario.tactile.seed, 9]}, variables=FIELDS, every=0.02)
    assert runs.compiled.all()
    for name in FIELDS:
        np.testing.assert_allclose(runs[name][0], recording[name][::20], atol=1e-10)
    assert bool(more) != np.array_equal(runs.tactile_normal_force[0], runs.tactile_normal_force[1])


def test_a_run_that_is_saved_goes_on_with_what_its_taxels_remember():
    """To the last bit, hysteresis and noise as well; with other taxels it cannot."""
    simulation = softhand.build("target-a", overrides=SLIPPING | ERRING)
    whole = simulation.run()
    simulation.reset()
    for _ in range(70):
        simulation.sample()
        simulation.step()
    state = simulation.save()
    rest = softhand.build("target-a", overrides=SLIPPING | ERRING).run(start=state)
    assert all(np.array_equal(rest[name], whole[name][70:]) for name in FIELDS)
    with pytest.raises(ScenarioError, match=r"\[tactile\]"):
        softhand.build("target-a", overrides=SLIPPING | {"tactile.count": 50}).reset(state)


def test_a_controller_sees_the_taxels(run):
    """As fields of its observation, those that a recording has, through instruments as well."""
    seen = []

    class Feeling(softhand.Controller):
        def torque(self, observation, memory):
            seen.append([getattr(observation, name).copy() for name in FIELDS])
            assert observation.copy().tactile_slip.shape == (3, 60)
            return observation.gravity_torque, memory

    for more in ({}, {"sensing.contact_force.noise": 0.1}):
        seen.clear()
        recording = softhand.simulate("target-a", Feeling(), overrides=SLIPPING | ERRING | {"duration": 0.01} | more)
        for k, name in enumerate(FIELDS):
            assert np.array_equal(np.array([row[k] for row in seen[-11:]]), recording[name])


@pytest.mark.parametrize(("key", "value", "names"), [
    ("count", 11, "must be a whole number >= 12 and <= 2000"), ("count", 2001, "tactile.count: got 2001"),
    ("pattern", "ring", 'must be one of "fibonacci", "rings"'), ("hysteresis", 1.2, "a number >= 0 and <= 1"),
    ("hysteresis", -0.1, "tactile.hysteresis: got -0.1"), ("dead", [101], "got 101, but a tip has 100 taxels"),
    ("dead", [0], "give 1 to 100"), ("dead", {"finger_4_tip": [1]}, "did you mean 'finger_1_tip'"),
    ("dead_share", 2.0, "tactile.dead_share"), ("noise", -1.0, "tactile.noise"),
    ("cuont", 50, "Did you mean tactile.count"),
])  # fmt: skip
def test_wrong_taxels_are_named(key, value, names):
    """The key, the value and what there is."""
    with pytest.raises(ScenarioError, match=names.replace("[", r"\[")) as error:
        softhand.build("target-a", overrides={f"tactile.{key}": value})
    assert "tactile" in str(error.value)


def test_derivatives_know_no_taxels_and_say_so():
    """Of outputs, costs, and a law that reads them."""
    scenario = softhand.load_scenario("target-a", {"tactile.count": 12, "duration": 0.01})
    with pytest.raises(ScenarioError, match="outputs: A derivative does not know taxels, and 'tactile_slip'"):
        softhand.linearize(scenario, outputs=["tactile_slip"])
    with pytest.raises(ScenarioError, match="cost: A gradient does not know taxels"):
        softhand.gradient(scenario, lambda penetration_depth: penetration_depth.sum(), "object.mass")


def test_what_taxels_feel_cannot_be_kept_where_there_are_none():
    """The message says what to give."""
    with pytest.raises(ScenarioError, match=r"'penetration_depth' is there under \[tactile\] alone"):
        softhand.rollout("target-a", {"mass": [0.2]}, variables=["penetration_depth"])


def test_the_scenario_and_the_pattern_have_the_same_bounds():
    """One says what the other refuses."""
    assert (FEWEST, MOST) == (pattern.FEWEST, pattern.MOST)
