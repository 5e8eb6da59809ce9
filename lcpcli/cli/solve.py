"""lcp solve: one method on one problem or on many."""

from __future__ import annotations

from functools import partial
from typing import Any

from lcpcli.cli import declarations
from lcpcli.cli.command import EXITS, command, option
from lcpcli.cli.declarations import refuse_beside
from lcpcli.cli.request import Request
from lcpcli.methods.variants import Variant
from lcpcli.options import JOBS, MAX_SOLUTIONS


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
    common=(*declarations.COMMON, "--exact", "--all"),
    lists={"Methods": declarations.METHOD.meanings},
    exits=EXITS,
)
@declarations.problem_files
@option(
    "Method",
    "-m",
    "--method",
    metavar="NAME",
    type=declarations.METHOD,
    default="auto",
    show_default=True,
    help=f"{declarations.METHOD_NAMES}, with options of its own as in shi:p=10.",
)
@option("Answer", "--exact", is_flag=True, help="Prove it in exact fractions; 0.1 means 1/10.")
@declarations.solving
@option("Answer", "--all", "all_of_them", is_flag=True, help="List every solution; see lcp help solutions.")
@declarations.numeric("Answer", MAX_SOLUTIONS)
@option(
    "Answer",
    "--minimize",
    metavar="EXPRESSION",
    help='Find the solution with the least value of an expression such as "z1 + 2 z3".  [default: none]',
)
@option("Answer", "--maximize", metavar="EXPRESSION", help="The same for the largest value.  [default: none]")
@declarations.numeric("Many problems", JOBS)
@option(
    "Many problems",
    "--cluster",
    metavar="ADDRESS",
    help="Have the workers of this Dask scheduler, such as tcp://host:8786, solve the problems.  [default: none]",
)
@option(
    "Many problems",
    "--sequence",
    is_flag=True,
    help="Solve each problem from the states of the previous one, as for time steps; see lcp help sequences.",
)
@declarations.file_option(
    "Many problems",
    "--resume",
    "Continue the log that -o FILE.jsonl has begun, given the same problems.  [default: none]",
)
def solve(
    files: tuple[str, ...], method: Variant, all_of_them: bool, minimize: str | None, maximize: str | None, **given: Any
) -> int:
    """Solve the problem in each FILE, or prove that it has no solution."""
    request = Request.of(files, variants=[method], **given)
    from lcpcli.cli.session import run

    options = {**request.given, "--minimize": minimize, "--maximize": maximize}
    sense, objective = ("min", minimize) if minimize is not None else ("max", maximize)
    own = None
    if all_of_them or objective is not None or (len(files) == 1 and files[0].casefold().endswith(".nl")):
        from lcpcli.cli import all_solutions

        if all_of_them:
            refuse_beside("--all", options)
            return run(request, all_solutions.outcome)
        own = all_solutions.objective_in(files[0]) if objective is None else None
    refuse_beside("one solution", options)
    if objective is None and own is None:
        return run(request)
    refuse_beside(f"--{sense}imize" if own is None else "the model's objective", options)
    sought = (objective or "", sense) if own is None else (own, "min")
    return run(request, partial(all_solutions.best_outcome, objective=sought[0], sense=sought[1]))
