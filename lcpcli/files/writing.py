"""Problems written to files, in the format given by the suffix."""

from __future__ import annotations

import os
from collections.abc import Iterable
from pathlib import Path

from lcpcli.errors import ProblemError
from lcpcli.files.atomic_write import write_together
from lcpcli.files.formats import COMPLETE, FORMATS, OF_PROGRAMS, READ_ONLY, TEXTS, WITH_BOUNDS, WRITTEN, load
from lcpcli.model.origins import Game
from lcpcli.model.problem import Problem
from lcpcli.rational.numbers import Written
from lcpcli.rational.problem import of_game


def write(problem: Problem, path: str | os.PathLike[str], *, as_program: bool = False) -> None:
    """Write a problem in the format given by the suffix of the file, completely or not at all.

    .json, .npz and .mat keep everything, .csv M, q and the bounds, the others only M and q; p.mtx or p.npy is M, with q
    beside it in p.q.mtx or p.q.npy. .mps is for problems made from programs, and has the program.
    as_program : whether .json, .npz and .mat too have the program that a problem was made from, Q, c, A and so on, in
        place of M and q, unless the problem holds what a program has no key for, such as x0.
    Raises ProblemError if the suffix is unknown or the file cannot be written.

    >>> from lcpcli import Problem, read, write
    >>> write(Problem([[2, 1], [1, 2]], [-5, -6]), "small.mtx")
    >>> read("small.mtx", "small.q.mtx").q.tolist()
    [-5.0, -6.0]
    """
    write_as(Written(problem, problem, {}), os.fspath(path), as_program)


def write_as(found: Written[Problem], path: str, as_program: bool) -> None:
    """Write a problem as `write` does, with the numbers as they are written, which texts keep."""
    ending = ending_of(path)
    if found.rounded.is_mixed and ending not in (*WITH_BOUNDS, *OF_PROGRAMS):
        raise ProblemError(path, "cannot hold the bounds of z", f"use {', '.join(COMPLETE)} or .csv")
    contents = contents_of(found, path, ending, as_program)
    write_together({path.removesuffix(ending) + part + ending: content for part, content in contents.items()})


def contents_of(found: Written[Problem], path: str, ending: str, as_program: bool) -> dict[str, bytes]:
    """The contents of the files to be written, as `Format.render` has them."""
    problem, exact = (found.own, [found.exact]) if ending in TEXTS else (found.rounded, [])
    if ending in OF_PROGRAMS:
        if kind_of(problem) != "qp":
            raise ProblemError(path, "is for programs, and the problem is not made from one", f"use {_or(COMPLETE)}")
        try:
            return load(READ_ONLY[ending]).render(problem, *exact)
        except ProblemError as error:
            raise error.inside(path) from None
    if as_program and ending in COMPLETE:
        from lcpcli.files import programs

        if programs.is_whole(problem):
            return {"": programs.WRITERS[ending](problem, *exact)}
    return load(FORMATS[ending]).render(problem, *exact)


def with_costs(found: Written[Problem], path: str) -> Written[Problem]:
    """The problem of a game for a file with M and q, with its costs as the payoffs are written; as it is where some are
    no decimals, and for any other file."""
    game = found.rounded.origin
    is_of_costs = isinstance(game, Game) and path.endswith(TEXTS) and not path.endswith(COMPLETE)
    return (of_game(found.rounded, game) or found) if is_of_costs and isinstance(game, Game) else found


def is_rounded(found: Written[Problem], path: str) -> bool:
    """Whether a file with that of `with_costs` holds doubles in place of some of the numbers as they are written."""
    game = found.own.origin if isinstance(found.own.origin, Game) else None
    if path.endswith(TEXTS):
        return game is not None and not path.endswith(COMPLETE)
    return bool(found.exact) or (game is not None and game.written is not None)


def kind_of(problem: Problem) -> str:
    """What a problem comes from: "qp", "game", "names", or "" for nothing."""
    return "" if problem.origin is None else str(problem.origin.data()["kind"])


def exact_endings(problem: Problem) -> list[str]:
    """The suffixes of files that keep all digits of a problem: of a program and of a game those that keep it."""
    if kind_of(problem) in ("qp", "game"):
        return [".json", *OF_PROGRAMS] if kind_of(problem) == "qp" else [".json"]
    return [ending for ending in TEXTS if ending in (WITH_BOUNDS if problem.is_mixed else FORMATS)]


def ending_of(path: str) -> str:
    """The suffix of a file to be written, one of FORMATS or OF_PROGRAMS, or a ProblemError."""
    ending = Path(path).suffix
    if ending in OF_PROGRAMS:
        return ending
    if ending in READ_ONLY:
        raise ProblemError(
            path, "is of a format that is only read", f"use {_or(COMPLETE)}, or {_or(OF_PROGRAMS)} for a program"
        )
    if ending not in FORMATS:
        raise ProblemError(path, f"has the unknown suffix {ending}" if ending else "has no suffix", f"use {WRITTEN}")
    return ending


def _or(endings: Iterable[str]) -> str:
    return " or ".join(endings)
