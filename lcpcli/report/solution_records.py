"""All solutions of a problem as JSON and as CSV."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterator, Sequence
from fractions import Fraction
from itertools import cycle
from typing import Any, TypeAlias

from lcpcli import __version__
from lcpcli.enumeration.equilibria import Equilibria
from lcpcli.enumeration.search import SolutionSet, objective
from lcpcli.files.contents import Source
from lcpcli.model.program import Program
from lcpcli.rational.numbers import rounded, text
from lcpcli.rational.polyhedra import Point
from lcpcli.report import answer_csv, json_lines
from lcpcli.report.numbers import finite

HEADER = ("piece", "kind", "number", "component", "z", "w")
OF_GAMES = ("equilibrium", "player", "strategy", "probability", "payoff")
Cells: TypeAlias = tuple[Any, ...]
Numbers: TypeAlias = Callable[[Sequence[Fraction]], Sequence[Any]]


def in_json(found: SolutionSet, source: Source, exact: bool) -> str:
    """One object in one line; numbers are texts of fractions if they are to be exact."""
    data, points, held = found.data, found.points, found.equilibria
    place = {point: k for k, point in enumerate(points)}
    vector = _exactly if exact else _rounded
    record = {
        "version": __version__,
        "file": source.file,
        "item": source.item,
        "problem": data.problem.name,
        "n": data.n,
        "names": json_lines.names(data.problem),
        "status": found.status,
        "message": found.message,
        "complete": found.complete,
        "others": found.others,
        "solutions": [_solution(found, k, point, vector) for k, point in enumerate(points)],
        "pieces": [
            {
                "vertices": [place[vertex] for vertex in piece.vertices],
                "rays": [vector(ray) for ray in piece.rays],
                "lines": [vector(line) for line in piece.lines],
                "states": [list(states) for states in piece.states],
            }
            for piece in found.pieces
        ],
        "components": None if held is None or held.components is None else [list(part) for part in held.components],
        "degenerate": None if held is None else held.is_degenerate,
        "seconds": found.seconds,
    }
    return json.dumps(record, allow_nan=False, ensure_ascii=False) + "\n"


def _solution(found: SolutionSet, k: int, z: Point, vector: Any) -> dict[str, Any]:
    """A solution, and what it is for the program or the game."""
    told: dict[str, Any] = {"z": vector(z), "w": vector(found.data.w(z)), "objective": None, "equilibrium": None}
    origin = found.data.problem.origin
    if isinstance(origin, Program):
        (told["objective"],) = vector([objective(found.data, origin, z)])
    if found.equilibria is not None:
        each = found.equilibria.extreme[k]
        told["equilibrium"] = {
            "row": vector(each.row),
            "column": vector(each.column),
            "payoffs": vector(each.payoffs),
            "pure": each.is_pure,
            "index": each.index,
        }
    return told


def in_csv(found: SolutionSet, exact: bool) -> str:
    """A line for each component of each vertex, ray and line: z, and w or for directions its change; of a game one for
    each strategy in each extreme equilibrium: its probability, and what its player gets in all. Names, if there are
    any, are last."""
    vector = _exactly if exact else _rounded
    header: Cells = HEADER if found.equilibria is None else OF_GAMES
    rows = _of_pieces(found, vector) if found.equilibria is None else _of_equilibria(found.equilibria, vector)
    names = [" ".join(name.split()) for name in found.data.problem.names]
    if any(names):  # the lines of a vertex, or of an equilibrium, are in the order of the unknowns
        header, rows = (*header, "name"), ((*row, name) for row, name in zip(rows, cycle(names), strict=False))
    head = [found.data.problem.name, found.message]
    return answer_csv.comments([": ".join(filter(None, head))]) + answer_csv.text([header, *rows])


def _of_equilibria(held: Equilibria, vector: Numbers) -> Iterator[Cells]:
    for number, each in enumerate(held.extreme, 1):
        payoffs = vector(each.payoffs)
        for player, strategy, payoff in zip(("row", "column"), (each.row, each.column), payoffs, strict=True):
            for i, probability in enumerate(vector(strategy), 1):
                yield number, player, i, probability, payoff


def _of_pieces(found: SolutionSet, vector: Numbers) -> Iterator[Cells]:
    data = found.data
    constant = data.w([Fraction(0)] * data.n)
    for number, piece in enumerate(found.pieces, 1):
        parts = [("vertex", z, data.w(z)) for z in piece.vertices]
        for kind, directions in (("ray", piece.rays), ("line", piece.lines)):
            changes = ([a - b for a, b in zip(data.w(each), constant, strict=True)] for each in directions)
            parts += [(kind, each, change) for each, change in zip(directions, changes, strict=True)]
        for k, (kind, z, w) in enumerate(parts, 1):
            for i, pair in enumerate(zip(vector(z), vector(w), strict=True), 1):
                yield number, kind, k, i, *pair


def _rounded(values: Sequence[Fraction]) -> list[float | None]:
    return [finite(value) for value in rounded(values).tolist()]


def _exactly(values: Sequence[Fraction]) -> list[str]:
    return [text(value) for value in values]
