"""The outcome of runs in lines of text: for one run the verdict, main numbers and z; for several, a row of costs
each."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Sequence

import numpy as np

from lcpcli.errors import count
from lcpcli.linalg.doubles import ROW_ROUNDING
from lcpcli.model.origins import OwnNames
from lcpcli.model.start import STATES
from lcpcli.report import wording
from lcpcli.report.wording import ELLIPSIS, LEVELS, PIPE_WIDTH, duration, error, name, residual, short
from lcpcli.solving.result import Result
from lcpcli.verify.digits import fewest

DIGITS = 7  # of z at most, as in the paper's tables
ENOUGH_DIGITS = 6  # of z: a line warns if the data determine fewer, as some printed digits then mean nothing
OTHERS = {None: "", False: "; the only solution", True: "; one of several: --all lists them"}
UNSOLVABLE = "; with the numbers as written there is no exact solution"
SETTLED = ("infeasible", "unsolvable")  # the statuses without a z of interest
SHORT = {"iteration_limit": "k limit", "time_limit": "t limit"}  # for crowded rows
NOT_REACHED = "-"
WIDE_SPREAD = 2.0  # the ratio of the median time to the least from which on a line warns of disturbances


def verdict(result: Result) -> str:
    """Return a line on how the run ended, and by which methods, unless the problem is proved to have no solution."""
    by = f"by {', '.join(result.route)}"
    if result.solved:
        others = UNSOLVABLE if result.exactly_solvable is False else OTHERS[result.others]
        return f"{result.status.word} {by}: {_work(result)}{others}"
    if result.status.word in SETTLED:
        return result.message
    return f"{name(result)}{f' ({by})' * (result.route != (result.method,))} {result.message}"


def remark(result: Result) -> str:
    """Return a line on how a run ended that did not solve the problem, with the name of the run."""
    return f"{name(result)}{':' * (result.status.word in SETTLED)} {result.message}"


def _work(result: Result) -> str:
    counts = count(result.iterations, "iteration"), count(result.evaluations, "evaluation")
    return ", ".join([*counts, duration(result.seconds)])


def facts(result: Result, width: int | None, whole: bool) -> list[str]:
    """Return lines with the work and its parts, the residuals, the error and z, and with bounds also the basis.

    whole : whether to show all of a long z instead of what fits on one line.
    """
    parts = {"set-up": result.setup_seconds, "iterations": result.solve_seconds, "verification": result.verify_seconds}
    times = ", ".join(f"{part} {duration(seconds)}" for part, seconds in parts.items())
    if result.status.word in SETTLED:
        return [f"by {', '.join(result.route)}: {_work(result)}", times]
    lines = [times] if result.solved else [_work(result), times]
    measures = f"residual {residual(result)}, relative {short(result.relative_residual, ROW_ROUNDING)}"
    if result.error is not None:
        measures += f", error {error(result.error, result.problem)}"
    lines += [measures, *_few_digits(result), *_vector(result, width or PIPE_WIDTH, whole)]
    return [*lines, *_basis(result, width or PIPE_WIDTH)]


def _few_digits(result: Result) -> list[str]:
    """Return a line on the number of digits of z that the data determine, if that is less than the printed number."""
    if result.digits is None:
        return []
    least, i = fewest(result.problem, result.z, np.array(result.digits, dtype=float))
    if least >= ENOUGH_DIGITS:
        return []
    digits = f"about {count(least, 'digit')}" if least else "no digit"
    return [f"the data determine {digits} of z{i + 1}: rounding them once changes the others"]


def _basis(result: Result, width: int) -> list[str]:
    """Return a line with the state of each variable, or with the numbers of variables in each state if it is too long;
    no line without bounds."""
    states = result.states
    if states is None or len(line := f"basis = ({', '.join(states)})") <= width:
        return [] if states is None else [line]
    counts = Counter(states)
    return [f"basis: {', '.join(f'{counts[state]} {state}' for state in STATES if counts[state])}"]


def short_vector(result: Result, width: int) -> str:
    """Return z in a line of that width: all components, or the first ones and the last."""
    n = result.problem.n
    for room in range(max(min(n, width // 3), 1), 0, -1):
        cells = _cells(result, slice(n))
        if room < n:
            cells = [*_cells(result, slice(room - 1)), ELLIPSIS, *_cells(result, slice(n - 1, n))]
        line = f"({', '.join(cells)})"
        if len(line) <= width or room <= 2:
            break
    return line


def _vector(result: Result, width: int, whole: bool) -> list[str]:
    """Return z in one line, elided if necessary; or all of z in aligned lines, each labelled with its first
    component."""
    start = "z =" if result.solved else "best z ="
    if not whole:
        return [f"{start} {short_vector(result, width - len(start) - 1)}"]
    cells = _cells(result, slice(None))
    line = f"{start} ({', '.join(cells)})"
    if len(line) <= width:
        return [line]
    widest, label = max(map(len, cells)), len(f"z{len(cells)}")
    in_a_row = max((width - label) // (widest + 2), 1)
    rows = [cells[i : i + in_a_row] for i in range(0, len(cells), in_a_row)]
    firsts = (f"z{1 + i * in_a_row}".ljust(label) for i in range(len(rows)))
    padded = ("".join(cell.rjust(widest + 2) for cell in row) for row in rows)
    return [start, *map(str.__add__, firsts, padded)]


def _cells(result: Result, part: slice) -> list[str]:
    """Return a part of z to the known digits, at most 7; for an LCP with the names of the components."""
    known = result.bound.value if result.bound and result.bound.proved else result.error
    place = -math.inf
    if result.solved and known is not None and 0 < known < math.inf:
        place = math.floor(math.log10(known))
    cells, problem = list[str](), result.problem
    for v in result.z[part].tolist():
        digits = 1 if v == 0 or not math.isfinite(v) else min(math.floor(math.log10(abs(v))) - place + 1, DIGITS)
        cells.append(f"{v + 0.0:.{digits}g}" if digits > 0 else "0")
    if not isinstance(problem.origin, OwnNames):
        return cells
    return [f"{wording.in_a_line(name)} {cell}".strip() for name, cell in zip(problem.names[part], cells, strict=True)]


def costs(results: Sequence[Result]) -> tuple[list[str], list[list[str]]]:
    """Return header and rows of the costs: to reach each level of error if recorded, else the plain counts."""
    noted = any(result.curve is not None and result.curve.levels for result in results)
    rows = [_costs(result, noted) for result in results]
    empty = {key: all(getattr(result, key) is None for result in results) for key in ("error", "verified")}
    header = [key for key in rows[0] if noted or not empty.get(key)]
    return header, [[row[key] for key in header] for row in rows]


def _costs(result: Result, noted: bool) -> dict[str, str]:
    """Return the cells of a run by column; the end is the time of the last iterate, by the clock of all."""
    rows = result.trace.rows if result.trace else []
    end = rows[-1].seconds if rows else result.seconds
    if noted:
        reached = {m.level: _cost(m.k, m.seconds) for m in (result.curve.milestones if result.curve else ())}
        own = {f"to {wording.level(level)}": reached.get(level, NOT_REACHED) for level in LEVELS}
        own["end"] = _cost(result.iterations, end)
        status = SHORT.get(result.word, result.word)
    else:
        own = {"iterations": str(result.iterations), "evaluations": str(result.evaluations), "end": duration(end)}
        own["residual"] = residual(result)
        status = result.word.replace("_", " ")
    seconds = duration(result.seconds) if result.verified else "FALSE"  # for a claim that does not hold
    return {
        "method": name(result),
        **own,
        "error": error(result.error, result.problem),
        "status": status,
        "verified": NOT_REACHED if result.verified is None else seconds,
    }


def _cost(k: int, seconds: float) -> str:
    return f"{k}/{duration(seconds)}".replace(" ", "")


def leaders(results: Sequence[Result]) -> set[tuple[int, int]]:
    """Return the cells of `costs`, by row and column, with the shortest time to each level of error among several
    runs."""
    reached = [(i, m) for i, result in enumerate(results) if result.curve for m in result.curve.milestones]
    firsts = set()
    for j, level in enumerate(LEVELS, start=1):
        seconds = [(milestone.seconds, i) for i, milestone in reached if milestone.level == level]
        if len(results) > 1 and seconds:
            firsts.add((min(seconds)[1], j))
    return firsts


def doubt(result: Result) -> str:
    """Return a warning for a solved run whose z differs from the solution in its leading digits; else ""."""
    near = result.error is None or result.error <= LEVELS[0] * result.problem.size_of_solutions
    if near or not result.solved:
        return ""
    return (
        f"the residual is small but z is far from the {result.problem.reference} solution: "
        "either it is another solution, or M is so ill-conditioned that the residual says little"
    )


def spread(result: Result) -> str:
    """Return a warning if the times of a run, although the least of several repetitions, are unreliable; else ""."""
    if result.spread is None or result.spread <= WIDE_SPREAD:
        return ""
    return f"half of its repetitions took over {result.spread:.1f} times as long: other programs disturb the times"


def bound(result: Result) -> str:
    """Return a line with the proved bound on the error, or saying that there is none; "" if not requested."""
    if result.bound is None:
        return ""
    if not result.bound.proved:
        return f"no bound: {result.bound.source}"
    return f"|z - z*| <= {wording.above(result.bound.value)} ({result.bound.source})"
