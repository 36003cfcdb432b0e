"""Each of examples/threads runs, is short, prints both sides, and its claims hold, MuJoCo's where it is installed."""

from __future__ import annotations

import ast
import importlib
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np
import pytest

import softhand

FOLDER = Path(__file__).parent.parent / "examples" / "threads"
NAMES = sorted(file.stem for file in FOLDER.glob("*.py") if file.stem != "peer")
G = 9.81  # [m/s^2]


@pytest.fixture
def ask(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> Any:
    """What `main` of a thread returns; what it prints has a column of each side."""
    monkeypatch.syspath_prepend(str(FOLDER))

    def run(name: str, **arguments: Any) -> Any:
        found = thread(name).main(**arguments)
        told = capsys.readouterr().out
        assert "softhand" in told and "MuJoCo" in told and len(told.splitlines()) > 3
        return found

    return run


def thread(name: str) -> ModuleType:
    return importlib.import_module(name)


def test_there_are_twelve() -> None:
    """Each is in the table of its page, and each is tested below."""
    page = (FOLDER.parent.parent / "docs" / "threads.md").read_text()
    assert len(NAMES) == 12
    assert all(f"`{name}.py`" in page and f'ask("{name}"' in Path(__file__).read_text() for name in NAMES)


@pytest.mark.parametrize("name", [*NAMES, "peer"])
def test_a_thread_is_short_and_keeps_to_public_names(name: str) -> None:
    """40 to 95 lines; of softhand only its names; its docstring asks a question and says how it is run."""
    text = (FOLDER / f"{name}.py").read_text()
    assert 40 <= len(text.splitlines()) <= 95
    if name != "peer":
        docstring = ast.get_docstring(ast.parse(text)) or ""
        assert "?" in docstring.splitlines()[0] and docstring.endswith(f"Example: python examples/threads/{name}.py")
        assert text.endswith('\n\nif __name__ == "__main__":\n    main()\n')
    for node in ast.walk(ast.parse(text)):
        assert not (isinstance(node, ast.ImportFrom) and (node.module or "").startswith("softhand"))
        if isinstance(node, ast.Attribute) and isinstance(node.value, ast.Name) and node.value.id == "softhand":
            assert node.attr in {*softhand.__all__, "laws"}


def test_what_is_held_does_not_creep(ask: Any) -> None:
    """Not by a bit; MuJoCo's speed of creep is as its impratio says, and noslip stops nearly all of it."""
    speed, slipped, peer = ask("creep")
    assert slipped == 0.0 and abs(speed) < 1e-12
    if peer:
        default, ten, hundred, noslip = peer.values()
        assert 1e-3 < default < 1e-2 and [default / ten, ten / hundred] == pytest.approx([10.0, 10.0], rel=0.01)
        assert 0.0 < noslip < 1e-3 * ten


def test_sliding_friction_is_the_same_at_any_speed(ask: Any) -> None:
    """mu N to rounding, and then the box stops; MuJoCo's falls with the speed, the more the softer its contact."""
    (*uses, press, left), peer = ask("braking")
    assert uses == pytest.approx([1.0, 1.0, 1.0], rel=1e-9) and abs(left) < 1e-6 and press < 9.0
    if peer:
        default, stiff = peer
        assert default[0] > default[1] > default[2] and default[1] < stiff[1] and default[1] < 0.6


def test_the_least_friction_is_coulombs(ask: Any) -> None:
    """The load that breaks away lies within a step of the ramp above the limit; nothing has slipped before."""
    rows, least = ask("least_friction")
    for _, limit, (load, before), peer in rows:
        assert limit < load < limit * 1.03 and before == 0.0
        assert peer is None or (peer[0] < limit * 1.1 and peer[1] > 1e-4)
    assert least == pytest.approx(0.2 * G / (2.0 * 0.6), rel=1e-3)


def test_the_forces_add_up_and_the_depth_is_the_laws(ask: Any) -> None:
    """Weight and squeeze to 1e-9 N at any mass. What the depth lacks of the law grows with the square of the shear;
    MuJoCo's depth falls with the mass."""
    rows, depth = ask("force_readback")
    for _, (shear, press, _), peer in rows:
        assert abs(shear) < 1e-9 and abs(press) < 1e-9
        assert peer is None or (abs(peer[0]) < 1e-6 and abs(peer[1]) < 1e-6)
    lack = [depth - found[2] for _, found, _ in rows]
    assert lack[1] / lack[0] == pytest.approx(16.0, rel=0.1) and lack[2] < 0.06 * depth
    if rows[0][2]:
        depths = [peer[2] for _, _, peer in rows]
        assert depths[0] > 2.0 * depths[1] > 2.0 * depths[2]


def test_the_jaws_stay_together(ask: Any) -> None:
    """To the last digit; the tips differ by the push, the box goes by what their springs say, and some by shear."""
    springs, (gone, apart, differ), peer = ask("parallel_gripper")
    assert apart == 0.0 and differ == pytest.approx(3.0, abs=0.01) and springs < gone < 1.06 * springs
    assert not peer or peer[0][1] > 10.0 * peer[1][1] > 1e-4


def test_a_load_in_steps_is_followed(ask: Any) -> None:
    """Error and scatter below 1e-5 N, and the same depth on the way down, to a nanometre. MuJoCo's likewise."""
    for found in ask("stepped_load"):
        assert found is None or (found[0] < 1e-4 and found[1] < 1e-4 and found[2] < 1.5 and found[3] < 1e-7)


def test_the_taxels_add_up(ask: Any) -> None:
    """To the force, the same to the left and to the right, less in each ring farther out, nothing in the last."""
    force, beside, normal, peer = ask("taxels")
    assert force.sum() == pytest.approx(normal, rel=1e-12)
    places = softhand.taxel_pattern(len(force), "rings")
    mirrored = np.argmin(np.linalg.norm(places[:, None] * [1.0, -1.0, 1.0] - places, axis=2), axis=1)
    assert np.allclose(force[mirrored], force, atol=1e-9 * normal) and not np.array_equal(mirrored, range(len(force)))
    means = np.array([force[np.isclose(beside, radius, atol=1e-6)].mean() for radius in np.unique(beside.round(6))])
    assert len(means) == 7 and np.all(np.diff(means[:5]) < 0.0) and np.all(means[4:] == 0.0)
    if peer:
        touch, depth = peer
        assert np.count_nonzero(touch) == 1 and touch.sum() == pytest.approx(normal, rel=1e-3)
        assert np.count_nonzero(depth) > 25


def test_a_modulus_is_a_stiffness(ask: Any) -> None:
    """Hertz's at a touch, within 5 % of finite elements up to 3 mm. A fit in MuJoCo is one for a mass."""
    touch, elements, fits = ask("stiffness_from_material")
    assert touch == pytest.approx(1.0, abs=1e-3) and elements < 0.05
    if fits:
        assert fits[0.2] < 0.05 and fits[0.05] == pytest.approx(0.75, abs=0.02)
        assert fits[0.8] == pytest.approx(3.0, abs=0.2)


@pytest.mark.slow
def test_what_lifts_a_box_is_known_before(ask: Any) -> None:
    """The squeeze for the acceleration holds without slip, that for the weight does not; both are m (g + a) / 2 mu."""
    top, weight, moved, slid, peer = ask("pinch_and_lift")
    assert [weight, moved] == pytest.approx([0.2 * G / 1.2, 0.2 * (G + top) / 1.2], rel=1e-3)
    assert slid["enough to lift"] == 0.0 and slid["enough for the weight"] > 5e-3
    assert not peer or (0.0 < peer["enough to lift"] < 1e-3 < peer["enough for the weight"])


@pytest.mark.slow
def test_a_bottle_is_lifted_with_the_least_squeeze(ask: Any) -> None:
    """It arrives, slips by nothing and keeps the margin that was asked for; with half there is no grasp."""
    press, rise, slip, use, refusal, height = ask("lift_a_bottle")
    assert rise == pytest.approx(0.02, abs=1e-5) and slip == 0.0 and 0.6 < use < 0.8
    assert 3.0 * 0.8 * press > 0.5 * G and "friction" in refusal
    assert height is None or 0.01 < height < 0.0199


@pytest.mark.slow
def test_stored_starts_hold(ask: Any) -> None:
    """What has a grasp stays to a picometre; no start that is kept is lost by a knock."""
    kept, moved, knocked, slipped, peer = ask("stable_starts")
    assert kept >= 10 and len(moved) == kept and moved.max() < 1e-12
    assert 0.0 < knocked.max() < 2e-3 and slipped.max() < 1e-3
    assert peer is None or peer > 1e-6


@pytest.mark.slow
def test_derivatives_are_those_of_the_step(ask: Any) -> None:
    """In stick and in slip within 1e-7; MuJoCo's differences are as good with the right size, not with a wrong one."""
    found, peer = ask("derivatives")
    for name in ("stick", "slip"):
        assert max(found[name]) < 1e-7
        assert not peer or (peer[name][1] < 1e-5 and peer[name][0] > 0.1)
