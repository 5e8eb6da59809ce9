"""The problems of a command, as given by its files and options, without wrong solutions, of which a line tells."""

from __future__ import annotations

import os
import stat
import sys
from collections.abc import Callable, Collection, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import replace
from functools import cache, partial
from itertools import chain, islice, pairwise
from typing import TYPE_CHECKING, Any, NamedTuple

from lcpcli.cli.declarations import refuse, refuse_beside
from lcpcli.cli.main import say
from lcpcli.cli.terminal import STANDARD
from lcpcli.errors import OptionError, ProblemError, count
from lcpcli.files import contents, fields, formats
from lcpcli.files.contents import place
from lcpcli.linalg.threads import GENERAL, MANY_ROWS, VARIABLES
from lcpcli.report.wording import flag

if TYPE_CHECKING:
    from lcpcli.files.inputs import Input, QColumns, Work
    from lcpcli.files.nl_format import Model
    from lcpcli.model.problem import Problem
    from lcpcli.rational.exact_problem import ExactProblem

LARGE_FILE = 8 * MANY_ROWS**2  # bytes: a dense matrix of that many rows as .npz; text takes 2 or 3 times as many


class InputProblem(NamedTuple):
    """A problem from the input: a Problem, or a NonlinearProblem where these are taken.

    exactly : reads the numbers of a linear problem as written; None for a nonlinear one. remarks : lines on wrong known
    solutions, which are dropped, on far bounds and the like. length : returns the number of bytes of its text.
    """

    problem: Any
    exactly: Any
    remarks: list[str]
    length: Callable[[], int] = int


class Inputs(NamedTuple):
    """The files of a command, and how they are to be read.

    of_folders : those files that come from folders. lower, upper : bounds of z in place of the problem's own, numbers
    or a file. infinity : bounds of at least this size count as infinite. game : whether two files have the payoffs of a
    game. has_q : whether --q has named the second of two files. quiet : whether remarks on the input are left out.
    others : the values of other options that may name files to read, such as starting points.
    """

    files: Sequence[str]
    lower: str | None = None
    upper: str | None = None
    infinity: float | None = None
    game: bool = False
    has_q: bool = False
    quiet: bool = False
    of_folders: Collection[str] = ()
    others: Sequence[str] = ()

    @classmethod
    def of(cls, files: Sequence[str], q: str | None = None, **given: Any) -> Inputs:
        """Return the inputs in these files, with q in the file of --q if there is one."""
        if q is not None and (len(files) != 1 or given["game"]):
            fault = f"names q for one file with M, not for {'a game' if given['game'] else count(len(files), 'file')}"
            raise OptionError("--q", fault, "write M.csv --q q.csv, with both names")
        return cls([*files, *filter(None, [q])], has_q=q is not None, **given)

    @property
    def bounds(self) -> dict[str, Any]:
        return {name: getattr(self, name) for name in fields.BOUND_OPTIONS}

    @property
    def paths(self) -> list[str]:
        """Return the files, and the values given for bounds and the like, which are numbers or files."""
        return [*self.files, *(bound for bound in (self.lower, self.upper) if bound is not None), *self.others]

    def prepare(self, outputs: Mapping[str, str | None], threads: int | None = None) -> None:
        """Set the number of threads; refuse to read standard input twice, and refuse outputs as `refuse` does."""
        settle_threads(self.files, threads)
        refuse(self.paths.count(STANDARD) > 1, "standard input", "can be read only once", "name a file")
        self.refuse(outputs)

    def refuse(self, outputs: Mapping[str, str | None]) -> None:
        """Refuse outputs, by option, that cannot be written or would overwrite an input or each other."""
        written: dict[str, str] = {}
        for option, output in outputs.items():
            if output is None:
                continue
            if source := next((path for path in self.paths if same_file(output, path)), None):
                fault = "is an input of this run" if source in self.others else "holds the problem"
                raise OptionError(output, fault, "choose another file for the output")
            earlier = written.setdefault(os.path.abspath(output), option)
            refuse(earlier != option, option, f"goes to the same file as {earlier}", "choose another file for one")
            if output != STANDARD and option != "--resume":  # a log that is there is written at its end
                from lcpcli.files.atomic_write import refuse_unwritable

                refuse_unwritable(output)

    def read(self, takes_models: bool = False) -> InputProblem:
        """Read the problem in the files, which has to be linear unless `takes_models`."""
        from lcpcli.files import reading
        from lcpcli.files.games import game_in
        from lcpcli.files.inputs import Input

        with self.hint_at_game():
            paths = tuple(self.files)
            work = game_in(self.files) if self.game else Input(paths, reading.contents_of(paths))
            (found,) = self.problems(work, takes_models)
        self.tell(found.remarks)
        self.hint_at_option(self.files)
        return found

    def hint_at_option(self, paths: Sequence[str]) -> None:
        """Say how a file of q is named, if it stands behind -q."""
        if len(paths) == 2 and ("-q", paths[1]) in pairwise(sys.argv):
            tell(f"-q is --quiet; to name the file of q, write --q {paths[1]}")

    def tell(self, remarks: Sequence[str]) -> None:
        for remark in remarks:
            tell(remark, self.quiet)

    @contextmanager
    def hint_at_game(self) -> Iterator[None]:
        """Open a context in which the error for two files that may be the payoffs of a game hints at --game."""
        try:
            yield
        except ProblemError as error:
            from lcpcli.files.games import hint

            advice = "" if self.game else hint(self.files)
            raise ProblemError(error.where, error.fault, f"{error.hint}; {advice}") if advice else error from None

    def works(self, are_many: bool = False) -> tuple[Iterator[Work], bool]:
        """Return the inputs in the files, and whether they may be several problems, as they are with `are_many`."""
        from lcpcli.files.inputs import FIRST_NAME, QColumns, inputs

        if self.game:
            from lcpcli.files.games import game_in

            return iter([game_in(self.files)]), are_many
        each = inputs(self.files, streams=are_many, of_folders=self.of_folders, has_q=self.has_q)
        if are_many:
            return each, True
        first = list(islice(each, 2))
        if isinstance(first[0], QColumns) and not self.has_q and first[0].names[0] == FIRST_NAME:
            own, columns = first[0].sources[0].file, len(first[0].names)
            means = f"its {columns} columns are {columns} q, as --q would say; if they are M and q, name it alone"
            self.tell([f"{own}: {means}"] * (columns == len(first[0].Q) + 1))  # it may have been meant as [M | q]
        self.hint_at_option(first[0].paths if len(first) == 1 else ())
        return chain(first, each), len(first) > 1 or isinstance(first[0], QColumns)

    def problems(self, work: Work, takes_models: bool = False) -> Iterator[InputProblem]:
        """Yield the problems of an input. takes_models : whether they may be nonlinear."""
        from lcpcli.files.inputs import QColumns, nonlinear_in

        if not isinstance(work, QColumns):
            is_file = work.line is None and work.fault is None
            model = nonlinear_in(work.paths[0], work.contents[0]) if takes_models and is_file else None
            yield self._single(work) if model is None else self._nonlinear(work, model)
            return
        from lcpcli.rational.exact_problem import ExactProblem

        first = self.first_of(work)
        for q, name in zip(work.Q.T, work.names, strict=True):
            problem = replace(first, q=q, name=name)
            yield InputProblem(problem, cache(partial(ExactProblem.of_decimals, problem)), [])

    def _nonlinear(self, work: Input, model: Model) -> InputProblem:
        from lcpcli.files.reading import NOT_SECOND

        file = work.sources[0].file
        if others := work.paths[1:]:
            raise ProblemError(others[0], f"is not needed: {file} is a model", NOT_SECOND)
        refuse_beside("a nonlinear model", {flag(name): value for name, value in self.bounds.items()})
        return InputProblem(model.nonlinear, None, [f"{file}: {model.remark}"] if model.remark else [])

    def first_of(self, work: QColumns) -> Problem:
        from lcpcli.files import beside

        return beside.with_bounds(work.first_problem(), self.bounds)

    def _single(self, work: Input) -> InputProblem:
        fetch = cache(contents.content_of)  # standard input can be read only once
        original = changed = work.read()
        if any(bound is not None for bound in self.bounds.values()):
            from lcpcli.files import beside

            changed = beside.with_bounds(original, self.bounds, fetch)
        problem, remarks = without_wrong_solutions(changed, work.paths[0])
        notes = [problem.note] if work.paths[0].casefold().endswith(".nl") else []  # on what has been read
        if problem.may_have_far_bounds and self.infinity is None:
            from lcpcli.model import changes

            notes.append(changes.remark(problem))
        is_file = len(work.contents) == 1 and work.line is None
        if is_file and formats.form_of(work.paths[0], work.contents[0]) == "csv_format":
            from lcpcli.files import csv_format

            notes.append(csv_format.remark(problem))
        remarks.extend(f"{place(work.paths[0])}: {note}" for note in notes if note)

        @cache
        def exactly() -> ExactProblem:
            from lcpcli.rational.exact_problem import ExactProblem

            data = ExactProblem(original, *work.exact_parts())
            if changed.is_mixed:
                from lcpcli.files import beside

                data = beside.with_exact_bounds(data, changed, self.bounds, fetch)
            data.problem = problem
            return data

        return InputProblem(problem, exactly, remarks, work.length)


def without_wrong_solutions(problem: Problem, file: str) -> tuple[Problem, list[str]]:
    """Return the problem without wrong known solutions, and remarks on these and on a shipped problem in place of a
    missing file."""
    vetted, faults = problem, list[str]()
    if problem.solutions:
        from lcpcli.verify.point import without_wrong_solutions

        vetted, faults = without_wrong_solutions(problem)
    if os.path.splitext(file)[1] and contents.shipped_file(file):  # perhaps the user meant a file
        faults.insert(0, "no such file; the problem that ships under this name is read")
    return vetted, [f"{place(file)}: {fault}" for fault in faults]


def tell(line: str, quiet: bool = False) -> None:
    if not quiet:
        say(f"lcp: {line}")


def same_file(output: str, other: str) -> bool:
    """Return whether an output goes to an input file; - means standard output and standard input, respectively."""
    try:
        one = os.fstat(sys.stdout.fileno()) if output == STANDARD else os.stat(output)
        two = os.fstat(0) if other == STANDARD else os.stat(other)
    except OSError:
        return False
    return os.path.samestat(one, two) and (STANDARD not in (output, other) or stat.S_ISREG(one.st_mode))


def settle_threads(files: Iterable[str], threads: int | None = None) -> None:
    """Set the number of BLAS threads in the environment, from which numpy takes it when it is loaded later: by default
    one, unless a file is so large that more threads save time.

    threads : the requested number; only this replaces a number that the environment already has.
    """
    if threads is not None:
        os.environ.update(dict.fromkeys(VARIABLES, str(threads)))
        return
    are_small = all(not os.path.exists(file) or os.path.getsize(file) < LARGE_FILE for file in files)
    if are_small and not os.environ.get(GENERAL):
        os.environ.update({name: os.environ.get(name) or "1" for name in VARIABLES})
