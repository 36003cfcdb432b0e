"""A mode to look at: the state moved along it, slowly and far enough to be seen, as a recording."""

from __future__ import annotations

import numpy as np

from softhand.assembly.parts import read_start
from softhand.margins.modes import Mode
from softhand.margins.place import Place
from softhand.model.configuration import integrate
from softhand.numerics.arrays import AnyArray, Array
from softhand.plant.state import State
from softhand.recording.recording import Recording
from softhand.sensing.fields import RECORDED, room
from softhand.sensing.sensor import Sensor
from softhand.simulation.keep import Keep
from softhand.simulation.samples import Samples

CYCLES, CYCLE, FRAME = 4, 1.0, 0.02
"""Swings of the picture, the time of each and of a frame [s]."""
_TURN, _SHIFT = 0.15, 5e-3  # largest of any joint or of the object [rad, m]
_PRESSING = 0.8  # share of its depth that a tip may lose or gain
_LEAST = 0.2  # of the size, at the small end


def record_mode(place: Place, mode: Mode) -> Recording:
    """A mode as a recording that viewers, films and reports play.

    A swing takes 1 s, whatever it takes in truth; a motion that does not ring comes and goes once. The picture grows or
    dies out as the mode does, over as many swings, to a fifth at most. Joints and object move by at most 0.15 rad and
    5 mm, and no tip lets go. The attribute `mode` of the recording says what it shows.

    Args:
        place: where.
        mode: of the loop there.
    """
    setup, plant = place.setup, place.plant
    motion = setup.reference.start(read_start(setup.scenario))
    sensor, n = Sensor(plant, motion.desired), plant.world.n_joints
    duration = CYCLES * CYCLE if mode.frequency else 2.0 * CYCLE
    rings = 2.0 * np.pi / CYCLE if mode.frequency else 0.0
    times = np.arange(round(duration / FRAME) + 1) * FRAME
    truth = CYCLES / mode.frequency if mode.frequency else np.inf
    decades = float(np.clip(mode.growth * truth, np.log(_LEAST), -np.log(_LEAST))) if mode.growth else 0.0
    size = np.exp(decades * times / duration - max(decades, 0.0))
    shape = mode.shape / _largest(place, mode.shape)
    swing = np.exp(1j * rings * times)
    sizes = sensor.observation.known.sizes
    live: dict[str, AnyArray] = {
        "observed": sensor.block[: room(sizes, RECORDED)],
        "joint_torque": np.zeros(n),
        "torque_limited": np.zeros(n, np.int8),
        "external_force": plant.external,
    }
    samples = Samples(plant, live, sizes, FRAME, Keep.all())
    amounts = size[:, None] * np.column_stack([swing.real, -swing.imag])
    for k, (time, amount) in enumerate(zip(times, amounts, strict=True)):
        motion.update(place.state.time)
        sensor.observe(beside(place, shape @ amount), float(time))
        samples.record(k, always=True)
    note, scenario = f"{mode}; {_slowness(mode)}", setup.scenario
    scenario = scenario.model_copy(update={"duration": duration, "description": f"Mode: {mode}"})
    return samples.recording(scenario.to_toml(), "", (), {"mode": note})


def _slowness(mode: Mode) -> str:
    if not mode.frequency:
        return "a motion that does not ring, in 2 s"
    return f"shown {mode.frequency * CYCLE:.3g} times as slow as it is"


def beside(place: Place, along: Array) -> State:
    """The state displaced; the contacts follow by rolling."""
    plant, state = place.plant, place.state
    plant.update(state.q, along, state.z)
    z, q = state.z.copy(), state.q.copy()
    z[:, :3] += plant.contacts["deformation_rate"][:, 1:]
    integrate(plant.joints, state.q, along, 1.0, q)
    return State(q, np.zeros_like(state.v), z)


def _largest(place: Place, shape: Array) -> float:
    """By how much a shape is to be divided so that it can be seen and is within bounds."""
    plant, state, n = place.plant, place.state, place.plant.world.n_joints
    bounds = np.full(len(shape), _TURN)
    slides = place.situation().slides
    bounds[:n][slides] = _SHIFT
    bounds[n : n + 3] = _SHIFT
    least = float(np.max(np.hypot(*shape.T) / bounds))
    depth_rates = []
    for part in shape.T:
        plant.update(state.q, part, state.z)
        depth_rates.append(plant.contacts["deformation_rate"][:, 0].copy())
    depth, touches = plant.contacts["deformation"][:, 0], plant.contacts["deformation"][:, 0] > 0.0
    pressed = np.hypot(*depth_rates)[touches] / (_PRESSING * depth[touches])
    return max(least, float(np.max(pressed, initial=0.0)))
