"""Figures: what is drawn, on top of what, in which units, for any hand; and files that are whole or not there."""

from __future__ import annotations

import errno
import subprocess
import sys
from collections.abc import Callable
from functools import cache
from itertools import combinations
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from matplotlib import rc_context
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from softhand.analysis.energy import ACCOUNTS, Ledger
from softhand.errors import RecordingError, SofthandError
from softhand.plots.comparison import Compared, draw_comparison
from softhand.plots.energy import draw_energy
from softhand.plots.line_up import Lined, draw_line_up
from softhand.plots.panels import new_figure, panel
from softhand.plots.run import draw_run
from softhand.plots.style import DASH_DOTTED, FINGERS, FORMATS, STYLE, TARGETS, save_figure
from softhand.recording.recording import Recording
from softhand.recording.variables import COMPONENTS, VARIABLES

SAMPLES = 101
CONTACT_PANELS = 9


def invented(contacts: int = 3, joints: int = 3, samples: int = SAMPLES, **changes: Any) -> Recording:
    """A recording of smooth invented curves over 2 s; fields, or arrays by name, are replaced by `changes`."""
    fingers = range(1, contacts + 1)
    labels = {
        "joint": tuple(f"finger_{i}_joint_{j + 1}" for i in fingers for j in range(joints)),
        "contact": tuple(f"finger_{i}_tip" for i in fingers),
        "pair": tuple(f"{i}{j}" for i, j in combinations(fingers, 2)),
        "support": ("palm 1",),
        "velocity": ("joint_1", "object_x"),
        "coupled_joint": ("finger_1_joint_9",),
        "taxel": ("1", "2", "3"),
        "element": ("1", "2"),
    }
    sizes = {dim: len(names) for dim, names in {**labels, **COMPONENTS}.items()}
    time, rng = np.linspace(0.0, 2.0, SAMPLES)[:samples], np.random.default_rng(contacts)
    variables: dict[str, Any] = {
        name: np.multiply.outer(np.sin(3.0 * time), rng.uniform(0.1, 0.9, [sizes[dim] for dim in entry.dims[1:]]))
        for name, entry in VARIABLES.items()
    }
    variables |= {"time": time, "friction_use": np.abs(variables["friction_use"])}
    variables["torque_limited"] = np.zeros_like(variables["joint_torque"], dtype=np.int8)
    variables |= {name: changes.pop(name) for name in list(changes) if name in variables}
    fields: dict[str, Any] = {
        "variables": variables,
        "labels": labels,
        "scenario": 'description = "An invented run"\nduration = 2.0\n',
        "version": "0.1.0",
        "complete": True,
        "reason": "",
        "stop_time": float(time[-1]) if samples else 0.0,
    }
    return Recording(**{**fields, **changes})


def stopped(samples: int = 61) -> Recording:
    """A recording that ends at 1.2 s."""
    return invented(samples=samples, complete=False, reason="finger_2_tip rolls over its apex")


FORCE = ("f₁", "f₂", "f₃", "f₄", "f [")
"""How the labels of internal-force panels begin."""


def panels(figure: Figure, label: str | tuple[str, ...]) -> list[Axes]:
    return [axes for axes in figure.axes if axes.get_ylabel().startswith(label)]


def texts(figure: Figure) -> str:
    legends = [text.get_text() for legend in figure.legends for text in legend.get_texts()]
    titles = [axes.get_title(loc) for axes in figure.axes for loc in ("left", "right")]
    return "\n".join([text.get_text() for text in figure.texts] + legends + titles)


@cache
def drawn(contacts: int = 3, joints: int = 3) -> Figure:
    """The figure of an invented run; for tests that only look."""
    return draw_run(invented(contacts, joints))


@cache
def compared() -> Figure:
    pairs = [Compared("A", invented(), invented()), Compared("B", invented(), invented())]
    return draw_comparison(pairs, "Both targets")


def plain() -> Figure:
    """A small figure with what could differ from one file to the next: text, curves, marks, a clipped area."""
    with rc_context(STYLE):
        figure = new_figure(1.5)
        axes = panel(figure, figure.add_gridspec(1, 1)[0], "force [N]", "A title", bottom=True)
        axes.plot([0.0, 1.0], [0.0, 2.0], marker="v")
        axes.fill_between([0.0, 1.0], 0.0, [1.0, 2.0], alpha=0.3)
    return figure


def lined(count: int = 11, complete: bool = True) -> list[Lined]:
    """Runs whose errors differ by factors, and one without samples at the end."""
    time = np.linspace(0.0, 1.0, 101)
    runs = [
        Lined(f"run {k}", time, *(np.exp(-k * time) * size for size in (5.0, 2.0, 1.0)), 0.5 + 0.01 * time, complete)
        for k in range(count)
    ]
    return [*runs, Lined("none (cannot begin)", *[np.zeros(0)] * 5, True)]


# ------------------------------------------------------------------------------------------------------- one run


def test_a_run_has_a_panel_for_each_quantity() -> None:
    """9 panels of the object, 9 of the contacts, one for each joint of a finger."""
    assert len(drawn().axes) == 9 + CONTACT_PANELS + 3


@pytest.mark.parametrize("contacts", [2, 3, 4, 5])
def test_each_contact_has_its_curve(contacts: int) -> None:
    """A panel of the contacts has one curve a finger, in the finger's colour."""
    (axes,) = panels(drawn(contacts), "normal force")
    assert [line.get_color() for line in axes.lines] == list(FINGERS[:contacts])


@pytest.mark.parametrize("contacts", [2, 3, 4, 5])
def test_each_pair_has_its_curve_and_its_desired_one(contacts: int) -> None:
    """All pairs of contacts are drawn, whatever their number."""
    force = panels(drawn(contacts), FORCE)
    assert sum(len(axes.lines) for axes in force) == contacts * (contacts - 1)


@pytest.mark.parametrize("joints", [2, 4])
def test_torques_are_sorted_by_joint_and_coloured_by_finger(joints: int) -> None:
    """One panel for the first joints, one for the second, and so on."""
    torques = panels(drawn(3, joints), "torque, joint")
    assert len(torques) == joints
    assert np.array_equal(torques[1].lines[2].get_ydata(), invented(3, joints).joint_torque[:, 2 * joints + 1])
    assert torques[1].lines[2].get_color() == FINGERS[2]


def test_joints_without_names_of_fingers_are_shared_in_order() -> None:
    """Joint names that say nothing still give three panels of three curves."""
    recording = invented()
    labels = {**recording.labels, "joint": tuple(f"q{k}" for k in range(9))}
    torques = panels(draw_run(invented(labels=labels)), "torque, joint")
    assert [len(axes.lines) for axes in torques] == [3, 3, 3]


def test_desired_values_are_on_top() -> None:
    """The desired curve is black, thinner than the other, and above it."""
    for label in ("x [", "roll", FORCE):
        run, desired = panels(drawn(), label)[0].lines
        assert desired.get_color() == "black"
        assert desired.get_linewidth() < run.get_linewidth()
        assert desired.get_zorder() > run.get_zorder()


def test_values_are_drawn_in_the_units_of_the_label() -> None:
    """m as mm, rad as deg."""
    recording = invented()
    figure = draw_run(recording)
    assert np.allclose(panels(figure, "z [mm]")[0].lines[0].get_ydata(), 1e3 * recording.object_position[:, 2])
    assert np.allclose(panels(figure, "yaw [deg]")[0].lines[0].get_ydata(), np.degrees(recording.object_rpy[:, 2]))


@pytest.mark.parametrize("draw", [drawn, lambda: drawn(2), compared])
def test_every_axis_has_a_unit(draw: Callable[[], Figure]) -> None:
    """Each y label ends with a unit; each column ends with the time axis."""
    figure = draw()
    assert all(axes.get_ylabel().endswith("]") for axes in figure.axes)
    assert sum(axes.get_xlabel() == "time [s]" for axes in figure.axes) >= 3


def test_all_axes_share_the_time_axis() -> None:
    """All panels show the same times."""
    assert {axes.get_xlim() for axes in drawn().axes} == {(0.0, 2.0)}


def test_the_title_is_the_description() -> None:
    """The scenario's description heads the figure."""
    assert "An invented run" in texts(drawn())


def test_a_scenario_that_cannot_be_read_is_no_obstacle() -> None:
    """The figure then has a general title."""
    assert "softhand run" in texts(draw_run(invented(scenario="= not TOML")))


def test_an_incomplete_run_says_where_and_why_it_stopped() -> None:
    """Time and reason stand in the head, a line marks the time in every panel, and the time axis goes on."""
    figure = draw_run(stopped())
    assert "1.2 s: finger_2_tip rolls over its apex" in texts(figure)
    assert all(axes.lines[-1].get_xdata() == pytest.approx([1.2, 1.2]) for axes in figure.axes)
    assert figure.axes[0].get_xlim() == (0.0, 2.0)


def test_a_run_that_stopped_early_is_shown_large() -> None:
    """Ten samples of a hundred fill a quarter of the time axis."""
    assert draw_run(stopped(samples=11)).axes[0].get_xlim() == pytest.approx((0.0, 0.8))


@pytest.mark.parametrize("samples", [0, 1])
def test_a_run_without_length_can_be_drawn(samples: int, tmp_path: Path) -> None:
    """A run that stopped at its start gives a figure, not an error."""
    save_figure(draw_run(stopped(samples)), tmp_path / "figure.png")
    assert (tmp_path / "figure.png").stat().st_size > 10_000


def test_what_is_lifted_goes_up() -> None:
    """Where z points down its axis does too, and says so; elsewhere it is the usual one."""
    upright = "gravity = [0.0, 0.0, -9.81]\nduration = 2.0\n"
    (usual,) = panels(draw_run(invented(scenario=upright)), "z [mm]")
    (hanging,) = panels(draw_run(invented(scenario=upright.replace("-", ""))), "z (down) [mm]")
    assert not usual.yaxis_inverted() and hanging.yaxis_inverted()


def test_no_curve_crosses_the_number_of_a_phase() -> None:
    """Each stands above its panel, in all blocks."""
    phases = '[["close", 0.0], ["squeeze", 0.7], ["lift", 1.4]]'
    figure = draw_run(invented(attributes={"phases": phases}))
    figure.canvas.draw()
    renderer = figure.canvas.get_renderer()
    marked = [axes for axes in figure.axes if axes.texts and axes.texts[-1].get_text() == "3"]
    assert len(marked) == 9
    for axes in marked:
        for number in axes.texts[-3:]:
            extent = number.get_window_extent(renderer)
            assert extent.y0 >= axes.bbox.y1


def test_equal_curves_of_fingers_are_all_seen() -> None:
    """Each is narrower than those below it."""
    (axes,) = panels(drawn(), "normal force")
    widths = [line.get_linewidth() for line in axes.lines]
    assert np.all(np.diff(widths) < -0.1)


def test_friction_use_has_its_limit() -> None:
    """A line at 1."""
    (axes,) = panels(drawn(), "friction use")
    assert axes.lines[-1].get_ydata() == [1.0, 1.0]


def test_friction_use_above_its_limit_is_marked() -> None:
    """The panel says how far above 1 it went, where and when, and what that means; it keeps a readable scale."""
    use = invented().friction_use.copy()
    use[30, 1] = 4.2
    figure, time = draw_run(invented(friction_use=use)), invented().time[30]
    assert f"above 1 a real tip slips: 4.2 (finger 2, {time:.3g} s)" in texts(figure)
    use[50, 0] = np.inf
    figure = draw_run(invented(friction_use=use))
    assert "no normal force" in texts(figure)
    assert panels(figure, "friction use")[0].get_ylim() == (0.0, 3.0)


def test_friction_use_with_torsion_is_drawn_and_marked() -> None:
    """That of the limit surface, dotted, also where friction has no limit: there it says that a real tip slips."""
    coupled = np.full((SAMPLES, 3), 0.5)
    coupled[40, 2] = 1.07
    figure = draw_run(invented(limit_surface_use=coupled))
    (axes,) = panels(figure, "friction use")
    dotted = [line.get_ydata() for line in axes.lines if line.get_linestyle() == ":"]
    np.testing.assert_array_equal(np.column_stack(dotted), coupled)
    assert "dotted: with torsion" in [text.get_text() for text in axes.texts]
    assert f"above 1 a real tip slips: 1.07 (finger 3, {invented().time[40]:.3g} s)" in texts(figure)


def test_friction_use_below_its_limit_is_not_marked() -> None:
    """No warning without a cause."""
    assert "above 1" not in texts(drawn())


def test_torques_at_their_limit_are_marked() -> None:
    """A line at the limit, in the panel of the joint that hit it and in no other."""
    limited, torque = np.zeros((SAMPLES, 9), np.int8), invented().joint_torque.copy()
    limited[40:50, 4], torque[40:50, 4] = 1, 2.0
    torques = panels(draw_run(invented(joint_torque=torque, torque_limited=limited)), "torque, joint")
    assert torques[1].lines[-1].get_ydata() == [2.0, 2.0]
    assert [axes.get_title("right") for axes in torques] == ["", "effort limit reached", ""]


def test_rounding_errors_do_not_look_like_motion() -> None:
    """An angle that is zero but for 1e-15 rad is drawn flat."""
    figure = draw_run(invented(object_rpy=np.full((SAMPLES, 3), 1e-15), object_rpy_desired=np.zeros((SAMPLES, 3))))
    low, high = panels(figure, "roll")[0].get_ylim()
    assert high - low >= 1.0


def test_a_missing_array_is_named() -> None:
    """A recording without deformation cannot be drawn, and the message says so."""
    recording = invented()
    variables = {name: array for name, array in recording.variables.items() if name != "deformation"}
    with pytest.raises(RecordingError, match="no deformation"):
        draw_run(invented(variables=variables))


# --------------------------------------------------------------------------------------------------- comparison


def test_a_comparison_has_the_columns_of_the_paper() -> None:
    """Position, orientation, internal force; three components and the mean error each."""
    figure = compared()
    assert [axes.get_title("left") for axes in figure.axes[::4]] == ["Position", "Orientation", "Internal force"]
    assert len(figure.axes) == 12


def test_compensated_is_solid_and_uncompensated_dash_dotted() -> None:
    """For each target: dash-dotted, desired, solid, desired; desired on top of all."""
    lines = compared().axes[0].lines
    runs, desired = [*lines[0::2]], [*lines[1::2]]
    expected = [(TARGETS[0][1], True), (TARGETS[0][0], False), (TARGETS[1][1], True), (TARGETS[1][0], False)]
    assert [(line.get_color(), line.is_dashed()) for line in runs] == expected
    assert min(line.get_zorder() for line in desired) > max(line.get_zorder() for line in runs)
    assert {line.get_color() for line in desired} == {"black"}
    assert max(line.get_linewidth() for line in desired) < min(line.get_linewidth() for line in runs)


def test_the_legend_says_what_is_what() -> None:
    """Every kind of line has an entry."""
    shown = [text.get_text() for text in compared().legends[0].get_texts()]
    kinds = [f"{target}, {how} compensation" for target in "AB" for how in ("with", "without")]
    assert shown == [*kinds, "desired"]


def test_the_last_row_is_the_length_of_the_mean_error() -> None:
    """An error of (3, 4, 0) mm with a swing of whole periods is 5 mm."""
    swing = 1e-3 * np.sin(2.0 * np.pi * np.linspace(0.0, 2.0, SAMPLES) / 0.5)
    position = np.column_stack([3e-3 + swing, 4e-3 - swing, swing])
    run = invented(object_position=position, object_position_desired=np.zeros((SAMPLES, 3)))
    figure = draw_comparison([Compared("A", run, run)], "One target", window=0.5)
    error = np.asarray(figure.axes[3].lines[-1].get_ydata())
    assert np.isnan(error[:25]).all()
    assert np.allclose(error[26:], 5.0)


def test_an_incomplete_run_is_marked_in_a_comparison() -> None:
    """A cross at its end, its reason in the head."""
    figure = draw_comparison([Compared("A", stopped(), invented())], "One target")
    (cross,) = [line for line in figure.axes[0].lines if line.get_marker() == "x"]
    assert cross.get_xdata() == pytest.approx([1.2])
    assert "A, with compensation, stopped at 1.2 s: finger_2_tip rolls over its apex" in texts(figure)


def test_two_fingers_can_be_compared() -> None:
    """One pair of contacts gives one component of internal force."""
    figure = draw_comparison([Compared("A", invented(2), invented(2))], "Two fingers")
    assert len(panels(figure, FORCE)) == 1


# -------------------------------------------------------------------------------------------------------- files


@pytest.mark.parametrize("name", [*(f"figure.{ending}" for ending in FORMATS), "FIGURE.PNG"])
def test_the_ending_gives_the_format(name: str, tmp_path: Path) -> None:
    """Each allowed ending writes a file of that kind and nothing else."""
    save_figure(plain(), tmp_path / name)
    start = (tmp_path / name).read_bytes()[:8]
    assert start.startswith({"png": b"\x89PNG", "pdf": b"%PDF", "svg": b"<?xml"}[name[-3:].lower()])
    assert [file.name for file in tmp_path.iterdir()] == [name]


@pytest.mark.parametrize("name", ["figure.jpg", "figure", "figure.png.partial"])
def test_another_ending_is_refused(name: str, tmp_path: Path) -> None:
    """The message names the ending and those allowed; nothing is written."""
    with pytest.raises(SofthandError, match=r"choose one of \.png, \.pdf, \.svg") as caught:
        save_figure(plain(), tmp_path / name)
    assert caught.value.value == Path(name).suffix  # type: ignore[attr-defined]
    assert not list(tmp_path.iterdir())


def test_text_in_a_vector_figure_is_text(tmp_path: Path) -> None:
    """SVG keeps letters as text."""
    save_figure(plain(), tmp_path / "figure.svg")
    assert "force [N]</text>" in (tmp_path / "figure.svg").read_text(encoding="utf-8")


@pytest.mark.parametrize("ending", FORMATS)
def test_the_same_figure_gives_the_same_file(ending: str, tmp_path: Path) -> None:
    """No date and no random name in the file."""
    for name in ("one", "two"):
        save_figure(plain(), tmp_path / f"{name}.{ending}")
    assert (tmp_path / f"one.{ending}").read_bytes() == (tmp_path / f"two.{ending}").read_bytes()


def test_a_missing_folder_is_told(tmp_path: Path) -> None:
    """It is an error of ours that names the file."""
    with pytest.raises(RecordingError, match="choose a folder that exists") as caught:
        save_figure(plain(), tmp_path / "nowhere" / "figure.png")
    assert caught.value.file == tmp_path / "nowhere" / "figure.png"  # type: ignore[attr-defined]


def test_a_full_disk_leaves_the_older_figure(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The older file stays as it was, and no half of a new one."""

    def fail(path: Path, content: bytes) -> int:
        raise OSError(errno.ENOSPC, "No space left on device")

    (tmp_path / "figure.png").write_bytes(b"older")
    monkeypatch.setattr(Path, "write_bytes", fail)
    with pytest.raises(RecordingError, match="No space left on device"):
        save_figure(plain(), tmp_path / "figure.png")
    assert [file.read_bytes() for file in tmp_path.iterdir()] == [b"older"]


def test_importing_needs_neither_pyplot_nor_the_simulator() -> None:
    """No window system and no Pinocchio for a figure of a recording."""
    code = "import sys, softhand.plots; print({'matplotlib.pyplot', 'pinocchio', 'numba'} & set(sys.modules) or 'none')"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "none"


def test_every_run_of_a_line_up_has_its_row_and_its_name() -> None:
    """Eleven and one that cannot begin: each curve keeps to the row of its name, its value stands at its end."""
    runs = lined()
    figure = draw_line_up(runs, "A dozen")
    names = [text for text in figure.axes[0].texts if text.get_text().startswith(("run", "none"))]
    assert [name.get_text().replace("\n", " ") for name in names] == [run.label for run in runs]
    for column, axes in enumerate(figure.axes):
        curves = [line for line in axes.lines if len(line.get_xdata()) > 2]
        for curve, run, name in zip(curves, runs, names, strict=False):
            assert np.all(np.abs(curve.get_ydata() - name.xy[1]) < 0.5) and curve.get_color() == name.get_color()
            assert f"{run[2 + column][-1]:.2g}" in [text.get_text() for text in axes.texts]
        assert len(curves) == len(runs) - 1


def test_runs_of_a_line_up_have_one_scale() -> None:
    """A larger error is drawn higher within its row, in every column of errors."""
    runs = lined(3)
    for axes in draw_line_up(runs, "Three").axes[:3]:
        ends = [line.get_ydata()[-1] % 1.0 for line in axes.lines if len(line.get_xdata()) > 2]
        assert ends == sorted(ends, reverse=True) and ends[0] > ends[-1] + 0.1


def test_a_run_that_stopped_has_its_cross() -> None:
    """And one that did not has none."""
    crosses = [[line for line in draw_line_up(lined(2, complete), "Two").axes[0].lines if line.get_marker() == "x"]
               for complete in (True, False)]  # fmt: skip
    assert list(map(len, crosses)) == [0, 2]


def ledger() -> Ledger:
    """Accounts that are all equal to nothing but the work and the height."""
    time = np.linspace(0.0, 1.0, 11)
    nothing, rising = np.zeros_like(time), 0.1 * time
    joints = dict.fromkeys(("joint_damping", "joint_friction", "stops", "stop_damping"), 0.1 * rising)
    values = dict.fromkeys(ACCOUNTS, nothing) | joints | {"work": rising, "pushed": rising, "gravity": 2.0 * rising}
    return Ledger(time=time, is_spring=True, **values)


def test_every_account_of_energy_is_seen_and_named() -> None:
    """Equal curves differ in width or dashes, and the legend has all of them."""
    figure = draw_energy(ledger(), "A run")
    lines = figure.axes[0].lines
    assert {line.get_label() for line in lines} == set(ACCOUNTS.values()) <= set(texts(figure).splitlines())
    hidden = [line for line in lines if not line.get_ydata().any()]
    whole = [line.get_linewidth() for line in lines if not line.is_dashed()]
    assert len(hidden) == 4 and [line.is_dashed() for line in hidden] == [False, False, True, True]
    assert whole == sorted(whole, reverse=True) and len(set(whole)) == len(whole)


def compared_nearly() -> Figure:
    """Runs that stay within a few um of what is asked for."""
    run = invented()
    near = invented(object_position_desired=(1.0 + 5e-6) * run.object_position)
    return draw_comparison([Compared("A", near, near)], "One target")


@pytest.mark.parametrize(
    "draw", [compared_nearly, lambda: draw_line_up(lined(), "A dozen")], ids=["compared", "lined up"]
)
def test_labels_of_logarithmic_axes_can_be_read(draw: Callable[[], Figure]) -> None:
    """Plain powers, no math text."""
    figure = draw()
    figure.canvas.draw()
    labels = [label.get_text() for axes in figure.axes for label in axes.get_yticklabels()]
    assert not any("$" in label for label in labels) and {"10⁻³"} & set(labels)


def test_dash_dotted_is_what_it_says() -> None:
    """A long dash, a gap, a dot, a gap."""
    _, (dash, gap, dot, _) = DASH_DOTTED
    assert dash > gap >= dot
