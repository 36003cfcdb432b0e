"""Tuning: bounds, costs, worlds and the search, and that a judgement in other worlds is what it says."""

from __future__ import annotations

import copy
import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from commands import run_command
from numpy.testing import assert_allclose, assert_array_equal

import softhand
from softhand.analysis.performance import measure
from softhand.errors import SimulationStopped, StudyError
from softhand.tuning.figures import FIGURES
from softhand.tuning.judged import judge
from softhand.tuning.objective import Objective
from softhand.tuning.search import Best, search_cma
from softhand.tuning.settings import Method, Term
from softhand.tuning.slopes import WITH_SLOPES, Slopes, search_gradient
from softhand.tuning.trials import Trials, Tried
from softhand.tuning.tune import read_tuning

SMALL: dict[str, Any] = {
    "scenario": "target-a",
    "set": {"duration": 0.2, "reference": {"duration": 0.1}},
    "tune": {"controller": {"K_O_position": {"range": [50.0, 400.0], "scale": "log"}}, "K_v": {"range": [0.002, 0.02]}},
    "cost": {"tracking": 1.0, "effort": {"at_most": "before"}},
    "worlds": {"count": 2, "held_out": 3, "vary": {"mass": {"factor": [0.8, 1.2]}, "k_r": {"factor": [0.8, 1.2]}}},
    "method": {"name": "cma", "runs": 24, "population": 4},
}


def study(**changes: Any) -> dict[str, Any]:
    """`SMALL` with values of dotted keys put over it; `__` stands for a dot, None removes."""
    table = copy.deepcopy(SMALL)
    for key, value in changes.items():
        *above, last = key.split("__")
        place = table
        for name in above:
            place = place.setdefault(name, {})
        place[last] = value
        if value is None:
            del place[last]
    return table


def bowl(centre: Any) -> Any:
    """The square of the distance from a point."""
    return lambda points: [float(np.sum((point - np.asarray(centre)) ** 2)) for point in points]


# the search


@pytest.mark.parametrize("centre", [[0.3], [0.2, 0.7], [0.9, 0.1, 0.4, 0.6]])
def test_the_search_finds_the_bottom_of_a_bowl(centre: list[float]) -> None:
    start = np.full(len(centre), 0.5)
    best = Best(start, bowl(centre)([start])[0])
    search_cma(bowl(centre), best, Method(seed=3), 500)
    assert_allclose(best.point, centre, atol=2e-3)
    costs = [cost for _, cost in best.history]
    assert costs == sorted(costs, reverse=True) and best.history[-1][0] <= 500


def test_points_stay_within_the_cube() -> None:
    """The bottom lies beyond two faces of it."""
    asked: list[Any] = []

    def cost(points: Any) -> list[float]:
        asked.extend(points)
        return bowl([1.4, -0.3, 0.5])(points)

    best = Best(np.full(3, 0.5), np.inf)
    search_cma(cost, best, Method(), 400)
    assert np.min(asked) >= 0.0 and np.max(asked) <= 1.0
    assert_allclose(best.point, [1.0, 0.0, 0.5], atol=5e-3)


def test_the_search_is_its_seed_alone() -> None:
    """Neither the generator of NumPy nor another search changes it, and it does not change that."""
    found = []
    for seed in (1, 1, 2):
        np.random.seed(len(found))
        before = np.random.get_state()[1].copy()
        best = Best(np.full(2, 0.5), np.inf)
        search_cma(bowl([0.2, 0.7]), best, Method(seed=seed), 60)
        assert_array_equal(np.random.get_state()[1], before)
        found.append(best.point)
    assert_array_equal(found[0], found[1])
    assert np.any(found[0] != found[2])


class Bowls:
    """Two figures with slopes, in place of runs: a bowl, and a plane that limits it."""

    def at(self, point: Any) -> Any:
        from softhand.tuning.slopes import Sloped

        figures = np.array([[np.sum((point - [0.8, 0.6]) ** 2) + 1.0, 1.0 + point[0]]])
        slopes = np.array([[2.0 * (point - [0.8, 0.6]), [1.0, 0.0]]])
        return Sloped(figures, np.zeros(1), slopes)


def test_the_gradient_search_stops_at_the_limit() -> None:
    """The bottom is at 0.8, and the limit lets the first number up to 0.5 alone."""
    terms = {"tracking": Term(weight=1.0), "effort": Term(at_most=1.5)}
    objective = Objective(terms, Method(margin=0.0), Bowls().at(np.array([0.2, 0.2])).figures)
    best = Best(np.array([0.2, 0.2]), np.inf)
    search_gradient(Bowls(), objective, best, 50)  # type: ignore[arg-type]
    assert_allclose(best.point, [0.5, 0.6], atol=1e-4)


# costs


def test_the_cost_is_its_formula() -> None:
    terms = {
        "settling": Term(weight=2.0), "effort": Term(at_most="before"), "overshoot": Term(weight=1.0, over="worst"),
    }  # fmt: skip
    before = np.array([[0.5, 1.0, 4.0], [0.7, 1.2, 2.0], [np.nan] * 3])
    objective = Objective(terms, Method(margin=0.02, lost=5.0), before)
    after = np.array([[0.3, 1.3, 3.0], [0.5, 1.3, 6.0], [0.4, 1.3, 1.0], [np.nan] * 3])
    wanted = 2.0 * 0.4 / 0.6 + 30.0 * (1.3 / (0.98 * 1.1) - 1.0) + 6.0 / 4.0 + 5.0 * 1.5 / 4
    assert objective(after, np.array([0.0, 0.0, 0.0, 1.5])) == pytest.approx(wanted)
    within = after * [1.0, 0.5, 1.0]
    assert objective(within[:3], np.zeros(3)) == pytest.approx(2.0 * 0.4 / 0.6 + 6.0 / 4.0)


def test_a_lost_run_costs_more_than_any_gain() -> None:
    """More the earlier it is lost, most where all are, and always a number."""
    objective = Objective({"settling": Term(weight=1.0)}, Method(), np.array([[1.0], [1.0]]))
    perfect, lost = np.array([[0.0], [np.nan]]), np.array([0.0, 1.0])
    costs = [
        objective(np.ones((2, 1)), np.zeros(2)), objective(perfect, lost), objective(perfect, 2.0 * lost),
        objective(np.full((2, 1), np.nan), np.ones(2)), objective(np.full((2, 1), np.nan), np.full(2, 2.0)),
    ]  # fmt: skip
    assert costs == sorted(costs) and len(set(costs)) == 5 and np.all(np.isfinite(costs))


def test_figures_are_those_of_compare_and_slopes_those_of_differences() -> None:
    """Each in a run that is cut short, through the same loop as in a tuning."""
    asked = read_tuning(study(cost=dict.fromkeys(WITH_SLOPES, 1.0)))
    world = asked.worlds.search[:1]
    table = asked.knobs.values(asked.knobs.numbers(np.array([0.4, 0.6])))
    found = Trials(asked.setup.scenario, tuple(FIGURES)).run([table], world)
    own = dict(zip(FIGURES, found.figures[0, 0], strict=True))
    run = softhand.simulate(asked.setup.scenario.with_values({**world[0], **table}))
    wanted = measure(run)
    for name in ("overshoot", "friction_use", "effort", "position_error", "orientation_error", "force_error"):
        assert own[name] == pytest.approx(getattr(wanted, name), rel=1e-9), name
    assert own["settling"] == pytest.approx(min(wanted.settling_time, 0.2))
    off = np.linalg.norm(run.object_position - run.object_position_desired, axis=1)
    assert own["tracking"] == pytest.approx(1e3 * np.sqrt(np.mean(off**2)))
    place = 1e3 * run.object_position[150:]
    assert own["scatter"] == pytest.approx(np.sqrt(3.0 * np.mean((place - place.mean(axis=0)) ** 2)))


@pytest.mark.slow
def test_slopes_are_those_of_differences() -> None:
    """Of each figure that has one, and the figures beside them are those of runs."""
    asked = read_tuning(study(cost=dict.fromkeys(WITH_SLOPES, 1.0)))
    names, world, point = tuple(asked.terms), asked.worlds.search[:1], np.array([0.4, 0.6])
    trials = Trials(asked.setup.scenario, names)

    def figures(at: Any) -> Any:
        return trials.run([asked.knobs.values(asked.knobs.numbers(at))], world).figures[0, 0]

    sloped = Slopes(asked.setup.scenario, asked.knobs, world, names, lambda runs: None).at(point)
    assert_allclose(sloped.figures[0], figures(point), rtol=1e-9)
    for k, step in enumerate(1e-3 * np.eye(2)):
        wanted = (figures(point + step) - figures(point - step)) / 2e-3
        assert_allclose(sloped.slopes[0, :, k], wanted, rtol=2e-4, atol=1e-6)
        assert np.count_nonzero(np.abs(wanted) > 1e-4) > 2


# what is turned, and the worlds


def test_numbers_go_to_their_places() -> None:
    asked = read_tuning(
        study(
            tune={
                "grasp.contact_points[2][0]": {"range": [-0.01, 0.01]},
                "grasp.contact_points[2][2]": {"range": [-0.015, 0.005]},
                "grasp.internal_force": {"factor": [0.5, 2.0], "scale": "log"},
                "reference": {"internal_force": {"range": [3.0, 8.0]}},
            }
        )
    )
    knobs = asked.knobs
    assert [knob.name for knob in knobs.knobs][2:4] == ["grasp.internal_force (factor)", "reference.internal_force[0]"]
    assert_allclose(knobs.numbers(knobs.start), [0.0, -0.005, 1.0, 6.0, 6.0, 5.0])
    values = knobs.values([0.002, -0.01, 1.5, 4.0, 5.0, 7.0])
    assert_allclose(values["grasp.contact_points"], [[0.028, 0.0, 0.0], [-0.028, 0.0, 0.0], [0.002, -0.018, -0.01]])
    assert_allclose(values["grasp.internal_force"], [6.0, 6.0, 4.5])
    assert_allclose(values["reference.internal_force"], [4.0, 5.0, 7.0])
    for u in (0.0, 0.3, 1.0):
        for knob in knobs.knobs:
            assert knob.place(knob.at(u)) == pytest.approx(u)
            assert knob.slope(u) == pytest.approx((knob.at(u + 1e-6) - knob.at(u)) / 1e-6, rel=1e-3) or u == 1.0
    assert knobs.knobs[2].at(0.5) == pytest.approx(1.0)  # half the way of a ratio of 4


def test_worlds_lie_in_their_ranges_and_the_held_out_ones_are_others() -> None:
    table = study(worlds={"count": 20, "held_out": 50, "seed": 4, "vary": {
        "mass": {"factor": [0.8, 1.2]}, "k_r": {"range": [3e5, 4e5], "scale": "log", "also": ["k_phi"]}}})  # fmt: skip
    worlds = read_tuning(table).worlds
    assert len(worlds.search) == 20 and len(worlds.held_out) == 50
    for some in (worlds.search, worlds.held_out):
        mass = np.array([one["object.mass"] for one in some])
        assert 0.16 <= mass.min() < 0.17 and 0.23 < mass.max() <= 0.24
        assert all(one["fingertip.k_r"] == one["fingertip.k_phi"] for one in some)
    assert not {one["object.mass"] for one in worlds.search} & {one["object.mass"] for one in worlds.held_out}
    assert read_tuning(table).worlds == worlds
    table["worlds"]["seed"] = 5
    assert read_tuning(table).worlds != worlds


def test_noise_differs_from_world_to_world() -> None:
    noisy = study(set__sensing={"object_position": {"noise": 1e-5}}, worlds__vary=None, cost={"scatter": 1.0})
    worlds = read_tuning(noisy).worlds
    assert len({one["sensing.seed"] for one in worlds.search + worlds.held_out}) == 5


# the judgement


def tried(figures: Any, lost: Any = None) -> Tried:
    """One candidate."""
    rows = np.asarray(figures, dtype=float)
    gone = np.zeros(len(rows)) if lost is None else np.asarray(lost, dtype=float)
    rows[gone > 0.0] = np.nan
    return Tried(rows[None], gone[None], {})


TERMS = {"settling": Term(weight=1.0), "effort": Term(at_most="before")}


def verdict(before: Tried, after: Tried, astray: tuple[float, float] = (0.0, 0.0)) -> tuple[str, ...]:
    """The reasons why it is no better."""
    return judge(TERMS, Objective(TERMS, Method(), before.figures[0]).bounds, before, after, astray).reasons


def test_better_is_better_in_other_worlds() -> None:
    rng = np.random.default_rng(0)
    first = np.column_stack([rng.normal(1.0, 0.1, 40), rng.normal(2.0, 0.2, 40)])
    before = tried(first)
    assert verdict(before, tried(first * [0.7, 0.99])) == ()
    assert "did not surely fall" in verdict(before, tried(first))[0]
    noise = rng.normal(0.0, 0.2, 40)
    assert "did not surely fall" in verdict(before, tried(first + np.outer(noise - noise.mean() - 0.03, [1, 0])))[0]
    assert "effort" in verdict(before, tried(first * [0.7, 1.01]))[0]
    assert "not sure" in verdict(before, tried(first * [0.7, 1.0] + np.outer(noise - noise.mean() - 1e-3, [0, 1])))[0]
    assert "go on for longer" in verdict(before, tried(first * [0.7, 0.99]), (0.0, 0.1))[0]
    assert verdict(before, tried(first * [0.7, 0.99]), (0.1, 0.1)) == ()
    one_lost = np.arange(40) == 3
    assert "lost" in verdict(before, tried(first * [0.7, 0.99], one_lost))[0]
    assert verdict(tried(first, one_lost), tried(first * [0.7, 0.99], one_lost)) == ()


def test_the_interval_is_that_of_a_mean_of_differences() -> None:
    rng = np.random.default_rng(1)
    missed = 0
    for _ in range(400):
        first = rng.normal(1.0, 0.3, (12, 2))
        second = first + rng.normal(-0.1, 0.05, (12, 2))
        line = judge(TERMS, Objective(TERMS, Method(), first).bounds, tried(first), tried(second)).figures[0]
        missed += abs(line.change + 0.1) > line.half_width
    assert 8 <= missed <= 34  # of 400, 5 % are 20


# the whole


def test_a_small_tuning_keeps_its_bounds_and_says_what_it_did(tmp_path: Path) -> None:
    """Two threads find what one finds, and the scenario that is written gives the figures that are told."""
    found, again = softhand.tune(SMALL, threads=1), softhand.tune(SMALL, threads=2)
    assert found.to_json() == again.to_json()
    assert found.scenario == again.scenario
    for one in found.turned:
        assert one.low <= one.after <= one.high
    assert found.worlds == (2, 3) and found.runs == (2 + 2 * 8, 6) and found.method == "cma"
    written = softhand.load_scenario(_saved(tmp_path / "tuned.toml", found.to_toml()))
    assert written == found.scenario
    assert written.controller.parameters["K_v"] == {one.name: one.after for one in found.turned}["controller.K_v"]
    world = read_tuning(SMALL).worlds.held_out[1]
    assert_allclose(found.each[1, 1, 1], measure(softhand.simulate(written.with_values(world))).effort, rtol=1e-9)
    assert_allclose(found.each[0, 1, 1], measure(softhand.simulate(found.before.with_values(world))).effort, rtol=1e-9)
    assert found.figures[1].after == pytest.approx(np.mean(found.each[1, :, 1]))


def _saved(path: Path, text: str) -> Path:
    path.write_text(text)
    return path


def test_interrupting_tells_the_best_so_far(monkeypatch: pytest.MonkeyPatch) -> None:
    runs: list[int] = []

    def stop(self: Trials, count: int) -> None:
        runs.append(count)
        self.done += count
        if len(runs) == 4:
            raise KeyboardInterrupt

    monkeypatch.setattr(Trials, "count", stop)
    with pytest.raises(SimulationStopped, match="best so far") as caught:
        softhand.tune(SMALL, threads=1)
    assert caught.value.reason == "interrupted" and set(caught.value.rows) == {
        "controller.K_O_position", "controller.K_v",
    }  # fmt: skip


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"tune": {}}, "nothing to turn"),
        ({"tune": {"K_P": {"range": [1.0, 2.0]}}}, "tune.K_P: K_P: no key"),
        ({"tune": {"K_v": {"range": [0.02, 0.02]}}}, "nothing between these bounds"),
        ({"tune": {"K_v": {}}}, "give its bounds"),
        ({"tune": {"K_v": {"range": [0.0, 0.1], "scale": "log"}}}, "needs bounds above 0"),
        ({"tune": {"K_v": {"range": [-0.1, 0.1]}}}, "does not take controller.K_v = -0.1"),
        ({"tune": {"K_v": {"range": [0.001, 0.1]}, "controller.K_v": {"factor": [0.5, 2.0]}}}, "turned twice"),
        ({"tune": {"torsion_compensation": {"range": [0.0, 1.0]}}}, "no number"),
        ({"tune": {"mass": {"range": [0.1, 0.2]}}}, "differs from world to world too"),
        ({"tune__K_v": 0.1}, "tune.K_v"),
        ({"cost": {}}, "no figure has a weight"),
        ({"cost": {"setling": 1.0}}, "Did you mean \"settling\""),
        ({"cost": {"effort": {"at_most": "before"}}}, "no figure has a weight"),
        ({"cost": {"effort": {"weight": 0.0}}}, "it costs nothing"),
        ({"cost": {"scatter": 1.0}}, "nothing is noisy"),
        ({"method__name": "gradient", "cost__settling": 1.0}, "settling has none"),
        ({"method__name": "gradiant"}, "one of"),
        ({"worlds__vary__mass": {"factor": [1.2, 0.8]}}, "nothing between"),
        ({"worlds__vary__contact_points": {"factor": [0.8, 1.2]}}, "one number"),
        ({"worlds__vary__masss": {"factor": [0.8, 1.2]}}, "no key"),
        ({"worlds__count": 0}, "worlds.count"),
        ({"sweep": {}}, "unknown key"),
        ({"scenario": "target-z"}, "No scenario is called"),
    ],
)  # fmt: skip
def test_a_mistake_is_told_by_its_key(changes: dict[str, Any], words: str) -> None:
    with pytest.raises(StudyError) as caught:
        read_tuning(study(**changes))
        from softhand.tuning.tune import _search_of

        _search_of(read_tuning(study(**changes)))
    assert words in str(caught.value)
    assert "\n" not in str(caught.value)


def test_the_study_of_the_page_can_be_read(tmp_path: Path) -> None:
    """All its tables, with contact points moved on their faces."""
    page = (Path(__file__).parent.parent / "docs/tune.md").read_text()
    asked = read_tuning(_saved(tmp_path / "study.toml", page.partition("```toml\n")[2].partition("```")[0]))
    assert len(asked.knobs) == 12 and len(asked.worlds.keys) == 6 and asked.method.runs == 3000
    assert_allclose(asked.knobs.numbers(asked.knobs.start)[-1], -0.005)


def test_the_command_writes_nothing_that_is_no_better(tmp_path: Path) -> None:
    """Bounds about the scenario itself leave nothing to gain; asked for, it is written."""
    file = _saved(tmp_path / "study.toml", _toml(study(
        tune={"controller.K_v": {"range": [0.00499999, 0.00500001]}}, method__runs=8)))  # fmt: skip
    ended = run_command("tune", str(file), "--quiet", folder=tmp_path)
    assert ended.returncode == 1 and not (tmp_path / "runs").exists()
    ended = run_command("tune", str(file), "--anyway", "--out", "found", folder=tmp_path)
    assert ended.returncode == 0, ended.stderr
    assert "no better than before" in ended.stdout
    assert {one.name for one in (tmp_path / "found").iterdir()} == {"tuned.toml", "tuning.csv", "tuning.png"}


def test_the_command_gives_json_and_one_error(tmp_path: Path) -> None:
    file = _saved(tmp_path / "study.toml", _toml(study(method__runs=8)))
    told = json.loads(run_command("tune", str(file), "--json", "--anyway", folder=tmp_path).stdout)
    assert [one["name"] for one in told["turned"]] == ["controller.K_O_position", "controller.K_v"]
    _saved(file, _toml(study(cost={"setling": 1.0})))
    ended = run_command("tune", str(file), folder=tmp_path)
    assert ended.returncode == 1 and ended.errors.count("\n") == 1
    assert "study.toml, line " in ended.errors


def _toml(table: dict[str, Any]) -> str:
    import tomli_w

    return tomli_w.dumps(table)
