"""lcp check: judge an answer, whoever gave it."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import click

from lcpcli.cli import candidates, output, session
from lcpcli.cli.command import Command, argument, option
from lcpcli.cli.options import format_option, numeric
from lcpcli.errors import OptionError
from lcpcli.options import TOL
from lcpcli.report.judged import FORMATS

if TYPE_CHECKING:
    from lcpcli.verify.verification import Judgement


@click.command(
    cls=Command,
    short_help="Judge an answer, whoever gave it.",
    examples=(
        "lcp solve problems/bimatrix.json --exact -o result.json",
        "lcp check problems/bimatrix.json result.json",
        "lcp check problems/bimatrix.json result.json --exact --format json",
    ),
    exits={0: "the answer stands", 1: "it does not", 2: "bad usage or bad input, told in one line"},
)
@argument(
    "Problem and answer",
    "paths",
    {
        "FILE [Q_FILE]": "As for lcp solve.",
        "SOLUTION": "A result of lcp solve in JSON, of several the first, or z as a list in JSON, one row or column of "
        "numbers, or as numbers here: 1,0,15/29; fractions are read everywhere. A result with fractions is judged "
        "by these, one with a proof that there is no z >= 0 with Mz + q >= 0 by that proof. - is standard input.",
    },
    metavar="FILE [Q_FILE] SOLUTION",
    nargs=-1,
    shell_complete=candidates.files(*candidates.VECTORS),
)
@numeric("Judging", TOL)
@option("Judging", "--exact", is_flag=True, help="Judge in rational arithmetic, decimals as written; no tolerance.")
@format_option(FORMATS, "table")
def check(paths: tuple[str, ...], tol: float | None, exact: bool, form: str) -> int:
    """Judge the answer in SOLUTION to the problem in FILE, or in FILE and Q_FILE."""
    if not 2 <= len(paths) <= 3:
        raise click.UsageError("give a file of the problem, one of q if it is apart, and one of the solution")
    if exact and tol is not None:
        raise OptionError("--tol", "has no effect with --exact", "leave it out")
    session.refuse_twice(paths)
    judgement = _judgement(paths[:-1], paths[-1], tol, exact)
    from lcpcli.report import judged

    output.emit(judged.render(judgement, form), color=False)
    return judgement.exit_code


def _judgement(problem_paths: tuple[str, ...], solution: str, tol: float | None, exact: bool) -> Judgement:
    from lcpcli import options
    from lcpcli.files import reading
    from lcpcli.rational.numbers import rounded
    from lcpcli.verify import verification

    options.check((TOL,), {"tol": tol})
    data = reading.read_exact(*problem_paths) if exact else None
    problem = data.problem if data else reading.read(*problem_paths)
    answer = reading.read_candidate(solution, problem.n)
    if answer.kind == "farkas":
        if tol is not None:
            raise OptionError("--tol", "has no effect on a proof", "leave it out")
        if data:
            return verification.judge_farkas_exactly(data, answer.values, is_rounded=not answer.exact)
        return verification.judge_farkas(problem, answer.values)
    if data:
        judged = verification.judge_exactly(data, answer.values, answer.w)
    else:
        judged = verification.judge(problem, rounded(answer.values), tol or TOL.value)
    return replace(judged, message=f"{judged.message}; {answer.claim}") if answer.claim else judged
