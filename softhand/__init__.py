"""Simulation and control of robot hands with soft fingertips.

    import softhand

    recording = softhand.simulate("target-a", mass=0.3)
    recording.save("run.nc")

Names are imported when they are first used, so that the command line starts at once.
"""

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from softhand.analysis.energy import Ledger, energy_ledger
    from softhand.analysis.summary import Summary, summarize
    from softhand.assembly.build import build, simulate
    from softhand.batch.rollout import rollout
    from softhand.batch.runs import Runs
    from softhand.checks.check import check
    from softhand.closed_loop.linearize import LinearModel, linearize
    from softhand.closed_loop.lyapunov import Lyapunov, lyapunov
    from softhand.closed_loop.stability import Stability, stability
    from softhand.controllers import blocks
    from softhand.controllers.controller import Controller
    from softhand.dampings.damping import Damping
    from softhand.errors import (
        BrowserError,
        ControllerError,
        GraspError,
        LawError,
        ModelError,
        RecordingError,
        RolloutStopped,
        ScenarioError,
        SimulationStopped,
        SofthandError,
    )
    from softhand.export.writing import read_mcap, write_mcap, write_rrd
    from softhand.grasping.placement import Placement, place_object
    from softhand.grasping.proposals import Proposal, Proposals, propose_grasps
    from softhand.grasping.quality import GraspQuality, grasp_quality
    from softhand.grasping.workspace import Workspace, workspace
    from softhand.identification.identify import Identification, identify
    from softhand.laws.law import Law
    from softhand.plant.plant import Plant
    from softhand.plant.state import State
    from softhand.plots.run import draw_run
    from softhand.plots.style import save_figure
    from softhand.recording.recording import Recording, load_recording
    from softhand.references.goal import Goal
    from softhand.references.reference import Reference
    from softhand.scenario.file import scenario_names
    from softhand.scenario.scenario import Scenario, load_scenario
    from softhand.sensing.observation import Observation
    from softhand.simulation.pushes import Push
    from softhand.simulation.simulation import Simulation
    from softhand.steppers.stepper import Integration, Stepper
    from softhand.studies.compare import compare
    from softhand.version import __version__
    from softhand.viewer.live.replay import view
    from softhand.viewer.live.viewer import Viewer
    from softhand.viewer.meshcat.viewer import MeshcatViewer
    from softhand.viewer.report.film import write_film
    from softhand.viewer.report.report import write_report

_HOMES = {
    "grasping.quality": ("GraspQuality", "grasp_quality"),
    "grasping.placement": ("Placement", "place_object"),
    "grasping.proposals": ("Proposal", "Proposals", "propose_grasps"),
    "grasping.workspace": ("Workspace", "workspace"),
    "analysis.energy": ("Ledger", "energy_ledger"),
    "batch.rollout": ("rollout",),
    "batch.runs": ("Runs",),
    "checks.check": ("check",),
    "closed_loop.linearize": ("LinearModel", "linearize"),
    "closed_loop.lyapunov": ("Lyapunov", "lyapunov"),
    "closed_loop.stability": ("Stability", "stability"),
    "analysis.summary": ("Summary", "summarize"),
    "assembly.build": ("build", "simulate"),
    "studies.compare": ("compare",),
    "controllers": ("blocks",),
    "controllers.controller": ("Controller",),
    "dampings.damping": ("Damping",),
    "errors": (
        "BrowserError",
        "ControllerError",
        "GraspError",
        "LawError",
        "ModelError",
        "RecordingError",
        "RolloutStopped",
        "ScenarioError",
        "SimulationStopped",
        "SofthandError",
    ),
    "export.writing": ("read_mcap", "write_mcap", "write_rrd"),
    "identification.identify": ("Identification", "identify"),
    "laws.law": ("Law",),
    "plant.state": ("State",),
    "plots": ("draw_run", "save_figure"),
    "recording.recording": ("Recording", "load_recording"),
    "references.goal": ("Goal",),
    "scenario.scenario": ("Scenario", "load_scenario"),
    "scenario.file": ("scenario_names",),
    "sensing.observation": ("Observation",),
    "simulation.pushes": ("Push",),
    "simulation.simulation": ("Simulation",),
    "plant.plant": ("Plant",),
    "references.reference": ("Reference",),
    "steppers.stepper": ("Integration", "Stepper"),
    "version": ("__version__",),
    "viewer.report.film": ("write_film",),
    "viewer.report.report": ("write_report",),
    "viewer.live.replay": ("view",),
    "viewer.live.viewer": ("Viewer",),
    "viewer.meshcat.viewer": ("MeshcatViewer",),
}
_HOME = {name: f"softhand.{home}" for home, names in _HOMES.items() for name in names}

__all__ = sorted(_HOME)


def __getattr__(name: str) -> Any:
    if name not in _HOME:
        raise AttributeError(f"module 'softhand' has no attribute {name!r}")
    if name == "blocks":  # a module
        return import_module("softhand.controllers.blocks")
    return getattr(import_module(_HOME[name]), name)


def __dir__() -> list[str]:
    return __all__
