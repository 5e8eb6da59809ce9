"""A path in terms of its problem: the names of the variables, the number that varies,
the objective of a program, and what happens along it, in words; and in each of the
formats: as JSON and CSV, and as a table with a row for each breakpoint."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import replace
from fractions import Fraction
from functools import cached_property, partial
from itertools import chain, islice, zip_longest
from typing import Any, NamedTuple, TypeAlias

import numpy as np

from lcpcli.errors import count, visible
from lcpcli.files.contents import NO_SOURCE
from lcpcli.interrupts import in_time
from lcpcli.model.block_form import Blocks
from lcpcli.model.box import BASIC, LOWER, UPPER, WORDS
from lcpcli.model.formulation import unnamed
from lcpcli.model.problem import Problem, conditions_of
from lcpcli.parametric.path import INFEASIBLE, REACHED, TURN, Path, StateChange
from lcpcli.rational.exact_problem import ExactProblem
from lcpcli.rational.numbers import shortest_decimal
from lcpcli.report import plotting, result_formats, tables, wording
from lcpcli.report.document import FORMATS, Document, Section, Table
from lcpcli.typing import Vector


def title(path: Path) -> str:
    titles = (
        wording.title(problem) or "problem" for problem in (path.problem, path.to)
    )
    return f"{' to '.join(dict.fromkeys(titles))}: {wording.size(path.problem)}"


def verdict(path: Path) -> str:
    """Return how the path terminates, its breakpoints, and whether it is verified."""
    if not path.t.size:
        return path.message
    has_fractions = path.verified and path.exact is not None
    in_fractions = " in fractions" if has_fractions else ""
    proof = f"{'' if path.verified else 'not '}verified{in_fractions}"
    return f"{path.message}; {count(path.t.size, 'breakpoint')}, {proof}"


def line(path: Path) -> str:
    span = f" for t from {path.t[0]:.7g} to {path.t[-1]:.7g}" if path.t.size else ""
    return f"<Path{span}: {verdict(path)}>"


def changes(path: Path) -> list[list[StateChange]]:
    """Return the changes at each breakpoint, none at the first and at the last."""
    return [[], *path.changes, []][: path.t.size]


def notes_on(path: Path, names: Sequence[str], max_changes: float) -> list[str]:
    """Return for each breakpoint what happens there: which variables enter and leave
    the basis, a jump to it, a turning point, and the last point."""
    problem, block_form = path.problem, path.problem.block_form
    # Multipliers of a maximization are shown with the other sign.
    reversed_ones = range(0) if block_form is None else block_form.reversed(problem.n)
    verbs = {
        state: f"to {state}" if problem.is_mixed else "leaves"
        for state in WORDS.values()
    } | {WORDS[BASIC]: "enters"}
    reversed_verbs = verbs | {
        WORDS[LOWER]: verbs[WORDS[UPPER]],
        WORDS[UPPER]: verbs[WORDS[LOWER]],
    }
    notes = []
    for each in changes(path):
        shown = each if len(each) <= max_changes else each[: int(max_changes) - 1]
        texts = [
            f"{names[i]} {(reversed_verbs if i in reversed_ones else verbs)[after]}"
            for i, _, after in shown
        ]
        if len(each) > len(shown):
            texts.append(f"{len(each) - len(shown)} more")
        notes.append(texts)
    for k in path.jumps:
        notes[k + 1].insert(0, "jump")
    moves = np.sign(np.diff(path.t))
    pieces = np.flatnonzero(moves)
    for k in pieces[1:][np.diff(moves[pieces]) != 0]:
        notes[k].append("turn")
    if notes:
        notes[-1].append(path.end.replace("_", " "))
    return [", ".join(note) for note in notes]


class Points(NamedTuple):
    """Points of a path: m values of t, and z and w of each, in double precision or in
    fractions."""

    t: list[Any]
    z: list[Any]
    w: list[Any]


class Moving(NamedTuple):
    """The only number that differs between two problems: the name of the row or
    variable, what the number is for it (row for the right-hand side of an equation),
    and its values in both problems."""

    name: str
    what: str
    first: float
    last: float

    def __str__(self) -> str:
        return f"{self.label}: {self.first:.7g} to {self.last:.7g}"

    @property
    def label(self) -> str:
        return (
            f"{self.what} {self.name}"
            if self.what in ("c", "lower", "upper")
            else self.name
        )


class EndpointProblems:
    """The two problems of a path, with the names by which they are reported, and the
    block form of both, if they have one."""

    def __init__(self, *problems: Problem) -> None:
        forms = (each.block_form for each in problems)
        self._problems = problems
        self._block_forms = [
            block_form for block_form in forms if block_form is not None
        ]
        kinds = {(each.sign, each.variables, each.ranges) for each in self._block_forms}
        is_one = len(self._block_forms) == 2 and len(kinds) == 1
        self.block_form = self._block_forms[0] if is_one else None

    def names(self, max_length: float = math.inf) -> list[str]:
        """Return the names of the components of z by `short_names`; those of a
        program's multipliers begin with y."""
        if self.block_form is None:
            return wording.headings(self._problems[0], max_length)
        (data, _) = self._data
        rows = self.block_form.rows or [""] * (
            self._problems[0].n - self.block_form.variables
        )
        rows = rows[: data.row_lower.size]
        sides = [rows[i] for i in np.flatnonzero(data.ranges)]
        y, s = (
            [f"{letter} {row}" if row else "" for row in row_names]
            for letter, row_names in (("y", rows), ("s", sides))
        )
        columns = wording.short_names(
            self.block_form.columns or unnamed(self.block_form.variables),
            max_length,
            "x",
        )
        return [
            *columns,
            *wording.short_names(y, max_length, "y"),
            *wording.short_names(s, max_length, "s"),
        ]

    @cached_property
    def _data(self) -> tuple[Blocks, Blocks]:
        assert self.block_form is not None
        first, last = (
            self.block_form.blocks(conditions_of(each)) for each in self._problems
        )
        assert first is not None
        assert last is not None
        return first, last


class Terms(EndpointProblems):
    def __init__(self, path: Path) -> None:
        super().__init__(path.problem, path.to)
        self.path = path

    @property
    def points(self) -> Points:
        """Return the breakpoints, in fractions if the path has them."""
        path = self.path
        return Points(*map(list, path.exact or (path.t.tolist(), path.z, path.w)))

    def at_all(self, values: Sequence[Any]) -> Points:
        """Return the points of the path at several values of t; there are none for
        values that it does not reach."""
        if not values:
            return Points([], [], [])
        (ts, *vectors), n = self.points, self.path.problem.n
        rows = np.array([[*z, *w] for z, w in zip(*vectors, strict=True)], dtype=object)
        stacked_path = replace(self.path, t=np.array(ts, dtype=object), z=rows)
        points = Points([], [], [])
        for t in (t for t in values if ts and min(ts) <= t <= max(ts)):
            for row in np.atleast_2d(stacked_path(t)).tolist():
                for part, value in zip(points, (t, row[:n], row[n:]), strict=True):
                    part.append(value)
        return points

    def values(self, z: Sequence[Any]) -> Sequence[Any]:
        """Return z; of a program x, y and s, where the multipliers y have the signs of
        its sense, min or max."""
        reversed_indices = (
            range(0) if self.block_form is None else self.block_form.reversed(len(z))
        )
        if not reversed_indices:
            return z
        return [
            0 - value if i in reversed_indices else value for i, value in enumerate(z)
        ]

    def objective(self, t: Any, z: Sequence[Any]) -> Any:
        """Return the objective of the program at t, in the sense in which it is stated
        and with its constant."""
        assert self.block_form is not None
        share = self._share(t)
        if isinstance(t, Fraction) and self._exact:
            from lcpcli.enumeration.meaning import meaning_of

            objectives: list[Any] = [
                meaning_of(exact_problem).objective(z) for exact_problem in self._exact
            ]
        else:
            share = float(share)
            x = np.array(self.block_form.parts(z)[0], dtype=float)
            both = zip(self._block_forms, self._data, strict=True)
            objectives = [
                block_form.objective(blocks, x) for block_form, blocks in both
            ]
        return (1 - share) * objectives[0] + share * objectives[1]

    @cached_property
    def _exact(self) -> tuple[ExactProblem, ExactProblem] | None:
        """Return the problems whose solutions the fractions are: their floating-point
        numbers as exact, or as decimals."""
        points = self.points
        for read in (
            (ExactProblem.of_decimals, ExactProblem.of_floats)
            if self.path.exact and points.t
            else ()
        ):
            first, last = map(read, self._problems)
            if first.w(points.z[0]) == points.w[0]:
                return first, last
        return None

    @property
    def is_quadratic(self) -> bool:
        return self.block_form is not None and bool((self._data[0].Q != 0).sum())

    @cached_property
    def moving(self) -> Moving | None:
        """Return the number that differs, in the sense of the program, if only one
        differs; else None."""
        differences = list(islice(self._differences(), 2))
        return differences[0] if len(differences) == 1 else None

    def varying_at(self, t: Any) -> Any:
        assert self.moving is not None
        share, values = self._share(t), self.moving[2:]
        first, last = (
            map(shortest_decimal, values) if isinstance(share, Fraction) else values
        )
        return (1 - share) * first + share * last

    def _share(self, t: Any) -> Any:
        family = self.path.family
        if not isinstance(t, Fraction):
            return family.share(t)
        start, stop = Fraction(family.start), Fraction(family.stop)
        return (t - start) / (stop - start)

    def _differences(self) -> Iterator[Moving]:
        """Yield the numbers that differ; both sides of an equation are one."""
        conditions: Sequence[Any] = (
            self._data
            if self.block_form
            else [conditions_of(each) for each in self._problems]
        )
        if self.block_form is None:
            names = [f"q {name}" if name else "" for name in self.path.problem.names]
            yield from _moving(
                wording.short_names(names, math.inf, "q"),
                "q",
                *(each.q for each in conditions),
            )
        else:
            yield from _moving(
                self.names(),
                "c",
                *(self.block_form.sign * each.c for each in conditions),
            )
        for key in ("lower", "upper"):
            yield from _moving(
                self.names(), key, *(getattr(each, key) for each in conditions)
            )
        if self.block_form is None:
            return
        one, two = self._data
        rows = self.block_form.rows or [
            f"row {i}" for i in range(1, one.row_lower.size + 1)
        ]
        equal = (one.row_lower == one.row_upper) & (two.row_lower == two.row_upper)
        yield from _moving(rows, "row", one.row_lower, two.row_lower, equal)
        for key in ("row_lower", "row_upper"):
            yield from _moving(rows, key, getattr(one, key), getattr(two, key), ~equal)


def _moving(
    names: Sequence[str], what: str, first: Vector, last: Vector, among: Any = True
) -> Iterator[Moving]:
    for i in np.flatnonzero((first != last) & among).tolist():
        yield Moving(names[i], what, float(first[i]), float(last[i]))


# Rows of a table: typesetting takes a millisecond a row, and nobody reads a longer one.
MAX_ROWS = 500
# Changes that are named at a breakpoint. There are more of them where pieces of no
# length have been left out, and naming all would make the column wide.
MAX_CHANGES = 3
NOISE = 1e-12  # relative to the largest entry: smaller ones are shown as 0

# Further values of t, whose points a text shows too.
At: TypeAlias = Sequence["float | Fraction"]


def data(path: Path, at: At = (), files: Sequence[str] = ()) -> dict[str, Any]:
    """Return a path as the object of its line in JSON, with the points at further t.
    files : the files that were read."""
    terms, doubles = Terms(path), Points(path.t.tolist(), list(path.z), list(path.w))
    points = terms.at_all(at)
    moving = terms.moving and {
        **terms.moving._asdict(),
        "values": [terms.varying_at(t) for t in doubles.t],
    }
    overrides = {
        **result_formats.source_record(NO_SOURCE, path.problem),
        **dict(zip_longest(("file", "to_file"), files)),
        "to": path.to.name,
        "changes": [
            [change._asdict() for change in changes] for changes in changes(path)
        ],
        "moving": moving,
        "answer": _answer(terms, doubles),
        "exact": path.exact
        and {**path.exact._asdict(), "answer": _answer(terms, terms.points)},
        "at": {**points._asdict(), "answer": _answer(terms, points)},
    }
    return result_formats.record(result_formats.keys_of("path"), path, overrides)


def _answer(terms: Terms, points: Points) -> dict[str, Any] | None:
    if (block_form := terms.block_form) is None:
        return None
    parts = [block_form.parts(terms.values(z)) for z in points.z]
    vectors = {"x": [x for x, _ in parts], "y": [y for _, y in parts]}
    values = {"objective": list(map(terms.objective, points.t, points.z))}
    return {
        "kind": block_form.kind,
        **vectors,
        **values,
        "rows": list(block_form.rows),
        "columns": list(block_form.columns),
    }


def rows(
    path: Path, at: At, names: Sequence[str]
) -> tuple[Iterable[Sequence[Any]], list[str]]:
    """Return a row for each breakpoint, and then for each further point: its number, t,
    the number that moves, what changes, z (x and y of a program), w, and the objective
    of a program; and comments. names : as for `path_report`."""
    terms = Terms(path)
    selected = wording.selected_components(terms.names(), names) if names else None

    def selected_part(vector: Sequence[Any]) -> Sequence[Any]:
        return vector if selected is None else [vector[i] for i in selected]

    def row(number: Any, note: str, t: Any, z: Any, w: Any) -> list[Any]:
        varying = [terms.varying_at(t)] if terms.moving else []
        value = [terms.objective(t, z)] if terms.block_form else []
        vectors = (
            result_formats.plain(selected_part(vector))
            for vector in (terms.values(z), w)
        )
        return [
            *result_formats.plain([number, t, *varying, note]),
            *chain(*vectors),
            *result_formats.plain(value),
        ]

    moving = [terms.moving.label] if terms.moving else []
    w_names = [
        f"w {name}" if name else f"w{i}" for i, name in enumerate(path.problem.names, 1)
    ]
    header = [
        "breakpoint",
        "t",
        *moving,
        "change",
        *selected_part(terms.names()),
        *selected_part(w_names),
    ]
    notes = notes_on(path, terms.names(), math.inf)
    breakpoints = (
        row(k, *each)
        for k, each in enumerate(zip(notes, *terms.points, strict=True), 1)
    )
    others = (row("", "", *point) for point in zip(*terms.at_all(at), strict=True))
    header += ["objective"] * bool(terms.block_form)
    return chain([header], in_time(breakpoints), others), [title(path), verdict(path)]


def path_report(
    path: Path, at: At, files: Sequence[str] = (), names: Sequence[str] = ()
) -> result_formats.Report:
    """Return the report on a path, with the points at further t. files : the files of
    the problems. names : as for `build`; JSON has all."""
    return result_formats.Report(
        lambda format_name, width: build(path, format_name, at, width, names),
        lambda: [data(path, at, files)],
        lambda: rows(path, at, names),
    )


def build(
    path: Path, format_name: str, at: At, width: int | None, names: Sequence[str] = ()
) -> Document:
    """Return the report on a path for a format: a row for each breakpoint, and the
    further points below them. names : of the unknowns that are shown, as for
    `wording.selected_components`; empty for as many as fit."""
    terms, max_length = Terms(path), tables.longest(format_name)
    notes = notes_on(path, wording.all_visible(terms.names(max_length)), MAX_CHANGES)[
        :MAX_ROWS
    ]
    further_points = terms.at_all(at)
    unreached = [f"{float(t):.7g}" for t in at if t not in further_points.t]
    points = Points(
        *(
            [*part[:MAX_ROWS], *more]
            for part, more in zip(terms.points, further_points, strict=True)
        )
    )
    columns, elided = _columns(
        terms,
        points,
        [*notes, *["(--at)"] * len(further_points.t)],
        format_name,
        width,
        names,
    )
    header, *rows = map(list, zip(*columns, strict=True))
    groups = list(filter(None, (rows[: len(notes)], rows[len(notes) :])))
    section = Section(
        title(path),
        verdict(path),
        path.verified and path.end == REACHED,
        [str(terms.moving)] if terms.moving else [],
        [Table(header, groups, words=[header.index("change")], name="Breakpoints")],
        [
            *_remarks(terms, format_name, elided),
            *[f"the path does not come to t = {', '.join(unreached)}"]
            * bool(unreached),
        ],
        f"{wording.PROGRAM}{wording.took(path.seconds, format_name)}",
        (lambda: plotting.plot_path(path, show=names)) if path.t.size else None,
    )
    return Document(section.title, [section])


def _columns(
    terms: Terms,
    points: Points,
    notes: Sequence[str],
    format_name: str,
    width: int | None,
    selection: Sequence[str],
) -> tuple[list[list[str]], bool]:
    """Return the columns of a table with their headings, and whether unknowns are
    omitted: t, the number that moves, what changes, as many components of z (x and y of
    a program) as fit in the width, w if all fit, and the objective of a program.
    selection : as names for `build`."""
    path = terms.path
    blocks = terms.block_form
    max_length = tables.longest(format_name)
    n, names = path.problem.n, wording.all_visible(terms.names(max_length))
    of_z, *of_w = (
        float(np.abs(array).max(initial=0.0))
        for array in (path.z, path.w, path.problem.q, path.to.q)
    )
    vectors = list(map(terms.values, points.z))

    def of_places(indices: Iterable[int | None]) -> list[list[str]]:
        gap = [wording.ELLIPSIS] * (len(vectors) + 1)
        return [
            gap if i is None else _column(names[i], (z[i] for z in vectors), of_z)
            for i in indices
        ]

    before, after = _of_change(terms, points, notes, max_length), list[list[str]]()
    if blocks:
        after.append(_column("objective", map(terms.objective, points.t, points.z)))
    if selection:
        shown = of_places(wording.selected_components(terms.names(), selection))
        return [*before, *shown, *after], False
    available_width = None
    if format_name == "table" and width is not None:
        others = tables.CELL * (len(before) - 1 + len(after))
        others += max(map(len, notes), default=0)
        available_width = width - others + tables.OTHER_COLUMNS
    counts = [n] if blocks is None else [n - blocks.ranges, blocks.variables]
    fitting = (k for k in counts if tables.shown_components(k, available_width) is None)
    number = next(fitting, counts[-1])
    shown = of_places(
        tables.with_gap(number, tables.shown_components(number, available_width))
    )
    # The rounding of w is that of its terms.
    if blocks is None and tables.shown_components(2 * n, available_width) is None:
        largest_w = max(of_w)
        shown += [
            _column(f"w{i + 1}", (w[i] for w in points.w), largest_w) for i in range(n)
        ]
    return [*before, *shown, *after], len(shown) < counts[0]


def _of_change(
    terms: Terms, points: Points, notes: Sequence[str], longest: float
) -> list[list[str]]:
    """Return the columns of t, unless the number that moves is t, of this number, if
    there is one, and of what changes."""
    path, moving = terms.path, terms.moving
    span = path.family.start, path.family.stop
    columns = [["change", *notes]]
    if moving:
        label = moving.label if len(visible(moving.label)) < longest else "value"
        largest = max(map(abs, moving[2:]))
        columns.insert(0, _column(label, map(terms.varying_at, points.t), largest))
    if moving is None or moving[2:] != tuple(map(float, span)):
        columns.insert(0, _column("t", points.t, float(max(map(abs, span)))))
    return columns


def _column(name: str, values: Iterable[Any], largest: float = 0.0) -> list[str]:
    return [name, *(_cell(value, largest) for value in values)]


def _cell(value: Any, largest: float = 0.0) -> str:
    return wording.number(
        0.0 if isinstance(value, float) and abs(value) <= NOISE * largest else value
    )


def _remarks(terms: Terms, format_name: str, elided: bool) -> list[str]:
    path, remarks = terms.path, []
    has_names = any(path.problem.names)
    named = partial(
        wording.named,
        names=terms.names() if has_names else (),
        sparing=has_names,
    )
    if path.certificate is not None:
        which = "first" if path.end == INFEASIBLE else "second"
        y = named(path.certificate.tolist(), cell=wording.multiplier)
        remarks.append(f"proof that the {which} problem has no solution: y = {y}")
    if path.direction is not None:
        largest = float(np.abs(path.direction).max())
        along = (np.round(path.direction / largest, 12) * largest).tolist()
        remarks.append(
            f"direction of z on the ray: {named(along, cell='{:.7g}'.format)}"
        )
    if path.jumps:
        remarks.append("at a jump all points between the two rows solve the problem")
    if path.t.size > MAX_ROWS:
        remarks.append(
            f"the first {MAX_ROWS} of {path.t.size} rows; --format json and "
            "csv have all of them"
        )
    if not FORMATS[format_name].is_printed:
        if path.end == TURN:
            remarks.append("with --turns the path continues, with t decreasing")
        if elided:
            remarks.append(f"see all {path.problem.n} components with --format csv")
    return remarks
