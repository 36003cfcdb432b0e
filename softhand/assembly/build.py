"""From a scenario to a simulation that is ready to run."""

from __future__ import annotations

from softhand.assembly.parts import read_controller, read_reference, read_start, read_stepper, resolved
from softhand.assembly.plant import read_grasp, read_supports, read_world
from softhand.controllers.controller import Controller
from softhand.laws.law import Law
from softhand.plant.plant import Plant
from softhand.recording.recording import Recording
from softhand.scenario.scenario import Scenario
from softhand.simulation.pushes import Push
from softhand.simulation.simulation import Progress, Simulation


def build(scenario: Scenario, controller: Controller | None = None, law: Law | None = None) -> Simulation:
    """Load the model, solve the start and put everything together.

    Args:
        scenario: what to run.
        controller: used in place of the scenario's, for one that is not a plugin.
        law: used at all tips in place of the scenario's fingertip laws, likewise.

    Raises:
        ScenarioError: a name or a setting of a plugin is wrong.
        ModelError: a URDF cannot be used.
        GraspError: there is no grasp at rest.
        LawError: the fingertip law cannot be compiled.
    """
    controller = controller or read_controller(scenario)
    stepper, reference = read_stepper(scenario), read_reference(scenario)
    world = read_world(scenario)
    fingertips, grasp = read_grasp(scenario, world, law)
    plant = Plant(world, fingertips, read_supports(scenario, world, fingertips))
    return Simulation(
        plant=plant,
        start=plant.with_supports(grasp.state),
        controller=controller,
        stepper=stepper,
        reference=reference.start(read_start(scenario)),
        duration=scenario.duration,
        control_period=scenario.control_period,
        scenario=resolved(scenario, law, controller, stepper, reference).to_toml(),
        pushes=[Push(**push.model_dump()) for push in scenario.push],
    )


def simulate(
    scenario: Scenario,
    controller: Controller | None = None,
    law: Law | None = None,
    progress: Progress | None = None,
) -> Recording:
    """Build a scenario and run it.

    Args:
        scenario: what to run, from `load_scenario`.
        controller: used in place of the scenario's, for one that is not a plugin.
        law: used at all tips in place of the scenario's fingertip laws, likewise.
        progress: called now and then with the simulated time [s].

    Raises:
        SofthandError: as `build` and `Simulation.run`.
    """
    return build(scenario, controller, law).run(progress)
