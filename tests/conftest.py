"""Fixtures: the reference grasp, and the hands that the tests make."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
from chromium import browser, coarse_page, new_page  # noqa: F401  fixtures for all
from hands import LAYOUTS, Task, make_law, make_named_task, random_state, reference_task

from softhand.contact.pads import Fingertip
from softhand.laws.nakashima import Nakashima
from softhand.model.world import World
from softhand.plant.plant import Plant
from softhand.plant.state import State
from softhand.start.grasp import Grasp


@pytest.fixture(scope="session")
def reference() -> Task:
    """The reference hand and box in their grasp at the start."""
    return reference_task()


@pytest.fixture(scope="session")
def world(reference: Task) -> World:
    """Rigid bodies of the reference hand and box."""
    return reference.world


@pytest.fixture(scope="session")
def law() -> Nakashima:
    """The paper's fingertip."""
    return make_law()


@pytest.fixture(scope="session")
def fingertips(reference: Task) -> tuple[Fingertip, ...]:
    """The tips of the reference hand and the faces that they touch."""
    return reference.fingertips


@pytest.fixture(scope="session")
def grasp(reference: Task) -> Grasp:
    """The grasp at rest of the reference hand."""
    return reference.grasp


@pytest.fixture
def plant(reference: Task) -> Plant:
    """A plant of the reference hand, not shared."""
    return reference.plant()


@pytest.fixture(scope="session")
def make_task(tmp_path_factory: pytest.TempPathFactory) -> Callable[[str], Task]:
    """Function from a name of `LAYOUTS` to the task, each made once."""
    made: dict[str, Task] = {}

    def make(name: str) -> Task:
        if name not in made:
            made[name] = make_named_task(name, tmp_path_factory.mktemp("hand"))
        return made[name]

    return make


@pytest.fixture(params=list(LAYOUTS))
def task(request: pytest.FixtureRequest, make_task: Callable[[str], Task]) -> Task:
    """Each of the hands in turn."""
    return make_task(request.param)


@pytest.fixture(params=range(3), ids=lambda seed: f"seed{seed}")
def rng(request: pytest.FixtureRequest) -> np.random.Generator:
    """Three seeded generators in turn."""
    return np.random.default_rng(request.param)


@pytest.fixture
def state(task: Task, rng: np.random.Generator) -> State:
    """A random moving state of `task` near its grasp."""
    return random_state(task, rng)
