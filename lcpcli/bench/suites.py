"""Suites of cases by name; the cases of suites, files and folders, and the problem of
each. No import is heavy."""

from __future__ import annotations

import math
import os
from ast import literal_eval
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from itertools import chain, product
from pathlib import Path
from typing import TYPE_CHECKING, Any

from lcpcli.errors import (
    LEAVE_OUT,
    NAME_FILE,
    File,
    OptionError,
    ParameterError,
    ProblemError,
    likely,
)
from lcpcli.files import contents
from lcpcli.files.contents import files_in

if TYPE_CHECKING:
    from lcpcli.model.nonlinear import NonlinearProblem
    from lcpcli.model.problem import Problem

Tell = Callable[[str], None]
DEFAULT_METHODS = ("auto", "newton", "lemke", "fixed-point", "shi")


@dataclass(frozen=True)
class Case:
    """A problem of the gallery, or one in a file, described so that it can be made
    again.

    name : unique within a bench. family, n, seed, parameters : the arguments of
    `gallery.make`; "", 0, 0 and none for a file. Nonlinear problems have no seed and no
    parameters. file, q_file : the paths of its file, and of the file of q if separate.
    infinity : bounds in its file of at least this size count as infinite; None if only
    infinite ones do.
    """

    name: str
    family: str = ""
    n: int = 0
    seed: int = 0
    parameters: dict[str, bool | int | float | str] = field(default_factory=dict)
    file: str = ""
    q_file: str = ""
    infinity: float | None = None


@dataclass(frozen=True)
class Suite:
    """Cases under one name.

    text : the cases: families with their sizes, then values of parameters and of the
    seed, all of which are combined, as in "planted 40 100 entries=10 seed=0,1; murty
    5"; a parameter without a value is true. Also files of shipped programs. budget :
    default number of seconds for a measurement. over_time : whether the report shows
    what is solved within which time. methods : those that are measured by default.
    """

    meaning: str
    text: str
    budget: float = 2.0
    over_time: bool = False
    methods: tuple[str, ...] = DEFAULT_METHODS

    @cached_property
    def cases(self) -> list[Case]:
        made = list[Case]()
        for part in self.text.split(";"):
            family, *words = part.split()
            if family.endswith(".json"):
                made += (
                    Case(file, file=contents.shipped_path(f"programs/{file}"))
                    for file in (family, *words)
                )
                continue
            axes = [[("n", int(word)) for word in words if word.isdecimal()]]
            for name, _, values in (
                word.partition("=") for word in words if not word.isdecimal()
            ):
                axes.append(
                    [
                        (name, literal_eval(value))
                        for value in (values or "True").split(",")
                    ]
                )
            made += (case(family, **dict(chosen)) for chosen in product(*axes))
        return made


def case(family: str, n: int, seed: int = 0, **parameters: Any) -> Case:
    name = series(f"{family} {n}", {**parameters, **({"seed": seed} if seed else {})})
    return Case(name, family, n, seed, parameters)


def series(family: str, parameters: dict[str, Any]) -> str:
    """Return the common name of cases that differ only in size and seed."""
    return " ".join(
        [
            family,
            *(
                name if value is True else f"{name}={value}"
                for name, value in parameters.items()
            ),
        ]
    )


def method_of(solver: str) -> str:
    # Shi of shi:p=10, which decides how the solver is drawn.
    return solver.partition(":")[0]


SUITES = {
    "quick": Suite(
        "a little of everything, in under a minute",
        "harker-pang 25 50 100; obstacle 100 225 400; tridiagonal 300; "
        "ben-gharbia-gilbert 51;"
        "curtis-han-robinson 3; murty 10; diagonal 20 decades=6; bimatrix 10; "
        "infeasible 10",
        budget=0.5,
    ),
    "paper": Suite(
        "fixed-point and shi on more than the paper's examples",
        "tridiagonal 10 100 1000 10000; dominant 100 300 1000; obstacle 25 100 "
        "400; journal-bearing 25 100 400;"
        "american-put 25 100 400; near-singular 100 epsilon=1e-1,1e-2,1e-3; "
        "near-degenerate 100 epsilon=1e-2,1e-6;"
        "degenerate 20 50 100; ben-gharbia-gilbert 5 51 201; kostreva 3 51; "
        "murty 3 6 9; curtis-han-robinson 3;"
        "hilbert 4; diagonal 20 decades=2; qp 10 20",
        budget=0.5,
    ),
    "dense": Suite(
        "dense problems up to n = 800",
        "harker-pang 50 100 200 400 800; harker-pang 50 100 200 400 800 "
        "symmetric; bimatrix 10 20 40;"
        "contact 50 100 200; lp 50 100 200; qp 50 100 200; degenerate 50 100 200",
    ),
    "sparse": Suite(
        # Dominant ones fill in, and the time limit stops no factorization.
        "sparse problems up to n = 100,000",
        "obstacle 900 2500 10000 40000; journal-bearing 900 2500 10000; "
        "american-put 1000 3000 10000;"
        "tridiagonal 1000 10000 100000; dominant 300 1000 3000",
    ),
    "mixed": Suite(
        "problems with bounds, free variables and equations",
        "two-obstacles 100 2500 10000 90000; torsion 100 2500 10000; circuit 8 "
        "80 800 8000; relays 10 50 200 800;"
        "spatial-prices 24 120 1000; boxes 10 100 300 1000",
    ),
    "hard": Suite(
        "problems without a structure to rely on, and models: solved over time",
        "planted 40 60 100 200 500 seed=0,1; planted 40 100 200 500 seed=0,1 "
        "entries=10; gaussian 20 30 40 seed=0,1;"
        "indefinite 100 seed=0,1; indefinite 100 seed=0,1 symmetric; indefinite "
        "100 seed=0,1 strict;"
        "indefinite 100 seed=0,1 strict symmetric; circuit 80; relays 50 200; "
        "spatial-prices 120; contact 100",
        0.0,
        over_time=True,
    ),
    "programs": Suite(
        "linear and quadratic programs",
        "hs21.json hs35.json hs53.json hs76.json klee-minty.json portfolio.json "
        "transport.json;"
        "portfolio 100 1000 2500; control 100 1000 5000; transport 100 1000 10000",
    ),
    "nonlinear": Suite(
        "nonlinear problems of the literature",
        "kojima-shindo 4; josephy 4; mathiesen 4; billups 1; nash-cournot 5 10; "
        "scarf 19; bratu 289 5625;"
        "elastohydrodynamic 41 101",
        methods=("josephy-newton",),
    ),
    "speed": Suite(
        "the problems of lcp help speed: small and large, dense and sparse",
        "harker-pang 10 symmetric; harker-pang 10; harker-pang 300 symmetric; "
        "harker-pang 300;"
        "harker-pang 1000 symmetric; harker-pang 1000; harker-pang 2000 "
        "symmetric; harker-pang 2000;"
        "obstacle 10000 90000",
    ),
    "stiff": Suite(
        "ill-conditioned, badly scaled and nearly degenerate problems",
        "beam 100 1000 4000 20000; "
        "beam 1000 contrast=100,10000,1000000,100000000 load=10; "
        "plate 400 10000; frame 100 1000 4000;"
        "diagonal 50 decades=1,2,4,8,16,50,100,150; near-singular 50 "
        "epsilon=1e-2,1e-4,1e-6,1e-8,1e-10,1e-12;"
        "near-degenerate 50 epsilon=1e-2,1e-4,1e-6,1e-8,1e-10,1e-12; ill-scaled "
        "50 decades=1,2,4,8,16,32,50;"
        "hilbert 2 4 6 8 10 12 14 16 20; obstacle 25 100 400 2500 10000; "
        "journal-bearing 25 100 400 2500;"
        "american-put 25 100 400 3000",
        0.0,
        methods=("auto", "interior", "newton", "lemke", "fixed-point", "shi"),
    ),
    "extreme": Suite(
        "problems constructed to defeat a method, and problems without a solution",
        "growth 10 20 30 40 50 60; murty 5 10 20 40 100; fathi 5 10 15 20 100; "
        "ben-gharbia-gilbert 5 51 201;"
        "kostreva 3 51; curtis-han-robinson 3; degenerate 10 50 100; bimatrix 4 "
        "10 20 40; contact 10 50 100;"
        "lp 10 50 100; infeasible 10 50 100; unsolvable 4 10 20; ray 4 10 20",
        0.0,
    ),
}
ALL = "all"
GONE = {  # suites of earlier versions
    "path": "run tests/benchmarks/paths.py of the source instead",
    "sequences": "run tests/benchmarks/steps.py of the source instead",
}


def methods_of(asked: Sequence[str]) -> list[str]:
    return list(
        dict.fromkeys(
            chain.from_iterable(SUITES.get(name, Suite).methods for name in asked)
        )
    )


def cases_of(
    asked: Sequence[str],
    faults: list[str] | None = None,
    tell: Tell = lambda _: None,
    infinity: float | None = None,
) -> list[Case]:
    """Return the cases of suites, files and folders, each once; a file with M alone is
    followed by the file of q.

    faults : receives what is wrong with files that cannot be read, which are left out;
        else a ProblemError is raised.
    tell : called with remarks on the problem in a file. infinity : as in `Case`, for
    the files. Raises OptionError for a name that is neither a suite nor a file.
    """
    left = asked = [
        path
        for each in asked
        for path in ([each] if each in SUITES else files_in([each], tell))
    ]
    cases = list[Case]()
    while left:
        files: Sequence[str] = left[:1]
        if left[0] in (*SUITES, ALL):
            cases += [
                each
                for name, suite in SUITES.items()
                if left[0] in (name, ALL)
                for each in suite.cases
            ]
        else:
            try:
                files = _files(left, tell, infinity)
                alike = {
                    path: [each for each in asked if Path(each).name == Path(path).name]
                    for path in files
                }
                short = [
                    path
                    if len({*map(os.path.abspath, alike[path])}) > 1
                    else Path(path).name
                    for path in files
                ]
                cases.append(
                    Case(
                        " ".join(short),
                        file=files[0],
                        q_file="".join(files[1:]),
                        infinity=infinity,
                    )
                )
            except ProblemError as fault:
                if faults is None:
                    raise
                faults.append(str(fault))
        left = left[len(files) :]
    if (
        infinity is not None
        and not faults
        and all(each.infinity is None for each in cases)
    ):
        raise ParameterError(
            "infinity",
            "has no effect on the problems of a suite",
            "name a file, or leave it out",
        )
    return list({each.name: each for each in cases}.values())


def _files(asked: Sequence[str], tell: Tell, infinity: float | None) -> Sequence[str]:
    """Return the files of the problem that begins with the first file, after reading
    them."""
    from lcpcli.files import reading
    from lcpcli.files.fields import is_whole
    from lcpcli.files.input_file import WHOLE, InputFile
    from lcpcli.files.inputs import nonlinear_in
    from lcpcli.model import changes
    from lcpcli.verify.point import without_wrong_solutions

    path, known = asked[0], (*SUITES, ALL)
    if path == "-":
        raise OptionError(
            "standard input", "cannot be read again for a resumed bench", NAME_FILE
        )
    # Reading reports what is wrong with it.
    is_file = os.path.lexists(path) or os.sep in path or Path(path).suffix
    if not is_file and path not in contents.shipped_problems():
        hint = likely(
            path,
            (*known, *contents.shipped_problems()),
            f"choose one of {', '.join(known)}, or name a file",
        )
        where, hint = File(path), GONE.get(path, hint)
        raise OptionError(where, "is neither a suite nor a file", hint)
    contents.refuse_folder(path)
    file = InputFile.read(path, WHOLE)
    if nonlinear_in(file) is not None:
        if infinity is not None:
            raise ParameterError(
                "infinity", "has no effect on a nonlinear model", LEAVE_OUT
            )
        return asked[:1]
    paths = asked[: 1 if is_whole(file.fields) else 2]
    files = [file, *map(InputFile.read, paths[1:])]
    problem = reading.problem_in(files, infinity or math.inf)
    far = changes.remark(problem) if infinity is None else ""
    for remark in filter(None, [*without_wrong_solutions(problem)[1], far]):
        tell(f"{path}: {remark}")
    return paths


def problem_of(case: Case) -> Problem | NonlinearProblem:
    """Return the problem of a case, with its verdict or its known solutions but without
    wrong ones."""
    if case.file:
        from lcpcli.files import reading
        from lcpcli.files.inputs import nonlinear_in
        from lcpcli.verify.point import without_wrong_solutions

        files = reading.files_of([*filter(None, (case.file, case.q_file))])
        if (model := nonlinear_in(files[0])) is not None:
            return model.nonlinear
        problem = reading.problem_in(files, case.infinity or math.inf)
        return without_wrong_solutions(problem)[0]
    from lcpcli.gallery import families as gallery
    from lcpcli.gallery import nonlinear

    if case.family in nonlinear.FAMILIES:
        return nonlinear.make(case.family, case.n)
    return gallery.make(case.family, case.n, case.seed, **case.parameters)


def prepare(case: Case) -> Problem | NonlinearProblem:
    """Return the problem of a case with a reference for errors: a solution is computed
    if none is known and the problem is linear. The verdict in a file is not believed if
    there is a solution."""
    from lcpcli.model.problem import Problem
    from lcpcli.solving.proof import with_reference

    problem = problem_of(case)
    if not isinstance(problem, Problem):
        return problem
    complete = with_reference(
        replace(problem, verdict="") if case.file and problem.verdict else problem
    )
    return complete if complete.solutions else problem
