"""docs/theory.md: its numbers are what quadrature and the software give, its letters are those of the code."""

from __future__ import annotations

import re
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from hands import Array, Task
from scipy.integrate import quad

import softhand
from softhand.contact.records import CONTACT, PAD
from softhand.laws.nakashima import Nakashima
from softhand.numerics.rotations import turns_between
from softhand.sensing.observation import ALIASES, Observation

PAGE = (Path(__file__).parent.parent / "docs/theory.md").read_text()


def row(label: str) -> list[float]:
    """The numbers of the row of a table that begins so."""
    found = re.search(rf"^\| {re.escape(label)} \|(.+)\|$", PAGE, re.MULTILINE)
    assert found is not None, label
    return [float(cell) for cell in found[1].split("|")]


def in_series(radius: Callable[[float], float], end: float) -> float:
    """Twist stiffness of slices from 0 to `end` that hand on one torque, for G = 1: pi / 2 over int dx / radius^4."""
    return 0.5 * np.pi / quad(lambda x: radius(x) ** -4, 0.0, end, epsabs=0.0, epsrel=1e-10, limit=200)[0]


def of_unit_ball(x: float) -> float:
    return float(np.sqrt(1.0 - x * x))


@pytest.mark.parametrize("r", [1.0, 0.7])
def test_slices_in_series_have_no_pole(r: float) -> None:
    """Twists that add up give the row of K_theta, its closed form, and a finite stiffness of f_x at the apex."""
    angles = np.radians([60.0, 85.0, 89.0])
    series = [in_series(lambda x: np.sqrt(r * r - x * x), r * np.sin(phi)) / r**3 for phi in angles]
    assert series == pytest.approx(row("slices in series, K_theta / (G r^3)"), rel=5e-3)
    closed = np.pi / (np.sin(angles) / np.cos(angles) ** 2 + np.arctanh(np.sin(angles)))
    assert series == pytest.approx(closed, rel=1e-8)
    along_x = np.array(series) / np.cos(angles) ** 2
    assert np.all(np.diff(along_x) > 0.0) and along_x[-1] == pytest.approx(np.pi, rel=2e-3)


def test_torques_that_are_added_have_one() -> None:
    """The row of (9) is the torque T(x) of the paper's angle (7), added up over x, and what the law does."""
    law = Nakashima(radius=1.0, k_r=1.0, k_phi=1.0, k_theta=1.0, k_psi=1.0)
    written = row("(9), Ftheta / (k_theta r^4 dtheta)")
    for phi, number in zip(np.radians([60.0, 85.0, 89.0]), written, strict=True):
        # T(x) = (pi / 2) (1 - x^2)^2 d(angle)/dx, angle = {1 - (1 - x^2)^(1/2)} / (1 - cos phi)
        added = 0.5 * np.pi / (1.0 - np.cos(phi)) * quad(lambda x: x * of_unit_ball(x) ** 3, 0.0, np.sin(phi))[0]
        force = law(np.array([0.0, 1e-3, 0.0, 0.0]), phi)[1] / 1e-3
        assert [added, force] == pytest.approx([number] * 2, rel=2e-3)


def test_torsion_of_the_tip() -> None:
    """The rows of K_psi: slices in series down to the disc, which are stiffer than a disc of Hertz's radius."""
    depth = np.array([0.1, 0.2, 0.3, 0.4])
    series = [in_series(of_unit_ball, 1.0 - d) for d in depth]
    assert series == pytest.approx(row("slices in series, K_psi / (G r^3)"), abs=5e-4)
    s = 1.0 - depth
    assert series == pytest.approx(np.pi / (s / (1.0 - s * s) + np.arctanh(s)), rel=1e-8)
    hertz = np.array(row("disc of Hertz's radius"))
    assert hertz == pytest.approx(16.0 / 3.0 * depth**1.5, abs=5e-4)
    elements = np.array(row("finite elements"))
    assert np.all(hertz < elements) and np.all(elements < series)


def shares(f: Array) -> Array:
    """abs(f_t) / f_z of contact forces, shape (..., 3)."""
    return np.hypot(f[..., 0], f[..., 1]) / f[..., 2]


def test_squeezing_does_not_keep_the_cone(reference: Task) -> None:
    """Along each line of the reference grasp the force of a pair has the share that the page says, at any size."""
    del reference  # compiled already
    observation = softhand.build("target-a").sample()
    K = observation.internal_force_basis.reshape(3, 3, 3)  # contact, axis, pair 23, 13, 12
    for force in (1.0, 40.0):
        pair_23, pair_13 = force * K[:, :, 0], force * K[:, :, 1]
        assert shares(np.array([pair_23[2], pair_13[2]])) == pytest.approx([1.580, 1.580], abs=5e-4)
        assert shares(np.array([pair_23[1], pair_13[0]])) == pytest.approx([0.667, 0.667], abs=5e-4)
        assert shares(pair_23[2] + pair_13[2]) == pytest.approx(5.0 / 18.0, rel=1e-9)
        assert shares(1.725 * pair_23[2] + pair_13[2]) < 0.5 < shares(1.735 * pair_23[2] + pair_13[2])
    assert "1.58" in PAGE and "0.67" in PAGE and "1.73" in PAGE


def test_the_errors_of_the_steppers() -> None:
    """The column of `minimum-jerk`, measured as the page says, against `adaptive` with its default tolerances."""
    base = run("adaptive", 1e-3)
    found = re.findall(r"^\| `([\w-]+)` \| ([\d.]+) ms \| ([\d.]+) um, ([\d.]+) deg \|", PAGE, re.MULTILINE)
    assert len(found) == 6
    for name, step, place, turn in found:
        other = run(name, 1e-3 * float(step))
        away = np.linalg.norm(other.object_position - base.object_position, axis=1).max()
        turned = np.linalg.norm(turns_between(base.object_rpy, other.object_rpy), axis=1).max()
        assert 1e6 * away == pytest.approx(float(place), rel=0.03)
        assert np.degrees(turned) == pytest.approx(float(turn), rel=0.13)


def run(stepper: str, step: float, **settings: float) -> softhand.Recording:
    return softhand.simulate("target-a", overrides={"stepper": {"name": stepper, "step": step, **settings}})


def test_the_highest_contact_frequency() -> None:
    """Of the reference grasp at the start, the root of the largest eigenvalue of M^-1 J^T K J."""
    simulation = softhand.build("target-a")
    simulation.sample()
    plant = simulation.plant
    stiffness = sum(J.T @ K @ J for J, K in zip(plant.jacobian, plant.contacts["stiffness"], strict=True))
    eigenvalues = np.linalg.eigvals(np.linalg.solve(plant.rigid.mass_matrix(simulation.state.q), stiffness))
    assert np.sqrt(eigenvalues.real.max()) == pytest.approx(639.0, rel=2e-3) and "639 rad/s" in PAGE


SECTION = PAGE.partition("## Letters")[2].partition("\n## ")[0]
LETTERS = [line.strip("|").split("|") for line in SECTION.splitlines() if line.startswith("| `")]
"""The rows of the table: letter, meaning, unit, field, elsewhere."""

OWN = {name for name in vars(Observation) if not name.startswith("_")} | set(Observation.__annotations__)


def names(cell: str) -> list[str]:
    return re.findall(r"`([^`]+)`", cell)


def test_every_letter_is_there_once() -> None:
    """And the second names of an observation are among them, beside the field that they stand for."""
    letters = [letter for cells in LETTERS for letter in names(cells[0])]
    assert len(letters) == len(set(letters)) > 90
    told = {name: names(cells[3]) for cells in LETTERS for name in names(cells[4])}
    for alias, field in ALIASES.items():
        assert any(name.startswith(field) for name in told.get(alias, [])), alias


def test_every_name_beside_a_letter_is_there() -> None:
    """Fields of an observation, of a contact and of a pad."""
    for cells in LETTERS:
        fields = [re.match(r"\w+", name)[0] for name in names(cells[3])]  # type: ignore[index]
        assert [name for name in fields if name not in OWN] == []
        for kind, table in (("contact", CONTACT), ("pad", PAD)):
            elsewhere = [name.removeprefix(f"{kind}.") for name in names(cells[4]) if name.startswith(f"{kind}.")]
            assert [name for name in elsewhere if name not in table.names] == []
