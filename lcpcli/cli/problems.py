"""The problems of a command, read and written. Known solutions that are wrong get a line each, and are dropped."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import replace
from functools import cache, partial
from itertools import chain, islice
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import click

from lcpcli.cli.output import emit
from lcpcli.errors import ProblemError
from lcpcli.files.fields import BOUNDS
from lcpcli.files.formats import COMPLETE, OF_PROGRAMS

if TYPE_CHECKING:
    from lcpcli.files.inputs import Input, QColumns, Work
    from lcpcli.model.problem import Problem
    from lcpcli.rational.numbers import Written
    from lcpcli.rational.problem import ExactProblem


PARTS = {"qp": ["objective"], "game": ["payoffs"]}  # of an origin, as users call them
Given = Mapping[str, Any]  # by the options OF_BOUNDS: texts for lower and upper, a number for infinity; and by game


def read(files: Sequence[str], given: Given, quiet: bool = False) -> Problem:
    """The problem in one file, in one with M and one with q, or in two with the payoffs of a game, with the bounds
    given as options."""
    if given["game"]:
        return _of_game(files, given, quiet).problem
    from lcpcli.files import beside, reading

    with _hint_at_game(files):
        return _vetted(beside.bounded(reading.read(*files), given), files[0], quiet)


def read_exact(files: Sequence[str], given: Given, quiet: bool = False) -> ExactProblem:
    """Return the problem that `read` does with its numbers as written, as fractions."""
    if given["game"]:
        return _of_game(files, given, quiet).exactly()
    from lcpcli.files import beside, contents, reading

    fetch = cache(contents.content_of)
    with _hint_at_game(files):
        data = reading.read_exact(*files)
    problem = beside.bounded(data.problem, given, fetch)
    data = beside.exactly_bounded(data, problem, given, fetch)
    data.problem = _vetted(problem, files[0], quiet)
    return data


def read_written(files: Sequence[str], given: Given) -> Written[Problem]:
    """Return the problem that `read` does, rounded and, where texts have more digits than doubles, as written."""
    from lcpcli.rational.numbers import Doubles, Written, written

    if given["game"]:
        problem = _of_game(files, given, quiet=False).problem
        return Written(problem, problem, {})
    from lcpcli.files import beside, contents, reading

    fetch = cache(contents.content_of)
    file, q_file = [*files, None][:2]

    def parse(doubles: Doubles) -> Problem:
        problem = reading.problem_of(str(file), q_file, fetch, doubles)
        return beside.bounded(problem, given, fetch, doubles)

    with _hint_at_game(files):
        found = written(parse)
    return Written(_vetted(found.rounded, files[0], False), _vetted(found.own, files[0], True), found.exact)


@contextmanager
def _hint_at_game(files: Sequence[str]) -> Iterator[None]:
    """A context in which the error for two files that may be a game says so."""
    try:
        yield
    except ProblemError as error:
        from lcpcli.files.games import hint

        told = hint(files)
        raise ProblemError(error.where, error.fault, f"{error.hint}; {told}") if told else error from None


def _of_game(files: Sequence[str], given: Given, quiet: bool) -> Held:
    """Return the game whose payoffs are in the files."""
    from lcpcli.files.games import game_in

    held = _single(game_in(files), given)
    for remark in [] if quiet else held.remarks:
        tell(remark)
    return held


def works(files: Sequence[str], game: bool = False, are_many: bool = False) -> tuple[Iterator[Work], bool]:
    """What is in the files, and whether there may be several problems in them; game is whether they are the payoffs of
    one. are_many : whether they are to be taken as several, whose number need not be known."""
    from lcpcli.files.inputs import QColumns, inputs

    if game:
        from lcpcli.files.games import game_in

        return iter([game_in(files)]), are_many
    each = inputs(files, streams=are_many)
    if are_many:
        return each, True
    first = list(islice(each, 2))
    return chain(first, each), len(first) > 1 or isinstance(first[0], QColumns)


class Held(NamedTuple):
    """A problem that was read.

    exactly : reads its numbers as written. remarks : lines on what is wrong with its known solutions, which are dropped
    then, and on bounds that may stand for none. length : returns the bytes of the text that it was read from.
    """

    problem: Problem
    exactly: Callable[[], ExactProblem]
    remarks: list[str]
    length: Callable[[], int] = int


def held(work: Work, given: Given) -> Iterator[Held]:
    """The problems of an input, with the bounds given as options."""
    from lcpcli.files.inputs import QColumns

    yield from _columns(work, given) if isinstance(work, QColumns) else [_single(work, given)]


def _single(work: Input, given: Given) -> Held:
    from lcpcli.files import beside, contents

    fetch = cache(contents.content_of)  # standard input can be read only once
    original = work.read()
    bounded = beside.bounded(original, given, fetch)
    problem, remarks = _without_wrong_solutions(bounded, work.paths[0])
    if far := beside.remark(bounded, given):
        remarks.append(f"{contents.place(work.paths[0])}: {far}")

    @cache
    def exactly() -> ExactProblem:
        from lcpcli.rational.problem import ExactProblem

        data = beside.exactly_bounded(ExactProblem(original, *work.exact_parts()), bounded, given, fetch)
        data.problem = problem
        return data

    return Held(problem, exactly, remarks, work.length)


def _columns(work: QColumns, given: Given) -> Iterator[Held]:
    from lcpcli.rational.problem import ExactProblem

    first = first_of(work, given)
    for q, name in zip(work.Q.T, work.names, strict=True):
        problem = replace(first, q=q, name=name)
        yield Held(problem, cache(partial(ExactProblem.of_decimals, problem)), [])


def first_of(work: QColumns, given: Given) -> Problem:
    """The problem of the first of several q for one M."""
    from lcpcli.files import beside

    return beside.bounded(work.first_problem(), given)


def inputs(files: Sequence[str], given: Given) -> list[str]:
    """The files of a problem, and what is given for its bounds: numbers or files."""
    return [*files, *(given[name] for name in BOUNDS if given[name] is not None)]


def write(
    made: Callable[[], Problem | Written[Problem]], output: str | None, as_program: bool = False
) -> Written[Problem]:
    """Make a problem and write it in the format of the file's suffix, or as JSON to standard output; return it.

    as_program : as for `writing.write`.
    Raises OptionError before it is made if the file cannot be written.
    """
    from lcpcli.files import atomic_write, writing
    from lcpcli.rational.numbers import Written

    if output is not None:
        writing.ending_of(output)
        atomic_write.refuse_unwritable(output)
    problem = made()
    found = problem if isinstance(problem, Written) else Written(problem, problem, {})
    if output is None:
        emit(writing.contents_of(found, "", ".json", as_program)[""].decode(), color=False)
    else:
        writing.write_as(found, output, as_program)
    return found


def lost(problem: Problem, output: str) -> list[str]:
    """What a problem holds that the format of the file does not keep."""
    from lcpcli.files.writing import kind_of

    if output.endswith(COMPLETE):
        return []
    held = {name: getattr(problem, name) for name in ("name", "source", "note", "x0", "x1", "verdict", "origin")}
    if output.endswith(OF_PROGRAMS):
        del held["name"], held["origin"]
    known = [name for name, value in held.items() if (value is not None and not isinstance(value, str)) or value]
    if known[-1:] == ["origin"]:
        known[-1:] = [*PARTS.get(kind_of(problem), []), *["names"] * any(problem.names)]
    return [*known, *(["solution"] if problem.solutions else [])]


def tell(line: str) -> None:
    """Print a line about an input on standard error."""
    click.echo(f"lcp: {line}", err=True)


def teller(quiet: bool) -> Callable[[str], object]:
    """What tells a line, or nothing."""
    return (lambda _: None) if quiet else tell


def _vetted(problem: Problem, file: str, quiet: bool) -> Problem:
    vetted, faults = _without_wrong_solutions(problem, file)
    for fault in [] if quiet else faults:
        tell(fault)
    return vetted


def _without_wrong_solutions(problem: Problem, file: str) -> tuple[Problem, list[str]]:
    """The problem without those of its known solutions that are wrong, and lines that say so, or that it is shipped."""
    from lcpcli.files.contents import place, shipped_file
    from lcpcli.verify.known import without_wrong_solutions

    vetted, faults = without_wrong_solutions(problem)
    if Path(file).suffix and shipped_file(file):  # perhaps a file of the user was meant
        faults.insert(0, "no such file; the problem that ships under this name is read")
    return vetted, [f"{place(file)}: {fault}" for fault in faults]
