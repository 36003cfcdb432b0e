"""Tuning: numbers of a scenario are turned until its runs cost less, over many worlds, and judged on others."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from softhand.assembly.resolve import Setup, resolve
from softhand.errors import RolloutStopped, SimulationStopped
from softhand.numerics.arrays import Array
from softhand.scenario.scenario import Scenario
from softhand.settings.wording import choices, show
from softhand.studies.loading import as_study
from softhand.studies.study_file import StudyFile
from softhand.tuning.figures import FIGURES, has_noise
from softhand.tuning.judged import judge
from softhand.tuning.knobs import Knobs, read_knobs, rounded
from softhand.tuning.objective import Objective
from softhand.tuning.record import Tuning, Turn
from softhand.tuning.search import Best, search_cma
from softhand.tuning.settings import Method, Term, Worlds
from softhand.tuning.slopes import RUNS, WITH_SLOPES, Slopes, has_slopes, search_gradient
from softhand.tuning.trials import Trials, Tried
from softhand.tuning.worlds import Drawn, read_worlds

_GO_ON = 8  # held-out worlds, beside the scenario itself, in which runs go on for longer

TABLES = ("tune", "cost", "worlds", "method")
"""What a study has for `tune`, beside `scenario`, `description` and `[set]`."""


class Asked(NamedTuple):
    """A study that was read and checked."""

    base: Scenario
    setup: Setup
    knobs: Knobs
    terms: dict[str, Term]
    worlds: Drawn
    go_on: float
    method: Method
    file: StudyFile


def read_tuning(source: str | Path | Mapping[str, Any]) -> Asked:
    """Read and check a study for `tune`.

    Raises:
        StudyError: a key or a value is wrong; names file and line.
        SofthandError: as `build`, of its scenario.
    """
    studied = as_study(source, TABLES)
    file, base = studied.file, studied.base
    setup = resolve(base)
    tables = {name: studied.others.get(name, {}) for name in TABLES}
    for name, table in tables.items():
        if not isinstance(table, Mapping):
            raise file.error(f"{name}: got {show(table)}, but it must be a table.", [name], table)
    knobs = read_knobs(file, tables["tune"], setup)
    terms = _terms(file, tables["cost"], base)
    own = dict(tables["worlds"])
    vary = own.pop("vary", {})
    if not isinstance(vary, Mapping):
        raise file.error(f"worlds.vary: got {show(vary)}, but it must be a table.", ["worlds", "vary"], vary)
    settings = file.section(Worlds, own, ["worlds"])
    worlds = read_worlds(file, settings, vary, setup)
    for one in knobs.knobs:
        for part in one.parts:
            if part.key in {key.partition("[")[0] for key in worlds.keys}:
                raise file.error(
                    f"tune: {part.key} differs from world to world too; take it out of [tune] or of [worlds.vary].",
                    ["tune"], part.key,
                )  # fmt: skip
    method = file.section(Method, tables["method"], ["method"])
    return Asked(base, setup, knobs, terms, worlds, settings.go_on, method, file)


def _terms(file: StudyFile, table: Mapping[str, Any], base: Scenario) -> dict[str, Term]:
    terms = {}
    for name, entry in table.items():
        if name not in FIGURES:
            raise file.error(f"cost.{name}: no figure has this name. {choices(name, FIGURES)}", ["cost", name], entry)
        is_number = isinstance(entry, int | float) and not isinstance(entry, bool)
        terms[name] = file.section(Term, {"weight": entry} if is_number else entry, ["cost", name])
    if not any(term.weight for term in terms.values()):
        raise file.error(
            f"cost: no figure has a weight, so that nothing is to be made less; give one, such as settling = 1.0. "
            f"There are: {', '.join(FIGURES)}.",
            ["cost"],
        )  # fmt: skip
    if "scatter" in terms and not has_noise(base):
        raise file.error(
            "cost.scatter: nothing is noisy in this scenario; give an instrument of [sensing] or the drives of "
            "[actuation] a noise, or leave scatter out.",
            ["cost", "scatter"],
        )
    return terms


def tune(
    study: str | Path | Mapping[str, Any],
    threads: int | None = None,
    progress: Callable[[float], None] | None = None,
) -> Tuning:
    """Turn numbers of a scenario until its runs cost less, over many worlds, and judge what was found on others.

        found = softhand.tune("study.toml")
        print(found, found.reasons)
        found.scenario.replace(mass=0.25)

    The same study gives the same result, for any number of threads.

    Args:
        study: path of a TOML file, docs/tune.md, or its tables; paths in these are relative to the current folder.
        threads: at work at the same time; as many as there are processors if not given.
        progress: called with the share that is done.

    Raises:
        StudyError: a key or a value of the study is wrong; names file and line.
        SofthandError: as `build`, of its scenario; or a package is missing.
        SimulationStopped: interrupted; carries the best numbers so far in `.rows`.
    """
    asked = read_tuning(study)
    search, held_out = asked.worlds.search, asked.worlds.held_out
    candidates = max(asked.method.runs // len(search), 1)
    some = [{}, *held_out[:_GO_ON]]
    total = candidates * len(search) + 2 * (len(held_out) + len(some))
    done = 0

    def tell(more: int) -> None:
        nonlocal done
        done += more
        if progress is not None:
            progress(min(done / total, 1.0))

    name = _search_of(asked)
    trials = Trials(asked.setup.scenario, tuple(asked.terms), threads, tell)
    best = Best(asked.knobs.start, np.inf)
    try:
        first = trials.run([{}], search)
        _check_start(asked, first)
        objective = Objective(asked.terms, asked.method, first.figures[0])

        def cost(points: Sequence[Array]) -> list[float]:
            tables = [asked.knobs.values(asked.knobs.numbers(point)) for point in points]
            tried = trials.run(tables, search)
            return [objective(one, lost) for one, lost in zip(tried.figures, tried.lost, strict=True)]

        is_within = all(knob.low <= knob.start <= knob.high for knob in asked.knobs.knobs)
        best.take([best.point], [objective(first.figures[0], first.lost[0])] if is_within else cost([best.point]))
        if name == "gradient":
            slopes = Slopes(asked.setup.scenario, asked.knobs, search, trials.names, trials.count)
            search_gradient(slopes, objective, best, max((candidates - 1) // (RUNS * len(asked.terms)), 1))
        else:
            search_cma(cost, best, asked.method, candidates - 1)
        spent = trials.done
        numbers = [
            rounded(knob, one) for knob, one in zip(asked.knobs.knobs, asked.knobs.numbers(best.point), strict=True)
        ]
        values = asked.knobs.values(numbers)
        before, after = trials.run([{}], held_out), trials.run([values], held_out)
        longer = Trials(asked.setup.scenario, ("settling",), threads, tell).run([{}, values], some, asked.go_on)
    except (RolloutStopped, KeyboardInterrupt) as stop:
        raise _interrupted(asked.knobs, best, trials.done) from stop
    until = asked.go_on * asked.base.duration * (1.0 - 1e-9)
    first_astray, astray = np.mean((longer.lost > 0.0) | (longer.figures[..., 0] >= until), axis=1).tolist()
    judged = judge(asked.terms, objective.bounds, before, after, (first_astray, astray))
    turned = tuple(
        Turn(knob.name, knob.unit, knob.low, knob.high, knob.is_log, knob.start, number)
        for knob, number in zip(asked.knobs.knobs, numbers, strict=True)
    )
    each = len(search) * (RUNS * len(asked.terms) if name == "gradient" else 1)
    history = np.array([(each * count, value) for count, value in best.history])
    return Tuning(
        turned, judged.figures, judged.lost, judged.astray, asked.go_on, judged.gain, not judged.reasons,
        judged.reasons,
        (len(search), len(held_out)), (spent, trials.done - spent), name, history,
        np.concatenate([before.figures, after.figures]), asked.base.with_values(values), asked.base,
    )  # fmt: skip


def _search_of(asked: Asked) -> str:
    """The method, by name."""
    names = tuple(asked.terms)
    able = has_slopes(asked.base, names)
    if asked.method.name == "auto":
        return "gradient" if able else "cma"
    if asked.method.name == "gradient" and not able:
        others = [name for name in names if name not in WITH_SLOPES]
        what = f"{', '.join(others)} has none" if others else (
            "there is none of a run with instruments, drives or another stepper than midpoint")  # fmt: skip
        raise asked.file.error(
            f'method.name: "gradient" needs the gradient of all costs, and {what}. These have one: '
            f'{", ".join(WITH_SLOPES)}; or choose "cma".',
            ["method", "name"], "gradient",
        )  # fmt: skip
    return asked.method.name


def _check_start(asked: Asked, first: Tried) -> None:
    """What is turned has to be compared with something."""
    there = first.lost[0] == 0.0
    if not np.any(there):
        reason, message = next(iter(first.why.items()))
        raise asked.file.error(
            f"scenario: it is lost in all {first.lost.size} worlds as it is ({reason}: {message}), so that nothing can "
            "be better than before; begin with one that holds its object in some.",
            ["scenario"],
        )
    for k, name in enumerate(asked.terms):
        if np.any(np.isnan(first.figures[0][there, k])):
            raise asked.file.error(
                f"cost.{name}: it is not defined in this scenario, whose target is where it starts; leave it out.",
                ["cost", name],
            )


def _interrupted(knobs: Knobs, best: Best, runs: int) -> SimulationStopped:
    rows = {knob.name: number for knob, number in zip(knobs.knobs, knobs.numbers(best.point), strict=True)}
    if not np.isfinite(best.cost):
        return SimulationStopped("interrupted before the first generation was done.", rows={}, reason="interrupted")
    told = ", ".join(f"{name} = {number:.5g}" for name, number in rows.items())
    return SimulationStopped(
        f"interrupted after {runs} runs. The best so far, at a cost of {best.cost:.4g} and not judged in other "
        f"worlds: {told}.",
        rows=rows, reason="interrupted",
    )  # fmt: skip
