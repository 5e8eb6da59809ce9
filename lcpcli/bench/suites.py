"""Suites of cases by name; the cases of suites, files and folders, and the problem of
each. No import is heavy."""

from __future__ import annotations

import math
import os
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field, replace
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
    `gallery.make`; "", 0, 0 and none for a file.
    file, q_file : the paths of its file, and of the file of q if separate.
    infinity : bounds in its file of at least this size are infinite; None if only
        infinite ones are.
    """

    name: str
    family: str = ""
    n: int = 0
    seed: int = 0
    parameters: dict[str, bool | int | float | str] = field(default_factory=dict)
    file: str = ""
    q_file: str = ""
    infinity: float | None = None


class Grid:
    """Cases of a family, one for each combination of the sizes and of the values of
    parameters and of the seed, each a value or a tuple of several."""

    def __init__(self, family: str, *sizes: int, **values: Any) -> None:
        self.family = family
        self.sizes = sizes
        self.values = values

    def cases(self) -> Iterator[Case]:
        axes = [
            value if isinstance(value, tuple) else (value,)
            for value in self.values.values()
        ]
        for n, *values in product(self.sizes, *axes):
            yield case(self.family, n, **dict(zip(self.values, values, strict=True)))


class Shipped:
    """Shipped programs, by name."""

    def __init__(self, *names: str) -> None:
        self.names = names

    def cases(self) -> Iterator[Case]:
        for file in (f"{name}.json" for name in self.names):
            yield Case(file, file=contents.shipped_path(f"programs/{file}"))


class Kind:
    """Cases of one kind, which have rows of the report under its name."""

    def __init__(self, name: str, *grids: Grid | Shipped) -> None:
        self.name, self.grids = name, grids

    def cases(self) -> Iterator[Case]:
        return chain.from_iterable(grid.cases() for grid in self.grids)


@dataclass(frozen=True)
class Suite:
    """Cases under one name.

    grids : what the cases are made of. budget : default number of seconds for a
    measurement. over_time : whether the report shows what is solved within which time.
    methods : those that are measured by default.
    """

    meaning: str
    grids: Sequence[Grid | Shipped | Kind]
    budget: float = 2.0
    over_time: bool = False
    methods: tuple[str, ...] = DEFAULT_METHODS

    @property
    def cases(self) -> list[Case]:
        return [case for grid in self.grids for case in grid.cases()]


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
    # The method, as shi in shi:p=10, decides how the solver is drawn.
    return solver.partition(":")[0]


SUITES = {
    "quick": Suite(
        "a little of everything, in under a minute",
        (
            Grid("harker-pang", 25, 50, 100),
            Grid("obstacle", 100, 225, 400),
            Grid("tridiagonal", 300),
            Grid("ben-gharbia-gilbert", 51),
            Grid("curtis-han-robinson", 3),
            Grid("murty", 10),
            Grid("diagonal", 20, decades=6),
            Grid("bimatrix", 10),
            Grid("infeasible", 10),
        ),
        budget=0.5,
    ),
    "paper": Suite(
        "fixed-point and shi on more than the paper's examples",
        (
            Grid("tridiagonal", 10, 100, 1000, 10_000),
            Grid("dominant", 100, 300, 1000),
            Grid("obstacle", 25, 100, 400),
            Grid("journal-bearing", 25, 100, 400),
            Grid("american-put", 25, 100, 400),
            Grid("near-singular", 100, epsilon=(1e-1, 1e-2, 1e-3)),
            Grid("near-degenerate", 100, epsilon=(1e-2, 1e-6)),
            Grid("degenerate", 20, 50, 100),
            Grid("ben-gharbia-gilbert", 5, 51, 201),
            Grid("kostreva", 3, 51),
            Grid("murty", 3, 6, 9),
            Grid("curtis-han-robinson", 3),
            Grid("hilbert", 4),
            Grid("diagonal", 20, decades=2),
            Grid("qp", 10, 20),
        ),
        budget=0.5,
    ),
    "dense": Suite(
        "dense problems up to n = 800",
        (
            Grid("harker-pang", 50, 100, 200, 400, 800),
            Grid("harker-pang", 50, 100, 200, 400, 800, symmetric=True),
            Grid("bimatrix", 10, 20, 40),
            Grid("contact", 50, 100, 200),
            Grid("lp", 50, 100, 200),
            Grid("qp", 50, 100, 200),
            Grid("degenerate", 50, 100, 200),
        ),
    ),
    "sparse": Suite(
        # Dominant ones fill in, and the time limit stops no factorization.
        "sparse problems up to n = 100,000",
        (
            Grid("obstacle", 900, 2500, 10_000, 40_000),
            Grid("journal-bearing", 900, 2500, 10_000),
            Grid("american-put", 1000, 3000, 10_000),
            Grid("tridiagonal", 1000, 10_000, 100_000),
            Grid("dominant", 300, 1000, 3000),
        ),
    ),
    "hard": Suite(
        "problems without a structure to rely on, and models: solved over time",
        (
            Grid("planted", 40, 60, 100, 200, 500, seed=(0, 1)),
            Grid("planted", 40, 100, 200, 500, seed=(0, 1), entries=10),
            Grid("gaussian", 20, 30, 40, seed=(0, 1)),
            Grid("indefinite", 100, seed=(0, 1)),
            Grid("indefinite", 100, seed=(0, 1), symmetric=True),
            Grid("indefinite", 100, seed=(0, 1), strict=True),
            Grid("indefinite", 100, seed=(0, 1), strict=True, symmetric=True),
            Grid("circuit", 80),
            Grid("relays", 50, 200),
            Grid("spatial-prices", 120),
            Grid("contact", 100),
        ),
        0.0,
        over_time=True,
    ),
    "speed": Suite(
        "the problems of lcp help speed: small and large, dense and sparse",
        (
            Grid("harker-pang", 10, symmetric=True),
            Grid("harker-pang", 10),
            Grid("harker-pang", 300, symmetric=True),
            Grid("harker-pang", 300),
            Grid("harker-pang", 1000, symmetric=True),
            Grid("harker-pang", 1000),
            Grid("harker-pang", 2000, symmetric=True),
            Grid("harker-pang", 2000),
            Grid("obstacle", 10_000, 90_000),
        ),
    ),
    "peers": Suite(
        "the kinds of problems of the table in README",
        (
            Kind(
                "small LCPs",
                Grid("harker-pang", 5, 10, 20, 50),
                Grid("harker-pang", 5, 10, 20, 50, symmetric=True),
                Grid("murty", 10, 20),
                Grid("degenerate", 10, 50),
            ),
            Kind(
                "dense LCPs",
                Grid("harker-pang", 300, 1000),
                Grid("harker-pang", 300, 1000, symmetric=True),
            ),
            Kind(
                "sparse LCPs",
                Grid("obstacle", 2500, 10_000),
                Grid("journal-bearing", 2500),
                Grid("american-put", 3000),
                Grid("tridiagonal", 10_000),
            ),
            Kind("mixed LCPs", Grid("boxes", 10, 100), Grid("torsion", 2500)),
            Kind("contact, friction", Grid("contact", 20, 100, seed=(0, 1))),
            Kind("bimatrix games", Grid("bimatrix", 4, 10, 20, 40)),
            Kind(
                "stiff LCPs",
                Grid("beam", 100, 1000),
                Grid("beam", 1000, contrast=(10_000, 1_000_000), load=10),
                Grid("plate", 400),
                Grid("frame", 100, 1000),
                Grid("hilbert", 8, 12),
                Grid("near-singular", 50, epsilon=(1e-6, 1e-12)),
                Grid("ill-scaled", 50, decades=(8, 32)),
            ),
            Kind("no solution", Grid("infeasible", 10, 50), Grid("ray", 10)),
            Kind(
                "convex programs",
                Shipped(
                    "hs21",
                    "hs35",
                    "hs53",
                    "hs76",
                    "klee-minty",
                    "portfolio",
                    "transport",
                ),
                Grid("portfolio", 100, 1000),
                Grid("control", 100, 1000),
                Grid("transport", 100, 1000),
            ),
        ),
        budget=0.2,
        methods=("auto",),
    ),
    "stiff": Suite(
        "ill-conditioned, badly scaled and almost degenerate problems",
        (
            Grid("beam", 100, 1000, 4000, 20_000),
            Grid("beam", 1000, contrast=(100, 10_000, 1_000_000, 100_000_000), load=10),
            Grid("plate", 400, 10_000),
            Grid("frame", 100, 1000, 4000),
            Grid("diagonal", 50, decades=(1, 2, 4, 8, 16, 50, 100, 150)),
            Grid("near-singular", 50, epsilon=(1e-2, 1e-4, 1e-6, 1e-8, 1e-10, 1e-12)),
            Grid("near-degenerate", 50, epsilon=(1e-2, 1e-4, 1e-6, 1e-8, 1e-10, 1e-12)),
            Grid("ill-scaled", 50, decades=(1, 2, 4, 8, 16, 32, 50)),
            Grid("hilbert", 2, 4, 6, 8, 10, 12, 14, 16, 20),
            Grid("obstacle", 25, 100, 400, 2500, 10_000),
            Grid("journal-bearing", 25, 100, 400, 2500),
            Grid("american-put", 25, 100, 400, 3000),
        ),
        0.0,
        methods=("auto", "interior", "newton", "lemke", "fixed-point", "shi"),
    ),
    "extreme": Suite(
        "problems constructed to defeat a method, and problems without a solution",
        (
            Grid("growth", 10, 20, 30, 40, 50, 60),
            Grid("murty", 5, 10, 20, 40, 100),
            Grid("fathi", 5, 10, 15, 20, 100),
            Grid("ben-gharbia-gilbert", 5, 51, 201),
            Grid("kostreva", 3, 51),
            Grid("curtis-han-robinson", 3),
            Grid("degenerate", 10, 50, 100),
            Grid("bimatrix", 4, 10, 20, 40),
            Grid("contact", 10, 50, 100),
            Grid("lp", 10, 50, 100),
            Grid("infeasible", 10, 50, 100),
            Grid("unsolvable", 4, 10, 20),
            Grid("ray", 4, 10, 20),
        ),
        0.0,
    ),
}
ALL = "all"


def methods_of(asked: Sequence[str]) -> list[str]:
    return list(
        dict.fromkeys(
            chain.from_iterable(SUITES.get(name, Suite).methods for name in asked)
        )
    )


def kinds_of(asked: Sequence[str]) -> list[Kind]:
    grids = chain.from_iterable(SUITES[name].grids for name in asked if name in SUITES)
    return [grid for grid in grids if isinstance(grid, Kind)]


def cases_of(
    asked: Sequence[str],
    errors: list[str] | None = None,
    tell: Tell = lambda _: None,
    infinity: float | None = None,
) -> list[Case]:
    """Return the cases of suites, files and folders, each once; a file with M alone is
    followed by the file of q.

    errors : receives what is wrong with files that cannot be read, which are skipped;
        else a ProblemError is raised.
    tell : called with remarks on the problem in a file. infinity : as in `Case`, for
    the files. Raises OptionError for a name that is neither a suite nor a file.
    """
    remaining_names = asked = [
        path
        for each in asked
        for path in ([each] if each in SUITES else files_in([each], tell))
    ]
    cases = list[Case]()
    while remaining_names:
        files: Sequence[str] = remaining_names[:1]
        if remaining_names[0] in (*SUITES, ALL):
            for name, suite in SUITES.items():
                if remaining_names[0] in (name, ALL):
                    cases += suite.cases
        else:
            try:
                files = _files(remaining_names, tell, infinity)
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
            except ProblemError as error:
                if errors is None:
                    raise
                errors.append(str(error))
        remaining_names = remaining_names[len(files) :]
    if (
        infinity is not None
        and not errors
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
    from lcpcli.model import usual_units
    from lcpcli.verify.point import without_wrong_solutions

    path, suite_names = asked[0], (*SUITES, ALL)
    if path == "-":
        raise OptionError(
            "standard input", "cannot be read again for a resumed bench", NAME_FILE
        )
    # Reading the file reports what is wrong with it.
    is_file = os.path.lexists(path) or os.sep in path or Path(path).suffix
    if not is_file and path not in contents.shipped_problems():
        hint = likely(
            path,
            (*suite_names, *contents.shipped_problems()),
            f"choose one of {', '.join(suite_names)}, or name a file",
        )
        raise OptionError(File(path), "is neither a suite nor a file", hint)
    contents.refuse_folder(path)
    file = InputFile.read(path, WHOLE)
    if file.nonlinear is not None:
        if infinity is not None:
            raise ParameterError(
                "infinity", "has no effect on a nonlinear model", LEAVE_OUT
            )
        return asked[:1]
    paths = asked[: 1 if is_whole(file.fields) else 2]
    files = [file, *map(InputFile.read, paths[1:])]
    problem = reading.problem_in(files, infinity or math.inf)
    far = usual_units.remark(problem) if infinity is None else ""
    for remark in filter(None, [*without_wrong_solutions(problem)[1], far]):
        tell(f"{path}: {remark}")
    return paths


def problem_of(case: Case) -> Problem | NonlinearProblem:
    """Return the problem of a case, with its verdict or its known solutions but without
    wrong ones."""
    if case.file:
        from lcpcli.files import reading
        from lcpcli.verify.point import without_wrong_solutions

        files = reading.files_of([*filter(None, (case.file, case.q_file))])
        if (model := files[0].nonlinear) is not None:
            return model
        problem = reading.problem_in(files, case.infinity or math.inf)
        return without_wrong_solutions(problem)[0]
    from lcpcli.gallery import families as gallery

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
