"""Paths for tests: of small problems, from one portfolio to another, and one that is
made up of its breakpoints."""

import json
from dataclasses import replace

import numpy as np

import lcpcli
from lcpcli import Problem
from lcpcli.files import contents
from lcpcli.model.box import BASIC, LOWER, UPPER
from lcpcli.parametric.path import ENDS, Family, Path
from lcpcli.report.path_formats import path_report

SMALL = [Problem([[2, 1], [1, 2]], q, name="small") for q in ([1, 1], [-5, -6])]


def small(**others):
    """q goes from (1, 1) to (-5, -6): z2 enters at 1/7, and z1 at 1/5."""
    return replace(lcpcli.path(*SMALL), **others)


def entering(n):
    """As many components, each of which enters at a t of its own."""
    return lcpcli.path(
        Problem(np.eye(n), np.ones(n)), Problem(np.eye(n), -np.arange(1.0, n + 1))
    )


def made(family, t, z, states, end="reached"):
    """A path with these breakpoints, and w as it follows from z."""
    n = family.problem.n
    z = np.array(z, dtype=float).reshape(len(t), n)
    w = np.array(
        [family.at(each).w(own) for each, own in zip(t, z, strict=True)]
    ).reshape(z.shape)
    states = np.array(states).reshape(max(len(t) - 1, 0), n)
    return Path(
        family, np.array(t, dtype=float), z, w, states, end, ENDS[end], True, 1e-3
    )


def cornered():
    """0 <= z <= 3 with w = 1 - t: a jump at t = 1 from the upper bound to the lower
    one, and there, as no path does, a turn."""
    first, last = (
        Problem([[0.0]], [q], name="cornered", upper=3.0) for q in (-1.0, 1.0)
    )
    return made(
        Family(first, last, 0.0, 2.0),
        [0, 1, 1, 0],
        [3, 3, 0, 0],
        [UPPER, BASIC, LOWER],
        "turn",
    )


def portfolio(least, sense="min", **changes):
    """The shipped portfolio with at least this return, and no limit above."""
    with open(
        contents.shipped_path("programs/portfolio.json"), encoding="utf-8"
    ) as file:
        data = json.load(file)
    given = {
        **data,
        "row_lower": [1, least],
        "row_upper": [1, np.inf],
        "sense": sense,
        **changes,
    }
    if sense == "max":
        given["Q"] = -np.array(given["Q"])
    return lcpcli.from_qp(**given)


def frontier(**changes):
    """From a return of at least 0.05 to 0.12, which only goes up to 0.1."""
    return lcpcli.path(portfolio(0.05, **changes), portfolio(0.12, **changes))


def written(form, path, *at, files=("a", "b")):
    """A path as a text in a format with all numbers."""
    return path_report(path, at, files).render(form)
