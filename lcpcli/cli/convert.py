"""lcp convert: a problem from one format to another."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from lcpcli.cli import problems, threads
from lcpcli.cli.command import Command
from lcpcli.cli.options import problem_file, problem_output
from lcpcli.cli.session import refuse_clashes
from lcpcli.errors import OptionError, count, quoted
from lcpcli.files.formats import COMPLETE, OF_PROGRAMS, WITH_BOUNDS

if TYPE_CHECKING:
    from lcpcli.model.problem import Problem
    from lcpcli.rational.numbers import Written

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

    files = [file] if q_file is None else [file, q_file]
    threads.settle(files)
    if q_file is not None and output is None and not Path(q_file).exists():
        raise OptionError(q_file, "no such file", f"to write it, give -o {q_file}")
    output = None if output == "-" else output
    refuse_clashes(problems.inputs(files, given), {"--output": output})
    written = problems.write(lambda: _read(files, given, output or ""), output, as_program=True)
    lost = [] if output is None else problems.lost(written.rounded, output)
    if lost:
        kept = next(kept for endings, kept in KEPT if str(output).endswith(endings))
        form = CONDITIONS.get(kind_of(written.rounded), "the format keeps only")
        problems.tell(f"{output}: {form} {kept}; left out: {', '.join(lost)}")
    if output is not None and output.endswith(OF_PROGRAMS):
        _tell_of_names(written.rounded, output)
    if output is not None and is_rounded(written, output):
        endings = " or ".join(exact_endings(written.rounded))
        problems.tell(
            f"{output}: some numbers have more digits than doubles and were rounded; {endings} would keep them all"
        )
    return 0


def _tell_of_names(problem: Problem, output: str) -> None:
    """Say which names of rows and columns the file has others for."""
    from lcpcli.files.mps_lines import changed

    if names := changed(problem):
        old, new = next(iter(names.items()))
        told = f"{count(len(names), 'name')} had to be changed, as MPS has none with spaces, or twice"
        problems.tell(f"{output}: {told}: {quoted(old)} is {quoted(new)}{', and so on' * (len(names) > 1)}")


def _read(files: Sequence[str], given: problems.Given, output: str) -> Written[Problem]:
    """The problem for a file of that name, without a name if it has none of its own."""
    from lcpcli.files import reading, writing
    from lcpcli.rational.numbers import Written

    found = problems.read_written(files, given)
    if found.rounded.name == reading.name_of(files[0]):
        found = Written(found.rounded.named(""), found.own.named(""), found.exact)
    return writing.with_costs(found, output)
