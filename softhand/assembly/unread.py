"""Instruments that measure what the controller does not read."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from softhand.assembly.parts import read_start
from softhand.assembly.resolve import Setup
from softhand.controllers.controller import Controller
from softhand.controllers.formula import fields_read
from softhand.plant.plant import Plant
from softhand.plant.state import State
from softhand.plugins import plugin_name
from softhand.sensing.instruments import Instruments
from softhand.sensing.quantities import Channel, Sensing, components
from softhand.sensing.sensor import Sensor

_ERROR = 1e-4  # small, in SI units of anything that is measured


def unread(setup: Setup) -> Iterator[str]:
    """A sentence for each instrument on whose errors nothing depends that the controller reads while it runs."""
    fields, sensing = fields_read(setup.controller), setup.sensing
    if fields is None or sensing is None or type(setup.controller).torque is not Controller.torque:
        return
    plant = Plant(setup.world, setup.fingertips, setup.supports, "compiled", setup.taxels)
    state = plant.with_supports(setup.grasp.state)
    moving = State(state.q, np.linspace(0.01, 0.02, len(state.v)), state.z)
    motion = setup.reference.start(read_start(setup.scenario))
    sensor = Sensor(plant, motion.desired)
    truth = sensor.observe(moving, 0.0)
    sizes = components(setup.world.n_joints, setup.world.n_tips)
    for name in sensing.channels:
        error = Channel(np.zeros(sizes[name]), np.full(sizes[name], _ERROR))
        ideal = Channel(np.zeros(sizes[name]), np.zeros(sizes[name]))
        with_error, without = (
            Instruments(plant, truth, Sensing({name: one}), motion.desired).see(0) for one in (error, ideal)
        )
        if all(np.array_equal(getattr(with_error, field), getattr(without, field), equal_nan=True) for field in fields):
            who = plugin_name("controllers", type(setup.controller))
            yield (
                f"sensing.{name}: the controller {who!r} does not read it while it runs, so that it does nothing but "
                "at the start; leave it out, or choose another controller."
            )
