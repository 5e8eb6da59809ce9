"""lcp as a solver of AMPL, and of what calls solvers as AMPL does: lcp STUB -AMPL [NAME=VALUE]...

The model in STUB.nl is solved, and the answer is written to STUB.sol, in which solve_result_num says how the run has
ended; the exit code is then 0. Options are taken from the environment variable lcp_options and from the command line.
"""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from contextlib import suppress
from typing import Any

from lcpcli.errors import OptionError, likely, quoted
from lcpcli.files import atomic_write
from lcpcli.files.contents import content_of, within
from lcpcli.files.nl_format import Model
from lcpcli.files.reading import WHOLE
from lcpcli.files.sol_format import solution_text
from lcpcli.methods.registry import RESTARTS
from lcpcli.model.nonlinear import NonlinearProblem
from lcpcli.options import LIMITS, THREADS, Limits, check
from lcpcli.solving import driver
from lcpcli.solving.result import Result
from lcpcli.solving.solve_mcp import run_nonlinear
from lcpcli.solving.status import Status
from lcpcli.version import VERSION

ENVIRONMENT = "lcp_options"
OPTIONS = {option.name: option for option in (*LIMITS, THREADS, RESTARTS)}
NUMBERS = {  # solve_result_num: 0 to 99 solved, 200 to 299 infeasible, 400 to 499 a limit, 500 to 599 a failure
    Status.SOLVED: 0,
    Status.INFEASIBLE: 200,
    Status.UNSOLVABLE: 201,
    Status.ILL_POSED: 202,
    Status.ITERATION_LIMIT: 400,
    Status.TIME_LIMIT: 401,
    Status.INTERRUPTED: 402,
    Status.STALLED: 500,
    Status.DIVERGED: 501,
    Status.BREAKDOWN: 502,
    Status.RAY: 503,
}


def run(stub: str, words: Sequence[str]) -> int:
    """Solve the model in a file, write the answer beside it, and return 0. words : options, each NAME=VALUE."""
    stem = stub.removesuffix(".nl")
    path, answer = f"{stem}.nl", f"{stem}.sol"
    if os.path.isfile(answer):  # which would stand for the answer if this run is refused or killed
        with suppress(OSError):
            os.unlink(answer)
    given = _options([*os.environ.get(ENVIRONMENT, "").split(), *words])
    model = within(path, Model, content_of(path, WHOLE), path)
    result = within(path, _solved, model, given)
    message = f"lcp {VERSION}: {result.message}; {result.iterations} iterations, residual {result.residual:.3g}"
    values = model.model.values(result.z)
    text = solution_text(model.model.header, message, values, NUMBERS[result.status])
    atomic_write.write_whole(answer, text)
    return 0


def _options(words: Sequence[str]) -> dict[str, Any]:
    """Return the values of options, of which the last one counts where one is given twice."""
    given: dict[str, Any] = {}
    for word in words:
        name, is_there, text = word.partition("=")
        name = name.replace("-", "_")
        if name not in OPTIONS or not is_there:
            raise OptionError(quoted(word), "is no option of lcp -AMPL", likely(name, [f"{each}=" for each in OPTIONS]))
        try:
            given[name] = OPTIONS[name].kind(text)
        except ValueError:
            raise OptionError(name, f"is {quoted(text)}", f"it must be: {OPTIONS[name].range}") from None
    check(OPTIONS.values(), given)
    return given


def _solved(model: Model, given: Mapping[str, Any]) -> Result:
    limits = Limits(**{option.name: given[option.name] for option in LIMITS if option.name in given})
    others = {name: value for name, value in given.items() if name not in {option.name for option in LIMITS}}
    if isinstance(model.problem, NonlinearProblem):
        return run_nonlinear(model.problem, limits=limits, interrupts="return", **others)
    if RESTARTS.name in others:
        raise OptionError(RESTARTS.name, "has no effect on a linear model", "leave it out")
    return driver.run(model.problem, "auto", limits=limits, **others)
