"""lcp check and lcp inspect: whether a proposed solution is correct, and the diagnosis
of a problem."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from contextlib import contextmanager, suppress
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

from lcpcli.cli import declarations, output
from lcpcli.cli.command import command
from lcpcli.cli.declarations import (
    EXACT,
    NONLINEAR_MODEL,
    OTHERS,
    PROBLEM_FILES,
    PROOF,
    Bounds,
    OneProblem,
    Reporting,
    argument,
    option,
    refuse,
    reject_conflicting_options,
    reporting,
)
from lcpcli.cli.main import of_end
from lcpcli.cli.problems import InputProblem, Inputs
from lcpcli.cli.terminal import Line, shows_progress
from lcpcli.errors import Exit, OptionError, ProblemError, listed
from lcpcli.files import contents
from lcpcli.files.contents import source_name
from lcpcli.model import formulations
from lcpcli.options import INSPECTION_SECONDS, TIME_LIMIT, TOL
from lcpcli.report.document import RECORD_MEANINGS

if TYPE_CHECKING:
    from fractions import Fraction

    from lcpcli.cli.problems import AnyProblem
    from lcpcli.files import beside
    from lcpcli.inspection.inspection import Inspection, NonlinearInspection
    from lcpcli.rational.exact_problem import ExactProblem
    from lcpcli.typing import Vector
    from lcpcli.verify.verification import Verification

OF_INSPECTION = TIME_LIMIT._replace(
    default=INSPECTION_SECONDS,
    meaning="Stop expensive computations after this many seconds.",
)


@dataclass(eq=False, repr=False)
class Check(Bounds, Reporting):
    """The request of lcp check; paths : the files of the problem, and the solution."""

    paths: Sequence[str] = ()
    tol: float | None = None
    exact: bool = False


@command(
    request=Check,
    short_help="Verify a proposed solution.",
    examples=(
        "lcp solve bimatrix --exact -o result.json",
        "lcp check bimatrix result.json",
        "lcp check bimatrix result.json --exact --format json",
    ),
    epilog="Components are counted from 1; the index of a violation in JSON, from 0.",
    exits={Exit.SOLVED: "the answer is correct", Exit.NOT_SOLVED: "it is not"},
)
@argument(
    "Problem and solution",
    "paths",
    {
        "FILE [Q_FILE]": f"As for lcp solve. {OTHERS}",
        "SOLUTION": "A result of lcp solve in JSON or CSV, with "
        "its fractions or its proof "
        "if it has them, each "
        "solution of --all; or z as a list in JSON, as a row, a column or a "
        "table of numbers, or typed here, such as "
        "1,0,15/29. Also the strategies of a game, x or x and y of a program, "
        "and a .sol file of an .nl model; lcp "
        "help proofs has the forms. - is standard input.",
    },
    metavar="FILE [Q_FILE] SOLUTION",
    nargs=-1,
    shell_complete=PROBLEM_FILES,
)
@declarations.with_bounds
@option("Verification", TOL, "--exact  Verify in exact fractions; 0.1 means 1/10.")
@reporting(RECORD_MEANINGS)
def check(request: Check) -> int:
    """Verify the proposed SOLUTION of the problem in FILE, or in FILE and Q_FILE."""
    paths, exact = request.paths, request.exact
    if not 2 <= len(paths) <= 3:
        hint = (
            "give the file of the problem, the file of q if it is separate, and the "
            "solution"
        )
        raise OptionError(
            "FILE [Q_FILE] SOLUTION", f"means 2 or 3 files, not {len(paths)}", hint
        )
    if exact:
        reject_conflicting_options(request.option_values, EXACT)
    destination = output.Destination.of(request)
    inputs = Inputs.of(request, paths[:-1], request.quiet, paths[-1:])
    inputs = inputs._replace(as_written=exact)
    inputs.prepare({"--output": destination.path})
    with _hint_at_one_list(paths):
        read = inputs.read(takes_models=True, tells=False)
    with Line("verifying", is_shown=shows_progress(destination.quiet)):
        verifications = _verifications(read, inputs, paths[-1], request.tol, exact)
    accepted = sum(verification.accepted for verification in verifications)
    verdict = (
        verifications[0].message
        if len(verifications) == 1
        else f"{accepted} of {len(verifications)} are correct"
    )
    if not destination.silent:
        from lcpcli.report import verification_text

        destination.show(
            verification_text.verification_report(
                verifications, contents.Source(paths[0])
            ).render,
            f"{source_name(paths[0])}: {verdict}",
        )
    return max(of_end(verification.accepted) for verification in verifications)


@contextmanager
def _hint_at_one_list(paths: Sequence[str]) -> Iterator[None]:
    """Open a context in which the error for a Q_FILE after a whole problem whose
    solutions have parts, such as the strategies of two players, says how to give
    these."""
    try:
        yield
    except ProblemError as error:
        parts = _parts_of_solution(paths[0])
        if len(paths) != 3 or error.file != paths[1] or not parts:
            raise
        reason = f"is one file or list too many after {source_name(paths[0])}"
        hint = (
            f"give {listed(parts)} in one list, as in 1,0,0,1, or in one JSON file "
            "with these keys"
        )
        raise ProblemError(error.file, reason, hint) from None


def _parts_of_solution(path: str) -> Sequence[str]:
    """Return the keys of the parts of a solution of the problem in a file; none if it
    has no such parts, or cannot be read."""
    from lcpcli.files.fields import kind_of
    from lcpcli.files.input_file import WHOLE, InputFile

    with suppress(ProblemError):
        kind = kind_of(InputFile.read(path, WHOLE).fields)
        return formulations.row_of(kind).parts if kind else ()
    return ()


def _verifications(
    read: InputProblem, inputs: Inputs, solution: str, tol: float | None, exact: bool
) -> list[Verification]:
    from lcpcli.model.problem import Problem

    problem, where = read.problem, source_name(solution)
    if not isinstance(problem, Problem):
        reject_conflicting_options({"--exact": exact}, NONLINEAR_MODEL)
    data = read.exactly() if exact else None
    candidates = _candidates(read, inputs, solution)
    remark = candidates[0].remark
    verifications = [
        contents.within(where, _verified, problem, data, candidate, tol)
        for candidate in candidates
    ]
    inputs.tell([*read.remarks, *([f"{where}: {remark}"] if remark else [])])
    if len(verifications) == 1:
        return verifications
    number = len(verifications)
    return [
        replace(each, message=f"solution {i} of {number}: {each.message}")
        for i, each in enumerate(verifications, 1)
    ]


def _candidates(
    read: InputProblem, inputs: Inputs, solution: str
) -> list[beside.Candidate]:
    """Return the solutions that a file proposes, at least one."""
    from lcpcli.files import beside
    from lcpcli.solving import checking

    values = None if read.file is None else read.file.solution_in(solution)
    if values is not None:
        return [beside.Candidate("solution", values)]
    problem = read.problem
    named = inputs.files[0], problem.name
    lengths = checking.lengths(problem)
    return beside.read_candidates(solution, lengths, named, lambda: problem.names)


def _verified(
    problem: AnyProblem,
    data: ExactProblem | None,
    candidate: beside.Candidate,
    tol: float | None,
) -> Verification:
    """Return what is true of a proposed solution, or of a proof that there is none.
    data : the numbers as written, for a verification in fractions; None for one in
        double precision."""
    from lcpcli.model.problem import Problem
    from lcpcli.solving import checking
    from lcpcli.verify import verification

    is_answer, is_proof = candidate.kind == "answer", candidate.kind == "farkas"
    if not isinstance(problem, Problem):
        reason = "is a proof, which a nonlinear model cannot have"
        refuse(is_proof, "SOLUTION", reason, "give z")
        values = _in_doubles(candidate.values, "give smaller numbers")
        return verification.verify_nonlinear(problem, values, tol or TOL.value)
    if is_proof:
        reject_conflicting_options({"--tol": tol}, PROOF)
        is_rounded = not candidate.exact
        return checking.verified_proof(
            problem, candidate.values, data, is_rounded=is_rounded
        )
    if candidate.parts:
        problem.formulation.joined(candidate.parts)
    if data:
        result = checking.verified_exactly(
            data, candidate.values, candidate.w, is_answer
        )
        remarks = [candidate.claim]
    else:
        values = _in_doubles(candidate.values, "add --exact")
        result = checking.verified(problem, values, tol or TOL.value, is_answer)
        larger = checking.accepting(problem, values, result, is_answer)
        hint = f"--tol {larger:g} accepts it" if larger else ""
        remarks = [hint, candidate.claim]
    message = "; ".join(filter(None, [result.message, *remarks]))
    return replace(result, message=message)


def _in_doubles(values: Sequence[Fraction], hint: str) -> Vector:
    """Return the values rounded to double precision; raise ProblemError with a hint if
    one is infinite."""
    from lcpcli.rational.numbers import rounded

    doubles = rounded(values)
    for i, double in enumerate(doubles.tolist(), 1):
        if math.isinf(double):
            raise ProblemError(f"entry {i}", "is beyond the range of doubles", hint)
    return doubles


@dataclass(eq=False, repr=False)
class Inspect(OneProblem, Reporting):
    """The request of lcp inspect; shows_all : by --all."""

    time_limit: float | None = None
    shows_all: bool = False


@command(
    request=Inspect,
    short_help="Classify and diagnose a problem.",
    examples=(
        "lcp inspect paper-example-2",
        "lcp make kostreva -n 5 | lcp inspect -",
        "lcp inspect bimatrix --time-limit 10 -o bimatrix-classes.json",
    ),
    exits={Exit.SOLVED: "inspected"},
    epilog='A class is "yes" or "no" only where rounding errors cannot affect the '
    "answer. Rows and columns are counted "
    "from 1; the indices of the JSON, from 0.",
)
@declarations.problem_file
@option("Stopping", OF_INSPECTION)
@option("Output", "--all shows_all  Show everything; JSON and CSV always do.")
@reporting(RECORD_MEANINGS)
def inspect(request: Inspect) -> int:
    """Report the classes of M, its scaling, and which methods are guaranteed to solve
    the problem; of a nonlinear model the rows and operators, and what is known of F and
    its Jacobian at the start."""
    destination = output.Destination.of(request)
    inputs = Inputs.of(request, request.files, request.quiet)
    inputs.prepare({"--output": destination.path})
    from lcpcli.inspection.inspection import inspect as inspected
    from lcpcli.report import inspection_text

    read = inputs.read(takes_models=True)
    diagnosis: Inspection | NonlinearInspection = inspected(
        read.problem, request.time_limit or OF_INSPECTION.value
    )
    report = inspection_text.inspection_report(
        diagnosis, request.shows_all, contents.Source(request.file)
    )
    destination.show(
        report.render,
        f"{source_name(request.file)}: {inspection_text.verdict(diagnosis)}",
    )
    return 0
