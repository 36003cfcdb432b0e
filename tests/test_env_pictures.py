"""Pictures of environments: as arrays, in meshcat, and what is told where there is no Chromium."""

from __future__ import annotations

import warnings

import numpy as np
import pytest
from chromium import needs_chromium

from softhand import BrowserError, ScenarioError

gymnasium = pytest.importorskip("gymnasium", reason="needs the extra gym: pip install 'softhand[gym]'")

import softhand.envs  # noqa: E402
from softhand.envs import shown  # noqa: E402
from softhand.viewer.browser import browser  # noqa: E402


@needs_chromium
@pytest.mark.slow
def test_pictures_show_the_world_as_it_is() -> None:
    """The same world gives the same picture; the box that moves and another goal give others."""
    env = gymnasium.make("softhand/ReorientBox-v0", render_mode="rgb_array", randomise={})
    env.reset(seed=0)
    first, again = env.render(), env.render()
    assert first.shape == (480, 640, 3) and first.dtype == np.uint8 and np.ptp(first) > 100
    assert np.mean(np.any(first != again, axis=2)) < 1e-3
    for _ in range(20):
        env.step(np.array([1.0, 0.0, 0.0, 0.0, 0.0, 1.0]))
    moved = env.render()
    assert np.mean(np.any(first != moved, axis=2)) > 0.01
    env.reset(seed=1)
    assert np.mean(np.any(env.render() != first, axis=2)) > 0.01
    env.close()
    env.close()


def test_without_chromium_that_is_told(monkeypatch: pytest.MonkeyPatch) -> None:
    """When the first picture is asked for."""

    def none() -> str:
        raise BrowserError("There is no Chromium.")

    monkeypatch.setattr(browser, "find_chromium", none)
    env = gymnasium.make("softhand/HoldBox-v0", render_mode="rgb_array", randomise={}).unwrapped
    env.reset(seed=0)
    with pytest.raises(BrowserError, match="no Chromium"):
        env.render()


def test_people_see_it_in_meshcat(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    """From the reset on, without a call of `render`; the address is told where there is no screen."""
    monkeypatch.setattr(shown.MeshcatViewer, "open", lambda self: False)
    env = gymnasium.make("softhand/HoldBox-v0", render_mode="human", randomise={}).unwrapped
    env.reset(seed=0)
    assert "meshcat at http://127.0.0.1" in capsys.readouterr().out
    seen: list[float] = []
    monkeypatch.setattr(shown.MeshcatViewer, "show", lambda self, observation: seen.append(observation.time))
    env.step(np.zeros(6))
    assert seen == [pytest.approx(0.01)]
    env.close()


def test_without_a_mode_there_is_nothing_to_see() -> None:
    """And an unknown mode is told."""
    env = gymnasium.make("softhand/HoldBox-v0", randomise={}).unwrapped
    env.reset(seed=0)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        assert env.render() is None
    with pytest.raises(ScenarioError, match=r"render_mode.*video.*human or rgb_array"):
        softhand.envs.env.HandEnv(render_mode="video")
