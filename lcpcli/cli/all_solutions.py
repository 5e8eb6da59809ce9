"""lcp solve --all: the search for all solutions of a problem, until it ends or is ended."""

from __future__ import annotations

import signal
from collections.abc import Iterator
from contextlib import contextmanager
from functools import partial
from typing import TYPE_CHECKING

from lcpcli import clock
from lcpcli.cli.main import INTERRUPTED, NO_SOLUTION, NOT_SOLVED, SOLVED
from lcpcli.cli.output import STANDARD, Output, show
from lcpcli.cli.session import Outcome, Request
from lcpcli.errors import OptionError, ProblemError
from lcpcli.options import MAX_ITERATIONS, TOL, flag

if TYPE_CHECKING:
    from lcpcli.enumeration.search import Solutions, SolutionSet
    from lcpcli.files.contents import Source
    from lcpcli.files.inputs import Work
    from lcpcli.methods.variants import Variant
    from lcpcli.rational.problem import ExactProblem

OF_ONE = (TOL.name, MAX_ITERATIONS.name, "trace", "every", "bound", "jobs", "cluster", "resume")


class Search:
    """List every solution of one problem, with decimals as written; OptionError for options that are for one solution.

    exact : whether numbers are shown as fractions.
    """

    takes_many = False
    levels: tuple[float, ...] = ()

    def __init__(self, asked: Request, variant: Variant, exact: bool) -> None:
        self._asked, self._exact = asked, exact
        if variant.method != "auto":
            hint = "leave out --method, or --all"
            raise OptionError("--all", f"has a method of its own, and {variant} finds one solution at most", hint)
        for name, value in {**asked.own, **{name: getattr(asked, name) for name in OF_ONE}}.items():
            if value not in (None, False):
                raise OptionError(flag(name), "has no effect with --all", "leave it out")
        if asked.plot == STANDARD:
            raise OptionError("--plot -", "has no effect with --all", "name a file for the picture")

    def take_several(self, works: Iterator[Work], output: Output) -> int | None:  # noqa: ARG002
        """Refuse several problems."""
        from lcpcli.files.games import hint

        otherwise = "give the others to another run"
        raise OptionError("--all", "takes one problem", hint(self._asked.inputs.files) or otherwise)

    def outcome(self, works: Iterator[Work], output: Output) -> Outcome:
        """What the search finds; it is solved if the list is complete or as long as was asked for."""
        from lcpcli.enumeration import search as sets

        work, inputs, picture = next(works), self._asked.inputs, self._asked.plot
        (held,) = inputs.held(work)
        inputs.tell(held.remarks)
        data = held.exactly()
        if picture is not None:
            from lcpcli.report import solutions

            solutions.require(data.problem)
        try:
            found = self._found(data)
        except ProblemError as fault:
            raise fault.inside(str(work.sources[0])) from None
        text = "" if output.silent else self._text(found, work.sources[0], output)
        codes = {sets.TIME_LIMIT: NOT_SOLVED, sets.INTERRUPTED: INTERRUPTED, sets.UNSOLVABLE: NO_SOLUTION}
        draw = partial(_draw, found, picture) if picture is not None else int
        return Outcome(text, codes.get(found.status, SOLVED), draw)

    def _found(self, data: ExactProblem) -> SolutionSet:
        """What the search finds, until it ends or is ended."""
        from lcpcli.enumeration import search as sets
        from lcpcli.enumeration.search import solutions

        began, most = clock.seconds(), self._asked.max_solutions
        search = solutions(data, time_limit=self._asked.time_limit, max_solutions=most)
        with _stopped_by_interrupts(search) as interrupts:
            for _ in search:
                continue
        ended = sets.INTERRUPTED if interrupts else sets.ENOUGH if len(search.pieces) == most else sets.TIME_LIMIT
        return sets.SolutionSet(search, ended, clock.seconds() - began)

    def _text(self, found: SolutionSet, source: Source, output: Output) -> str:
        """What is shown of the solutions."""
        from lcpcli.report import formats, solutions

        if output.form == "json":
            return solutions.in_json(found, source, self._exact)
        if output.form == "csv":
            return solutions.in_csv(found, self._exact)
        table = solutions.build(found, self._exact, output.form)
        return formats.typeset([table], output.form, output.width, output.color)


@contextmanager
def _stopped_by_interrupts(search: Solutions) -> Iterator[list[int]]:
    """A context in which Ctrl-C ends the search with what it has found, and a second one as usual; the signals."""
    received: list[int] = []
    usual = signal.getsignal(signal.SIGINT)

    def stop(number: int, _: object) -> None:
        received.append(number)
        search.stop()
        signal.signal(signal.SIGINT, usual)

    signal.signal(signal.SIGINT, stop)
    try:
        yield received
    finally:
        signal.signal(signal.SIGINT, usual)


def _draw(found: SolutionSet, picture: str) -> None:
    """Write the picture of the complementary cones."""
    from lcpcli.report import plotting
    from lcpcli.report.solutions import cones

    show(plotting.cones(cones(found), plotting.form_of(picture)), picture)
