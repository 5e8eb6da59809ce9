"""Families of problems by name, imported on demand.

A family `f` is a function f(n, seed, *, parameters) -> Problem with about n unknowns,
in the file of its theme or a new file. The same arguments give the same numbers on any
machine (up to rounding, if a product of matrices is not of integers). Keyword-only
parameters have defaults; a family without random entries calls its second argument
_seed.
"""

from __future__ import annotations

import inspect
from collections.abc import Callable, Iterator
from contextlib import suppress
from importlib import import_module
from operator import le, lt
from typing import TYPE_CHECKING, Any, NamedTuple

from lcpcli.errors import (
    LEAVE_OUT,
    LONGEST_QUOTE,
    OptionError,
    ParameterError,
    ProblemError,
    likely,
    out_of_range,
    quoted,
    unknown,
)
from lcpcli.model import formulations
from lcpcli.options import NATURAL, Option, up_to

if TYPE_CHECKING:
    from lcpcli.model.problem import Problem

DEFAULT_SIZE = 10  # unknowns: few enough to be read
# With more unknowns even the vectors of a problem would take gigabytes.
SIZE = Option(
    "n",
    int,
    None,
    *up_to(10**8),
    "Approximate number of unknowns; by default 10, or that of the family.",
)
SEED = Option("seed", int, 0, *NATURAL, "Seed of the random numbers, if any.")


class Entry(NamedTuple):
    """A family: its module, meaning, class of matrices and source, and its number of
    unknowns if that is fixed."""

    file: str
    meaning: str
    matrices: str
    source: str
    size: int | None = None


# The families under the heading of their file: name | meaning | class of matrices |
# source.
TABLE = """
random_problems:
harker-pang | random, dense (Harker and Pang 1990) | positive definite | \
Harker and Pang 1990
ill-scaled | harker-pang, badly scaled | P | \
after Harker and Pang 1990, rows and columns rescaled
tridiagonal | tridiag(-1, 4, -1), random q | SPD, M | \
after El foutayeni and Khaladi 2012, Example 1, random q
dominant | random, ten entries per row | H+ | random, original to lcp
systems:
obstacle | membrane over an obstacle on a square grid | SPD, M | \
Glowinski 1984, chapter II, five-point differences
two-obstacles | membrane between two obstacles, with bounds | SPD, M | \
Rodrigues 1987, five-point differences
torsion | elastic-plastic torsion of a bar, with bounds | SPD, M | \
Glowinski 1984, chapter II; Brezis and Sibony 1971; five-point differences
journal-bearing | oil film with cavitation (Cryer 1971) | SPD, M | Cryer 1971
american-put | option pricing, one implicit time step | SPD, M | \
Wilmott, Dewynne and Howison 1993
contact | rigid bodies with Coulomb friction | copositive | \
Stewart and Trinkle 1996, random contacts in the plane
structures:
beam | beam over an obstacle, stiff: condition near .032 n^4 | SPD | \
Collatz 1960, fourth differences; Glowinski 1984, chapter II
plate | plate over an obstacle, stiff: condition near .05 n^2 | SPD | \
Collatz 1960, differences with 13 points; Glowinski 1984, chapter II
frame | beam elements over an obstacle, stiff, with free rotations | SPD | \
Przemieniecki 1968, section 5.6, cubic elements
rigid_bodies:
rigid-boxes | a time step of rigid boxes: tower, pyramid, heap, crushed | copositive | \
Stewart and Trinkle 1996, a time step of boxes in the plane
systems:
bimatrix | random two-player game | copositive | Lemke and Howson 1964, random costs
circuit | bridge rectifiers with ideal diodes, free potentials | PSD | \
Acary, Bonnefon and Brogliato 2011, nodal analysis with ideal diodes
relays | switching system, with bounds | PSD | Acary and Brogliato 2008, random systems
spatial-prices | trade between regions, free prices, flows with capacities | PSD | \
Takayama and Judge 1971, random linear functions
random_problems:
boxes | random, with bounds of every kind | SPD | original to lcp
murty | exponential for least-index pivoting (Murty 1978) | P, PSD | Murty 1978
all-cones | line through all 2^n complementary cones | P, PSD | \
after Murty 1978 and 1980
fathi | exponential for Lemke's method (Fathi 1979) | SPD | Fathi 1979
ben-gharbia-gilbert | plain Newton-min cycles (2012) | P | Ben Gharbia and Gilbert 2012
curtis-han-robinson | plain active-set method cycles (2015) | SPD | \
Curtis, Han and Robinson 2015 | 3
kostreva | Lemke's method cycles without a tie-breaking rule (1979) | \
P, not positive definite | Kostreva 1979
growth | solution 1, 2, 4, ..., 2^(n-1) | M | after Wilkinson 1961
hilbert | Hilbert matrix, scaled to integers up to n = 18 | SPD | \
the Hilbert matrix (Hilbert 1894)
diagonal | diagonal matrix with entries over many decades | SPD, M | original to lcp
near-singular | smallest eigenvalue epsilon | SPD | random, original to lcp
degenerate | z_i = w_i = 0 for half of the indices | SPD | random, original to lcp
near-degenerate | max(z_i, w_i) = epsilon for half of the indices | SPD | \
random, original to lcp
infeasible | no z >= 0 with Mz + q >= 0 | none | random, original to lcp
unsolvable | feasible, but without a solution | none | random, original to lcp
planted | random, with a hidden solution | any | random, original to lcp
gaussian | random M and q, with or without a solution | any | random, original to lcp
indefinite | random, with a degenerate solution | any | \
after INFORMS J. Comput. 2024.0822
ray | solvable, but Lemke's method terminates on a ray | copositive | \
random, original to lcp
"""
LESS = {"<": lt, "<=": le}
RANGES = """
0 <= friction <= 10; 0 <= compliance <= 10; 0 < step <= 1e3; 0 < capacity <= 1e6
-1e6 <= tax <= 1e6
0 <= perturbation <= 1; 0 < discount <= 1; 0 < gap <= 1e6; -1e6 <= load <= 1e6
-1e6 <= angle <= 1e6
0 < eccentricity < 1; 0.5 <= strike <= 2; 0.001 <= volatility <= 10
0.001 <= rate <= 10; 0.001 <= years <= 10
1e-12 <= epsilon <= 1; 0 <= decades <= 150; -1e15 <= t <= 1e15; 1 < alpha <= 1e6
0 <= entries <= 1000; 0 < most <= 1
0 <= target <= 1; 0 <= weight <= 1e6; 0 <= penalty <= 2; 1 <= samples <= 1e5
1 <= masses <= 100; 0 < strength <= 1e6
1 <= contrast <= 1e9; 0 <= mass <= 1e30
"""  # the ranges of parameters, by their names, in all families
RANGE_OF = {
    text.split()[2]: text for text in RANGES.strip().replace("\n", "; ").split("; ")
}


def _entries(table: str, home: str) -> Iterator[tuple[str, Entry]]:
    """Yield the names and the families of a table. home : the package of its files."""
    text = table.replace(" PSD", " positive semidefinite")
    text, file = text.replace(" SPD", " symmetric positive definite"), ""
    for name, *texts in (line.split(" | ") for line in text.strip().split("\n")):
        if texts:
            yield name, Entry(file, texts[0], texts[1], texts[2], *map(int, texts[3:]))
        else:
            file = f"{home}.{name[:-1]}"


def _with_formulations(entries: dict[str, Entry]) -> dict[str, Entry]:
    """Return these families and those of the installed formulations, each inserted
    after the family that its table names.
    """
    for kind in formulations.TABLE:
        row = formulations.row_of(kind)
        with suppress(ProblemError):
            predecessor, table = formulations.module_of(row, "gallery", "").FAMILIES
            names, added = [*entries], dict(_entries(table, row.home))
            first = (
                names[: names.index(predecessor) + 1]
                if predecessor in entries
                else names
            )
            entries = {name: entries[name] for name in first} | added | entries
    return entries


REGISTRY = _with_formulations(dict(_entries(TABLE, "lcpcli.gallery")))
FAMILIES = {name: entry.meaning for name, entry in REGISTRY.items()}


def load(name: str) -> Callable[..., Problem]:
    """Return the function of a family."""
    family: Callable[..., Problem] = getattr(
        import_module(entry(name).file), name.replace("-", "_")
    )
    return family


def entry(name: str) -> Entry:
    """Return the entry of a family; raise OptionError if there is none."""
    if name not in REGISTRY:
        hint = likely(name, FAMILIES, "lcp make --list shows the families")
        raise OptionError("family", unknown(name), hint)
    return REGISTRY[name]


def is_random(name: str) -> bool:
    """Return whether a family has random entries."""
    return "seed" in inspect.signature(load(name)).parameters


def parameters_of(name: str) -> dict[str, Any]:
    """Return the parameters of a family with their default values."""
    return {
        p.name: p.default
        for p in inspect.signature(load(name)).parameters.values()
        if p.kind is p.KEYWORD_ONLY
    }


def make(name: str, n: int | None = None, seed: int = 0, **parameters: Any) -> Problem:
    """Return the problem of a family with about n unknowns; by default 10, or the
    number that the family fixes.

    Raises OptionError if there is no such family, parameter, size or seed.
    """
    for parameter, value in parameters.items():
        refuse_unknown(name, parameter)
        if admissible := RANGE_OF.get(parameter):
            low, above, _, below, high = admissible.split()
            require(
                parameter,
                value,
                LESS[above](float(low), value) and LESS[below](value, float(high)),
                admissible,
            )
    size = entry(name).size
    n = size or DEFAULT_SIZE if n is None else n
    SIZE.check(n)
    if size and n != size:
        raise ParameterError("n", f"is {n}, and {name} has {size} unknowns", LEAVE_OUT)
    SEED.check(seed)
    problem = load(name)(n, seed, **parameters)
    return problem.having(
        name=name if size else f"{name}-{problem.n}", source=entry(name).source
    )


def refuse_unknown(name: str, parameter: str) -> None:
    """Raise OptionError if a family has no such parameter."""
    valid_names = parameters_of(name)
    if parameter not in valid_names:
        hint = likely(parameter, valid_names) if valid_names else LEAVE_OUT
        raise OptionError(
            "parameters", f"{quoted(parameter)} is not a parameter of {name}", hint
        )


def require(parameter: str, value: float, fits: bool, admissible: str) -> None:
    """Raise OptionError for a parameter whose value does not fit; `admissible` is the
    range as shown to the user.
    """
    if not fits:
        raise OptionError(
            parameter,
            out_of_range(str(value)[:LONGEST_QUOTE]),
            f"it must be: {admissible}",
        )
