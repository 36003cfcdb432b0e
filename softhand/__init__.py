"""Simulation and control of robot hands with soft fingertips.

    import softhand

    recording = softhand.simulate("target-a", mass=0.3)
    recording.save("run.nc")

Names are imported when they are first used, so that the command line starts at once.
"""

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:  # for editors; `as` says that a name is public
    from softhand import controllers as controllers
    from softhand import dampings as dampings
    from softhand import laws as laws
    from softhand import references as references
    from softhand import steppers as steppers
    from softhand.analysis.energy import Ledger as Ledger
    from softhand.analysis.energy import energy_ledger as energy_ledger
    from softhand.analysis.incipient_slip import incipient_slip as incipient_slip
    from softhand.analysis.summary import Summary as Summary
    from softhand.analysis.summary import summarize as summarize
    from softhand.analysis.tactile import Markers as Markers
    from softhand.analysis.tactile import depth_image as depth_image
    from softhand.analysis.tactile import marker_displacements as marker_displacements
    from softhand.analysis.tactile import tactile_pressure as tactile_pressure
    from softhand.analysis.tactile import taxel_points as taxel_points
    from softhand.assembly.build import build as build
    from softhand.assembly.build import simulate as simulate
    from softhand.assembly.collisions import collisions as collisions
    from softhand.assembly.measurement_noise import MeasurementNoise as MeasurementNoise
    from softhand.assembly.measurement_noise import measurement_noise as measurement_noise
    from softhand.assistant.found_scenario import NewScenario as NewScenario
    from softhand.assistant.new_scenario import new_scenario as new_scenario
    from softhand.batch.rollout import rollout as rollout
    from softhand.batch.runs import Runs as Runs
    from softhand.calibration.calibrate import calibrate as calibrate
    from softhand.calibration.log import Log as Log
    from softhand.calibration.record import Calibration as Calibration
    from softhand.checks.check import check as check
    from softhand.closed_loop.grasp_stiffness import GraspStiffness as GraspStiffness
    from softhand.closed_loop.grasp_stiffness import grasp_stiffness as grasp_stiffness
    from softhand.closed_loop.linearize import LinearModel as LinearModel
    from softhand.closed_loop.linearize import linearize_plant as linearize_plant
    from softhand.closed_loop.lyapunov import Lyapunov as Lyapunov
    from softhand.closed_loop.lyapunov import lyapunov as lyapunov
    from softhand.collision.record import Collision as Collision
    from softhand.collision.record import Collisions as Collisions
    from softhand.controllers import blocks as blocks
    from softhand.controllers.controller import Controller as Controller
    from softhand.controllers.linear_set_point import LinearSetPoint as LinearSetPoint
    from softhand.dampings.damping import Damping as Damping
    from softhand.derivatives.costs import FunctionCost as FunctionCost
    from softhand.derivatives.costs import PeakCost as PeakCost
    from softhand.derivatives.costs import QuadraticCost as QuadraticCost
    from softhand.derivatives.gradient import gradient as gradient
    from softhand.derivatives.gradient_record import Gradient as Gradient
    from softhand.derivatives.linearization import ClosedLoop as ClosedLoop
    from softhand.derivatives.linearization import Linearization as Linearization
    from softhand.derivatives.linearize import linearize as linearize
    from softhand.derivatives.linearizer import Linearizer as Linearizer
    from softhand.design.gain_design import GainDesign as GainDesign
    from softhand.design.gains import design_gains as design_gains
    from softhand.design.lqr import LqrDesign as LqrDesign
    from softhand.design.lqr import design_lqr as design_lqr
    from softhand.errors import BrowserError as BrowserError
    from softhand.errors import ControllerError as ControllerError
    from softhand.errors import GraspError as GraspError
    from softhand.errors import LawError as LawError
    from softhand.errors import ModelError as ModelError
    from softhand.errors import RecordingError as RecordingError
    from softhand.errors import RolloutStopped as RolloutStopped
    from softhand.errors import ScenarioError as ScenarioError
    from softhand.errors import ScenarioWarning as ScenarioWarning
    from softhand.errors import SimulationStopped as SimulationStopped
    from softhand.errors import SofthandError as SofthandError
    from softhand.errors import StudyError as StudyError
    from softhand.errors import SweepStopped as SweepStopped
    from softhand.export.writing import read_mcap as read_mcap
    from softhand.export.writing import write_mcap as write_mcap
    from softhand.export.writing import write_rrd as write_rrd
    from softhand.grasping.placement import Placement as Placement
    from softhand.grasping.placement import place_object as place_object
    from softhand.grasping.proposals import Proposal as Proposal
    from softhand.grasping.proposals import Proposals as Proposals
    from softhand.grasping.proposals import propose_grasps as propose_grasps
    from softhand.grasping.quality import GraspQuality as GraspQuality
    from softhand.grasping.quality import grasp_quality as grasp_quality
    from softhand.grasping.workspace import Workspace as Workspace
    from softhand.grasping.workspace import workspace as workspace
    from softhand.holding.curve import SqueezeCurve as SqueezeCurve
    from softhand.holding.margin import SlipMargin as SlipMargin
    from softhand.holding.margin import slip_margin as slip_margin
    from softhand.holding.push_record import WorstPush as WorstPush
    from softhand.holding.record import Squeeze as Squeeze
    from softhand.holding.squeeze import squeeze as squeeze
    from softhand.holding.worst_push import worst_push as worst_push
    from softhand.identification.identify import Identification as Identification
    from softhand.identification.identify import identify as identify
    from softhand.laws.law import Law as Law
    from softhand.margins.along import StabilityAlong as StabilityAlong
    from softhand.margins.along import stability_along as stability_along
    from softhand.margins.margins import Margins as Margins
    from softhand.margins.modes import Mode as Mode
    from softhand.margins.stability import Stability as Stability
    from softhand.margins.stability import stability as stability
    from softhand.material.modulus import Material as Material
    from softhand.material.modulus import material_of as material_of
    from softhand.material.tip import MaterialTip as MaterialTip
    from softhand.material.tip import material_tip as material_tip
    from softhand.patch.bristles import Bristles as Bristles
    from softhand.patch.bristles import BristleState as BristleState
    from softhand.patch.creep import LimitOverTime as LimitOverTime
    from softhand.patch.creep import limit_at_depth as limit_at_depth
    from softhand.patch.creep import limit_under_force as limit_under_force
    from softhand.patch.curved_limit import CurvedLimit as CurvedLimit
    from softhand.patch.patch import Patch as Patch
    from softhand.patch.patch import PatchState as PatchState
    from softhand.plant.plant import Plant as Plant
    from softhand.plant.state import State as State
    from softhand.plots.run import draw_run as draw_run
    from softhand.plots.style import save_figure as save_figure
    from softhand.recording.recording import Recording as Recording
    from softhand.recording.recording import load_recording as load_recording
    from softhand.references.goal import Goal as Goal
    from softhand.references.reference import Reference as Reference
    from softhand.resting.equilibrium import equilibrium as equilibrium
    from softhand.resting.record import Equilibrium as Equilibrium
    from softhand.scenario.file import scenario_names as scenario_names
    from softhand.scenario.file import scenarios as scenarios
    from softhand.scenario.scenario import Scenario as Scenario
    from softhand.scenario.scenario import load_scenario as load_scenario
    from softhand.sensing.observation import Observation as Observation
    from softhand.simulation.pushes import Push as Push
    from softhand.simulation.simulation import Simulation as Simulation
    from softhand.steppers.stepper import Integration as Integration
    from softhand.steppers.stepper import Stepper as Stepper
    from softhand.studies.compare import compare as compare
    from softhand.studies.grasps.cache import GraspCache as GraspCache
    from softhand.studies.grasps.sample import sample_grasps as sample_grasps
    from softhand.studies.sweeps.result import Sweep as Sweep
    from softhand.studies.sweeps.result import load_sweep as load_sweep
    from softhand.studies.sweeps.sweep import sweep as sweep
    from softhand.tactile.pattern import taxel_pattern as taxel_pattern
    from softhand.tuning.record import Tuning as Tuning
    from softhand.tuning.tune import tune as tune
    from softhand.version import __version__ as __version__
    from softhand.viewer.live.replay import view as view
    from softhand.viewer.live.viewer import Viewer as Viewer
    from softhand.viewer.meshcat.viewer import MeshcatViewer as MeshcatViewer
    from softhand.viewer.report.film import write_film as write_film
    from softhand.viewer.report.report import write_report as write_report

_HOMES = {
    "grasping.quality": ("GraspQuality", "grasp_quality"),
    "grasping.placement": ("Placement", "place_object"),
    "grasping.proposals": ("Proposal", "Proposals", "propose_grasps"),
    "grasping.workspace": ("Workspace", "workspace"),
    "analysis.energy": ("Ledger", "energy_ledger"),
    "analysis.incipient_slip": ("incipient_slip",),
    "analysis.tactile": ("Markers", "depth_image", "marker_displacements", "tactile_pressure", "taxel_points"),
    "patch.bristles": ("Bristles", "BristleState"),
    "patch.creep": ("LimitOverTime", "limit_at_depth", "limit_under_force"),
    "patch.curved_limit": ("CurvedLimit",),
    "patch.patch": ("Patch", "PatchState"),
    "assembly.measurement_noise": ("MeasurementNoise", "measurement_noise"),
    "assistant.found_scenario": ("NewScenario",),
    "assistant.new_scenario": ("new_scenario",),
    "batch.rollout": ("rollout",),
    "batch.runs": ("Runs",),
    "checks.check": ("check",),
    "closed_loop.grasp_stiffness": ("GraspStiffness", "grasp_stiffness"),
    "closed_loop.linearize": ("LinearModel", "linearize_plant"),
    "closed_loop.lyapunov": ("Lyapunov", "lyapunov"),
    "assembly.collisions": ("collisions",),
    "collision.record": ("Collision", "Collisions"),
    "margins.along": ("StabilityAlong", "stability_along"),
    "margins.margins": ("Margins",),
    "margins.modes": ("Mode",),
    "margins.stability": ("Stability", "stability"),
    "analysis.summary": ("Summary", "summarize"),
    "assembly.build": ("build", "simulate"),
    "studies.compare": ("compare",),
    "studies.sweeps.result": ("Sweep", "load_sweep"),
    "studies.sweeps.sweep": ("sweep",),
    "studies.grasps.cache": ("GraspCache",),
    "studies.grasps.sample": ("sample_grasps",),
    "tuning.record": ("Tuning",),
    "tuning.tune": ("tune",),
    "controllers.controller": ("Controller",),
    "controllers.linear_set_point": ("LinearSetPoint",),
    "dampings.damping": ("Damping",),
    "design.gain_design": ("GainDesign",),
    "design.gains": ("design_gains",),
    "design.lqr": ("LqrDesign", "design_lqr"),
    "calibration.calibrate": ("calibrate",),
    "calibration.log": ("Log",),
    "calibration.record": ("Calibration",),
    "derivatives.costs": ("FunctionCost", "PeakCost", "QuadraticCost"),
    "derivatives.gradient": ("gradient",),
    "derivatives.gradient_record": ("Gradient",),
    "derivatives.linearization": ("ClosedLoop", "Linearization"),
    "derivatives.linearize": ("linearize",),
    "derivatives.linearizer": ("Linearizer",),
    "errors": (
        "BrowserError",
        "ControllerError",
        "GraspError",
        "LawError",
        "ModelError",
        "RecordingError",
        "RolloutStopped",
        "ScenarioError",
        "ScenarioWarning",
        "SimulationStopped",
        "SofthandError",
        "StudyError",
        "SweepStopped",
    ),
    "export.writing": ("read_mcap", "write_mcap", "write_rrd"),
    "holding.margin": ("SlipMargin", "slip_margin"),
    "holding.curve": ("SqueezeCurve",),
    "holding.record": ("Squeeze",),
    "holding.squeeze": ("squeeze",),
    "holding.push_record": ("WorstPush",),
    "holding.worst_push": ("worst_push",),
    "identification.identify": ("Identification", "identify"),
    "laws.law": ("Law",),
    "plant.state": ("State",),
    "plots": ("draw_run", "save_figure"),
    "recording.recording": ("Recording", "load_recording"),
    "references.goal": ("Goal",),
    "resting.equilibrium": ("equilibrium",),
    "resting.record": ("Equilibrium",),
    "scenario.scenario": ("Scenario", "load_scenario"),
    "scenario.file": ("scenario_names", "scenarios"),
    "sensing.observation": ("Observation",),
    "simulation.pushes": ("Push",),
    "simulation.simulation": ("Simulation",),
    "material.modulus": ("Material", "material_of"),
    "material.tip": ("MaterialTip", "material_tip"),
    "plant.plant": ("Plant",),
    "references.reference": ("Reference",),
    "steppers.stepper": ("Integration", "Stepper"),
    "version": ("__version__",),
    "tactile.pattern": ("taxel_pattern",),
    "viewer.report.film": ("write_film",),
    "viewer.report.report": ("write_report",),
    "viewer.live.replay": ("view",),
    "viewer.live.viewer": ("Viewer",),
    "viewer.meshcat.viewer": ("MeshcatViewer",),
}
_HOME = {name: f"softhand.{home}" for home, names in _HOMES.items() for name in names}
_MODULES = {
    "blocks": "softhand.controllers.blocks",
    **{kind: f"softhand.{kind}" for kind in ("controllers", "dampings", "laws", "references", "steppers")},
}
_MEANT = {
    "run": ("simulate",), "plot": ("draw_run",), "open": ("load_recording",), "read": ("load_recording",),
    "load": ("load_scenario", "load_recording"),
}  # fmt: skip
"""What names of other libraries may mean here."""

__all__ = sorted({*_HOME, "blocks"})


def _find(name: str) -> Any:
    if name in _MODULES:
        return import_module(_MODULES[name])
    if name in _HOME:
        return getattr(import_module(_HOME[name]), name)
    raise AttributeError(f"module 'softhand' has no attribute {name!r}{_hint(name)}")


def _hint(name: str) -> str:
    plugins, guesses = import_module("softhand.plugins"), import_module("softhand.settings.guesses")
    inside = [f"{kind}.{member}" for kind in plugins.SHIPPED for member in plugins.classes(kind)]
    hint: str = guesses.as_question(_MEANT.get(name) or guesses.meant(name, [*__dir__(), *inside]))
    return hint


if not TYPE_CHECKING:  # or else editors take any name for a right one
    __getattr__ = _find


def __dir__() -> list[str]:
    return sorted({*_HOME, *_MODULES})
