"""From a scenario to a simulation that is ready to run."""

from __future__ import annotations

import warnings
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from softhand.assembly.guard import read_guard
from softhand.assembly.parts import read_start
from softhand.assembly.resolve import Setup, resolve
from softhand.assembly.target import doubts_of_target
from softhand.assembly.unread import unread
from softhand.controllers.controller import Controller
from softhand.errors import ScenarioWarning
from softhand.laws.law import Law
from softhand.plant.plant import Plant
from softhand.recording.recording import Recording
from softhand.scenario.scenario import Scenario, as_scenario
from softhand.simulation.keep import Keep
from softhand.simulation.pushes import Push
from softhand.simulation.simulation import Progress, Simulation


def build(
    scenario: Scenario | str | Path,
    controller: Controller | None = None,
    law: Law | None = None,
    overrides: Mapping[str, Any] | None = None,
    **values: Any,
) -> Simulation:
    """Load the model, solve the start and put everything together.

        simulation = softhand.build("target-a", mass=0.3, overrides={"reference.duration": 0.5})

    Args:
        scenario: what to run: from `load_scenario`, the name of one that ships, or the path of a TOML file.
        controller: used in place of the scenario's, for one that is not a plugin.
        law: used at all tips in place of the scenario's fingertip laws, likewise.
        overrides: dotted keys and values put over those of the scenario.
        values: the same by the last part of the key, where there is only one such key.

    Raises:
        ScenarioError: a key, a value, a name or a setting of a plugin is wrong.
        ModelError: a URDF cannot be used.
        GraspError: there is no grasp at rest.
        LawError: the fingertip law cannot be compiled.
    """
    return assemble(resolve(as_scenario(scenario, overrides, **values), controller, law))


def assemble(setup: Setup) -> Simulation:
    """Put everything together.

    Raises:
        LawError: a fingertip law cannot be compiled.
    """
    scenario = setup.scenario
    plant = Plant(setup.world, setup.fingertips, setup.supports, scenario.stepper.terms, setup.taxels)
    return Simulation(
        plant=plant,
        start=plant.with_supports(setup.grasp.state),
        controller=setup.controller,
        stepper=setup.stepper,
        reference=setup.reference.start(read_start(scenario)),
        duration=scenario.duration,
        control_period=scenario.control_period,
        scenario=scenario.to_toml(),
        pushes=[Push(**push.model_dump()) for push in scenario.push],
        keep=_kept(scenario),
        sensing=setup.sensing,
        actuation=setup.actuation,
        guard=read_guard(setup),
    )


def _kept(scenario: Scenario) -> Keep:
    """What the section `record` asks for."""
    everything, record = Keep.all(), scenario.record
    return Keep(
        everything.variables if record.variables is None else record.variables,
        1 if record.every is None else round(record.every / scenario.control_period),
    )


def simulate(
    scenario: Scenario | str | Path,
    controller: Controller | None = None,
    law: Law | None = None,
    progress: Progress | None = None,
    overrides: Mapping[str, Any] | None = None,
    **values: Any,
) -> Recording:
    """Build a scenario and run it.

        recording = softhand.simulate("target-a", mass=0.3)

    Args:
        scenario: as in `build`.
        controller: likewise.
        law: likewise.
        progress: called now and then with the simulated time [s].
        overrides: as in `build`.
        values: likewise.

    Raises:
        SofthandError: as `build` and `Simulation.run`.

    Warns:
        ScenarioWarning: the fingers cannot get to where the reference asks for the object, or the controller does not
            read what an instrument measures.
    """
    setup = resolve(as_scenario(scenario, overrides, **values), controller, law)
    for doubt in (*doubts_of_target(setup), *unread(setup)):
        warnings.warn(doubt, ScenarioWarning, stacklevel=2)
    return assemble(setup).run(progress)
