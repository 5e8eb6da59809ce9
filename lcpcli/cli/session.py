"""From parsed options to an exit code: read, run, show."""

from __future__ import annotations

import os
import stat
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import replace
from functools import partial
from itertools import chain
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeAlias

from lcpcli import options
from lcpcli.cli import problems as problems_in
from lcpcli.cli import runs, threads
from lcpcli.cli.exit_codes import BAD_INPUT, INTERRUPTED, of_several
from lcpcli.cli.methods import for_methods
from lcpcli.cli.options import limits
from lcpcli.cli.output import HERE, Output, Plot, emit, terminal
from lcpcli.cli.progress import wanted
from lcpcli.errors import LCPError, OptionError
from lcpcli.files.fields import OF_BOUNDS
from lcpcli.files.formats import LINES

if TYPE_CHECKING:
    from lcpcli.cli.problems import Held
    from lcpcli.files.contents import Source
    from lcpcli.files.inputs import Work
    from lcpcli.methods.variants import Variant
    from lcpcli.rational.problem import ExactProblem
    from lcpcli.solving.result import Result

Faults: TypeAlias = "list[tuple[Source, LCPError]]"
Results: TypeAlias = "Sequence[Sequence[Result]]"
FOR_MANY = ("jobs", "cluster", "resume")
OF_OUTPUT = ("form", "trace", "every", "output", "quiet", "bound")


def run(
    files: Sequence[str],
    variants: Sequence[Variant],
    given: dict[str, Any],
    *,
    levels: tuple[float, ...] = (),
    exact: bool = False,
    many: Callable[[Iterator[Work], Output], int] | None = None,
) -> int:
    """Run the methods on each of the problems in the files; show the results; return the exit code.

    levels : relative errors whose first attainment is recorded; with them, and for figures, a problem without a known
        solution is solved beforehand to provide the reference for errors.
    exact : prove each result in rational arithmetic.
    many : what is done instead where there may be several problems, or where it is asked for.
    """
    threads.settle(files, given["threads"])
    output = Output(compared=bool(levels), **{name: given[name] for name in OF_OUTPUT})
    plot = Plot(given["plot"], levels)
    options.check((options.WARM, options.INFINITY), given)
    if exact:
        from lcpcli.rational.linear import require

        require()
    of_z = {name: given[name] for name in OF_BOUNDS}
    _refuse_amiss(problems_in.inputs(files, of_z), output, plot, given.get("resume"))
    bounds = limits(given)
    are_many = many is not None and _is_for_many(given, output)
    works, several = problems_in.works(files, given.get("game", False), are_many)
    if several and not given["quiet"]:
        from lcpcli.files.games import hint

        if told := hint(files):
            problems_in.tell(told)
    if many is not None and several:
        return many(works, output)
    held, sources, faults = _read(works, of_z, given["quiet"])
    if not held:
        if not output.silent:
            _show(_text([], [], faults, output, (None, False), compared=False), output, (None, False))
        return BAD_INPUT
    problems, data = [each.problem for each in held], [each.exactly for each in held if exact]
    exactly = held[0].exactly if many is not None and _is_searched(held[0]) else None
    del held  # with the contents of files
    plot.require_room(len(problems))
    chosen = [for_methods(given, variants, problem) for problem in problems]
    if levels or plot.path is not None:
        problems = runs.all_referred(problems, bounds)
    screen = (None, False) if output.path else terminal()
    each = runs.each(
        problems, variants, chosen, bounds, given.get("warm"), (output, plot, screen[0]), wanted(given["quiet"])
    )
    results: Results
    results, interrupted = runs.finished(each, data, bounds, given["bound"])
    _write_trace(results, output.trace_path)
    text_of = partial(_text, sources=sources, faults=faults, output=output, screen=screen, compared=bool(levels))
    if not output.silent:
        results, text = _with_conclusions(results, bool(levels), None if interrupted else exactly, text_of)
        _show(text, output, screen)
    plot.show(results)
    ended = [result for own in results for result in own]
    if interrupted or any(result.interrupted for result in ended):
        return INTERRUPTED
    return of_several([result.exit_code for result in ended] + [BAD_INPUT] * bool(faults))


def _with_conclusions(
    results: Results, compared: bool, exactly: Callable[[], ExactProblem] | None, text_of: Callable[[Results], str]
) -> tuple[Results, str]:
    """The results with what is concluded from them, and their text; without that if Ctrl-C comes before it is made."""
    try:
        made: Results = [_concluded(own, compared) for own in results]
        if exactly is not None:
            made = [[_among_others(result, exactly) for result in own] for own in made]
        return made, text_of(made)
    except KeyboardInterrupt:
        from lcpcli.solving.driver import interrupted

        bare = [interrupted(own) for own in results]
        return bare, text_of(bare)


def _concluded(results: Sequence[Result], compared: bool) -> list[Result]:
    """Results on one problem with the conclusions from them and, in a comparison, with their claims verified."""
    from lcpcli.solving.driver import concluded, verified

    return [verified(result) if compared else result for result in concluded(results)]


def _is_searched(held: Held) -> bool:
    """Whether other solutions of a problem are sought."""
    from lcpcli.enumeration.others import is_searched

    return is_searched(held.problem, held.length)


def _among_others(result: Result, exactly: Callable[[], ExactProblem]) -> Result:
    """The result with whether the problem has other solutions, and whether it has any as written."""
    if not result.solved or result.interrupted:
        return result
    from lcpcli.enumeration.others import search_others

    findings = search_others(result.z, exactly)
    return replace(result, others=findings.others, exactly_solvable=findings.solvable)


def _refuse_amiss(files: Sequence[str], output: Output, plot: Plot, resumed: str | None) -> None:
    """Refuse conflicting inputs and outputs."""
    own = output.path if resumed is None else None  # with --resume there is no other output
    written = {"--output": own, "--trace": output.trace_path, "--plot": plot.path, "--resume": resumed}
    refuse_clashes(files, written)
    if output.path is None and resumed is None and not output.silent:
        refuse_standard_output(files)
    if plot.path == HERE and output.path is None and output.form != "table":
        form = {"markdown": "Markdown", "latex": "LaTeX"}.get(output.form, output.form.upper())
        raise OptionError("--plot -", f"would be mixed into the {form}", "name a file, or write that to one by -o")


def _is_for_many(given: Mapping[str, Any], output: Output) -> bool:
    """Whether the options ask for what is done with several problems."""
    return any(given[name] is not None for name in FOR_MANY) or (output.path or "").casefold().endswith(LINES)


def _read(works: Iterator[Work], bounds: problems_in.Given, quiet: bool) -> tuple[list[Held], list[Source], Faults]:
    """The problems in the inputs, where they are, and what is wrong with the others; of a single one it is raised."""
    inputs = list(works)
    held: list[Held] = []
    sources: list[Source] = []
    faults: Faults = []
    for work in inputs:
        try:
            found = list(problems_in.held(work, bounds))
        except LCPError as fault:
            if len(inputs) == 1:
                raise
            faults.append((work.sources[0], fault))
            problems_in.tell(str(fault))
            continue
        held += found
        sources += work.sources
        for line in [] if quiet else chain.from_iterable(each.remarks for each in found):
            problems_in.tell(line)
    return held, sources, faults


def _write_trace(results: Results, path: str | None) -> None:
    """Write all iterates to the file for them, if there is one."""
    if path is None:
        return
    from lcpcli.files import atomic_write
    from lcpcli.report import result_csv

    atomic_write.write_whole(path, result_csv.iterates_text([result for own in results for result in own]))


def _text(
    results: Results,
    sources: Sequence[Source],
    faults: Faults,
    output: Output,
    screen: tuple[int | None, bool],
    compared: bool,
) -> str:
    """What is shown of the results, in JSON also what could not be read."""
    from lcpcli.report import formats as report

    width, color = screen
    shown = [[output.shown(result, width) for result in own] for own in results]
    whole, iterates = output.path is not None, output.with_iterates
    places = sources[: len(shown)]  # the others were not reached
    text = report.render(shown, places, output.form, width, color, compared=compared, whole=whole, iterates=iterates)
    if output.form == "json":
        text += report.unread(faults)
    return text


def _show(text: str, output: Output, screen: tuple[int | None, bool]) -> None:
    """Print the text, or write it to the output file."""
    if output.path is None:
        emit(text, screen[1])
    else:
        from lcpcli.files import atomic_write

        atomic_write.write_whole(output.path, text)


def refuse_clashes(inputs: Sequence[str], outputs: Mapping[str, str | None]) -> None:
    """Refuse to read standard input twice, and outputs, by their options, that would overwrite a problem or each
    other."""
    refuse_twice(inputs)
    written: dict[Path, str] = {}
    for option, output in outputs.items():
        if output is None:
            continue
        if any(same_file(output, name) for name in inputs):
            raise OptionError(output, "holds the problem", "choose another file for the output")
        earlier = written.setdefault(Path(output).absolute(), option)
        if earlier != option:
            raise OptionError(option, f"goes to the same file as {earlier}", "choose another file for one")


def refuse_standard_output(inputs: Sequence[str]) -> None:
    """Refuse to print to a file that is read, which would go on for ever."""
    if any(same_file(HERE, name) for name in inputs):
        raise OptionError("standard output", "goes to a file of problems", "choose another file for the output")


def refuse_twice(paths: Sequence[str | None]) -> None:
    """Raise OptionError if standard input is given for two files."""
    from lcpcli.files.contents import STANDARD_INPUT

    if paths.count(STANDARD_INPUT) > 1:
        raise OptionError("standard input", "can be read only once", "name a file")


def same_file(output: str, other: str) -> bool:
    """Whether an output goes to another file: - is standard output, and standard input as the other one."""
    try:
        one = os.fstat(1) if output == HERE else Path(output).stat()
        two = os.fstat(0) if other == HERE else Path(other).stat()
    except OSError:
        return False
    return os.path.samestat(one, two) and (HERE not in (output, other) or stat.S_ISREG(one.st_mode))
