"""lcp as a solver of AMPL, and of programs that call solvers as AMPL does: lcp STUB
-AMPL [NAME=VALUE]...

The model in STUB.nl is solved, and the answer is written to STUB.sol, in which
solve_result_num says how the run has ended; its message is also printed. The exit code
is then 0. Options are read from the environment variable lcp_options, and from the
arguments after -AMPL.
"""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from contextlib import suppress
from functools import partial
from typing import Any

import numpy as np

from lcpcli.errors import LEAVE_OUT, OptionError, count, likely, quoted, visible
from lcpcli.files import atomic_write
from lcpcli.files.input_file import WHOLE, InputFile
from lcpcli.files.inputs import problem_of
from lcpcli.formulations.nonlinear_model import nl_format
from lcpcli.formulations.nonlinear_model.program import NlProgram
from lcpcli.methods.registry import RESTARTS
from lcpcli.options import LIMITS, THREADS, Limits, check
from lcpcli.rational.numbers import approximate, rounded
from lcpcli.solving import driver, solve_mcp
from lcpcli.solving.result import Status
from lcpcli.typing import Vector
from lcpcli.version import VERSION

ENVIRONMENT = "lcp_options"
OPTIONS = {option.name: option for option in (*LIMITS, THREADS, RESTARTS)}
# solve_result_num: 0 solved, 200 to 299 no solution, 400 to 499 a point that is not
# verified.
NUMBERS = {
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
# solve_result_num of a linear complementarity problem with an objective.
OPTIMA = {"optimal": 0, "unsolvable": 201, "unbounded": 300, "time_limit": 401}
# solve_result_num of linear and quadratic programs, by the word that says what is
# proved.
OF_PROGRAMS = {
    "stationary": 100,
    "infeasible": 200,
    "no_optimum": 201,
    "unbounded": 300,
}
# solve_result_num of a run without a finite point, unless it proves that there is no
# solution.
NO_POINT = 500


def run(stub: str, arguments: Sequence[str]) -> int:
    """Solve the model in the file `stub`, write the answer to the file .sol in the same
    directory, and return the exit code 0.

    arguments : options, each NAME=VALUE.
    """
    stem = stub.removesuffix(".nl")
    path, written = f"{stem}.nl", f"{stem}.sol"
    # An old answer would be mistaken for the answer of this run if it is refused or
    # killed.
    if os.path.isfile(written):
        with suppress(OSError):
            os.unlink(written)
    option_values = _options([*os.environ.get(ENVIRONMENT, "").split(), *arguments])
    file = InputFile.read(path, WHOLE)
    model: nl_format.Model = file.data
    conditions = file.within(lambda: model.conditions)
    told, number, z = _answer(file, isinstance(conditions, NlProgram), option_values)
    statement = "; ".join(filter(None, [f"lcp {VERSION}: {told}", model.remark]))
    message = visible(" ".join(statement.split()))
    print(message)
    has_values = z is not None and bool(np.isfinite(z).all())
    number = number if has_values or 200 <= number < 400 else NO_POINT
    values = duals = np.empty(0)
    if z is not None and has_values:
        values, duals = conditions.values(z), conditions.multipliers(z)
    text = nl_format.solution_text(conditions.header, message, values, number, duals)
    atomic_write.write_whole(written, text)
    return 0


def _options(arguments: Sequence[str]) -> dict[str, Any]:
    """Return the values of the options by name. If one occurs twice, its last value
    counts.
    """
    option_values: dict[str, Any] = {}
    for argument in arguments:
        name, is_there, text = argument.partition("=")
        name = name.replace("-", "_")
        if name not in OPTIONS or not is_there:
            raise OptionError(
                quoted(argument),
                "unknown option",
                likely(name, [f"{each}=" for each in OPTIONS]),
            )
        try:
            option_values[name] = OPTIONS[name].kind(text)
        except ValueError:
            raise OptionError(name, f"is {quoted(text)}", OPTIONS[name].hint) from None
    check(OPTIONS.values(), option_values)
    return option_values


def _answer(
    file: InputFile, is_program: bool, option_values: Mapping[str, Any]
) -> tuple[str, int, Vector | None]:
    """Return how the run has ended, in words and as a solve_result_num, and the values
    of the unknowns, or None if there are none.
    """
    others = {**option_values}
    limits = Limits.pop_from(others)
    if file.nonlinear is not None:
        result = file.within(
            partial(
                solve_mcp.run_nonlinear,
                file.nonlinear,
                limits=limits,
                interrupts="return",
                **others,
            )
        )
    elif RESTARTS.name in others:
        raise OptionError(RESTARTS.name, "has no effect on a linear model", LEAVE_OUT)
    elif (objective := file.objective) is not None:
        from lcpcli.enumeration.optimum import best

        exact = file.exactly(file.problem())
        best_solution = file.within(best, exact, *objective, limits.time_limit)
        return (
            best_solution.message(approximate),
            OPTIMA[best_solution.status],
            None if best_solution.z is None else rounded(best_solution.z),
        )
    else:
        problem = problem_of([file])
        result = driver.run(problem, "auto", limits=limits, **others)
    sentence = (
        f"{result.message}; {count(result.iterations, 'iteration')}, residual "
        f"{result.residual:.3g}"
    )
    number, statement = NUMBERS[result.status], ""
    if is_program:
        statement = result.answer.statement
        number = OF_PROGRAMS.get(str(result.answer.proved), number)
    # The advice is worded for Python. It names options, which AMPL has too; but if
    # there is no solution, it names functions of Python.
    advice = "" if result.status.has_no_solution else result.advice
    told = "; ".join(filter(None, [sentence, statement, advice]))
    return told, number, result.z
