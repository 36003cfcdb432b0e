"""Simulation and control of robot hands with soft fingertips.

    import softhand

    scenario = softhand.load_scenario("target-a")
    recording = softhand.simulate(scenario)
    recording.save("run.nc")

Names are imported when they are first used, so that the command line starts at once.
"""

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from softhand.analysis.grasp_quality import GraspQuality, grasp_quality
    from softhand.analysis.placement import Placement, place_object
    from softhand.analysis.proposals import Proposal, propose_grasps
    from softhand.analysis.summary import Summary, summarize
    from softhand.assembly import build, simulate
    from softhand.comparison import compare
    from softhand.controllers.controller import Controller
    from softhand.dampings.damping import Damping
    from softhand.errors import (
        BrowserError,
        ControllerError,
        GraspError,
        LawError,
        ModelError,
        RecordingError,
        ScenarioError,
        SimulationStopped,
        SofthandError,
    )
    from softhand.laws.law import Law
    from softhand.observation import Observation
    from softhand.plots import draw_run, save_figure
    from softhand.recording import Recording
    from softhand.scenario import Scenario, load_scenario
    from softhand.scenario_file import scenario_names
    from softhand.simulation import Simulation
    from softhand.steppers.stepper import Integration, Stepper
    from softhand.version import __version__
    from softhand.viewer.film import write_film
    from softhand.viewer.live import Viewer, view
    from softhand.viewer.report import write_report

_HOMES = {
    "analysis.grasp_quality": ("GraspQuality", "grasp_quality"),
    "analysis.placement": ("Placement", "place_object"),
    "analysis.proposals": ("Proposal", "propose_grasps"),
    "analysis.summary": ("Summary", "summarize"),
    "assembly": ("build", "simulate"),
    "comparison": ("compare",),
    "controllers.controller": ("Controller",),
    "dampings.damping": ("Damping",),
    "errors": (
        "BrowserError",
        "ControllerError",
        "GraspError",
        "LawError",
        "ModelError",
        "RecordingError",
        "ScenarioError",
        "SimulationStopped",
        "SofthandError",
    ),
    "laws.law": ("Law",),
    "plots": ("draw_run", "save_figure"),
    "recording": ("Recording",),
    "scenario": ("Scenario", "load_scenario"),
    "scenario_file": ("scenario_names",),
    "observation": ("Observation",),
    "simulation": ("Simulation",),
    "steppers.stepper": ("Integration", "Stepper"),
    "version": ("__version__",),
    "viewer.film": ("write_film",),
    "viewer.report": ("write_report",),
    "viewer.live": ("Viewer", "view"),
}
_HOME = {name: f"softhand.{home}" for home, names in _HOMES.items() for name in names}

__all__ = sorted(_HOME)


def __getattr__(name: str) -> Any:
    if name not in _HOME:
        raise AttributeError(f"module 'softhand' has no attribute {name!r}")
    return getattr(import_module(_HOME[name]), name)


def __dir__() -> list[str]:
    return __all__
