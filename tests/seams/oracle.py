"""Small LCPs, mixed problems and programs with numbers of extreme scales, each decided
in fractions.

A claim is false if a "solved" z violates the conditions beyond the tolerance, if there
is a solution where none is said to exist, or if a proof does not hold in exact
arithmetic. The table on standard error counts what became of those that have a
solution, those that have none, and those with a planted solution, by status.
"""

from fractions import Fraction

import numpy as np
import populations
import truth
from record import GENEROUS_SECONDS, Case, exact, main, of_result

from lcpcli import exact as in_fractions
from lcpcli import run

EACH = 500  # cases of each kind
PROVED = 10  # one case in so many is also solved by lcpcli.exact


def cases(seed):
    """Return all cases, the kinds in turn."""
    return [
        Case(
            f"{kind} {k}",
            lambda make=make, k=k: make(np.random.default_rng([seed, k]), k),
        )
        for k in range(EACH)
        for kind, make in KINDS.items()
    ]


def lcp(random, k):
    """An LCP of one of ten classes."""
    return exact.random_problem(
        int(random.integers(1 << 30)),
        6 if k % 4 == 0 else 4,
        list(exact.CLASSES)[k % 10],
    )


def uneven(problem, random, is_rounded, least=1, end=17):
    """The problem in units over many powers of ten, which are rounded, or of two."""
    decades, base = int(random.integers(least, end)), 10 if is_rounded else 2
    return populations.in_uneven_units(problem, random, decades, base)


def extreme(random, k):
    """The same in uneven units."""
    return uneven(lcp(random, k), random, k % 2)


def mixed(random, k):
    """A problem with bounds of all kinds, in even or uneven units."""
    problem = populations.mixed(
        random, int(random.integers(1, 5)), list(exact.CLASSES)[k % 10]
    )
    return uneven(problem, random, k % 2) if k % 3 else problem


def program(random, k):
    """A linear or quadratic program with inequalities or equations, in units over many
    powers."""
    problem = populations.program(
        random, int(random.integers(1, 4)), int(random.integers(1, 3)), k % 2 == 0
    )
    return uneven(problem, random, k // 2 % 2, 0)


def run_off(random, k):
    """A program whose rows contradict each other by 1e-3 to 1e-15, agree, or leave as
    little room."""
    problem = populations.opposed_rows(
        random, (-1, 1, 0)[k % 3] * 10.0 ** -int(random.integers(3, 16))
    )
    return uneven(problem, random, False, 0, 9) if k % 2 else problem


def planted(random, k):
    """A larger problem with a known solution, in units of powers of two."""
    return populations.planted(
        random, int(random.integers(7, 41)), list(exact.CLASSES)[k % 10]
    )


KINDS = {
    "lcp": lcp,
    "extreme": extreme,
    "mixed": mixed,
    "program": program,
    "run-off": run_off,
    "planted": planted,
}


def outcome(case, problem):
    """Return the recorded outcome with the truth and whether the claim is false."""
    entry = of_result(run(problem, time_limit=GENEROUS_SECONDS))
    if truth.has_few_states(problem):
        found = exact.solution(problem, exact.states_of(problem, entry["z"]))
        entry["truth"] = "none" if found is None else "solution"
    else:
        entry["truth"] = "planted"
    entry = truth.judged(problem, entry)
    if int(case.key.split()[1]) % PROVED == 0 and problem.n <= truth.MAX_ENUMERATED:
        entry["false"] = entry["false"] or _fault_of_proof(problem, entry)
    return entry


def _fault_of_proof(problem, entry):
    """Record what lcpcli.exact proves, and return what is wrong with it, or ""."""
    proved = in_fractions(problem, time_limit=GENEROUS_SECONDS).exact
    entry["exact"] = proved.status.word if proved.status else None
    if proved.status is None:
        return ""
    if proved.z is not None:
        return (
            ""
            if exact.solves(problem, [Fraction(str(v)) for v in proved.z])
            else "exact z is no solution"
        )
    if proved.y is not None and not exact.refutes(
        problem, [Fraction(str(v)) for v in proved.y]
    ):
        return "exact y is no proof"
    return "" if entry["truth"] == "none" else "exact: there is a solution"


if __name__ == "__main__":
    main(cases, outcome)
