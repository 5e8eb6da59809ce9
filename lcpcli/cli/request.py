"""The request of a command, and runs of methods on a problem: each with the options that it has, timed, with proofs.

No displayed time includes the extra cost of a first run: imports never count, and short runs are repeated, as the first
one waits for memory and caches. Of runs that are compared, which are repeated more often, the least times count.
"""

from __future__ import annotations

import os
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import replace
from functools import partial
from types import MappingProxyType, SimpleNamespace
from typing import TYPE_CHECKING, Any, TypeAlias

from lcpcli import options
from lcpcli.cli.declarations import FLAGS, OF_METHODS, STARTS, refuse_beside
from lcpcli.cli.problems import Inputs, tell
from lcpcli.cli.terminal import Line, shows_progress
from lcpcli.clock import seconds
from lcpcli.errors import OptionError, listed
from lcpcli.files.contents import files_in
from lcpcli.files.fields import BOUND_OPTIONS
from lcpcli.interrupts import within
from lcpcli.methods.registry import METHODS, NONLINEAR, START_OPTIONS, declared, known_options
from lcpcli.methods.variants import Variant, labels
from lcpcli.options import AUTO, LIMITS, Limits, wants_kernels
from lcpcli.report.wording import flag

if TYPE_CHECKING:
    from lcpcli.model.nonlinear import NonlinearProblem
    from lcpcli.model.problem import Problem
    from lcpcli.rational.exact_problem import ExactProblem
    from lcpcli.solving.result import Result
    from lcpcli.solving.trace import Trace


_methods: set[str] = set()  # the methods that this process has run
Values = dict[str, Any]  # options of a method, by name
AnyProblem: TypeAlias = "Problem | NonlinearProblem"
Traces = Callable[[AnyProblem], "tuple[Trace | None, Trace | None]"]


class Request(SimpleNamespace):
    """The request of a command: its options, by name. One that is not given is None, False for a flag, or empty; one
    that the command does not have is None.

    inputs : the problems. own : the options of methods, the additions and the starts that are given, by name. numbers :
    likewise the limits of a run, and what a bench needs. levels : for a comparison, the errors whose first attainment
    is recorded. adds_auto : whether `auto` runs too where none of the methods solves a problem.
    """

    inputs: Inputs
    own: Mapping[str, Any] = MappingProxyType({})
    numbers: Mapping[str, Any] = MappingProxyType({})
    variants: Sequence[Variant] = ()
    levels: tuple[float, ...] = ()
    adds_auto = False

    def __getattr__(self, name: str) -> None:
        if name not in FLAGS:
            raise AttributeError(name)

    @classmethod
    def of(cls, files: Sequence[str], default: Sequence[str] = (), **given: Any) -> Request:
        """Return the request for files and folders; set the threads, and refuse what cannot be written or compiled."""
        wants_kernels()  # or its error, before anything is read
        found = files_in(files, partial(tell, quiet=given["quiet"])) or default
        how = {name: given.pop(name) for name in ("q", *BOUND_OPTIONS, "game")}
        starts = [given[name] for name in STARTS if given.get(name) is not None]
        of_folders = set(found) - {*files, *default}
        inputs = Inputs.of(found, **how, quiet=given["quiet"], of_folders=of_folders, others=starts)
        own, numbers = taken(given, OF_METHODS), taken(given, [limit.name for limit in LIMITS])
        request = cls(inputs=inputs, own=own, numbers=numbers, **given)
        path = request.output if request.resume is None else None  # with --resume there is no other output
        outputs = {"--output": path, "--trace": request.trace or None, "--plot": request.plot, "--paths": request.paths}
        inputs.prepare({**outputs, "--resume": request.resume}, request.threads)
        return request

    @property
    def given(self) -> dict[str, Any]:
        """Return the values of the options by flag; those of methods are all given, and no method stands for auto."""
        own = {
            flag(f"no-{name}" if value is False else name): True for name, value in {**self.own, **self.numbers}.items()
        }
        method = None if [*self.variants] == [Variant(AUTO)] else self.variants
        fields = {FLAGS.get(name) or flag(name): value for name, value in vars(self).items()}
        return own | fields | {"--method": method}

    @property
    def limits(self) -> Limits:
        return Limits(**self.numbers)

    def run(
        self,
        problem: AnyProblem,
        chosen: Sequence[Values],
        traces: Traces,
        compared: bool = False,
        of_many: bool = False,
        compiled: bool | None = None,
    ) -> Iterator[Result]:
        """Yield one result for each method.

        chosen : as from `options_for`. traces : makes the empty trace and curve of a run. compared : whether the times
        are compared. of_many : whether there are many problems; their results have no labels, and no progress is shown.
        compiled : whether there are so many that the extra `fast` is worth loading; by default as the process is set.
        """
        from lcpcli.model.problem import Problem
        from lcpcli.solving import driver

        limits, watched = self.limits, shows_progress(self.quiet) and not of_many

        def once(method: str, values: Values, again: bool, keeps: bool) -> Result:
            trace, curve = traces(problem) if keeps else (None, None)
            own: dict[str, Any] = {"limits": limits, "trace": trace, "curve": curve, "compiled": compiled, **values}
            if not isinstance(problem, Problem):
                from lcpcli.solving.solve_mcp import run_nonlinear

                z0 = own.pop("z0", None)
                begun = problem if z0 is None else problem.starting_at(z0)
                own |= {"trace": trace or False, "threads": self.threads, "proof": self.bound}
                return run_nonlinear(begun, interrupts="return", **own)
            with Line() as line:
                own |= {"compiled": compiled and method == "auto", "observe": line.tell if watched else None}
                return driver.run(problem.anew() if again else problem, method, began=seconds(), **own)

        is_open = self.adds_auto
        for variant, label, values in zip(self.variants, labels(self.variants), chosen, strict=True):
            is_first = variant.method not in _methods
            _methods.add(variant.method)
            for result in driver.repeated(partial(once, variant.method, values), compared, is_first):
                is_open &= not (result.solved or result.interrupted)
                named = label if result.method == variant.method else result.method
                yield result if of_many else replace(result, label=named)
        if is_open and isinstance(problem, Problem):
            repeated = driver.repeated(partial(once, AUTO, {}), compared, True)
            yield from (replace(result, label=AUTO) for result in repeated)

    def prove(self, result: Result, exactly: Callable[[], ExactProblem] | None) -> Result:
        """Return the result with the requested proofs, for numbers as written, as far as its run has left time."""
        if self.exact and exactly is not None:
            from lcpcli.solving.proof import prove

            result = prove(exactly, result)
        if not self.bound or result.method in NONLINEAR:  # whose run has proved it
            return result
        from lcpcli.solving.driver import with_bound

        return with_bound(result)

    def options_for(self, problem: AnyProblem) -> list[Values]:
        """Return for each method its options, with the given ones; raise OptionError if no method has a given one."""
        from lcpcli.model.problem import Problem

        if is_nonlinear := not isinstance(problem, Problem):
            for variant in self.variants:
                if variant.method != AUTO and variant.method not in NONLINEAR:
                    fault = f"{variant} solves linear problems only, and this model is nonlinear"
                    raise OptionError("--method", fault, f"give {listed([*NONLINEAR])}")
            refuse_beside("a nonlinear model", self.given)
        given = {name: _value(name, text, problem) for name, text in self.own.items()}
        if is_nonlinear:
            return [given | variant.options for variant in self.variants]
        first, *others = [name for name in START_OPTIONS if name in given] or [""]
        if others:
            raise OptionError(flag(others[0]), f"gives the starting point, and so does {flag(first)}", "leave one out")
        known = [known_options(variant.method) - set(variant.options) for variant in self.variants]
        for name in (name for name in given if not any(name in own for own in known)):
            self._refuse(name, given[name])
        chosen = []
        for variant, own in zip(self.variants, known, strict=True):
            chosen.append({name: value for name, value in given.items() if name in own} | variant.options)
            options.check(declared(variant.method).options, chosen[-1])
        return chosen

    def _refuse(self, name: str, value: Any) -> None:
        """Raise OptionError for an option that none of the methods has, naming the methods that have it."""
        fault = f"has no effect with {' and '.join(map(str, self.variants))}"
        if name in START_OPTIONS:
            fault += f", which use{'s' * (len(self.variants) == 1)} no starting point"
            raise OptionError(flag(name), fault, "leave it out")
        owners = [method for method in METHODS if name in known_options(method)]
        if not owners:
            raise OptionError(flag(name), fault, "it is for nonlinear models: leave it out")
        is_chosen = len(self.variants) == 1 and self.variants[0].method != "auto"
        cure = "leave it out, or give" if is_chosen else "add"
        hint = f"it belongs to {listed(owners)}: {cure} --method {' or '.join(owners)}"
        raise OptionError(flag(f"no-{name}" if value is False else name), fault, hint)


def taken(given: dict[str, Any], names: Iterable[str]) -> dict[str, Any]:
    """Return the options of these names that are given, and take them all away."""
    own = {name: given.pop(name, None) for name in names}
    return {name: value for name, value in own.items() if value is not None}


def _value(name: str, given: Any, problem: AnyProblem) -> Any:
    """Return the value of an option for a problem: a vector or states if the option gives a start."""
    if name not in STARTS:
        return given
    from lcpcli.files import beside
    from lcpcli.model.problem import Problem

    if name == "basis" and isinstance(problem, Problem):
        return beside.read_states(given, problem)
    if beside.typed_numbers(given) is None and not (given and os.path.exists(given)):
        raise OptionError(flag(name), f"{given!r} is neither a file nor numbers", "write 1,-2,0.5 or name a file")
    return beside.read_start(flag(name), given, problem.n, None if name == "z0" else problem.box, lambda: problem.names)


def with_references(problems: Sequence[AnyProblem], limits: Limits) -> list[AnyProblem]:
    """Return the problems, linear ones with references for errors if found within the time limit of a run."""
    from lcpcli.enumeration import others
    from lcpcli.model.problem import Problem
    from lcpcli.solving import proof

    found = list[AnyProblem]()
    try:
        for problem in problems:
            if isinstance(problem, Problem):
                with within(limits.time_limit):
                    solved = proof.with_reference(problem)
                found.append(others.with_all_references(solved))
            else:
                found.append(problem)
        return found
    except KeyboardInterrupt:
        tell("interrupted while solving for the reference of the errors, before the first run")
        raise
