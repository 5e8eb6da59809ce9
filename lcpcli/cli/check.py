"""lcp check: verify a proposed solution."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Any

import click

from lcpcli.cli import candidates, output, problems, session, threads
from lcpcli.cli.command import Command, argument, option
from lcpcli.cli.options import format_option, numeric, with_bounds
from lcpcli.errors import OptionError
from lcpcli.options import TOL
from lcpcli.report.verification import FORMATS

if TYPE_CHECKING:
    from lcpcli.verify.verification import Verification


@click.command(
    cls=Command,
    short_help="Verify a proposed solution.",
    examples=(
        "lcp solve problems/bimatrix.json --exact -o result.json",
        "lcp check problems/bimatrix.json result.json",
        "lcp check problems/bimatrix.json result.json --exact --format json",
    ),
    epilog="Components are counted from 1; the index of a violation in JSON, from 0.",
    exits={0: "the answer is correct", 1: "it is not", 2: "usage or input error (one-line message)"},
)
@argument(
    "Problem and solution",
    "paths",
    {
        "FILE [Q_FILE]": "As for lcp solve.",
        "SOLUTION": "A result of lcp solve in JSON or CSV (the first of several), or z as a list in JSON, as a row, a "
        "column or a table of numbers, or as numbers here: 1,0,15/29; fractions too. Of a result with fractions "
        "these are verified; of one with a proof that no z >= 0 has Mz + q >= 0, that proof. - is standard input.",
    },
    metavar="FILE [Q_FILE] SOLUTION",
    nargs=-1,
    shell_complete=candidates.files(*candidates.VECTORS),
)
@with_bounds
@numeric("Verification", TOL)
@option("Verification", "--exact", is_flag=True, help="Verify in rational arithmetic, decimals taken as written.")
@format_option(FORMATS, "table")
def check(paths: tuple[str, ...], tol: float | None, exact: bool, form: str, **given: Any) -> int:
    """Verify the proposed SOLUTION of the problem in FILE, or in FILE and Q_FILE."""
    if not 2 <= len(paths) <= 3:
        raise click.UsageError("give the file of the problem, that of q if it is separate, and the solution")
    if exact and tol is not None:
        raise OptionError("--tol", "has no effect with --exact", "leave it out")
    threads.settle(paths)
    session.refuse_twice(problems.inputs(paths, given))
    verification = _verification(paths[:-1], given, paths[-1], tol, exact)
    from lcpcli.report.verification import render

    output.emit(render(verification, form, output.terminal()[0]), color=False)
    return verification.exit_code


def _verification(
    problem_paths: tuple[str, ...], given: problems.Given, solution: str, tol: float | None, exact: bool
) -> Verification:
    from lcpcli import options
    from lcpcli.files import reading
    from lcpcli.rational.numbers import rounded
    from lcpcli.verify import verification

    options.check((TOL,), {"tol": tol})
    data = problems.read_exact(problem_paths, given) if exact else None
    problem = data.problem if data else problems.read(problem_paths, given)
    answer = reading.read_candidate(solution, problem.n)
    if answer.kind == "farkas":
        if tol is not None:
            raise OptionError("--tol", "has no effect on a proof", "leave it out")
        if data:
            return verification.verify_farkas_exactly(data, answer.values, is_rounded=not answer.exact)
        return verification.verify_farkas(problem, answer.values)
    if data:
        verified = verification.verify_exactly(data, answer.values, answer.w)
    else:
        verified = verification.verify(problem, rounded(answer.values), tol or TOL.value)
    return replace(verified, message=f"{verified.message}; {answer.claim}") if answer.claim else verified
