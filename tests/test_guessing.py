"""Python as one guesses it: names that work, wrong ones that tell the right one, what notebooks and editors show."""

from __future__ import annotations

import ast
import copy
import pickle
import subprocess
import sys
from collections.abc import Callable
from itertools import pairwise
from pathlib import Path
from typing import get_type_hints

import numpy as np
import pytest
from matplotlib.figure import Figure

import softhand
from softhand.errors import MissingArrayError, ScenarioError, SofthandError
from softhand.numerics.table import html_table
from softhand.plugins import SHIPPED, classes
from softhand.sensing.fields import ALIASES, FIELDS, SPANS
from softhand.sensing.observation import Observation
from softhand.settings.guesses import meant

ROOT = Path(__file__).parent.parent
KINDS = sorted(SHIPPED)


@pytest.fixture(scope="module")
def run() -> softhand.Recording:
    """Twenty samples of target A."""
    return softhand.simulate("target-a", duration=0.02)


@pytest.fixture(scope="module")
def scenario() -> softhand.Scenario:
    """Target A."""
    return softhand.load_scenario("target-a")


# Names that work


@pytest.mark.parametrize("kind", KINDS)
def test_every_class_that_ships_is_an_attribute_of_its_kind(kind: str) -> None:
    """softhand.laws.Nakashima and its like, the base too; completion has them, and editors are told of no others."""
    package = getattr(softhand, kind)
    for name, target in classes(kind).items():
        found = getattr(package, name)
        assert (found.__module__, found.__name__) == tuple(target.split(":"))
    assert dir(package) == sorted(classes(kind)) and kind in dir(softhand)
    told = [
        f"{node.module}:{alias.asname}"
        for node in ast.walk(ast.parse(Path(package.__file__).read_text()))
        if isinstance(node, ast.ImportFrom)
        for alias in node.names
        if alias.asname
    ]
    assert sorted(told) == sorted(classes(kind).values())


def test_editors_are_told_of_every_public_name() -> None:
    """What stands under TYPE_CHECKING is what there is, with the homes that it is imported from."""
    tree = ast.parse(Path(softhand.__file__).read_text())
    block = next(node for node in tree.body if isinstance(node, ast.If) and not node.orelse)
    told = {
        alias.asname: f"{node.module}.{alias.name}"
        for node in block.body
        if isinstance(node, ast.ImportFrom)
        for alias in node.names
    }
    assert sorted(told) == dir(softhand)
    for name, home in told.items():
        module, _, member = home.rpartition(".")
        assert getattr(sys.modules.get(module) or __import__(module, fromlist=[member]), member) is getattr(
            softhand, name
        )


def test_a_law_is_imported_when_it_is_asked_for() -> None:
    """`import softhand` loads no law, and one law not the others."""
    program = (
        "import softhand, sys\n"
        "print([name for name in sys.modules if name.startswith('softhand.')])\n"
        "softhand.laws.Hertz\n"
        "print('softhand.laws.hertz' in sys.modules, 'softhand.laws.nakashima' in sys.modules)"
    )
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=True)
    assert done.stdout.split("\n")[:2] == ["[]", "True False"]


def test_the_scenarios_with_a_line_each() -> None:
    """By name, in the words of their files."""
    assert list(softhand.scenarios()) == softhand.scenario_names()
    assert all(softhand.load_scenario(name).description == line for name, line in softhand.scenarios().items())


def test_a_recording_is_loaded_from_its_file_or_its_folder(run: softhand.Recording, tmp_path: Path) -> None:
    """Both give the same run."""
    run.save(tmp_path / "run.nc")
    for path in (tmp_path, str(tmp_path / "run.nc")):
        assert np.array_equal(softhand.load_recording(path).joint_torque, run.joint_torque)
    with pytest.raises(softhand.RecordingError, match=r"nowhere: .*no such file; give the run\.nc"):
        softhand.load_recording(tmp_path / "nowhere")


def test_a_recording_draws_itself(run: softhand.Recording) -> None:
    """A matplotlib figure, which shows itself in a notebook without pyplot and survives a copy."""
    figure = run.plot()
    assert isinstance(figure, Figure) and len(figure.axes) > 5
    assert figure._repr_png_().startswith(b"\x89PNG")
    pickle.loads(pickle.dumps(figure))


def test_a_recording_sums_itself_up(run: softhand.Recording) -> None:
    """As `summarize` does."""
    assert run.summary() == softhand.summarize(run)


def test_a_recording_is_what_xarray_reads_from_its_file(run: softhand.Recording, tmp_path: Path) -> None:
    """Arrays, labels, units and attributes."""
    xarray = pytest.importorskip("xarray", reason="needs the extra test: xarray")
    run.save(tmp_path / "run.nc")
    with xarray.open_dataset(tmp_path / "run.nc", engine="h5netcdf") as read:
        xarray.testing.assert_identical(run.to_xarray(), read.load())
    assert run.to_xarray().joint_torque.units == "N m"
    assert run.to_xarray().contact_force.sel(contact="finger_2_tip", force_component="f_z").shape == (21,)


def test_without_xarray_the_remedy_is_named(run: softhand.Recording, monkeypatch: pytest.MonkeyPatch) -> None:
    """In one line."""
    monkeypatch.setitem(sys.modules, "xarray", None)
    with pytest.raises(SofthandError, match="'xarray' is not installed; install it with: pip install xarray"):
        run.to_xarray()


def test_a_scenario_with_values_replaced(scenario: softhand.Scenario) -> None:
    """By dotted keys and by keywords; the first stays as it was."""
    other = scenario.replace({"fingertip.friction": 0.3, "controller.K_v": 0.01}, mass=0.25)
    assert (other.fingertip.friction, other.object.mass, other.controller.parameters["K_v"]) == (0.3, 0.25, 0.01)
    assert scenario.fingertip.friction == 0.5 and scenario.replace() == scenario


@pytest.mark.parametrize(
    ("overrides", "values", "message"),
    [
        ({"objct.mass": 0.3}, {}, r"objct: unknown key .* Did you mean object\?"),
        ({"object.maas": 0.3}, {}, r"object\.maas: unknown key \(with value 0\.3\)\. Did you mean object\.mass\?"),
        ({"fingertip.frction": 0.3}, {}, r"fingertip\.frction: unknown key .* Did you mean fingertip\.friction\?"),
        (
            {"controller.K_n": 0.3},
            {},
            r"controller\.K_n: .* Did you mean controller\.K_N\? Valid .* period",
        ),
        ({"stepper.name": "adaptive", "stepper.rtool": 1e-6}, {}, r"Did you mean stepper\.rtol\?"),
        (
            {},
            {"frction": 0.3},
            r"frction: no key .*\. Did you mean friction, for fingertip\.friction\?",
        ),
    ],
)
def test_an_unknown_key_is_refused_with_the_nearest(
    overrides: dict[str, object], values: dict[str, object], message: str, scenario: softhand.Scenario
) -> None:
    """Of sections, of the plugins that are chosen, and of keywords; in `load_scenario` alike."""
    with pytest.raises(ScenarioError, match=message):
        scenario.replace(overrides, **values)
    with pytest.raises(ScenarioError, match=message):
        softhand.load_scenario("target-a", overrides, **values)


def test_a_target_out_of_reach_is_warned_of() -> None:
    """At the line of the user, by a category that can be made an error; a target within reach is not."""
    away = {"reference.object_position": (0.5, 0.0, 0.3), "duration": 0.002}
    with pytest.warns(softhand.ScenarioWarning, match="at the target, finger_1_tip: .* out of reach") as caught:
        softhand.simulate("target-a", overrides=away)
    assert [Path(warning.filename) for warning in caught] == [Path(__file__)]


# Wrong names


@pytest.mark.parametrize(
    ("guess", "message"),
    [
        (lambda: softhand.load, "softhand' has no attribute 'load'; did you mean 'load_scenario' or 'load_recording'"),
        (lambda: softhand.Simulator, "did you mean 'Simulation' or 'simulate'?"),
        (lambda: softhand.Regulation, "did you mean 'controllers.Regulation'?"),
        (lambda: softhand.run, "did you mean 'simulate'?"),
        (lambda: softhand.plot, "did you mean 'draw_run'?"),
        (lambda: softhand.laws.__getattr__("nakashima"), "'softhand.laws' has no attribute 'nakashima'; did you mean "
         "'Nakashima'?"),
        (lambda: softhand.controllers.Regulator, "did you mean 'Regulation'?"),
        (lambda: softhand.steppers.Euler, "did you mean 'SemiImplicitEuler'?"),
        (lambda: softhand.steppers.Qqq, "there are: Stepper, Midpoint, RungeKutta4, SemiImplicitEuler, Adaptive"),
    ],
)  # fmt: skip
def test_a_wrong_name_of_a_module_tells_the_right_one(guess: Callable[[], object], message: str) -> None:
    """AttributeError with what may be meant."""
    with pytest.raises(AttributeError) as caught:
        guess()
    assert message in str(caught.value)


@pytest.mark.parametrize(
    ("guess", "meaning"),
    [
        ("plott", "'plot'"),
        ("torque", "'joint_torque' or 'torque_limited'"),
        ("object_pos", "'object_position'"),
        ("summarize", "'summary'"),
        ("to_dataset", "'to_xarray'"),
    ],
)
def test_a_wrong_name_of_a_recording_tells_the_right_one(guess: str, meaning: str, run: softhand.Recording) -> None:
    """Arrays and methods alike; the right ones are in `dir`, for completion."""
    if guess == "to_dataset":  # alike to nothing: all arrays are listed
        meaning = "there are: time, joint_position"
    with pytest.raises(MissingArrayError, match=f"'{guess}' in this recording; .*{meaning}"):
        getattr(run, guess)
    assert {"plot", "to_xarray", *run.variables} <= set(dir(run))


def test_a_wrong_name_of_a_scenario_tells_the_right_one(scenario: softhand.Scenario) -> None:
    """Its own, and those of its sections and plugins by their last part; what notebooks probe for means nothing."""
    for guess, meaning in (("objct", "'object'"), ("mass", "'object.mass'"), ("K_N", "'controller.K_N'")):
        with pytest.raises(AttributeError, match=f"no attribute '{guess}'; did you mean {meaning}"):
            getattr(scenario, guess)
    with pytest.raises(AttributeError, match="no attribute 'frction'; did you mean 'friction'"):
        _ = scenario.fingertip.frction
    with pytest.raises(AttributeError, match=r"_ipython_display_'$"):
        _ = scenario._ipython_display_


def test_a_value_of_a_scenario_is_not_set_in_place(scenario: softhand.Scenario) -> None:
    """The error says what is done instead."""
    with pytest.raises(AttributeError, match=r"ObjectSection\.mass cannot be set.*scenario\.replace\(mass=\.\.\.\)"):
        scenario.object.mass = 0.3


def test_a_wrong_name_of_an_observation_tells_the_right_one() -> None:
    """Of fields, letters and properties; all can be completed."""
    observation = softhand.build("target-a").observation
    for guess, meaning in (("object_pos", "object_position"), ("grasp_map", "grasp_matrix"), ("time_", "time")):
        with pytest.raises(AttributeError, match=f"an observation has no '{guess}'; did you mean '{meaning}'"):
            getattr(observation, guess)
    assert {*FIELDS, *SPANS, *ALIASES, "grasp_matrix"} <= set(dir(observation))


def test_what_is_meant_by_a_wrong_name() -> None:
    """Names that look alike or contain it, capitals aside, the likeliest first, at most three; else nothing."""
    names = ["load_scenario", "load_recording", "Stability", "stability", "energy_ledger"]
    assert meant("load", names) == ["load_scenario", "load_recording"]
    assert meant("Stabilty", names) == ["Stability", "stability"]
    assert meant("energy", names) == ["energy_ledger"]
    assert meant("qqq", names) == meant("_load", names) == meant("load" * 30, names) == meant("load", []) == []
    assert len(meant("name", [f"name_{k}" for k in range(9)])) == 3


# What a notebook shows


def test_what_is_shown_in_words(run: softhand.Recording, scenario: softhand.Scenario) -> None:
    """One line that says what it is."""
    shown = repr(scenario)
    assert shown == str(scenario) and "\n" not in shown
    assert shown.startswith("<Scenario: Box lowered") and "law nakashima, controller regulation" in shown
    assert repr(run.summary()).startswith("<Summary: final position error ")
    assert "21 samples, 3 contacts, complete" in repr(run)


def test_what_is_shown_as_a_table(run: softhand.Recording, scenario: softhand.Scenario) -> None:
    """Values with their units, no script."""
    tables = [
        (scenario, ["regulation", "<td>object.position</td><td>[0.0, 0.01, 0.142]</td><td>m</td>"]),
        (run, ["finger_2_tip", "<td>joint_torque</td><td>(21, 9)</td><td>N m</td>"]),
        (run.summary(), ["<td>largest friction use</td>"]),
    ]
    for item, words in tables:
        html = item._repr_html_().replace(' style="text-align: left"', "")
        assert all(word in html for word in words) and "<script" not in html
        assert html.count("<table>") == html.count("</table>") > 0


def test_text_in_a_table_is_text(run: softhand.Recording, scenario: softhand.Scenario) -> None:
    """Whoever wrote the scenario or the recording."""
    wicked = "<script>alert('&')</script>"
    ended = copy.copy(run)
    object.__setattr__(ended, "complete", False)
    object.__setattr__(ended, "reason", wicked)
    unknown = scenario.replace({"controller": {"name": wicked}, "description": wicked})
    for html in (ended._repr_html_(), unknown._repr_html_(), html_table(wicked, [wicked], [[wicked]], [wicked])):
        assert "&lt;script&gt;alert(&#x27;&amp;&#x27;)" in html and "<script" not in html


# What an editor infers


def test_what_a_law_of_ones_own_is_handed_has_a_type() -> None:
    """Editors take the types of parameters that have none from the base class."""
    assert get_type_hints(softhand.Controller.torque)["observation"] is Observation
    assert get_type_hints(softhand.Controller.start)["observation"] is Observation
    assert get_type_hints(softhand.Reference.at)["start"] is softhand.Goal
    assert (ROOT / "softhand/py.typed").is_file()


def test_every_field_of_an_observation_has_a_type_and_words() -> None:
    """Each with its shape; the letters of the paper stand for what they stand for at run time."""
    tree = ast.parse((ROOT / "softhand/sensing/observation.py").read_text())
    body = next(node for node in tree.body if isinstance(node, ast.ClassDef) and node.name == "Observation").body
    letters = next(node for node in body if isinstance(node, ast.If)).body
    told, named = _described(body), _described(letters)
    assert {*FIELDS, *SPANS} <= set(told)
    assert [name for name in (*FIELDS, *SPANS) if not told[name].rstrip(".").split("\n")[0].count("(")] == []
    assert named == {name: f"`{meaning}`" for name, meaning in ALIASES.items()}


def _described(body: list[ast.stmt]) -> dict[str, str]:
    return {
        field.target.id: text.value.value
        for field, text in pairwise(body)
        if isinstance(field, ast.AnnAssign) and isinstance(text, ast.Expr)
    }


@pytest.mark.slow
def test_a_type_checker_knows_the_names(tmp_path: Path) -> None:
    """Right names have types, wrong ones are found."""
    api = pytest.importorskip("mypy.api", reason="needs the extra test: mypy")
    program = (
        "import softhand\n"
        "class Mine(softhand.Controller):\n"
        "    def torque(self, observation: softhand.Observation, memory):\n"
        "        reveal_type(observation.q_O)\n"
        "        return observation.gravty_torque, memory\n"
        "reveal_type(softhand.laws.Nakashima(radius=0.01, k_r=1.0, k_phi=1.0, k_theta=1.0, k_psi=1.0))\n"
        "reveal_type(softhand.simulate('target-a').plot())\n"
        "softhand.load_scenario('target-a').objct\n"
        "softhand.Simulator\n"
    )
    (tmp_path / "mine.py").write_text(program)
    shown = api.run([str(tmp_path / "mine.py"), "--config-file=", "--check-untyped-defs", "--ignore-missing-imports"])[
        0
    ]
    lines = {int(line.split(":")[1]): line for line in shown.splitlines() if line.count(":") > 2}
    assert "ndarray" in lines[4] and "Nakashima" in lines[6] and "matplotlib.figure.Figure" in lines[7]
    assert all('no attribute "' in lines[number] for number in (5, 8, 9)), shown


@pytest.mark.parametrize("key", ["controller", "law"])
def test_values_in_the_place_of_a_controller_or_law_are_told(key: str) -> None:
    """A table is taken for overrides elsewhere, and a name is what scenarios have."""
    for given in ({"duration": 0.1}, "regulation"):
        with pytest.raises(softhand.ScenarioError, match=f"{key}: got .*; give a softhand.{key.title()}, and values"):
            softhand.build("hold", **{key: given})
