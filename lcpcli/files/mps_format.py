"""Linear and quadratic programs in MPS (fixed and free, with QUADOBJ or QMATRIX) and in the LP format, read by HiGHS;
MPS is written without it.

What HiGHS warns of, or repairs in silence, is refused: a number that is none, a column or an entry given twice, and a
negative upper bound without a lower one, which some programs read as a bound from below too. Bounds, right-hand sides
and ranges of 1e20 or more are none. Reading needs highspy.
"""

from __future__ import annotations

import re
import tempfile
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from lcpcli.errors import ProblemError, quoted
from lcpcli.files import mps_words
from lcpcli.files.content import unpacked
from lcpcli.files.formats import NEAREST
from lcpcli.files.mps_lines import (
    MPS,
    as_written,
    line_of,
    range_sides,
    refuse_misread,
    spaced_row,
    undeclared,
    unknown_row,
)
from lcpcli.linalg.doubles import EPS
from lcpcli.model.arrays import NO_BOUND
from lcpcli.model.problem import Problem
from lcpcli.model.reductions import from_qp
from lcpcli.rational.numbers import Doubles
from lcpcli.rational.problem import exact_parts
from lcpcli.typing import Matrix, Vector

if TYPE_CHECKING:
    from fractions import Fraction

    from lcpcli.files.formats import Exact, Number
    from lcpcli.rational.problem import ExactParts

Interval = tuple[float, float]

PACKAGE = "highspy"
HINT = "pip install 'linear-complementarity[mps]'"
NO_VECTOR = ("is a program", "name a file that holds a vector")
TOLD_BETTER = ("inconsistent bounds", "Parser error", "switching to fixed format")  # here, or harmless
DENSE = 200  # unknowns up to which the matrices are kept dense
NAME = re.compile(rb"^NAME[ \t]+(\S+)", re.MULTILINE)


def parse(content: bytes, number: Number = float) -> Problem:
    """The problem of the program in a file.

    number : makes the doubles of the numbers in MPS, one for each of them if it is a `Doubles`.
    """
    text = unpacked(content)
    is_mps = MPS.search(text) is not None
    if not is_mps:
        return _problem(_read(text, ".lp"), text, {})
    refuse_misread(text)
    double_of = number.of if isinstance(number, Doubles) else float
    sides = {row: (double_of(low), double_of(high)) for row, (low, high) in range_sides(text).items()}
    return _problem(_read(text if number is float else as_written(text, number), ".mps"), text, sides, is_mps)


def parse_exact(content: bytes) -> ExactParts:
    """The problem of the program in a file with the numbers as they are written, in the LP format the shortest decimals
    of their doubles."""
    return exact_parts(lambda number: parse(content, number))


def parse_vector(field: str, content: bytes, n: int | None = None) -> Vector:  # noqa: ARG001 (as in every format)
    raise ProblemError("", *NO_VECTOR)


def parse_exact_vector(field: str, content: bytes) -> list[Fraction]:  # noqa: ARG001
    raise ProblemError("", *NO_VECTOR)


def render(problem: Problem, exact: Exact = NEAREST) -> dict[str, bytes]:
    """The program as free MPS."""
    from lcpcli.files import mps_writing

    return {"": mps_writing.render(problem, exact)}


def _read(text: bytes, ending: str) -> Any:
    """HiGHS with the program; ProblemError for what it complains of."""
    try:
        import highspy
    except ModuleNotFoundError:
        raise ProblemError("", f"is read by {PACKAGE}, which is not installed", HINT) from None
    highs = highspy.Highs()
    highs.setOptionValue("log_to_console", False)
    highs.setOptionValue("infinite_bound", NO_BOUND)
    told: list[str] = []
    highs.cbLogging.subscribe(
        lambda event: told.append(event.message) if event.message.startswith(("WARNING", "ERROR")) else None
    )
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / f"program{ending}"
        file.write_bytes(text)
        try:
            status = highs.readModel(str(file))
        except UnicodeDecodeError:  # a complaint that quotes what is no text
            status = highspy.HighsStatus.kError
    complaints = [" ".join(line.partition(":")[2].split()) for line in told]
    complaints = [line for line in complaints if not any(words in line for words in TOLD_BETTER)]
    is_error = status == highspy.HighsStatus.kError
    if (complaints or is_error) and ending == ".mps" and (place := spaced_row(text)):
        raise ProblemError(place, "has a name with spaces", "write it without, as with _")
    if complaints and ending == ".mps" and (unknown := unknown_row(text)):
        place = line_of(text, f'"{unknown}"')
        raise ProblemError(place, f"names {quoted(unknown)}, which is not in ROWS", "correct it, or declare it there")
    if complaints:
        raise mps_words.fault(text, complaints[0])
    if is_error:
        raise ProblemError("", "is not a program in MPS or in the LP format", "is it complete?")
    return highs


def _problem(highs: Any, text: bytes, ranges: Mapping[str, Interval], is_mps: bool = False) -> Problem:
    model = highs.getModel()
    lp, hessian = model.lp_, model.hessian_
    k, names = lp.num_col_, list(lp.col_names_)
    if not k:
        raise ProblemError("", "has no columns", "give a program with at least one variable")
    _refuse_integers(lp, names, text)
    low, high = np.array(lp.col_lower_), np.array(lp.col_upper_)
    A = _sparse(lp.a_matrix_, (lp.num_row_, k))
    Q = _symmetric(hessian, k) if hessian.dim_ else None
    if is_mps:
        _refuse_undeclared(lp, A, names, text)
    _refuse_crossed(low, high, names, text)
    rows = _sides(np.array(lp.row_lower_), np.array(lp.row_upper_))
    _round_once(rows, list(lp.row_names_), ranges)
    if k + lp.num_row_ <= DENSE:
        A, Q = A.toarray(), None if Q is None else Q.toarray()
    return from_qp(
        Q,
        np.array(lp.col_cost_),
        A if lp.num_row_ else None,
        row_lower=rows[0] if lp.num_row_ else None,
        row_upper=rows[1] if lp.num_row_ else None,
        lower=low,
        upper=high,
        sense="max" if "Max" in lp.sense_.name else "min",
        constant=lp.offset_,
        rows=list(lp.row_names_),
        columns=names,
        name=name[1].decode("utf-8", "replace") if (name := NAME.search(text)) else "",
    )


def _sides(low: Vector, high: Vector) -> tuple[Vector, Vector]:
    """The sides of rows, without the one that a range of NO_BOUND makes of a right-hand side that is not 0."""
    ranges = (high - low >= (1 - EPS) * NO_BOUND) & np.isfinite(high - low)
    return np.where(ranges & (-low > high), -np.inf, low), np.where(ranges & (-low <= high), np.inf, high)


def _round_once(sides: tuple[Vector, Vector], names: list[str], ranges: Mapping[str, Interval]) -> None:
    """Put the sides of rows with ranges in their place, where rounding alone tells them from what HiGHS computes."""
    places = {name: i for i, name in enumerate(names)} if ranges else {}
    for name, ends in ranges.items():
        i = places.get(name)
        if i is None or not np.allclose([sides[0][i], sides[1][i]], ends, rtol=1e-12, atol=1e-12 * max(map(abs, ends))):
            continue
        sides[0][i], sides[1][i] = ends


def _sparse(matrix: Any, shape: tuple[int, int]) -> Matrix:
    """A matrix of HiGHS in compressed sparse rows."""
    from scipy.sparse import csc_array, csr_array

    by_columns = matrix.format_.name == "kColwise"
    parts = (np.array(matrix.value_), np.array(matrix.index_, np.intc), np.array(matrix.start_, np.intc))
    found = (csc_array if by_columns else csr_array)(parts, shape=shape)
    return csr_array(found)


def _symmetric(hessian: Any, k: int) -> Matrix:
    """Q from its lower triangle."""
    from scipy.sparse import csc_array, diags_array

    parts = (np.array(hessian.value_), np.array(hessian.index_, np.intc), np.array(hessian.start_, np.intc))
    triangle = csc_array(parts, shape=(k, k))
    return (triangle + triangle.T - diags_array(triangle.diagonal())).tocsr()


def _refuse_integers(lp: Any, names: list[str], text: bytes) -> None:
    kinds = [kind.name for kind in lp.integrality_]
    j = next((j for j, name in enumerate(kinds) if name != "kContinuous"), None)
    if j is not None:
        what = "an integer" if kinds[j] == "kInteger" else "a semicontinuous"
        hint = "lcp solves programs with continuous variables only"
        raise ProblemError(line_of(text, f'"{names[j]}"'), f"makes {quoted(names[j])} {what} variable", hint)


def _refuse_undeclared(lp: Any, A: Matrix, names: list[str], text: bytes) -> None:
    """Refuse a column that only BOUNDS name: HiGHS adds it to the program."""
    used = (np.array(lp.col_cost_) != 0) | (np.bincount(A.indices, minlength=len(names)) > 0)
    unknown = undeclared(text, [names[j] for j in np.flatnonzero(~used)])
    if unknown:
        hint = "correct the name, or declare it there"
        raise ProblemError(line_of(text, f'"{unknown}"'), f"names {quoted(unknown)}, which is not in COLUMNS", hint)


def _refuse_crossed(low: Vector, high: Vector, names: list[str], text: bytes) -> None:
    crossed = np.flatnonzero(low > high)
    if not crossed.size:
        return
    j = int(crossed[0])
    place = line_of(text, f'"{names[j]}" in BOUNDS section')
    fault = f"gives {quoted(names[j])} the upper bound {high[j]:g}, below its lower bound {low[j]:g}"
    hint = "make the lower bound the smaller one" if low[j] else "give a lower bound too: LO, or MI for none"
    raise ProblemError(place, fault, hint)
