"""Names of fingertip laws, dampings, controllers, references and steppers: those that ship, and those of others.

A package adds one by an entry point in its pyproject.toml, for instance

    [project.entry-points."softhand.laws"]
    gel = "my_package.gel:Gel"

A user adds the classes of a single file for one process with `load_plugin_file`, under their names in small letters
with hyphens: `SoftGel` is `soft-gel`. No scenario can do that.
"""

from __future__ import annotations

import inspect
import os
import re
import sys
from collections.abc import Callable, Sequence
from functools import lru_cache
from importlib import import_module
from importlib.metadata import EntryPoint, entry_points
from importlib.util import module_from_spec, spec_from_file_location
from pathlib import Path
from typing import Any

from softhand.errors import ScenarioError
from softhand.settings.failures import failure
from softhand.settings.guesses import did_you_mean
from softhand.settings.wording import nearest

SHIPPED: dict[str, dict[str, str]] = {
    "laws": {
        "nakashima": "softhand.laws.nakashima:Nakashima",
        "conservative": "softhand.laws.conservative:Conservative",
        "hemisphere": "softhand.laws.hemisphere:Hemisphere",
        "radial": "softhand.laws.radial:Radial",
        "parallel-distributed": "softhand.laws.parallel_distributed:ParallelDistributed",
        "planar": "softhand.laws.planar:Planar",
        "tabulated": "softhand.laws.tabulated:Tabulated",
        "hertz": "softhand.laws.hertz:Hertz",
        "power": "softhand.laws.power:Power",
        "point": "softhand.laws.point:Point",
        "fingerpad": "softhand.laws.fingerpad:Fingerpad",
        "bulk": "softhand.laws.bulk:Bulk",
    },
    "dampings": {
        "kelvin-voigt": "softhand.dampings.kelvin_voigt:KelvinVoigt",
        "hunt-crossley": "softhand.dampings.hunt_crossley:HuntCrossley",
        "fung": "softhand.dampings.fung:Fung",
    },
    "controllers": {
        "regulation": "softhand.controllers.regulation:Regulation",
        "least-squeeze": "softhand.controllers.least_squeeze:LeastSqueeze",
        "finger-only": "softhand.controllers.finger_only:FingerOnly",
        "point-contact": "softhand.controllers.point_contact:PointContact",
        "object-impedance": "softhand.controllers.object_impedance:ObjectImpedance",
        "computed-torque": "softhand.controllers.computed_torque:ComputedTorque",
        "state-feedback": "softhand.controllers.state_feedback:StateFeedback",
        "blind": "softhand.controllers.blind:Blind",
        "opposing": "softhand.controllers.opposing:Opposing",
        "angle-feedback": "softhand.controllers.angle_feedback:AngleFeedback",
        "two-phase": "softhand.controllers.two_phase:TwoPhase",
        "set-points": "softhand.controllers.set_points:SetPoints",
        "pick-and-place": "softhand.controllers.pick_and_place:PickAndPlace",
        "arm-pick-and-place": "softhand.controllers.arm_pick_and_place:ArmPickAndPlace",
    },
    "references": {
        "hold": "softhand.references.hold:Hold",
        "step": "softhand.references.straight:Step",
        "minimum-jerk": "softhand.references.straight:MinimumJerk",
        "waypoints": "softhand.references.waypoints:Waypoints",
    },
    "steppers": {
        "midpoint": "softhand.steppers.midpoint:Midpoint",
        "rk4": "softhand.steppers.rk4:RungeKutta4",
        "semi-implicit-euler": "softhand.steppers.semi_implicit_euler:SemiImplicitEuler",
        "adaptive": "softhand.steppers.adaptive:Adaptive",
    },
}

_BASES = {
    "laws": "softhand.laws.law:Law",
    "dampings": "softhand.dampings.damping:Damping",
    "controllers": "softhand.controllers.controller:Controller",
    "references": "softhand.references.reference:Reference",
    "steppers": "softhand.steppers.stepper:Stepper",
}


def classes(kind: str) -> dict[str, str]:
    """Where the classes of a kind that ship are, by their names, its base first: `Law`, `Nakashima`, ..."""
    return {target.rpartition(":")[2]: target for target in (_BASES[kind], *SHIPPED[kind].values())}


def attributes(kind: str) -> tuple[Callable[[str], Any], Callable[[], list[str]]]:
    """`__getattr__` and `__dir__` of the package of a kind: its classes, each imported when it is asked for."""
    named = classes(kind)

    def find(name: str) -> Any:
        if name not in named:
            hint = did_you_mean(name, named) or f"; there are: {', '.join(named)}"
            raise AttributeError(f"module 'softhand.{kind}' has no attribute {name!r}{hint}")
        return _load(named[name])

    return find, lambda: list(named)


_files: list[Path] = []
_from_files: dict[str, dict[str, type[Any]]] = {kind: {} for kind in SHIPPED}


def load_plugin_file(file: Path) -> list[str]:
    """Run a Python file and add the plugins that it defines.

    Returns:
        Their names.

    Raises:
        ScenarioError: the file cannot be run, defines none, or one of a name that is taken.
    """
    spec = spec_from_file_location(f"softhand_plugin_{len(_files)}_{file.stem}", file)
    if file.suffix != ".py" or not file.is_file() or spec is None or spec.loader is None:
        raise ScenarioError(f"{file}: this is no Python file; --plugin needs one, such as gel.py.", value=str(file))
    module = module_from_spec(spec)
    sys.modules[module.__name__] = module  # formulas of laws are compiled by the module that they are in
    try:
        spec.loader.exec_module(module)
    except (Exception, SystemExit) as error:
        why = failure(error, spec.origin or file)
        raise ScenarioError(f"{file}: this plugin cannot be run: {why}; mend it.", value=str(file)) from error
    own = [item for item in vars(module).values() if inspect.isclass(item) and item.__module__ == module.__name__]
    found = [(kind, item) for kind, base in _BASES.items() for item in own if issubclass(item, _load(base))]
    if not found:
        bases = ", ".join(base.rpartition(":")[2] for base in _BASES.values())
        raise ScenarioError(f"{file}: no subclass of {bases} is defined in it.", value=str(file))
    names = []
    for kind, item in found:
        name = re.sub(r"(?<=[a-z0-9])(?=[A-Z])", "-", item.__name__).lower()
        if name in plugin_names(kind):
            raise ScenarioError(f'{file}: there is a {kind[:-1]} "{name}" already; rename {item.__name__}.', value=name)
        _from_files[kind][name] = item
        names.append(name)
    _files.append(file)
    return names


def load_plugin_files(files: Sequence[Path]) -> None:
    """`load_plugin_file` for each: what a further process needs to know as much as this one."""
    for file in files:
        load_plugin_file(file)


def plugin_files() -> tuple[Path, ...]:
    """The files loaded so far."""
    return tuple(_files)


def plugin_names(kind: str) -> list[str]:
    """Names of one kind, a key of `SHIPPED`: shipped first, then those of other packages and files."""
    return list(SHIPPED[kind]) + sorted({*_foreign(kind), *_from_files[kind]} - set(SHIPPED[kind]))


def find_plugin(kind: str, name: str, key: str) -> type[Any]:
    """The class of that name.

    Args:
        kind: a key of `SHIPPED`.
        name: as in a scenario.
        key: key of the scenario that holds the name, for the message.

    Raises:
        ScenarioError: unknown name, or what the entry point names cannot be imported or is of another kind.
    """
    if name in SHIPPED[kind]:
        return _load(SHIPPED[kind][name])
    if name in _from_files[kind]:
        return _from_files[kind][name]
    entry = _foreign(kind).get(name)
    if entry is None:
        near = nearest(name, plugin_names(kind))
        hint = f' Did you mean "{near}"?' if near else ""
        names = ", ".join(plugin_names(kind))
        raise ScenarioError(f'{key}: no {kind[:-1]} is called "{name}".{hint} There are: {names}.', key=key, value=name)
    try:
        found = entry.load()
    except Exception as error:
        raise ScenarioError(
            f'{key}: the {kind[:-1]} "{name}" of the entry point {entry.value} cannot be imported: {failure(error)}.',
            key=key,
            value=name,
        ) from error
    base = _load(_BASES[kind])
    if not (inspect.isclass(found) and issubclass(found, base)):
        raise ScenarioError(
            f'{key}: "{name}" ({entry.value}) is no subclass of softhand.{base.__name__}.', key=key, value=name
        )
    return found


def plugin_name(kind: str, plugin: type[Any]) -> str:
    """The name of a class of a kind; that of the class itself if it was handed over without being known."""
    target = f"{plugin.__module__}:{plugin.__qualname__}"
    known = [name for name, other in SHIPPED[kind].items() if other == target]
    known += [name for name, other in _from_files[kind].items() if other is plugin]
    if not known:
        known = [name for name, entry in _foreign(kind).items() if _loads(entry, plugin)]
    return known[0] if known else plugin.__name__


def _loads(entry: EntryPoint, plugin: type[Any]) -> bool:
    try:
        return entry.load() is plugin
    except Exception:  # told where it is asked for
        return False


def describe_plugin(kind: str, name: str) -> str:
    """First line of the docstring of a plugin."""
    documentation = inspect.getdoc(find_plugin(kind, name, kind)) or ""
    return documentation.splitlines()[0] if documentation else ""


def _load(target: str) -> type[Any]:
    module, _, name = target.partition(":")
    return getattr(import_module(module), name)


def _foreign(kind: str) -> dict[str, EntryPoint]:
    return _listed(kind, tuple(map(_stamp, sys.path)))


@lru_cache(maxsize=16)
def _listed(kind: str, _stamps: tuple[tuple[str, int], ...]) -> dict[str, EntryPoint]:
    """Looked up anew, which takes some milliseconds, when packages have come or gone."""
    return {entry.name: entry for entry in entry_points(group=f"softhand.{kind}")}


def _stamp(folder: str) -> tuple[str, int]:
    """A place where packages are, and when one was last put there or taken away [ns]."""
    try:
        return folder, os.stat(folder or ".").st_mtime_ns
    except OSError:
        return folder, 0
