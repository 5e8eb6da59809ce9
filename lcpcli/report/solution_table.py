"""All solutions of a problem as a table: the pieces of the set, each by its vertices, rays and lines."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from fractions import Fraction
from itertools import islice

from lcpcli.enumeration.equilibria import Equilibria
from lcpcli.enumeration.pieces import Piece
from lcpcli.enumeration.search import SolutionSet, objective
from lcpcli.errors import count
from lcpcli.model.program import Program
from lcpcli.rational import numbers as rationals
from lcpcli.rational.problem import ExactProblem
from lcpcli.report import numbers, provenance, strategies
from lcpcli.report.iterations import longest
from lcpcli.report.result_table import ResultTable

Cell = Callable[[Fraction], str]
MOST_ROWS = 1000  # of a table; typesetting more takes longer than finding them
MOST_SUBSETS = 50  # in a remark


def build(found: SolutionSet, exact: bool, form: str) -> ResultTable:
    """The table of a solution set for a format, exact in fractions; of a game, that of its equilibria."""
    cell, most = cell_of(exact), longest(form)
    header, groups, remarks = (
        _pieces(found, cell, most) if found.equilibria is None else _equilibria(found, found.equilibria, cell, most)
    )
    problem = found.data.problem
    title = f"{numbers.title(problem) or 'problem'}: {numbers.size(problem)}"
    made_by = f"{provenance.PROGRAM}, in exact arithmetic, {numbers.duration(found.seconds)}"
    return ResultTable(title, header, groups, found.message, [], remarks, made_by, settled=found.complete)


def cell_of(exact: bool) -> Cell:
    """How a number is shown: as a fraction, or to seven digits."""
    return rationals.brief if exact else (lambda value: f"{float(rationals.rounded([value])[0]):.7g}")


def _pieces(found: SolutionSet, cell: Cell, most: float) -> tuple[list[str], list[list[list[str]]], list[str]]:
    """A row for each vertex, ray and line, z and then w; the isolated solutions are one group, each face is another."""
    data = found.data
    program = data.problem.origin if isinstance(data.problem.origin, Program) else None
    header = [
        "piece",
        "",
        *_names(data, most),
        *(f"w{i}" for i in range(1, data.n + 1)),
        *["objective"] * bool(program),
    ]
    shown, points = 0, list[list[str]]()
    faces: list[list[list[str]]] = []
    for number, piece in enumerate(found.pieces, 1):
        rows = list(islice(_rows(data, piece, program, cell), MOST_ROWS - shown))
        if not rows:
            break
        shown += len(rows)
        rows[0][0] = str(number)
        if piece.is_point:
            points += rows
        else:
            faces.append(rows)
    return header, [*([points] if points else []), *faces], _remarks(found)


def _rows(data: ExactProblem, piece: Piece, program: Program | None, cell: Cell) -> Iterator[list[str]]:
    constant = data.w([Fraction(0)] * data.n)
    word = "point" if piece.is_point else "vertex"
    for vertex in piece.vertices:
        value = [cell(objective(data, program, vertex))] if program else []
        yield ["", word, *map(cell, vertex), *map(cell, data.w(vertex)), *value]
    for kind, directions in (("ray", piece.rays), ("line", piece.lines)):
        for direction in directions:
            slope = [a - b for a, b in zip(data.w(direction), constant, strict=True)]
            yield ["", kind, *map(cell, direction), *map(cell, slope), *[""] * bool(program)]


def _remarks(found: SolutionSet) -> list[str]:
    rows = sum(len(piece.vertices) + len(piece.rays) + len(piece.lines) for piece in found.pieces)
    if all(piece.is_point for piece in found.pieces):
        return _left_out(rows)
    told = "the solutions of a face are the averages of its vertices"
    if any(piece.rays or piece.lines for piece in found.pieces):
        told += ", plus any positive multiples of its rays and any multiples of its lines"
    return [told, *_left_out(rows)]


def _left_out(rows: int) -> list[str]:
    """A remark where not all rows are shown."""
    return [f"the first {MOST_ROWS} of {rows} rows; --format json and csv have all of them"] * (rows > MOST_ROWS)


def _names(data: ExactProblem, most: float) -> list[str]:
    """The names of the unknowns that are shorter than that, else their places."""
    return [name if 0 < len(name) < most else f"z{i}" for i, name in enumerate(data.problem.names, 1)]


def _equilibria(
    found: SolutionSet, held: Equilibria, cell: Cell, most: float
) -> tuple[list[str], list[list[list[str]]], list[str]]:
    """A row for each extreme equilibrium, those of a component as a group."""
    game = found.game
    assert game is not None
    rows_, columns_ = strategies.names(game, most)
    indexed = any(each.index is not None for each in held.extreme)
    header = ["", *rows_, *columns_, *strategies.PAYOFFS, *["index"] * indexed, "pure"]
    lines = [
        [
            str(number),
            *map(cell, each.row),
            *map(cell, each.column),
            *map(cell, each.payoffs),
            *([f"{each.index:+d}" if each.index is not None else ""] if indexed else []),
            "pure" * each.is_pure,
        ]
        for number, each in enumerate(held.extreme[:MOST_ROWS], 1)
    ]
    left_out = _left_out(len(held.extreme))
    if all(len(subset.extreme) == 1 for subset in held.subsets):
        indices = [each.index or 0 for each in held.extreme]
        told = [f"the indices sum to {sum(indices)}"] if found.complete and all(indices) and len(indices) > 1 else []
        return header, [lines] if lines else [], [*told, *left_out]
    joined = [range(len(held.subsets))] if held.components is None else held.components
    members = [sorted({k for s in part for k in held.subsets[s].extreme}) for part in joined]
    groups = [[lines[k] for k in part if k < MOST_ROWS] for part in members]
    subsets = [f"{{{', '.join(str(k + 1) for k in subset.extreme)}}}" for subset in held.subsets[:MOST_SUBSETS]]
    if len(held.subsets) > MOST_SUBSETS:
        subsets.append(f"and {count(len(held.subsets) - MOST_SUBSETS, 'other')}")
    means = "any averages of the row and of the column strategies of one are an equilibrium"
    remark = f"maximal Nash subsets {', '.join(subsets)}: {means}"
    return header, [group for group in groups if group], [remark, *left_out]
