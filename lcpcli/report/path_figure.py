"""The picture of a path: its data, and writing it to a file."""

from __future__ import annotations

import os
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from lcpcli.errors import count
from lcpcli.parametric.path import Path
from lcpcli.report import path_terms, plotting, selection, wording
from lcpcli.report.figures.data import Pair, Response
from lcpcli.report.path_formats import line
from lcpcli.report.path_terms import Terms

SAMPLES = 24  # of the objective on a piece, on which it is a parabola
MOST_SAMPLES = 4000  # on a path, more than a figure shows


@dataclass(frozen=True, eq=False, repr=False)
class PathPicture(plotting.Picture):
    """The picture of a path; a notebook shows it."""

    response: Response

    def content(self, form: str) -> bytes:
        return plotting.response(self.response, form)

    def __repr__(self) -> str:
        return f"<Picture: path of {count(len(self.response.across), 'breakpoint')}>"


def plot(path: Path, file: str | os.PathLike[str] | None = None, show: Sequence[str] = ()) -> PathPicture:
    """Draw a path, and write the picture to a file if there is one: .png, .svg or .pdf."""
    plotting.require()
    show = [show] if isinstance(show, str) else show
    picture = PathPicture((), response(path, show))
    if file is not None:
        picture.save(file)
    return picture


def response(path: Path, chosen: Sequence[str] = ()) -> Response:
    """Return the data of the picture: the components of z, of a program those of x, that are not always 0.

    chosen : names of unknowns, or of a program's multipliers, as for `selection.places`, instead.
    """
    terms = Terms(path)
    moving, names, z = terms.moving, terms.names(), path.z
    if chosen:
        shown, z = selection.places(names, chosen), np.array(list(map(terms.values, z)))
    else:
        z = z if terms.program is None else z[:, : terms.program.variables]
        shown = np.flatnonzero(z.any(axis=0)).tolist()
    return Response(
        title=", ".join(filter(None, (wording.title(path.problem), wording.size(path.problem)))),
        abscissa=f"{moving.name}{f' ({moving.word})' * bool(moving.word)}" if moving else "t",
        across=_across(terms, path.t.tolist()),
        names=[names[i] for i in shown],
        lines=[z[:, i].tolist() for i in shown],
        jumps=path.jumps,
        turns=path_terms.turns(path),
        objective=_objective(terms) if terms.program is not None else None,
        is_frontier=terms.is_quadratic and moving is not None and moving.what.startswith("row"),
        provenance=[f"{wording.PROGRAM}: {line(path)}"],
    )


def _across(terms: Terms, t: list[float]) -> list[float]:
    return list(map(float, map(terms.moved, t))) if terms.moving else t


def _objective(terms: Terms) -> list[Pair]:
    """Return points (number that moves, objective) of the path."""
    path = terms.path
    pieces = path.t.size - 1
    shares = np.linspace(0, 1, max(2, min(SAMPLES, MOST_SAMPLES // max(pieces, 1))))
    t, z = path.t.tolist(), path.z
    points = list(zip(t[:1], z[:1], strict=True))
    for k in range(pieces):
        points += [((1 - s) * t[k] + s * t[k + 1], (1 - s) * z[k] + s * z[k + 1]) for s in shares[1:].tolist()]
    values = [terms.objective(*point) for point in points]
    return list(zip(_across(terms, [point[0] for point in points]), values, strict=True))
