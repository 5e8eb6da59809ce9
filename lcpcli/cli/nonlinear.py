"""lcp solve for a nonlinear model in an .nl file."""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np

from lcpcli.cli.main import of_result
from lcpcli.cli.output import Output, refuse, refuse_given, show
from lcpcli.cli.request import Request
from lcpcli.files.contents import content_of, place, within
from lcpcli.files.nl_format import Model
from lcpcli.files.reading import WHOLE
from lcpcli.model.nonlinear import NonlinearProblem
from lcpcli.model.problem import Problem
from lcpcli.report import result_csv, result_formats, selection
from lcpcli.solving.solve_mcp import METHOD, run_nonlinear

if TYPE_CHECKING:
    from lcpcli.cli.session import Outcome
    from lcpcli.files.inputs import Work
    from lcpcli.solving.result import Result

# The options that concern linear problems, or many problems.
OTHERS = "exact", "plot", "paths", "jobs", "cluster", "resume", "sequence", "max_solutions"


def problem_in(files: Sequence[str]) -> NonlinearProblem | None:
    """Return the problem in a file if it is the only one, and a nonlinear model; else None."""
    if len(files) != 1 or not files[0].casefold().endswith(".nl"):
        return None
    problem = within(place(files[0]), Model, content_of(files[0], WHOLE), files[0]).problem
    return problem if isinstance(problem, NonlinearProblem) else None


def outcome(problem: NonlinearProblem, request: Request, work: Work, output: Output) -> Outcome:
    """Solve the problem by the method for nonlinear ones, with a proof that a solution is near if --bound is given."""
    _refuse_others(request)
    selection.places(problem.names, request.names)  # which refuses unknown ones
    trace, _ = output.traces(_linear(problem))
    options: dict[str, Any] = {"callback": request.stop, "threads": request.threads, "proof": request.bound}
    options |= {"limits": request.limits, "trace": trace or False, "interrupts": "return"}
    options |= request.variants[0].options
    result: Result = within(str(work.sources[0]), partial(run_nonlinear, problem, **options))
    if output.trace_path is not None:
        show(result_csv.iterates_text([result]), output.trace_path)
    text = "" if output.silent else _text(result, request, work, output)
    return text, of_result(result), int


def _linear(problem: NonlinearProblem) -> Problem:
    """Return a linear problem in the same unknowns, by which it is chosen what is shown."""
    from scipy.sparse import csr_array

    n = problem.n
    return Problem(csr_array((n, n)), np.zeros(n), lower=problem.lower, upper=problem.upper, names=problem.names)


def _refuse_others(request: Request) -> None:
    """Raise OptionError for the first option that has no effect on a nonlinear problem."""
    (variant,) = request.variants
    fault = f"{variant} solves linear problems only, and this model is nonlinear"
    refuse(variant.method not in ("auto", METHOD), "--method", fault, f"leave it out, or give {METHOD}")
    refuse_given(request.given(*OTHERS) | request.inputs.bounds, "has no effect on a nonlinear model")


def _text(result: Result, request: Request, work: Work, output: Output) -> str:
    return result_formats.render(
        [[output.with_visible_trace(result)]],
        work.sources,
        output.form,
        output.destination.width,
        output.destination.color,
        compared=False,
        whole=output.path is not None,
        iterates=output.with_iterates,
        columns=request.columns,
        names=request.names,
    )
