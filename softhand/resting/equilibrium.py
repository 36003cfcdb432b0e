"""Where hand and object come to rest from a state, under given torques or under a controller."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pinocchio as pin
from numpy.typing import NDArray

from softhand.assembly.build import assemble
from softhand.assembly.parts import read_start
from softhand.assembly.probe import Probe
from softhand.closed_loop.linearize import linearize_plant
from softhand.closed_loop.start import goal_of
from softhand.controllers.controller import Controller
from softhand.derivatives.situation import Situation, find_situation
from softhand.errors import GraspError, ScenarioError
from softhand.laws.law import Law
from softhand.margins.groups import Groups
from softhand.margins.loop import close_loop
from softhand.margins.modes import find_modes
from softhand.margins.place import held_pose
from softhand.model.configuration import integrate
from softhand.model.world import joints_of
from softhand.numerics.arrays import Array
from softhand.plant.state import State
from softhand.recording.recording import Recording
from softhand.references.reference import Motion, resting
from softhand.resting.balance import Balance, Found, Point
from softhand.resting.record import Equilibrium, Limit, direction
from softhand.resting.torques import ControllerTorques, HeldTorques, Torques
from softhand.resting.way import Travel, travel
from softhand.scenario.scenario import Scenario
from softhand.simulation.pushes import Push, Pushes

_FIRST = 0.02  # of the way of a reference
_AT_LIMIT, _NEARLY = 1.0 - 1e-6, 0.99  # use of the limit surface, at rest and a step before it is lost
_FALLS = 1e-3  # [m]


def equilibrium(
    source: Scenario | Recording | str | Path,
    sample: int = 0,
    *,
    time: float | None = None,
    torque: Sequence[float] | Array | None = None,
    state: State | None = None,
    controller: Controller | None = None,
    law: Law | None = None,
    overrides: Mapping[str, Any] | None = None,
    progress: Callable[[float], None] | None = None,
    **values: Any,
) -> Equilibrium:
    """Where hand and object come to rest from a state, under a controller or under held torques.

        rest = softhand.equilibrium("target-a")            # where the reference ends
        softhand.linearize("target-a", state=rest.state)
        softhand.equilibrium("hold", torque=torque)        # under torques of yours

    At rest v = 0, forces and moments on all joints and on the object add up to zero, and what the controller remembers
    stays. Sticking tips make rest depend on the way there, as z follows it by rolling, z' = J_delta^-1 J v, and slip
    takes from it. What is found is the rest of the quasi-static way from the given state, in balance at each point:

    1. The state is taken without its velocity. What is not in balance there is held from outside and let go in
       proportion, R(q, z) = (1 - s) R(0), s from 0 to 1.
    2. The reference is followed from the time of the state to `time`, as slowly as it takes.

    Where nothing is in balance any more, at a limit of friction or torque, hand and object give way: they move as if
    all their speed were taken at once, M q' = R T, until they rest or the object has fallen. A run goes there with
    speed and swings; its rest is the same to first order in the way, and differs by what z gains on the loop between
    both ways, and by slip of its swings.

    Args:
        source: a scenario, its name or path, or a recording.
        sample: as in `linearize`: control period of the run of a scenario, or sample of a recording.
        time: up to which the reference is followed [s]; by default to where it comes to rest for good, and not at all
            with `torque` or if it does not say where it rests. Whole control periods.
        torque: held [N m, N], shape (n,), in place of those of the controller; cut to the effort limits.
        state: in place of that of the sample.
        controller: in place of the scenario's.
        law: at all tips in place of the scenario's.
        overrides: dotted keys and values put over those of the scenario, not of a recording.
        progress: called with the share of the way that is gone.
        values: the same by the last part of the key.

    Returns:
        The rest; or, with `refusal`, how far the balance went, and what is left there.

    Raises:
        ScenarioError: the sample is none of the run, the state or torque is none of this plant, or the time lies before
            the state.
        RecordingError: the recording lacks what tells its states, or has no number there.
        ControllerError: the controller fails on the way.
        SofthandError: as `build`.
    """
    at = find_situation(source, sample, state, torque, controller, law, overrides, values)
    motion = at.setup.reference.start(read_start(at.setup.scenario))
    end = _end(at, motion, time, torque is not None)
    return _Work(at, motion, end, torque is not None).result(progress or (lambda share: None))


def _end(at: Situation, motion: Motion, time: float | None, is_held: bool) -> float:
    """Time at which it rests [s]."""
    begin, period = float(at.state.time), at.setup.scenario.control_period
    if time is None:
        last = begin if is_held or not motion.stops else max(begin, *motion.stops)
        return round(math.ceil(last / period - 1e-9) * period, 12) if last > begin else begin
    if not (isinstance(time, int | float) and math.isfinite(time) and time >= begin - 1e-12):
        raise ScenarioError(
            f"time: got {time!r}; give a time [s] not before that of the state, {begin:g} s.", key="time", value=time
        )
    return round(round(time / period) * period, 12)


class _Work:
    """One search."""

    def __init__(self, at: Situation, motion: Motion, end: float, is_held: bool) -> None:
        self.at, self.motion, self.end, self.is_held = at, motion, end, is_held
        self.plant = at.probe.plant
        self.asked = resting(goal_of(motion.update(at.state.time)))
        self.probe = Probe(self.plant, self.asked)
        self.period = at.period
        begin = at.state
        self.start = Point(State(begin.q, np.zeros_like(begin.v), begin.z, begin.time), at.memory)
        pushes = Pushes(self.plant, [Push(**push.model_dump()) for push in at.setup.scenario.push])
        self.torques: Torques
        if is_held:
            self.torques = HeldTorques(np.array(at.torque))
        else:
            self.torques = ControllerTorques(
                at.setup.controller, self.probe, self.start.state, at.memory, self.period, self._ways()
            )
        self.balance = Balance(self.plant, self.torques, pushes, self.start)

    def result(self, tell: Callable[[float], None]) -> Equilibrium:
        """The rest, or what is left."""
        self.plant.update(*self.start.state.arrays)
        touching = self.plant.contacts["force"][:, 2] > 0.0
        for name in ("slip_travel", "slip_twist"):
            self.plant.contacts[name] = 0.0
        balance, t0 = self.balance, float(self.start.state.time)
        nothing = np.zeros(balance.size)
        left = balance.at(self.start, nothing).left
        done = let_go = travel(balance, self.start, lambda share: (1.0 - share) * left, lambda share: None, 1.0)
        if not done.fell and self.end > t0:
            begin = done.point._replace(state=replace(done.point.state, time=self.end))

            def ask(share: float) -> None:
                tell(share)
                self._ask(share)

            done = travel(balance, begin, lambda share: nothing, ask, _FIRST)
        return self._told(let_go, done, touching)

    def _ask(self, share: float) -> None:
        t0 = float(self.start.state.time)
        time = t0 + share * (self.end - t0)
        self.asked.now[0] = goal_of(self.motion.update(time)).row()
        self.torques.set_time(time)

    def _ways(self) -> list[Callable[[float], State]]:
        """Displacements of joints and object, the contacts rolling."""
        plant, start = self.plant, self.start.state

        def along(k: int, h: float) -> State:
            way, q = np.zeros_like(start.v), start.q.copy()
            way[k] = h
            plant.update(start.q, way, start.z)
            z = start.z.copy()
            z[:, :3] += plant.contacts["deformation_rate"][:, 1:]
            integrate(plant.joints, start.q, way, 1.0, q)
            return State(q, start.v, z, start.time)

        return [lambda h, k=k: along(k, h) for k in range(len(start.v))]  # type: ignore[misc]

    def _told(self, let_go: Travel, done: Travel, touching: NDArray[np.bool_]) -> Equilibrium:
        """The last point in balance, in words and numbers."""
        plant, world = self.plant, self.plant.world
        where = done.stuck if done.fell and done.stuck else done.point
        found = self.balance.at(where, np.zeros(self.balance.size))
        begin = self.start.state.q
        q, contacts, nt, n = found.state.q, plant.contacts, world.n_tips, world.n_joints
        R, R0 = world.object_rotation(q), world.object_rotation(begin)
        torque = self.balance.torque(found.command)
        effort = world.effort_limit
        left = found.left[n : n + 6]
        world_force = np.einsum("kab,kb->ka", contacts["rotation"], contacts["force"][:, :3])
        limits = tuple(self._limits(found, touching, _NEARLY if done.fell else _AT_LIMIT))
        refusal = self._refusal(let_go, done, limits, self._left(found.left, R)) if done.fell else None
        growth, growing = (math.nan, "") if refusal else self._growth(where, torque)
        return Equilibrium(
            refusal=refusal,
            time=float(self._time(done, let_go)),
            joints=tuple(world.joint_names),
            tips=plant.contact_names[:nt],
            supports=plant.contact_names[nt:],
            joint_position=joints_of(world, q),
            object_position=np.array(world.object_position(q)),
            object_rpy=np.array(pin.rpy.matrixToRpy(R)),
            moved=np.concatenate(
                [world.object_position(q) - world.object_position(self.start.state.q), pin.log3(R @ R0.T)]
            ),
            torque=torque,
            torque_use=np.divide(np.abs(torque), effort, out=np.zeros(n), where=np.isfinite(effort) & (effort > 0.0)),
            force=world_force[:nt],
            normal_force=contacts["force"][:nt, 2].copy(),
            torsion=contacts["force"][:nt, 3].copy(),
            limit_surface_use=contacts["limit_surface_use"][:nt].copy(),
            slipped=contacts["slip_travel"][:nt].copy(),
            support_force=world_force[nt:],
            limits=limits,
            share=done.share,
            gave_way=bool(let_go.gave_way or done.gave_way),
            unbalanced=np.concatenate([R @ left[:3], R @ left[3:]]),
            torque_left=found.left[:n].copy(),
            growth=growth,
            growing=growing,
            nearest=self._saved(where, torque),
        )

    def _limits(self, found: Found, touching: NDArray[np.bool_], slips: float) -> Iterator[Limit]:
        plant, world = self.plant, self.plant.world
        for name, pad, contact, touched in zip(plant.contact_names, plant.pads, plant.contacts, touching, strict=True):
            presses = contact["force"][2] > 0.0
            if presses and pad["can_slip"] and contact["limit_surface_use"] > slips:
                yield Limit("slip", name)
            if touched and not presses:
                yield Limit("lift-off", name)
        for name, command, limit in zip(world.joint_names, found.command, world.effort_limit, strict=True):
            if abs(command) >= limit:
                yield Limit("effort limit", name)
        lower, upper = world.position_limits
        for name, angle, least, most in zip(
            world.joint_names, joints_of(world, found.state.q), lower, upper, strict=True
        ):
            if not least <= angle <= most:
                yield Limit("joint limit", name)

    def _time(self, done: Travel, let_go: Travel) -> float:
        """Up to which the reference was followed [s]."""
        t0 = float(self.start.state.time)
        return t0 if done is let_go else t0 + done.share * (self.end - t0)

    def _left(self, left: Array, R: Array) -> str:
        """The larger part of what is left, in words: the force on the object, or the torque of a joint."""
        world, n = self.plant.world, self.plant.world.n_joints
        force = R @ left[n : n + 3]
        j = int(np.argmax(np.abs(left[:n])))
        slides = bool(self.balance.is_length[j])
        if np.abs(left[j]) / (1.0 if slides else self.balance.length) > np.linalg.norm(force):
            return f"{abs(left[j]):.3g} {'N' if slides else 'N m'} at {world.joint_names[j]}"
        return f"{np.linalg.norm(force):.3g} N on the object along {direction(-force)}"

    def _refusal(self, let_go: Travel, done: Travel, limits: tuple[Limit, ...], left: str) -> GraspError:
        """Why there is none: where balance ends, what is left there, and where the object goes."""
        world, stuck = self.plant.world, done.stuck or done.point
        way = world.object_position(done.point.state.q) - world.object_position(stuck.state.q)
        far = float(np.linalg.norm(way))
        told = f"there is no rest: the reference can be followed to t = {self._time(done, let_go):.4g} s"
        if let_go.fell:
            told = f"there is no rest: {100.0 * done.share:.3g} % of what holds the given state can be let go"
        if limits:
            told += f", where {', '.join(f'{one.where} is at its limit ({one.what})' for one in limits)}"
        told += f"; {left} would still have to be held" if let_go.fell else ""
        then = f"the object goes along {direction(way)}" if far > _FALLS else "hand and object do not come to rest"
        told += f"; then {then}" if done.point is not stuck else ""
        told += f"; balance was lost {done.gave_way} times before, and found again" if done.gave_way > 1 else ""
        told += f" until {done.fault}, where the fingertip model ends" if done.fault else ""
        return GraspError(f"{told}.", finger=limits[0].where if limits else "", quantity="rest", value=done.share)

    def _growth(self, where: Point, torque: Array) -> tuple[float, str]:
        """Of small motions beside a rest [1/s], and what moves most in the fastest."""
        state = where.state
        if not self.is_held:
            setup = self.at.setup
            goal = goal_of(self.motion.update(state.time))
            place = held_pose(setup, goal, state, state.time, "the rest")
            assert isinstance(self.torques, ControllerTorques)
            place = replace(place, memory=self.torques.before(state, where.memory), has_memory=True)
            mode = find_modes(close_loop(place), Groups(self.plant, state.q))[0]
            return mode.growth, mode.name
        model = linearize_plant(self.plant, state, torque)
        values, ways = np.linalg.eig(model.A)
        k = int(np.argmax(values.real))
        moving = np.abs(ways[: len(state.v), k]) * self.balance.weights[: len(state.v)]
        return float(values.real[k]), model.states[int(np.argmax(moving))]

    def _saved(self, where: Point, torque: Array) -> State:
        """The state as a run goes on from it: the controller with its memory."""
        plain = State(where.state.q, where.state.v, where.state.z, where.state.time)
        if self.is_held:
            return plain
        simulation = assemble(self.at.setup)
        simulation.reset(plain)
        saved = simulation.save()
        assert saved.carried is not None and isinstance(self.torques, ControllerTorques)
        loop = {**saved.carried.loop, "torque": torque.copy(), "has_memory": np.array([True])}
        memory = self.torques.before(plain, where.memory)
        return replace(saved, carried=replace(saved.carried, loop=loop, memory=memory))
