"""An inspection as human-readable text, in lines of at most a given width."""

from __future__ import annotations

import math
from textwrap import wrap

from lcpcli.errors import count
from lcpcli.inspection.difficulty import Factorization
from lcpcli.inspection.inspection import Inspection
from lcpcli.inspection.theory import Rate
from lcpcli.linalg.matrices import is_sparse
from lcpcli.options import TOL
from lcpcli.report import numbers

WIDTH = 80
NARROW = 30  # columns: the least width of a wrapped column beside others
TITLES = {
    "copositive_plus": "copositive-plus",
    "h_plus": "H+-matrix",
    "m_matrix": "M-matrix",
    "p_matrix": "P-matrix",
    "p0_matrix": "P0-matrix",
    "skew_symmetric": "skew-symmetric",
    "z_matrix": "Z-matrix",
}
UNKNOWN = "not computed: too expensive"
CLOSE = 0.999  # factors from here on are shown by their distance from 1
MANY = 999_999
BINARY = ((2**30, "GiB"), (2**20, "MiB"), (2**10, "KiB"), (1, "bytes"))

Row = tuple[str, ...]


def render(found: Inspection, width: int | None = None) -> str:
    """In lines of that width, at most and by default 80: the facts, the classes of M, the methods, and remarks."""
    width = min(width or WIDTH, WIDTH)
    classes = [
        (TITLES.get(name, name.replace("_", " ")), verdict.word, verdict.evidence)
        for name, verdict in found.classes.items()
    ]
    methods = [(name, guarantee.word, guarantee.reason) for name, guarantee in found.guarantees.items()]
    remarks = [text for text in (found.obvious, *found.hints) if text]
    lines = [
        *wrap(f"{found.problem.name}: {numbers.size(found.problem)}", width),
        *_grid(_facts(found), width),
        "",
        *_grid([("class of M", "", "because"), *classes], width, ruled=True),
        "",
        *_grid([("method", "guaranteed", "in exact arithmetic, because"), *methods], width, ruled=True),
    ]
    if remarks:
        lines.append("")
        for remark in remarks:
            lines += wrap(remark, width, initial_indent="- ", subsequent_indent="  ")
    return "".join(line + "\n" for line in lines)


def _facts(found: Inspection) -> list[Row]:
    return [
        ("entries", _entries(found)),
        ("scaling", _scaling(found)),
        ("condition", _condition(found)),
        ("eigenvalues", _eigenvalues(found)),
        ("factorization", _factorization(found)),
        *_interior(found.factorization),
        ("fixed-point", _rate(found.published, found)),
        ("  --omega auto", _rate(found.best, found)),
        ("shi", f"p = {found.smoothing.p:.2g} leaves a smoothing error of at most {found.smoothing.error:.1e} in F"),
    ]


def _entries(found: Inspection) -> str:
    n, stored = found.problem.n, "sparse" if is_sparse(found.problem.M) else "dense"
    share = 100 * found.nonzeros / n**2
    return f"{stored}, {found.nonzeros} of {n**2} nonzero ({share:.3g} %), {_bytes(found.cost.bytes)}"


def _scaling(found: Inspection) -> str:
    before, after = found.spread, found.equilibrated_spread
    return (
        f"largest entries vary by {before.rows:.1f} decades over rows, {before.columns:.1f} over columns; "
        f"by {after.rows:.1f} and {after.columns:.1f} after equilibration"
    )


def _condition(found: Inspection) -> str:
    own, scaled = found.condition, found.equilibrated_condition
    if own is None or scaled is None:
        return UNKNOWN
    if math.isinf(own) and math.isinf(scaled):
        return "singular to working precision"
    texts = ["infinite" if math.isinf(value) else f"{value:.2g}" for value in (own, scaled)]
    return f"{texts[0]} in the 1-norm, {texts[1]} after equilibration"


def _eigenvalues(found: Inspection) -> str:
    if found.spectrum is None:
        return "M is not symmetric" if found.classes["symmetric"].word == "no" else UNKNOWN
    about = "about " if found.spectrum.estimated else ""
    return f"{about}{found.spectrum.smallest:.4g} to {found.spectrum.largest:.4g}"


def _factorization(found: Inspection) -> str:
    cost = found.cost
    size = f"{cost.factor_entries:.2g} entries, {cost.factor_operations:.2g} operations"
    if cost.bandwidth is None:
        return size
    return f"at most {size} (bandwidth {cost.bandwidth} after reordering)"


def _interior(own: Factorization | None) -> list[Row]:
    if own is None:
        return []
    if own.library is None or own.first is None:
        return [("interior", f"factorization of M + D {own.note}")]
    ratio = "" if own.ratio is None else f" ({own.ratio:.3g} times as many)"
    again = own.note if own.repeated is None else f"then {numbers.duration(own.repeated)}"
    return [
        (
            "interior",
            f"factorizes M + D by {own.library}: {count(own.nonzeros, 'entry')} of M, {own.factor_nonzeros} of the "
            f"factors{ratio}, {numbers.duration(own.first)} at first, {again}",
        )
    ]


def _rate(rate: Rate | None, found: Inspection) -> str:
    if rate is None:
        return UNKNOWN
    if rate.factor is None:
        return f"omega = {rate.omega:.4g}: rate unknown"
    if rate.iterations is None:
        return f"omega = {rate.omega:.4g}: |T| = {rate.factor:.4g}, no contraction"
    factor = f"{rate.factor:.4g}" if rate.factor < CLOSE else f"1 - {1 - rate.factor:.1e}"
    many = rate.iterations > MANY
    times = f"{rate.iterations:.1e} iterations" if many else count(rate.iterations, "iteration")
    most = "about" if found.spectrum and found.spectrum.estimated else "at most"
    return f"omega = {rate.omega:.4g}: |T| = {factor}, {most} {times} to {TOL.value:.0e} of the initial error"


def _bytes(size: int) -> str:
    unit, name = next((unit, name) for unit, name in BINARY if size >= unit)
    return f"{size / unit:.3g} {name}"


def _grid(rows: list[Row], width: int, ruled: bool = False) -> list[str]:
    """Rows with aligned columns, the last one wrapped, on lines of its own if little room is left beside the others;
    with a rule of dashes under the first row if `ruled`."""
    widths = [max(len(row[k]) for row in rows) for k in range(len(rows[0]) - 1)]
    beside = width - sum(widths) - 2 * len(widths) >= NARROW
    indent = " " * (sum(widths) + 2 * len(widths) if beside else 4)
    lines = []
    for row in rows:
        head = "".join(cell.ljust(size + 2) for cell, size in zip(row, widths, strict=False))
        if not beside:
            lines.append(head.rstrip())
        folded = wrap(row[-1], width, initial_indent=head if beside else indent, subsequent_indent=indent)
        lines += [line.rstrip() for line in folded] or [head.rstrip()] * beside
        if ruled and row is rows[0]:
            lines.append("-" * width)
    return lines
