"""The cases of suites, files and folders, and the problem of each."""

from __future__ import annotations

import math
import os
from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

from lcpcli.bench import suites
from lcpcli.bench.suites import ALL, GONE, Case
from lcpcli.errors import OptionError, ParameterError, ProblemError, likely
from lcpcli.files import contents
from lcpcli.files.contents import content_of, files_in

if TYPE_CHECKING:
    from lcpcli.model.nonlinear import NonlinearProblem
    from lcpcli.model.problem import Problem


def cases_of(
    asked: Sequence[str],
    tell: Callable[[str], None] = lambda _: None,
    infinity: float | None = None,
    faults: list[str] | None = None,
) -> list[Case]:
    """Return the cases of suites, files and folders, each once; a file with M alone is followed by the file of q.

    tell : called with remarks on the problem in a file. infinity : as in `Case`, for the files. faults : receives what
    is wrong with files that cannot be read, which are left out.

    Raises OptionError for a name that is neither a suite nor a file, ProblemError for a file that cannot be read, if
    there are no `faults` to receive it.
    """
    left = asked = [path for each in asked for path in ([each] if each in suites.SUITES else files_in([each], tell))]
    cases = list[Case]()
    while left:
        files: Sequence[str] = left[:1]
        if left[0] in (*suites.SUITES, ALL):
            cases += [each for name, suite in suites.SUITES.items() if left[0] in (name, ALL) for each in suite.cases]
        else:
            try:
                files = _files(left, tell, infinity)
                title = " ".join(_name_of(path, asked) for path in files)
                cases.append(Case(title, file=files[0], q_file="".join(files[1:]), infinity=infinity))
            except ProblemError as fault:
                if faults is None:
                    raise
                faults.append(str(fault))
        left = left[len(files) :]
    if infinity is not None and not faults and all(each.infinity is None for each in cases):
        raise ParameterError("infinity", "has no effect on the problems of a suite", "name a file, or leave it out")
    return list({each.name: each for each in cases}.values())


def _files(asked: Sequence[str], tell: Callable[[str], None], infinity: float | None) -> Sequence[str]:
    """Return the files of the problem that begins with the first file, after reading them."""
    from lcpcli.files import reading
    from lcpcli.files.inputs import nonlinear_in
    from lcpcli.model import far_bounds
    from lcpcli.verify.known import without_wrong_solutions

    path, known = asked[0], (*suites.SUITES, ALL)
    if path == "-":
        raise OptionError("standard input", "cannot be read again for a resumed bench", "name a file")
    is_file = os.path.lexists(path) or os.sep in path or Path(path).suffix  # reading reports what is wrong with it
    if not is_file and path not in contents.shipped_problems():
        hint = likely(path, (*known, *contents.shipped_problems()), f"choose one of {', '.join(known)}, or name a file")
        raise OptionError(path, "is neither a suite nor a file", GONE.get(path, hint))
    contents.refuse_folder(path)
    if nonlinear_in(path, content_of(path, reading.WHOLE)) is not None:
        if infinity is not None:
            raise ParameterError("infinity", "has no effect on a nonlinear model", "leave it out")
        return asked[:1]
    problem, files = reading.read_next(asked, infinity or math.inf)
    far = far_bounds.remark(problem) if infinity is None else ""
    for remark in filter(None, [*without_wrong_solutions(problem)[1], far]):
        tell(f"{path}: {remark}")
    return files


def _name_of(path: str, asked: Sequence[str]) -> str:
    alike = {os.path.abspath(other) for other in asked if Path(other).name == Path(path).name}
    return Path(path).name if len(alike) == 1 else path


def problem_of(case: Case) -> Problem | NonlinearProblem:
    """Return the problem of a case, with its verdict or its known solutions but without wrong ones."""
    if case.file:
        from lcpcli.files import reading
        from lcpcli.files.inputs import nonlinear_in
        from lcpcli.verify.known import without_wrong_solutions

        if (model := nonlinear_in(case.file, content_of(case.file, reading.WHOLE))) is not None:
            return model.nonlinear
        problem = reading.read(case.file, case.q_file or None, infinity=case.infinity or math.inf)
        return without_wrong_solutions(problem)[0]
    from lcpcli.gallery import families as gallery
    from lcpcli.gallery import nonlinear

    if case.family in nonlinear.FAMILIES:
        return nonlinear.make(case.family, case.n)
    return gallery.make(case.family, case.n, case.seed, **case.parameters)


def prepare(case: Case) -> Problem | NonlinearProblem:
    """Return the problem of a case with a reference for errors: a solution is computed if none is known and the problem
    is linear.

    The verdict in a file is not believed if there is a solution.
    """
    from lcpcli.model.problem import Problem
    from lcpcli.solving.reference import with_reference

    problem = problem_of(case)
    if not isinstance(problem, Problem):
        return problem
    complete = with_reference(replace(problem, verdict="") if case.file and problem.verdict else problem)
    return complete if complete.solutions else problem
