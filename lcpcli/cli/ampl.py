"""lcp as a solver of AMPL, and of what calls solvers as AMPL does: lcp STUB -AMPL [NAME=VALUE]...

The model in STUB.nl is solved, and the answer is written to STUB.sol, in which solve_result_num says how the run has
ended; its message is printed, too. The exit code is then 0. Options are taken from the environment variable lcp_options
and from the command line.
"""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from contextlib import suppress
from typing import Any, NamedTuple

import numpy as np

from lcpcli.errors import OptionError, count, likely, quoted, visible
from lcpcli.files import atomic_write
from lcpcli.files.contents import within
from lcpcli.files.nl_format import Model, solution_text
from lcpcli.methods.registry import RESTARTS
from lcpcli.model.nonlinear import NonlinearProblem
from lcpcli.options import LIMITS, THREADS, Limits, check
from lcpcli.rational.numbers import approximate, rounded
from lcpcli.solving import driver
from lcpcli.solving.result import Status
from lcpcli.solving.solve_mcp import run_nonlinear
from lcpcli.typing import Vector
from lcpcli.version import VERSION

ENVIRONMENT = "lcp_options"
OPTIONS = {option.name: option for option in (*LIMITS, THREADS, RESTARTS)}
NUMBERS = {  # solve_result_num: 0 solved, 200 to 299 no solution, 400 to 499 a point that is not verified
    Status.SOLVED: 0,
    Status.INFEASIBLE: 200,
    Status.UNSOLVABLE: 201,
    Status.ILL_POSED: 202,
    Status.ITERATION_LIMIT: 400,
    Status.TIME_LIMIT: 401,
    Status.INTERRUPTED: 402,
    Status.STALLED: 403,
    Status.DIVERGED: 404,
    Status.BREAKDOWN: 405,
    Status.RAY: 406,
}
OPTIMA = {"optimal": 0, "unsolvable": 201, "unbounded": 300, "time_limit": 401}  # with an objective
NO_POINT = 500  # of a run without a finite point, unless it proves that there is no solution


class Answer(NamedTuple):
    """How a run has ended, in words and as a solve_result_num, and the unknowns; None if no values were found."""

    message: str
    number: int
    z: Vector | None


def run(stub: str, words: Sequence[str]) -> int:
    """Solve the model in a file, write the answer beside it, and return 0. words : options, each NAME=VALUE."""
    stem = stub.removesuffix(".nl")
    path, written = f"{stem}.nl", f"{stem}.sol"
    if os.path.isfile(written):  # which would stand for the answer if this run is refused or killed
        with suppress(OSError):
            os.unlink(written)
    given = _options([*os.environ.get(ENVIRONMENT, "").split(), *words])
    model = within(path, Model, None, path)
    answer = within(path, _answer, model, given)
    parts = [f"lcp {VERSION}: {answer.message}", model.remark]
    message = visible(" ".join("; ".join(filter(None, parts)).split()))
    print(message)
    has_values = answer.z is not None and bool(np.isfinite(answer.z).all())
    number = answer.number if has_values or 200 <= answer.number < 400 else NO_POINT
    values = model.model.values(answer.z) if answer.z is not None and has_values else np.empty(0)
    atomic_write.write_whole(written, solution_text(model.model.header, message, values, number))
    return 0


def _options(words: Sequence[str]) -> dict[str, Any]:
    """Return the values of options, of which the last one counts where one is given twice."""
    given: dict[str, Any] = {}
    for word in words:
        name, is_there, text = word.partition("=")
        name = name.replace("-", "_")
        if name not in OPTIONS or not is_there:
            raise OptionError(quoted(word), "unknown option", likely(name, [f"{each}=" for each in OPTIONS]))
        try:
            given[name] = OPTIONS[name].kind(text)
        except ValueError:
            raise OptionError(name, f"is {quoted(text)}", f"it must be: {OPTIONS[name].range}") from None
    check(OPTIONS.values(), given)
    return given


def _answer(model: Model, given: Mapping[str, Any]) -> Answer:
    others = {**given}
    limits = Limits.taken_from(others)
    if isinstance(model.problem, NonlinearProblem):
        result = run_nonlinear(model.problem, limits=limits, interrupts="return", **others)
    elif RESTARTS.name in others:
        raise OptionError(RESTARTS.name, "has no effect on a linear model", "leave it out")
    elif (objective := model.objective) is not None:
        from lcpcli.enumeration.optimum import best

        found = best(model.exactly(), *objective, limits.time_limit)
        z = None if found.z is None else rounded(found.z)
        return Answer(found.message(approximate), OPTIMA[found.status], z)
    else:
        result = driver.run(model.problem, "auto", limits=limits, **others)
    words = f"{result.message}; {count(result.iterations, 'iteration')}, residual {result.residual:.3g}"
    return Answer("; ".join(filter(None, [words, result.advice])), NUMBERS[result.status], result.z)
