"""lcp convert: a problem from one format to another."""

from __future__ import annotations

from collections.abc import Callable
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from lcpcli.cli.command import Command
from lcpcli.cli.options import problem_file, problem_output
from lcpcli.cli.output import emit
from lcpcli.cli.problems import Inputs, tell, without_wrong_solutions
from lcpcli.errors import OptionError, count, quoted
from lcpcli.files.formats import COMPLETE, OF_PROGRAMS, WITH_BOUNDS

if TYPE_CHECKING:
    from lcpcli.model.problem import Problem
    from lcpcli.rational.written import Doubles, Written

PARTS = {"qp": ["objective"], "game": ["payoffs"]}  # of an origin, as users call them
CONDITIONS = {"qp": "written as the program's optimality conditions,", "game": "written as the game's LCP,"}
KEPT = ((OF_PROGRAMS, "the program"), (WITH_BOUNDS, "M, q and bounds"), (("",), "M and q"))


@click.command(
    cls=Command,
    short_help="Write a problem in another format.",
    examples=(
        "lcp convert bimatrix -o bimatrix.mat",
        "lcp make obstacle -n 100 | lcp convert - -o obstacle.npz",
    ),
    exits={0: "written", 2: "usage or input error (one-line message)"},
    epilog=f"Texts keep the digits that were written; .npz, .npy and .mat hold doubles. {', '.join(COMPLETE)} keep "
    "everything, .csv M, q and bounds, the others M and q; .mtx and .npy need two files for them, such as p.mtx and "
    "p.q.mtx. A program stays one, also as .mps, and a game too; lcp make --from-qp and --from-game write M and q.",
)
@problem_file
@problem_output
def convert(file: str, q_file: str | None, output: str | None, **given: Any) -> int:
    """Write the problem in FILE in another format."""
    from lcpcli.files.writing import exact_endings, is_rounded, kind_of

    inputs = Inputs([file] if q_file is None else [file, q_file], **given)
    if q_file is not None and output is None and not Path(q_file).exists():
        raise OptionError(q_file, "no such file", f"to write it, give -o {q_file}")
    inputs.prepare({"--output": output})
    written = write(lambda: _read(inputs, output or ""), output, as_program=True)
    if output is None:
        return 0
    if left_out := lost(written.rounded, output):
        kept = next(kept for endings, kept in KEPT if output.endswith(endings))
        form = CONDITIONS.get(kind_of(written.rounded), "the format keeps only")
        tell(f"{output}: {form} {kept}; left out: {', '.join(left_out)}")
    if output.endswith(OF_PROGRAMS):
        _tell_of_names(written.rounded, output)
    if is_rounded(written, output):
        endings = " or ".join(exact_endings(written.rounded))
        tell(f"{output}: some numbers have more digits than doubles and were rounded; {endings} would keep them all")
    return 0


def _tell_of_names(problem: Problem, output: str) -> None:
    """Say which names of rows and columns the file has others for."""
    from lcpcli.files.mps_writing import changed

    if names := changed(problem):
        old, new = next(iter(names.items()))
        told = f"{count(len(names), 'name')} had to be changed, as MPS has none with spaces, or twice"
        tell(f"{output}: {told}: {quoted(old)} is {quoted(new)}{', and so on' * (len(names) > 1)}")


def _read(inputs: Inputs, output: str) -> Written[Problem]:
    """The problem for a file of that name, without a name if it has none of its own."""
    from lcpcli.files import reading, writing
    from lcpcli.rational.written import Written

    found = read_written(inputs)
    if found.rounded.name == reading.name_of(inputs.files[0]):
        found = Written(found.rounded.named(""), found.own.named(""), found.exact)
    return writing.with_costs(found, output)


def read_written(inputs: Inputs) -> Written[Problem]:
    """The problem in the files, rounded and, where texts have more digits than doubles, as written."""
    from lcpcli.files import bounds, reading
    from lcpcli.rational.written import Written, written

    if inputs.game:
        problem = inputs.read().problem
        return Written(problem, problem, {})
    fetch = cache(reading.content_of)
    file, q_file = [*inputs.files, None][:2]

    def parse(doubles: Doubles) -> Problem:
        problem = reading.problem_of(str(file), q_file, fetch, doubles)
        return bounds.bounded(problem, inputs.bounds, fetch, doubles)

    with inputs.hint_at_game():
        found = written(parse)
    rounded, remarks = without_wrong_solutions(found.rounded, str(file))
    inputs.tell(remarks)
    return Written(rounded, without_wrong_solutions(found.own, str(file))[0], found.exact)


def write(
    made: Callable[[], Problem | Written[Problem]], output: str | None, as_program: bool = False
) -> Written[Problem]:
    """Make a problem and write it in the format of the file's suffix, or as JSON to standard output; return it.

    as_program : as for `writing.write`.
    Raises OptionError before it is made if the file cannot be written.
    """
    from lcpcli.files import atomic_write, writing
    from lcpcli.rational.written import Written

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
