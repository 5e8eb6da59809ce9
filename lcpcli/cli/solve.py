"""lcp solve: one method on one problem or on many; and lcp compare: several methods
side by side."""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from functools import partial
from typing import TYPE_CHECKING

from lcpcli.cli import declarations
from lcpcli.cli.command import command
from lcpcli.cli.declarations import (
    ALL,
    MAXIMIZE,
    MINIMIZE,
    OBJECTIVE,
    ONE,
    chosen_variants,
    option,
    reject_conflicting_options,
)
from lcpcli.cli.problems import Request
from lcpcli.errors import EXITS, Exit, ProblemError
from lcpcli.files import contents
from lcpcli.files.formats import is_model
from lcpcli.methods.registry import NONLINEAR, Variant
from lcpcli.options import AUTO, JOBS, MAX_SOLUTIONS
from lcpcli.report.wording import LEVELS

if TYPE_CHECKING:
    from lcpcli.files.input_file import InputFile

BY_DEFAULT = Variant(AUTO)


@dataclass(eq=False, repr=False)
class Solve(Request):
    """The request of lcp solve; all_of_them : by --all."""

    method: Variant = BY_DEFAULT
    all_of_them: bool = False
    minimize: str | None = None
    maximize: str | None = None


AS_PUBLISHED: tuple[str, ...] = ("fixed-point", "shi")


@command(
    short_help="Solve one problem or many.",
    examples=(
        "lcp solve paper-example-1",
        "lcp make obstacle -n 100 | lcp solve -",
        "lcp solve paper-example-2 --method shi --every 10",
        "lcp solve tridiagonal-100 -o result.json",
        "lcp solve tridiagonal-100 --z0 result.json --quiet",
        "lcp solve bimatrix --all",
    ),
    request=Solve.of,
    common=(*declarations.COMMON, "--exact", "--all"),
    lists={"Methods": declarations.METHOD.meanings},
)
@declarations.problem_files
@option(
    "Method",
    f"-m --method NAME  {declarations.METHOD_NAMES}, with options as in shi:p=10.",
    type=declarations.METHOD,
    default=AUTO,
    show_default=True,
)
@option("Answer", "--exact  Prove it in exact fractions; 0.1 means 1/10.")
@declarations.solving
@option(
    "Answer",
    "--all all_of_them  List every solution; see lcp help solutions.",
    MAX_SOLUTIONS,
    "--minimize EXPRESSION  Find the solution with the least value of an "
    'expression such as "z1 + 2 z3".  '
    "[default: none]",
    "--maximize EXPRESSION  The same for the largest value.  [default: none]",
)
@option(
    "Many problems",
    JOBS,
    "--cluster ADDRESS  Have the workers of this Dask scheduler, such as "
    "tcp://host:8786, solve the problems.  "
    "[default: none]",
    "--sequence  Solve each problem from the basis of the previous one, as for "
    "time steps; see lcp help sequences.",
    "--resume FILE  Continue the log that -o FILE.jsonl has begun, with the same "
    "problems.  [default: none]",
)
def solve(request: Solve) -> int:
    """Solve the problem in each FILE, or prove that it has no solution."""
    request = request.prepared(variants=[request.method])
    from lcpcli.cli.session import run

    minimize, files = request.minimize, request.files
    objective = request.maximize if minimize is None else minimize
    if not request.all_of_them and objective is None:
        reject_conflicting_options(request.option_values, ONE)
        if not (len(files) == 1 and is_model(files[0])):
            return run(request)
    from lcpcli.cli import all_solutions

    if request.all_of_them:
        reject_conflicting_options(request.option_values, ALL)
        return run(request, all_solutions.outcome)
    reject_conflicting_options(request.option_values, ONE)
    if objective is not None:
        sense, mode = ("max", MAXIMIZE) if minimize is None else ("min", MINIMIZE)
        reject_conflicting_options(request.option_values, mode)
        search = partial(all_solutions.outcome, objective=objective, sense=sense)
        return run(request, search)
    from lcpcli.files.input_file import InputFile

    file = InputFile.read(files[0])
    objective_of_model = file.objective
    request = request.reading({files[0]: file})
    if objective_of_model is None:
        return run(request)
    reject_conflicting_options(request.option_values, OBJECTIVE)
    return run(request, partial(all_solutions.outcome, objective=objective_of_model))


def _is_nonlinear(file: InputFile) -> bool:
    """Return whether a file has a nonlinear problem, or an error, which its run
    reports."""
    with suppress(ProblemError):
        return file.nonlinear is not None
    return True


@dataclass(eq=False, repr=False)
class Compare(Request):
    """The request of lcp compare."""

    methods: Sequence[Variant] = ()


@command(
    short_help="Run methods side by side.",
    examples=(
        "lcp compare",
        "lcp compare tridiagonal-100 --every 10",
        "lcp compare --method shi --sweep k-star=1,5,20,100 --plot sweep.svg",
        "lcp compare --method shi --k-star 1 --trace -o it.csv",
        "lcp compare paper-example-1 --plot errors.svg",
    ),
    request=Compare.of,
    common=(*declarations.COMMON, "--sweep", "--trace"),
    lists={"Methods": declarations.METHOD.meanings},
    exits={**EXITS, Exit.SOLVED: "every method solved every problem"},
    epilog="An option applies to the methods that have it. Errors refer to a known "
    "solution, else to a computed one. "
    "By default auto runs too where neither of the paper's methods solves a "
    "problem; the exit code is theirs.",
)
@declarations.files_argument(
    "Problem",
    "files",
    "[FILE [Q_FILE]|FOLDER]...",
    {
        "FILE [Q_FILE]": (
            f"As for lcp solve. {declarations.OTHERS}  [default: the paper's two "
            "examples]"
        )
    },
)
@declarations.with_bounds
@declarations.several_methods("Method", "compare", AS_PUBLISHED)
@declarations.solving
def compare(request: Compare) -> int:
    """Run methods side by side on the problem in each FILE."""
    examples = [contents.shipped_path(name) for name in contents.PAPER_EXAMPLES]
    request = request.prepared(examples, levels=LEVELS)
    from lcpcli.cli.session import run

    default, files = AS_PUBLISHED, request.inputs.files
    if not request.methods and all(map(is_model, files)):
        from lcpcli.files.input_file import InputFile

        ahead = {file: InputFile.read(file) for file in files}
        request = request.reading(ahead)
        if all(map(_is_nonlinear, ahead.values())):
            default = tuple(NONLINEAR)
    is_free = not (request.methods or request.method_options)
    variants = chosen_variants(
        request.methods, request.sweep, default, request.method_options
    )
    adds_auto = is_free and not request.sweep
    return run(replace(request, variants=variants, adds_auto=adds_auto))
