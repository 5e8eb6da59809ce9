"""lcp make and lcp convert: write a problem of the gallery, or one in another
format."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

from lcpcli.cli.command import Choice, command
from lcpcli.cli.declarations import (
    LIST,
    OneProblem,
    Writing,
    argument,
    option,
    problem_file,
    problem_output,
    refuse,
    reject_conflicting_options,
)
from lcpcli.cli.output import Destination
from lcpcli.cli.problems import Inputs, tell, without_wrong_solutions
from lcpcli.cli.terminal import emit
from lcpcli.errors import (
    IS_MISSING,
    LEAVE_ONE_OUT,
    NO_SUCH_FILE,
    Exit,
    File,
    OptionError,
    ResourceError,
    quoted,
)
from lcpcli.files import contents, formats
from lcpcli.files.formats import ALL, COMPLETE
from lcpcli.gallery import families as gallery
from lcpcli.report.document import Document, Section, Table, typeset

if TYPE_CHECKING:
    from lcpcli.model.problem import Problem
    from lcpcli.rational.numbers import Doubles, Written

BOOLEANS = {
    "true": True,
    "yes": True,
    "1": True,
    "false": False,
    "no": False,
    "0": False,
}
# Unknowns from which on the memory for a problem is estimated, by a smaller one; and
# and how many times the memory of its numbers it takes at least while it is generated
# and written.
LARGE, SMALL = 10**6, 1000
COPIES_AS_ARRAYS, COPIES_AS_TEXT = 2, 8
KINDS = {bool: "true or false", int: "an integer", float: "a number"}


@dataclass(eq=False, repr=False)
class Make(Writing):
    """The request of lcp make; listed, settings : by --list and --set."""

    family: str | None = None
    listed: bool = False
    n: int | None = None
    seed: int | None = None
    settings: Sequence[str] = ()


@command(
    request=Make,
    short_help="Write a problem of the gallery.",
    examples=(
        "lcp make --list",
        "lcp make obstacle -n 100 | lcp solve -",
        "lcp make murty",
        "lcp make harker-pang -n 50 --seed 3 --set symmetric=true -o problem.npz",
    ),
    exits={Exit.SOLVED: "written"},
    epilog=f"The same arguments give the same problem. {', '.join(COMPLETE)} also hold "
    "its known solutions and, for a program or a game, what lcp solve needs to report "
    "the minimizer or the equilibrium.",
)
@argument(
    "Family",
    "family",
    {
        "FAMILY": (
            "A family; lcp make --list shows all families with their parameters and "
            "the class of M."
        )
    },
    required=False,
    metavar="[FAMILY]",
    type=Choice(gallery.FAMILIES, "lcp make --list shows the families"),
)
@option("Family", "--list listed  List the families instead of writing a problem.")
@option("Problem", gallery.SIZE, gallery.SEED)
@option(
    "Problem",
    "--set settings NAME=VALUE  Set a parameter of the family; repeatable.",
    multiple=True,
)
@problem_output
def make(request: Make) -> int:
    """Write a problem of FAMILY, a family of the gallery."""
    if request.listed:
        reject_conflicting_options(request.option_values, LIST)
        return _show_list()
    output = request.output
    quiet = request.quiet
    family = request.family
    prepare(Inputs([]), output)
    if family is None:
        raise OptionError(
            "FAMILY", IS_MISSING, "name a family; lcp make --list shows them"
        )
    parameters, seed = _parameters(family, request.settings), request.seed
    without_effect = seed is not None and not gallery.is_random(family)
    refuse(
        without_effect,
        "--seed",
        f"has no effect on {family}, which has no random entries",
    )
    make_problem = partial(gallery.make, family, seed=seed or 0, **parameters)
    has_any_size = not gallery.entry(family).size
    if request.n is not None and request.n > LARGE and has_any_size:
        _refuse_beyond_memory(make_problem(n=SMALL), request.n, output)
    write(make_problem(n=request.n), output, quiet)
    return 0


def _refuse_beyond_memory(sample: Problem, n: int, output: str | None) -> None:
    """Refuse n unknowns if they would take more memory than there is, by a small
    problem of the same family: else the system would kill this process."""
    from lcpcli.linalg.matrices import is_sparse

    kind = formats.kind_by_name(output or "")
    copies = (
        COPIES_AS_ARRAYS if kind is not None and kind.has_arrays else COPIES_AS_TEXT
    )
    M = sample.M
    numbers = M.nnz * 1.5 if is_sparse(M) else sample.n * n
    size = 8 * copies * n * (numbers / sample.n + 1)
    if size > (contents.memory() or math.inf):
        raise ResourceError("-n", "not enough memory for this problem", "give less")


def _show_list() -> int:
    rows = []
    for name, meaning in gallery.FAMILIES.items():
        parameters = gallery.parameters_of(name).items()
        texts = [
            f"{k}={str(v).lower() if isinstance(v, (bool, str)) else f'{v:g}'}"
            for k, v in parameters
        ]
        rows.append((name, gallery.entry(name).matrices, " ".join(texts), meaning))
    families = Table(
        ("family", "class of M", "parameters", "description"),
        [rows],
        range(4),
        range(1, 4),
    )
    title = "The families of the gallery"
    Destination("table", None).show(
        partial(typeset, Document(title, [Section(title, tables=[families])]))
    )
    return 0


def _parameters(family: str, settings: Sequence[str]) -> dict[str, Any]:
    defaults = gallery.parameters_of(family)
    values: dict[str, Any] = {}
    for setting in settings:
        name, equals, text = setting.partition("=")
        refuse(
            not equals, "--set", f"{quoted(setting)} has no value", "write NAME=VALUE"
        )
        refuse(name in values, "--set", f"{name} is set twice", LEAVE_ONE_OUT)
        try:
            gallery.refuse_unknown(family, name)
        except OptionError as error:
            raise OptionError("--set", error.fault, error.hint) from None
        kind = type(defaults[name])
        try:
            values[name] = (
                BOOLEANS[text.casefold()]
                if kind is bool
                else kind(text.replace("_", "?"))
            )  # 1_0 is no number
        except (KeyError, ValueError):
            raise OptionError(
                "--set",
                f"{quoted(text)} is not a value of {name}",
                f"give {KINDS[kind]}",
            ) from None
    return values


@dataclass(eq=False, repr=False)
class Convert(OneProblem, Writing):
    """The request of lcp convert."""


@command(
    request=Convert,
    short_help="Write a problem in another format.",
    examples=(
        "lcp convert bimatrix -o bimatrix.mat",
        "lcp make obstacle -n 100 | lcp convert - -o obstacle.npz",
    ),
    exits={Exit.SOLVED: "written"},
    epilog="Text formats keep all digits as written; .npz, .npy and .mat hold "
    f"doubles. {', '.join(COMPLETE)} keep "
    "everything, .csv M, q and bounds, the others M and q; .mtx and .npy need "
    "two files for them, such as p.mtx and "
    "p.q.mtx. Where a format can hold them, programs and games are kept as such, "
    "programs also in .mps.",
)
@problem_file
@problem_output
def convert(request: Convert) -> int:
    """Write the problem in FILE in another format."""
    inputs = Inputs.of(request, request.files, request.quiet)
    output, q_file = request.output, request.q_file
    if q_file is not None and output is None and not Path(q_file).exists():
        hint = f"to write it, give -o {q_file}"
        raise OptionError(File(q_file), NO_SUCH_FILE, hint)
    prepare(inputs, output)
    from lcpcli.files import writing
    from lcpcli.files.input_file import InputFile
    from lcpcli.files.writing import exact_endings, is_rounded, kind_to_write
    from lcpcli.model.formulation import Formulation

    written = read_written(inputs)
    # The problem has no name but that of its file.
    if written.rounded.name == InputFile(request.file).name:
        written = replace(
            written,
            rounded=written.rounded.named(""),
            distinct=written.distinct.named(""),
        )
    written = writing.with_exact_conditions(written, output or "")
    write(written, output, inputs.quiet, as_program=True)
    if output is None:
        return 0
    kind, left_out = kind_to_write(output), losses(written.rounded, output)
    form = Formulation.form if kind.of else written.rounded.formulation.form
    is_other_form = kind.keeps != ALL and form != Formulation.form
    if left_out or is_other_form:
        others = f"; left out: {', '.join(left_out)}" if left_out else ""
        tell(f"{output}: {form} {kind.keeps}{others}", inputs.quiet)
    if kind.of:
        for remark in formats.load(kind.form).remarks(written.rounded):
            tell(f"{output}: {remark}", inputs.quiet)
    if is_rounded(written, output):
        endings = " or ".join(exact_endings(written))
        change = (
            "some numbers have more digits than doubles and were rounded; "
            f"{endings} would keep them all"
        )
        tell(f"{output}: {change}", inputs.quiet)
    return 0


def read_written(inputs: Inputs) -> Written[Problem]:
    """Read the problem in the files, rounded and, where texts have more digits than
    double precision, as written."""
    from lcpcli.files import beside, reading
    from lcpcli.files.input_file import InputFile
    from lcpcli.rational.numbers import Written, written

    if inputs.tables:
        problem = inputs.read().problem
        return Written(problem, problem, {})
    bounds = dict[str, InputFile]()

    def parse(doubles: Doubles) -> Problem:
        problem = first.problem(*others, number=doubles)
        return beside.with_bounds(problem, inputs.bounds, bounds, doubles)

    with inputs.hint_at_tables(), inputs.reading():
        first, *others = reading.files_of(inputs.files)
        as_written = written(parse)
    rounded, remarks = without_wrong_solutions(as_written.rounded, inputs.files[0])
    inputs.tell(remarks)
    return Written(
        rounded,
        without_wrong_solutions(as_written.distinct, inputs.files[0])[0],
        as_written.exact,
    )


def prepare(inputs: Inputs, output: str | None) -> None:
    """Refuse an output that cannot be written, or whose suffix belongs to no format."""
    inputs.prepare({"--output": output})
    if output is not None:
        from lcpcli.files import writing

        inputs.refuse({"--output": writing.file_of_q(output)})


def write(
    problem: Problem | Written[Problem],
    output: str | None,
    quiet: bool,
    as_program: bool = False,
) -> None:
    """Write a problem in the format of the file's suffix and say so, or as JSON to
    standard output."""
    from lcpcli.files import writing
    from lcpcli.rational.numbers import Written

    written = problem if isinstance(problem, Written) else Written(problem, problem, {})
    if output is None:
        emit(
            writing.contents_of(written, "", ".json", as_program)[""].decode(),
            color=False,
        )
    else:
        writing.write_as(written, output, as_program)
        tell(
            f"wrote {' and '.join(filter(None, (output, writing.file_of_q(output))))}",
            quiet,
        )


def losses(problem: Problem, output: str) -> list[str]:
    """Return the names of those parts of a problem that the format of the file does not
    keep."""
    from lcpcli.files import csv_format
    from lcpcli.files.writing import kind_to_write

    kind = kind_to_write(output)
    if kind.keeps == ALL:
        return []
    parts = {
        name: getattr(problem, name)
        for name in ("name", "source", "note", "x0", "x1", "verdict", "origin")
    }
    if kind.of:
        del parts["name"], parts["origin"]
    lost_parts = [
        name
        for name, value in parts.items()
        if (value is not None and not isinstance(value, str)) or value
    ]
    if lost_parts[-1:] == ["origin"]:
        is_headed = kind.is_table and csv_format.can_head(problem.names)
        lost_parts[-1:] = problem.formulation.left_out
        if any(problem.names) and not is_headed:
            lost_parts.append("names")
    return [*lost_parts, *(["solution"] if problem.solutions else [])]
