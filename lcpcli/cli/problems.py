"""The request of a command that solves: its problems, with remarks on what was read,
and the runs of methods on them, each with its options, its time and its proofs.

No displayed time includes the extra cost of a first run: imports are not timed, and
short runs are repeated, as the first one waits for memory and caches. Runs that are
compared are repeated more often, and the smallest time of each is shown.
"""

from __future__ import annotations

import os
import stat
import sys
from collections.abc import Callable, Collection, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from dataclasses import dataclass, field, replace
from functools import cache, partial
from itertools import chain, islice
from typing import TYPE_CHECKING, Any, NamedTuple, TypeAlias, TypeVar

from lcpcli import options
from lcpcli.cli.declarations import (
    NONLINEAR_MODEL,
    OF_METHODS,
    STARTS,
    Bounds,
    ManyProblems,
    Reporting,
    refuse,
    reject_conflicting_options,
)
from lcpcli.cli.main import say
from lcpcli.cli.terminal import STANDARD, Line, shows_progress
from lcpcli.clock import seconds
from lcpcli.errors import (
    LEAVE_ONE_OUT,
    LEAVE_OUT,
    NAME_FILE,
    OTHER_OUTPUT,
    File,
    OptionError,
    ProblemError,
    listed,
    quoted,
)
from lcpcli.files import contents, fields, formats
from lcpcli.files.contents import files_in, source_name
from lcpcli.interrupts import deadline_after
from lcpcli.linalg.threads import GENERAL, MANY_ROWS, VARIABLES
from lcpcli.methods.registry import (
    METHODS,
    NONLINEAR,
    START_OPTIONS,
    Variant,
    declared,
    known_options,
    labels,
)
from lcpcli.model import formulations
from lcpcli.options import AUTO, LIMITS, Limits, wants_kernels
from lcpcli.report.wording import flag

if TYPE_CHECKING:
    from lcpcli.files.input_file import InputFile
    from lcpcli.files.inputs import Input, InputItem, QColumns
    from lcpcli.model.nonlinear import NonlinearProblem
    from lcpcli.model.problem import Problem
    from lcpcli.rational.exact_problem import ExactProblem
    from lcpcli.solving.result import Result
    from lcpcli.solving.trace import Trace

# bytes: a dense matrix of that many rows as .npz; text takes 2 or 3 times as many.
LARGE_FILE = 8 * MANY_ROWS**2
SMALL_FILE = 100_000  # bytes


NO_BOUNDS: Mapping[str, Any] = dict.fromkeys(fields.BOUND_OPTIONS)


class InputProblem(NamedTuple):
    """A problem from the input: a Problem, or a NonlinearProblem where these are
    accepted.

    exactly : reads the numbers of a linear problem as written; None for a nonlinear
    one. remarks : lines on wrong known solutions, which are dropped, on far bounds and
    the like. length : returns the number of bytes of its text. file : its file, unless
        that has many problems. paths : its files as another command may name them; none
        if that is impossible.
    """

    problem: Any
    exactly: Any
    remarks: list[str]
    length: Callable[[], int] = int
    file: InputFile | None = None
    paths: Sequence[str] = ()


class Inputs(NamedTuple):
    """The files of a command, and how they are to be read.

    of_folders : those files that come from folders. bounds : bounds of z, numbers or a
        file, that replace those of the problem, and the size from which on they are
        infinite, by name.
    tables : the formulation of which the files are tables, "" if they are none. quiet :
        whether remarks on the input are suppressed.
    others : the values of other options that may name files to read, such as starting
        points. ahead : the files that have been read already, by their names.
    as_written : whether numbers are also read as written, as by --exact.
    """

    files: Sequence[str]
    bounds: Mapping[str, Any] = NO_BOUNDS
    tables: str = ""
    quiet: bool = False
    of_folders: Collection[str] = ()
    others: Sequence[str] = ()
    ahead: Mapping[str, InputFile] = {}
    as_written: bool = False

    @classmethod
    def of(
        cls,
        asked: Bounds,
        files: Sequence[str],
        quiet: bool,
        others: Sequence[str] = (),
    ) -> Inputs:
        """Return the inputs in files, to be read as asked."""
        bounds = {name: getattr(asked, name) for name in fields.BOUND_OPTIONS}
        return cls(files, bounds, asked.tables, quiet, others=others)

    @property
    def paths(self) -> list[str]:
        """Return the files, and the values of options for bounds and starts, which may
        name files too."""
        return [
            *self.files,
            *(text for text in map(self.bounds.get, fields.BOUNDS) if text is not None),
            *self.others,
        ]

    def prepare(
        self, outputs: Mapping[str, str | None], threads: int | None = None
    ) -> None:
        """Set the number of threads; refuse to read standard input twice, and refuse
        outputs as `refuse` does."""
        settle_threads(self.files, threads)
        refuse(
            self.paths.count(STANDARD) > 1,
            "standard input",
            "can be read only once",
            NAME_FILE,
        )
        self.refuse(outputs)

    def refuse(self, outputs: Mapping[str, str | None]) -> None:
        """Refuse outputs, by option, that cannot be written or would overwrite an input
        or each other."""
        written: dict[str, str] = {}
        for option, output in outputs.items():
            if output is None:
                continue
            if source := next(
                (path for path in self.paths if same_file(output, path)), None
            ):
                reason = (
                    "is an input of this run"
                    if source in self.others
                    else "holds the problem"
                )
                raise OptionError(File(output), reason, OTHER_OUTPUT)
            earlier = written.setdefault(os.path.abspath(output), option)
            refuse(
                earlier != option,
                option,
                f"goes to the same file as {earlier}",
                "choose another file for one",
            )
            # An existing log is appended to.
            if output != STANDARD and option != "--resume":
                from lcpcli.files.atomic_write import refuse_unwritable

                refuse_unwritable(output)

    def read(self, takes_models: bool = False, tells: bool = True) -> InputProblem:
        """Read the problem in the files, which has to be linear unless `takes_models`.
        tells : whether to tell the remarks on it; otherwise the caller does, once it
        has accepted its other arguments, so that an error is one line."""
        from lcpcli.files import reading
        from lcpcli.files.inputs import Input

        with self.hint_at_tables(), self.reading():
            if self.tables:
                input_item = self.of_tables()
            else:
                input_item = Input(tuple(reading.files_of(self.files)))
            (input_problem,) = self.problems(input_item, takes_models)
        self.tell(input_problem.remarks if tells else [])
        return input_problem

    def reading(self) -> Line:
        """Return a context in which files are read, which may take long."""
        names = listed(map(source_name, self.files[:2])) if self.files else ""
        more = ", ..." if len(self.files) > 2 else ""
        return Line(f"reading {names}{more}", is_shown=shows_progress(self.quiet))

    def tell(self, remarks: Sequence[str]) -> None:
        for remark in remarks:
            tell(remark, self.quiet)

    @contextmanager
    def hint_at_tables(self) -> Iterator[None]:
        """Open a context in which the error for two files that may be tables of a
        formulation hints at its option."""
        try:
            yield
        except ProblemError as error:
            advice = self.with_tables().hint()
            raise (
                ProblemError(error.parts, error.fault, f"{error.hint}; {advice}")
                if advice
                else error
            ) from None

    def with_tables(self) -> Inputs:
        """Return the inputs with their files read if they are two small tables."""
        if len(self.files) != 2 or self.tables:
            return self
        from lcpcli.files.input_file import InputFile

        if not all(map(_may_be_table, self.files)):
            return self
        with suppress(ProblemError):
            read = {path: InputFile.read(path) for path in self.files}
            return self._replace(ahead={**read, **self.ahead})
        return self

    def hint(self) -> str:
        """Return the line, if any, that says that two tables, which have been read, may
        be those of a formulation."""
        if len(self.files) != 2 or not self.ahead.keys() >= {*self.files}:
            return ""
        read = [self.ahead[path] for path in self.files]
        for row in formulations.TABLE.values():
            if row.tables is not None and row.tables.hints:
                with suppress(ProblemError):  # its folder is missing
                    module = formulations.module_of(row, row.tables.module, "")
                    if advice := module.hint(read):
                        return str(advice)
        return ""

    def of_tables(self) -> Input:
        """Return the input in files that are tables of a formulation."""
        row = formulations.row_of(self.tables)
        assert row.tables is not None
        module = formulations.module_of(row, row.tables.module, row.tables.option)
        input_item: Input = module.input_of(self.files)
        return input_item

    def input_items(self, are_many: bool = False) -> tuple[Iterator[InputItem], bool]:
        """Return the inputs in the files, and whether they may be several problems, as
        they are with `are_many`."""
        from lcpcli.files.inputs import FIRST_NAME, QColumns, inputs

        if self.tables:
            return iter([self.of_tables()]), are_many
        each = inputs(
            self.files,
            streams=are_many,
            of_folders=self.of_folders,
            ahead=self.ahead,
        )
        if are_many:
            return each, True
        first = list(islice(each, 2))
        if isinstance(first[0], QColumns) and first[0].names[0] == FIRST_NAME:
            q_file, columns = first[0].sources[0].file, len(first[0].names)
            means = (
                f"its {columns} columns are {columns} q; if they are M and q, name it "
                "alone"
            )
            # The first file may have been meant as [M | q].
            if columns == len(first[0].Q) + 1:
                self.tell([f"{q_file}: {means}"])
        return chain(first, each), len(first) > 1 or isinstance(first[0], QColumns)

    def problems(
        self, input_item: InputItem, takes_models: bool = False
    ) -> Iterator[InputProblem]:
        """Yield the problems of an input. takes_models : whether they may be
        nonlinear."""
        from lcpcli.files.inputs import QColumns

        if not isinstance(input_item, QColumns):
            file, *others = input_item.files
            is_model = takes_models and file.kind.is_model
            model = file.nonlinear if is_model else None
            if model is None:
                yield self._single(input_item)
                return
            if others:
                from lcpcli.files.input_file import NOT_SECOND

                reason = f"is not needed: {file.source_name} is a model"
                raise ProblemError(others[0].source_name, reason, NOT_SECOND)
            option_values = {flag(name): value for name, value in self.bounds.items()}
            reject_conflicting_options(option_values, NONLINEAR_MODEL)
            remarks = [f"{file.source_name}: {model.note}"] if model.note else []
            yield InputProblem(model, None, remarks, file=file)
            return
        from lcpcli.model.problem import TextNumbers
        from lcpcli.rational.exact_problem import ExactProblem

        first = self.first_of(input_item)
        numbers = TextNumbers(ExactProblem.of_decimals, lambda: True)
        for q, name in zip(input_item.Q.T, input_item.names, strict=True):
            problem = replace(first, q=q, name=name).having(written=numbers)
            yield InputProblem(
                problem, cache(partial(ExactProblem.of_decimals, problem)), []
            )

    def first_of(self, input_item: QColumns) -> Problem:
        from lcpcli.files import beside

        return beside.with_bounds(input_item.first_problem(), self.bounds)

    def _single(self, input_item: Input) -> InputProblem:
        original = changed = input_item.read(self.as_written)
        file, as_given = input_item.files[0], input_item.compact()
        bounds: dict[str, InputFile] = {}  # standard input can be read only once
        if any(bound is not None for bound in self.bounds.values()):
            from lcpcli.files import beside

            changed = beside.with_bounds(
                original, self.bounds, bounds, keeps_digits=self.as_written
            )
        problem, remarks = without_wrong_solutions(changed, file.path)
        # Remarks on what has been read.
        notes = [problem.note] if file.kind.is_model else []
        if problem.has_far_sides and self.bounds.get("infinity") is None:
            from lcpcli.model import usual_units

            notes.append(usual_units.remark(problem))
        if len(input_item.files) == 1 and file.kind.is_table:
            from lcpcli.files import csv_format

            notes.append(csv_format.remark(problem))
        if len(input_item.files) == 1 and file.line is None:  # once, not in each line
            notes.append(problem.formulation.remark(file.fields))
        remarks.extend(f"{file.source_name}: {note}" for note in notes if note)

        @cache
        def exactly() -> ExactProblem:
            data = as_given.exactly(original)
            # A bound may be 0 in double precision alone.
            if changed.is_mixed or changed is not original:
                from lcpcli.files import beside

                data = beside.with_exact_bounds(data, changed, self.bounds, bounds)
            data.problem = problem
            return data

        if changed is not original and original.written is not None:
            from lcpcli.model.problem import TextNumbers

            numbers = TextNumbers(lambda _: exactly(), lambda: False)
            problem = problem.having(written=numbers)
        paths = () if self.tables else input_item.paths  # tables need their option
        return InputProblem(problem, exactly, remarks, as_given.length, file, paths)


def _may_be_table(path: str) -> bool:
    """Return whether a file may be a table, and is so small that it can be read again
    for a mere hint."""
    kind = formats.kind_by_name(path)
    is_small = os.path.isfile(path) and os.path.getsize(path) < SMALL_FILE
    return is_small and (kind is None or kind.is_table)


def without_wrong_solutions(problem: Problem, file: str) -> tuple[Problem, list[str]]:
    """Return the problem without wrong known solutions, and remarks on these and on a
    shipped problem instead of a missing file."""
    vetted, reasons = problem, list[str]()
    if problem.solutions:
        from lcpcli.verify.point import without_wrong_solutions

        vetted, reasons = without_wrong_solutions(problem)
    # The user may have meant a file.
    if os.path.splitext(file)[1] and contents.shipped_file(file):
        reasons.insert(
            0, "no such file; the problem that ships under this name is read"
        )
    return vetted, [f"{source_name(file)}: {reason}" for reason in reasons]


def tell(line: str, quiet: bool = False) -> None:
    if not quiet:
        say(f"lcp: {line}")


def same_file(output: str, other: str) -> bool:
    """Return whether an output goes to an input file; - means standard output and
    standard input, respectively."""
    try:
        one = os.fstat(sys.stdout.fileno()) if output == STANDARD else os.stat(output)
        two = os.fstat(0) if other == STANDARD else os.stat(other)
    except OSError:
        return False
    return os.path.samestat(one, two) and (
        STANDARD not in (output, other) or stat.S_ISREG(one.st_mode)
    )


def settle_threads(files: Iterable[str], threads: int | None = None) -> None:
    """Set the number of BLAS threads in the environment, from which numpy takes it when
    it is loaded later: by default one, unless a file is so large that more threads save
    time.

    threads : the requested number; only this replaces a number that the environment
        already has.
    """
    if threads is not None:
        os.environ.update(dict.fromkeys(VARIABLES, str(threads)))
        return
    are_small = all(
        not os.path.exists(file) or os.path.getsize(file) < LARGE_FILE for file in files
    )
    if are_small and not os.environ.get(GENERAL):
        os.environ.update({name: os.environ.get(name) or "1" for name in VARIABLES})


NO_INPUTS = Inputs(())
methods_run: set[str] = set()  # by this process
Values = dict[str, Any]  # options of a method, by name
AnyProblem: TypeAlias = "Problem | NonlinearProblem"
R = TypeVar("R", bound="Request")
Traces = Callable[[AnyProblem], "tuple[Trace | None, Trace | None]"]


@dataclass(eq=False, repr=False)
class Request(ManyProblems, Reporting):
    """The request of a command that solves.

    method_options : the options of methods, the additions and the starts on the command
        line, by name. numbers : likewise the limits of a run. max_solutions to sweep :
        options of one of the commands alone. inputs : the problems. levels : for a
        comparison, the errors whose first attainment is recorded. adds_auto : whether
        `auto` runs too where none of the methods solves a problem.
    """

    exact: bool = False
    bound: bool = False
    threads: int | None = None
    trace: bool = False
    names: Sequence[str] = ()
    every: int | None = None
    columns: Sequence[str] = ()
    plot: str | None = None
    paths: str | None = None
    max_solutions: int | None = None
    jobs: int | None = None
    cluster: str | None = None
    sequence: bool = False
    resume: str | None = None
    sweep: Sequence[str] = ()
    method_options: Mapping[str, Any] = field(default_factory=dict)
    numbers: Mapping[str, Any] = field(default_factory=dict)
    inputs: Inputs = NO_INPUTS
    variants: Sequence[Variant] = ()
    levels: tuple[float, ...] = ()
    adds_auto: bool = False

    @classmethod
    def of(cls: type[R], **option_values: Any) -> R:
        """Return the request for the values of the options of a command."""
        method_options = pop_options(option_values, OF_METHODS)
        numbers = pop_options(option_values, [each.name for each in LIMITS])
        return cls(method_options=method_options, numbers=numbers, **option_values)

    def prepared(self: R, default: Sequence[str] = (), **more: Any) -> R:
        """Return the request with its inputs and more attributes; set the threads, and
        refuse what cannot be written or compiled. default : the files if the command
        line has none."""
        wants_kernels()  # or its error, before anything is read
        files = files_in(self.files, partial(tell, quiet=self.quiet)) or default
        starts = [
            self.method_options[name] for name in STARTS if name in self.method_options
        ]
        inputs = Inputs.of(self, files, self.quiet, starts)
        # With --resume there is no other output.
        outputs = {
            "--output": self.output if self.resume is None else None,
            "--plot": self.plot,
            "--paths": self.paths,
            "--resume": self.resume,
        }
        inputs.prepare(outputs, self.threads)
        of_folders = set(files) - {*self.files, *default}
        inputs = inputs._replace(of_folders=of_folders, as_written=self.exact)
        return replace(self, inputs=inputs, **more)

    def reading(self: R, ahead: Mapping[str, InputFile]) -> R:
        """Return the request with files that have been read, by their names."""
        return replace(self, inputs=self.inputs._replace(ahead=ahead))

    @property
    def option_values(self) -> dict[str, Any]:
        """Return the values of the options by flag; all options of methods are among
        them, and no method means auto."""
        flags = {flag(name): True for name in (*self.method_options, *self.numbers)}
        method = None if [*self.variants] == [Variant(AUTO)] else self.variants
        return flags | super().option_values | {"--method": method}

    @property
    def limits(self) -> Limits:
        return Limits(**self.numbers)

    def prove(
        self, result: Result, exactly: Callable[[], ExactProblem] | None
    ) -> Result:
        """Return the result with the requested proofs, for numbers as written, as far
        as the remaining time allows."""
        if self.exact and exactly is not None:
            from lcpcli.solving.proof import prove

            result = prove(exactly, result)
        if not self.bound or result.method in NONLINEAR:  # whose run has proved it
            return result
        from lcpcli.solving.driver import with_bound

        return with_bound(result)

    def options_for(self, problem: AnyProblem) -> list[Values]:
        """Return for each method its options, with those of the command line; raise
        OptionError for one that no method has."""
        from lcpcli.model.problem import Problem

        if is_nonlinear := not isinstance(problem, Problem):
            for variant in self.variants:
                if variant != Variant(AUTO) and variant.method not in NONLINEAR:
                    reason = (
                        f"{variant} solves linear problems only, and this model is "
                        "nonlinear"
                    )
                    raise OptionError(
                        "--method", reason, f"give {listed([*NONLINEAR])}"
                    )
            reject_conflicting_options(self.option_values, NONLINEAR_MODEL)
        explicit_options = {
            name: _value(name, text, problem)
            for name, text in self.method_options.items()
        }
        if is_nonlinear:
            return [explicit_options | variant.options for variant in self.variants]
        first, *others = [
            name for name in START_OPTIONS if name in explicit_options
        ] or [""]
        if others:
            raise OptionError(
                flag(others[0]),
                f"gives the starting point, and so does {flag(first)}",
                LEAVE_ONE_OUT,
            )
        valid_names = [
            known_options(variant.method) - set(variant.options)
            for variant in self.variants
        ]
        for name in (
            name
            for name in explicit_options
            if not any(name in names for names in valid_names)
        ):
            self._refuse(name)
        options_of_methods = []
        for variant, names in zip(self.variants, valid_names, strict=True):
            options_of_methods.append(
                {
                    name: value
                    for name, value in explicit_options.items()
                    if name in names
                }
                | variant.options
            )
            options.check(declared(variant.method).options, options_of_methods[-1])
        return options_of_methods

    def _refuse(self, name: str) -> None:
        """Raise OptionError for an option that none of the methods has, naming the
        methods that have it."""
        reason = f"has no effect with {' and '.join(map(str, self.variants))}"
        if name in START_OPTIONS:
            verb = "uses" if len(self.variants) == 1 else "use"
            reason += f", which {verb} no starting point"
            raise OptionError(flag(name), reason, LEAVE_OUT)
        owners = [method for method in METHODS if name in known_options(method)]
        is_chosen = len(self.variants) == 1 and self.variants[0].method != "auto"
        cure = "leave it out, or give" if is_chosen else "add"
        hint = f"it belongs to {listed(owners)}: {cure} --method {' or '.join(owners)}"
        raise OptionError(flag(name), reason, hint)


class Runs(NamedTuple):
    """The runs of the requested methods on a problem.

    traces : makes the empty trace and curve of a run. of_many : whether there are many
        problems; their results have no labels, and no progress is shown.
    compiled : whether there are so many that loading the extra `fast` is worthwhile; by
        default as the process is set.
    """

    request: Request
    problem: AnyProblem
    traces: Traces
    of_many: bool = False
    compiled: bool | None = None

    def results(
        self, options_of_methods: Sequence[Values], compared: bool = False
    ) -> Iterator[Result]:
        """Yield one result for each method.

        options_of_methods : as from `options_for`. compared : whether the times are
        compared.
        """
        from lcpcli.model.problem import Problem
        from lcpcli.solving import driver

        request = self.request
        # The times are shown to somebody.
        is_shown = not (request.quiet or request.output)
        is_open = request.adds_auto
        for variant, label, values in zip(
            request.variants, labels(request.variants), options_of_methods, strict=True
        ):
            is_first = variant.method not in methods_run
            methods_run.add(variant.method)
            once = partial(self._once, variant.method, values)
            for result in driver.repeated(once, compared, is_first and is_shown):
                is_open &= not (result.solved or result.interrupted)
                named = label if result.method == variant.method else result.method
                yield result if self.of_many else replace(result, label=named)
        if is_open and isinstance(self.problem, Problem):
            repeated = driver.repeated(
                partial(self._once, AUTO, {}), compared, is_shown
            )
            yield from (replace(result, label=AUTO) for result in repeated)

    def _once(self, method: str, values: Values, again: bool) -> Result:
        """Return the result of a run with these options of the method. again : whether
        an earlier run is repeated, for its time."""
        from lcpcli.model.problem import Problem
        from lcpcli.solving import driver

        problem, request = self.problem, self.request
        trace, curve = self.traces(problem)
        run_options: dict[str, Any] = {
            "limits": request.limits,
            "trace": trace,
            "curve": curve,
            "compiled": self.compiled,
            **values,
        }
        if not isinstance(problem, Problem):
            from lcpcli.solving.solve_mcp import run_nonlinear

            z0 = run_options.pop("z0", None)
            begun = problem if z0 is None else problem.starting_at(z0)
            run_options |= {
                "trace": trace or False,
                "threads": request.threads,
                "proof": request.bound,
            }
            return run_nonlinear(begun, interrupts="return", **run_options)
        is_watched = shows_progress(request.quiet) and not self.of_many
        with Line(is_shown=is_watched) as line:
            run_options |= {
                "compiled": self.compiled and method == "auto",
                "observe": line.tell if is_watched and not again else None,
            }
            return driver.run(
                problem.anew() if again else problem,
                method,
                began=seconds(),
                **run_options,
            )


def pop_options(option_values: dict[str, Any], names: Iterable[str]) -> dict[str, Any]:
    """Remove the options of these names, and return those that the command line has."""
    values = {name: option_values.pop(name, None) for name in names}
    return {name: value for name, value in values.items() if value is not None}


def _value(name: str, text: Any, problem: AnyProblem) -> Any:
    """Return the value of an option for a problem: a vector or a basis if the option
    sets a start."""
    if name not in STARTS:
        return text
    from lcpcli.files import beside
    from lcpcli.model.problem import Problem

    if name == "basis" and isinstance(problem, Problem):
        return beside.read_states(text, problem)
    if beside.typed_numbers(flag(name), text) is None and not (
        text and os.path.exists(text)
    ):
        raise OptionError(
            flag(name),
            f"{quoted(text)} is neither a file nor numbers",
            "write 1,-2,0.5 or name a file",
        )
    return beside.read_start(
        flag(name),
        text,
        problem.n,
        None if name == "z0" else problem.box,
        lambda: problem.names,
    )


def with_references(problems: Sequence[AnyProblem], limits: Limits) -> list[AnyProblem]:
    """Return the problems, linear ones with references for errors if these are computed
    within the time limit of a run."""
    from lcpcli.enumeration import others
    from lcpcli.model.problem import Problem
    from lcpcli.solving import proof

    referenced = [*problems]
    try:
        for i, problem in enumerate(problems):
            if isinstance(problem, Problem):
                with deadline_after(limits.time_limit):
                    solved = proof.with_reference(problem)
                referenced[i] = others.with_all_references(solved)
    except KeyboardInterrupt:
        tell(
            "interrupted while solving for the reference of the errors, before "
            "the first run"
        )
        raise
    return referenced
