"""The outcome of one run, for the lines above its iterates: the verdict, the main numbers, and z."""

from __future__ import annotations

import math
from collections import Counter

import numpy as np

from lcpcli.errors import count
from lcpcli.linalg.doubles import ROW_ROUNDING
from lcpcli.model.origins import OwnNames
from lcpcli.model.start import STATES
from lcpcli.report import numbers, summary
from lcpcli.report.numbers import ELLIPSIS
from lcpcli.solving.result import Result
from lcpcli.verify.digits import fewest

PAGE = 80
DIGITS = 7
FEW_DIGITS = 6  # of z that the data determine: if fewer, it is said
OTHERS = {None: "", False: "; the only solution", True: "; one of several: --all lists them"}
UNSOLVABLE = "; with the numbers as written there is no exact solution"
SETTLED = ("infeasible", "unsolvable")  # without a z of interest


def verdict(result: Result) -> str:
    """One line: how the run ended, and by which methods."""
    by = f"by {', '.join(result.route)}"
    if result.solved:
        told = UNSOLVABLE if result.exactly_solvable is False else OTHERS[result.others]
        return f"{result.status.word} {by}: {_work(result)}{told}"
    return f"{summary.name(result)}{f' ({by})' * (result.route != (result.method,))} {result.message}"


def _work(result: Result) -> str:
    counts = count(result.iterations, "iteration"), count(result.evaluations, "evaluation")
    return ", ".join([*counts, numbers.duration(result.seconds)])


def _parts(result: Result) -> str:
    """Where the time went."""
    parts = (("set-up", result.setup_seconds), ("iterations", result.solve_seconds))
    return ", ".join(f"{name} {numbers.duration(s)}" for name, s in (*parts, ("verification", result.verify_seconds)))


def facts(result: Result, width: int | None, whole: bool) -> list[str]:
    """The work, its parts, the residuals, the error and z, of a long one what fits on one line, unless `whole`; with
    bounds also the basis."""
    work = [*([] if result.solved else [_work(result)]), _parts(result)]
    if result.status.word in SETTLED:
        return work
    relative = numbers.short(result.relative_residual, ROW_ROUNDING)
    measures = [f"residual {summary.residual(result)}", f"relative {relative}"]
    if result.error is not None:
        measures.append(f"error {summary.error(result.error, result.problem)}")
    z = _vector("z" if result.solved else "best z", result, width or PAGE, whole)
    return [
        *work,
        ", ".join(measures),
        *_few_digits(result),
        *z,
        *([_basis(result, width or PAGE)] if result.problem.is_mixed else []),
    ]


def _few_digits(result: Result) -> list[str]:
    """A line on the digits of z that the data determine, if these are fewer than the printed ones."""
    if result.digits is None:
        return []
    least, i = fewest(result.problem, result.z, np.array(result.digits, dtype=float))
    if least >= FEW_DIGITS:
        return []
    digits = f"about {count(least, 'digit')}" if least else "no digit"
    return [f"the data determine {digits} of z{i + 1}: rounding them once changes the others"]


def _basis(result: Result, width: int) -> str:
    """The state of each variable, or how many are in which, if that is too long for a line."""
    line = f"basis = {_line(result.basis)}"
    if len(line) <= width:
        return line
    counts = Counter(result.basis)
    return f"basis: {', '.join(f'{counts[state]} {state}' for state in STATES if counts[state])}"


def short_vector(result: Result, width: int) -> str:
    """z in a line of that width: all components, or the first ones and the last."""
    room = min(result.problem.n, width // 3)
    while True:
        gap = [] if room == result.problem.n else [ELLIPSIS]
        line = _line([*_cells(result, room - len(gap)), *gap, *_cells(result, -1)[: len(gap)]])
        if len(line) <= width or room <= 2:
            return line
        room -= 1


def _vector(name: str, result: Result, width: int, whole: bool) -> list[str]:
    """z in one line, elided if necessary; or all of z in aligned lines, each labelled with its first component."""
    if not whole:
        return [f"{name} = {short_vector(result, width - len(name) - 3)}"]
    cells = _cells(result, result.problem.n)
    line = f"{name} = {_line(cells)}"
    return [line] if len(line) <= width else _rows(name, cells, width)


def _line(cells: list[str]) -> str:
    return f"({', '.join(cells)})"


def _rows(name: str, cells: list[str], width: int) -> list[str]:
    widest, label = max(map(len, cells)), len(f"z{len(cells)}")
    a_row = max((width - label) // (widest + 2), 1)
    rows = [cells[i : i + a_row] for i in range(0, len(cells), a_row)]
    lines = [
        f"z{1 + i * a_row}".ljust(label) + "".join(cell.rjust(widest + 2) for cell in row) for i, row in enumerate(rows)
    ]
    return [f"{name} =", *lines]


def _cells(result: Result, first: int) -> list[str]:
    """The first components of z, or the last if negative, to the known digits, at most 7; those of an LCP with their
    names, if they have some."""
    cells, problem = _numbers(result, first), result.problem
    if not isinstance(problem.origin, OwnNames):
        return cells
    names = problem.names[:first] if first >= 0 else problem.names[first:]
    return [f"{' '.join(name.split())} {cell}".strip() for name, cell in zip(names, cells, strict=True)]


def _numbers(result: Result, first: int) -> list[str]:
    z = result.z[:first] if first >= 0 else result.z[first:]
    known = result.bound.value if result.bound and result.bound.proved else result.error
    if not result.solved or known is None or not 0 < known < math.inf:
        return [f"{v + 0.0:.{DIGITS}g}" for v in z.tolist()]
    place = math.floor(math.log10(known))
    return [_rounded(v, place) for v in z.tolist()]


def _rounded(v: float, place: int) -> str:
    """v to 7 digits, but none below that decimal place."""
    if v == 0 or not math.isfinite(v):
        return f"{v:g}"
    digits = min(math.floor(math.log10(abs(v))) - place + 1, DIGITS)
    return f"{v:.{digits}g}" if digits > 0 else "0"
