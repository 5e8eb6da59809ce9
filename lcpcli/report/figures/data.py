"""What is drawn: curves of runs, growth of times, performance profiles, complementary cones."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass


@dataclass(frozen=True)
class Curve:
    """One run on one problem.

    name : the method or peer, which decides colour, marker and line style.
    label : the text shown.
    k : the numbers of the iterates; None where the run does not tell, which leaves the iterate out of the axis of k.
    seconds : the run time until each iterate.
    errors : the error or residual of each, as long as k and seconds; None where it was not measured.
    solved : an unsolved run ends in a cross.
    """

    name: str
    label: str
    k: Sequence[int | None]
    seconds: Sequence[float]
    errors: Sequence[float | None]
    solved: bool


@dataclass(frozen=True)
class Panel:
    """The runs on one problem.

    measure : "error" or "residual", what the curves' errors are.
    provenance : what made them, for the file's metadata.
    """

    title: str
    measure: str
    curves: Sequence[Curve]
    provenance: str = ""


@dataclass(frozen=True)
class Power:
    """The fit seconds = coefficient n^exponent, and the margin of the exponent's confidence interval."""

    exponent: float
    margin: float
    coefficient: float


@dataclass(frozen=True)
class Growth:
    """One solver's median run times in seconds on problems of n unknowns, with their quartiles.

    fit : None for too few sizes.
    """

    name: str
    label: str
    n: Sequence[int]
    seconds: Sequence[float]
    lower: Sequence[float]
    upper: Sequence[float]
    fit: Power | None


@dataclass(frozen=True)
class GrowthPanel:
    """The growth of time over n for several solvers on one family of problems."""

    title: str
    growths: Sequence[Growth]


@dataclass(frozen=True)
class Profile:
    """One solver's times as multiples of the fastest solver's, one a problem, inf where it failed."""

    name: str
    label: str
    ratios: Sequence[float]


@dataclass(frozen=True)
class Cones:
    """An LCP with two unknowns: which of its complementary cones hold q.

    M : two rows of two. q : two.
    holding : whether q lies in the cone of each set of unknowns that may be positive: none, first, second, both.
    count : how many solutions there are, in words.
    names : of the unknowns; "" for one that has none.
    provenance : lines on what was solved, and how, for the file's metadata.
    """

    title: str
    M: Sequence[Sequence[float]]
    q: Sequence[float]
    holding: Sequence[bool]
    count: str
    names: Sequence[str] = ("", "")
    provenance: Sequence[str] = ()
