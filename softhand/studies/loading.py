"""Reading a study, and checking it against its scenario before anything runs."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any, NamedTuple

from softhand.batch.variations import varied
from softhand.errors import ScenarioError, SofthandError
from softhand.scenario.instruments import check_variables
from softhand.scenario.scenario import Scenario, load_scenario
from softhand.settings.wording import nearest, show
from softhand.studies.keys import full_key, values_at
from softhand.studies.outcome_settings import READY, Condition, Outcome
from softhand.studies.study import Study, Varied
from softhand.studies.study_file import StudyFile

_NAMES = {"law", "name", "kind"}
_USUAL = tuple(READY)[:3]


class Studied(NamedTuple):
    """A study with its scenario.

    Attributes:
        study: the settings, what varies by full keys.
        base: the scenario with `[set]` put over it.
        table: the same as tables.
        others: tables of the file that belong to somebody else, as they are.
        file: which mistakes are told of.
    """

    study: Study
    base: Scenario
    table: dict[str, Any]
    others: dict[str, Any]
    file: StudyFile


def load_study(source: str | Path, others: tuple[str, ...] = ()) -> Studied:
    """Read and check a study.

    Args:
        source: path of a TOML file.
        others: names of tables that are not the study's own, and are left as they are.

    Raises:
        StudyError: a key or a value is wrong; names file and line.
    """
    return _checked(StudyFile.read(source), others)


def as_study(source: str | Path | Mapping[str, Any], others: tuple[str, ...] = ()) -> Studied:
    """A study by its path, or from tables as the file has them; paths are then relative to the current folder."""
    if isinstance(source, Mapping):
        return _checked(StudyFile(Path("study"), "", dict(source)), others)
    return load_study(source, others)


def _checked(file: StudyFile, others: tuple[str, ...]) -> Studied:
    """Section by section, so that each mistake has its line."""
    table = {key: value for key, value in file.table.items() if key not in others}
    tables = {name: _table(file, table.pop(name, {}), name) for name in ("set", "vary", "outcomes", "success")}
    own = file.section(Study, table, ())
    put = {".".join(keys): value for keys, value in _set_leaves(tables["set"])}
    base = _base(file, own.scenario, tables["set"])
    outcomes = {
        name: file.section(Outcome, {"figure": entry} if isinstance(entry, str) else entry, ["outcomes", name])
        for name, entry in tables["outcomes"].items()
    } or {name: Outcome(figure=name) for name in _USUAL}
    success = {name: file.section(Condition, entry, ["success", name]) for name, entry in tables["success"].items()}
    for name in success.keys() - outcomes.keys():
        near = nearest(name, outcomes)
        hint = f" Did you mean {near}?" if near else ""
        told = f"success.{name}: no outcome has this name.{hint} There are: {', '.join(outcomes)}."
        raise file.error(told, ["success", name])
    _check_recorded(file, own, outcomes, base)
    vary = _vary(file, own, tables["vary"], base)
    study = own.model_copy(update={"set": put, "vary": vary, "outcomes": outcomes, "success": success})
    there = {name: file.table[name] for name in others if name in file.table}
    return Studied(study, base, base.model_dump(exclude_none=True), there, file)


def _table(file: StudyFile, table: Any, name: str) -> dict[str, Any]:
    if not isinstance(table, Mapping):
        raise file.error(f"{name}: got {show(table)}, but it must be a table.", [name], table)
    return dict(table)


def _base(file: StudyFile, name: str, put: Mapping[str, Any]) -> Scenario:
    """The scenario that all runs share."""
    source: str | Path = file.path.parent / name if name.endswith(".toml") else name
    try:
        base = load_scenario(source)
    except ScenarioError as error:
        raise file.error(f"scenario: {error}", ["scenario"], name) from error
    table, values = base.model_dump(exclude_none=True), {}
    keys: tuple[str, ...] = ()
    try:
        for keys, value in _set_leaves(put):
            values[full_key(".".join(keys), table)] = value
        return base.with_values(values_at(values.items(), table)) if values else base
    except ScenarioError as error:
        at = [own for own, _ in _set_leaves(put) if ".".join(own).endswith(getattr(error, "key", "") or "?")]
        keys = at[0] if at else keys
        raise file.error(f"set.{'.'.join(keys)}: {error}", ["set", *keys], getattr(error, "value", None)) from error


def _set_leaves(table: Mapping[str, Any], above: tuple[str, ...] = ()) -> Iterator[tuple[tuple[str, ...], Any]]:
    """Keys and values of `[set]`; a table that names a law, a controller and the like is the whole section."""
    for name, value in table.items():
        keys = (*above, name)
        if isinstance(value, Mapping) and not (len(keys) == 1 and _NAMES & value.keys()):
            yield from _set_leaves(value, keys)
        else:
            yield keys, value


def _vary(file: StudyFile, own: Study, table: Mapping[str, Any], base: Scenario) -> dict[str, Varied]:
    """What varies, by full keys, each of which the scenario takes at its ends."""
    vary: dict[str, Varied] = {}
    known = base.model_dump(exclude_none=True)
    taken: set[str] = set()
    for keys, entry in _vary_leaves(table):
        key, place = ".".join(keys), ["vary", *keys]
        entry_read = file.section(Varied, entry, place)
        if entry_read.is_grid is False and own.sample.method == "grid":
            raise file.error(
                f'vary.{key}: the method "grid" takes values from a grid; give grid = [...] or a range with points, or '
                "a method of [sample] that draws.",
                place,
            )
        try:
            full, *also = (full_key(each, known) for each in (key, *entry_read.also))
            for value in entry_read.ends:
                varied(base, values_at([(each, value) for each in (full, *also)], known), 0)
        except SofthandError as error:
            told = str(error).removeprefix("run 0 ")
            raise file.error(f"vary.{key}: {told}", place, getattr(error, "value", None)) from error
        for each in (full, *also):
            if each in taken:
                raise file.error(f"vary.{key}: {each} is varied twice.", place)
            taken.add(each)
        vary[full] = entry_read.model_copy(update={"also": tuple(also)})
    if own.sample.method != "grid" and vary and all(entry.is_grid for entry in vary.values()):
        told = f"sample: {own.sample.method} has nothing to draw: all that varies is a grid; give a range or a normal."
        raise file.error(told, ["sample", "method"])
    if own.sample.repeats > 1 and base.sensing is None and base.actuation is None:
        raise file.error(
            "sample.repeats: all repeats would be the same run: the scenario has no [sensing] and no [actuation], whose"
            " noise they differ in; leave out repeats, or vary what shall differ.",
            ["sample", "repeats"], own.sample.repeats,
        )  # fmt: skip
    return vary


def _vary_leaves(table: Mapping[str, Any], above: tuple[str, ...] = ()) -> Iterator[tuple[tuple[str, ...], Any]]:
    """Keys and entries of `[vary]`, whose keys may be written as tables in tables."""
    for name, value in table.items():
        inner = isinstance(value, Mapping) and any(isinstance(entry, Mapping) for entry in value.values())
        if inner and not set(value) & set(Varied.model_fields):
            yield from _vary_leaves(value, (*above, name))
        else:
            yield (*above, name), value


def _check_recorded(file: StudyFile, own: Study, outcomes: Mapping[str, Outcome], base: Scenario) -> None:
    """Variables that the scenario records."""
    for name, outcome in outcomes.items():
        if outcome.variable:
            _check_variable(file, outcome.variable, base, ["outcomes", name])
    for variable in own.keep.variables:
        _check_variable(file, variable, base, ["keep", "variables"])


def _check_variable(file: StudyFile, variable: str, base: Scenario, keys: list[str]) -> None:
    try:
        check_variables(
            ".".join(keys), (variable,), base.sensing, base.actuation, base.tactile, base.fingertip.has_elements
        )
    except ScenarioError as error:
        raise file.error(str(error), keys, variable) from error
