"""The figure of one run: object against desired, contacts, joint torques."""

from __future__ import annotations

from matplotlib import rc_context, rcParams
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.gridspec import SubplotSpec
from matplotlib.lines import Line2D

from softhand.numerics.arrays import Array
from softhand.plots.panels import (
    desired_handle,
    draw_legend,
    draw_title,
    finish,
    from_top,
    new_figure,
    panel,
    plot_desired,
    split,
    widen,
)
from softhand.plots.quantities import CONTACT_ARRAYS, OBJECT_ARRAYS, ObjectQuantity, check, object_quantities
from softhand.plots.run_contacts import draw_contacts
from softhand.plots.style import DASHED, OBJECT, STYLE, WARNING, finger_color
from softhand.recording.events import phases_of
from softhand.recording.recorded import RecordedScenario, scenario_of
from softhand.recording.recording import Recording


def draw_run(recording: Recording) -> Figure:
    """All of one run: pose and internal force against their desired values, then contacts and joint torques.

    Args:
        recording: with any number of contacts and joints. If it is incomplete, the figure says where and why.

    Raises:
        RecordingError: an array that the figure shows is not in the recording.
    """
    check(recording, *OBJECT_ARRAYS, *CONTACT_ARRAYS)
    with rc_context(STYLE):
        figure = new_figure(11.4)
        scenario = scenario_of(recording)
        top = _draw_head(figure, recording, scenario)
        grid = figure.add_gridspec(2, 1, height_ratios=(3.1, 6.6), left=0.075, right=0.98, top=top, bottom=0.04,
                                   hspace=0.15)  # fmt: skip
        _draw_object(figure, grid[0], recording)
        draw_contacts(figure, grid[1], recording)
        finish(figure, _time_shown(recording, scenario))
        _mark_phases(figure, recording)
        if not recording.complete:
            _mark_stop(figure, recording.stop_time)
    return figure


def _draw_head(figure: Figure, recording: Recording, scenario: RecordedScenario) -> float:
    """Title, settings, legend of the upper part, why an incomplete run stopped; returns where the axes may begin."""
    handles = [Line2D([], [], color=OBJECT, lw=1.8, label="object"), desired_handle()]
    draw_legend(figure, handles, from_top(figure, 0.34), loc="upper right")
    names = ", ".join(f"{k} {name}" for k, (name, _, _) in enumerate(phases_of(recording), start=1))
    figure.text(0.012, from_top(figure, 0.36), scenario.settings_line, color="0.35", va="top")
    if names:
        figure.text(0.012, from_top(figure, 0.53), f"phases: {names}", color="0.35", va="top")
    stop = "" if recording.complete else f"Incomplete, stopped at {recording.stop_time:g} s: {recording.reason}"
    return draw_title(figure, scenario.title, stop, room=0.17 if names else 0.0)


def _draw_object(figure: Figure, place: SubplotSpec, recording: Recording) -> None:
    """One column a quantity, one axes a component; more than three pairs of contacts share three axes."""
    for quantity, column in zip(object_quantities(recording), split(place, 1, 3, wspace=0.31), strict=True):
        groups = quantity.groups()
        for row, (group, spot) in enumerate(zip(groups, split(column, len(groups), 1, hspace=0.2), strict=True)):
            label = quantity.labels[group[0]] if len(group) == 1 else "f"
            title, is_last = "" if row else quantity.title, row == len(groups) - 1
            axes = panel(figure, spot, f"{label} [{quantity.unit}]", title, is_last)
            _plot_components(axes, recording.time, quantity, group)
            widen(axes, quantity.least)
            if quantity.falling and quantity.falling[group[0]]:
                axes.invert_yaxis()


def _plot_components(axes: Axes, time: Array, quantity: ObjectQuantity, group: list[int]) -> None:
    """Values and desired values of the components that share a panel."""
    for k, member in enumerate(group):
        color = OBJECT if len(group) == 1 else finger_color(k)
        axes.plot(time, quantity.values[:, member], color=color, lw=1.8, label=quantity.labels[member])
        plot_desired(axes, time, quantity.desired[:, member])
    if len(group) > 1:
        curves = axes.lines[::2]
        axes.legend(handles=curves, ncols=4, fontsize=7, handlelength=0.9, handletextpad=0.3, columnspacing=0.7,
                    borderpad=0.0, loc="lower right", bbox_to_anchor=(1.0, 0.97))  # fmt: skip


def _mark_phases(figure: Figure, recording: Recording) -> None:
    """Every other phase of the reference a little darker, its number above each block, where no curve crosses it."""
    phases = phases_of(recording)
    for axes in figure.axes if phases else ():
        for _, begin, end in phases[::2]:
            axes.axvspan(begin, end, color="0.5", alpha=0.1, lw=0, zorder=0)
        place = axes.get_subplotspec()
        if place is not None and place.is_first_row():
            axes.set_title("", pad=rcParams["font.size"] + 2.0)  # of all its titles: above the numbers
            for k, (_, begin, end) in enumerate(phases, start=1):
                axes.annotate(str(k), (0.5 * (begin + end), 1.0), (0.0, 1.5), xycoords=axes.get_xaxis_transform(),
                              textcoords="offset points", color="0.4", fontsize=6.5, ha="center",
                              va="bottom")  # fmt: skip


def _time_shown(recording: Recording, scenario: RecordedScenario) -> float:
    """Duration of the run [s], less if it stopped so early that its curves would be slivers."""
    duration = scenario.number("duration")
    if duration is None:
        duration = recording.stop_time
    return min(duration, 4.0 * recording.stop_time) or duration or 1.0


def _mark_stop(figure: Figure, time: float) -> None:
    for axes in figure.axes:
        axes.axvline(time, color=WARNING, lw=1.0, ls=DASHED)
