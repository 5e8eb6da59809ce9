"""Tables in LaTeX and in Markdown."""

from __future__ import annotations

import itertools
import re
from collections.abc import Collection, Sequence
from typing import TypeAlias

from lcpcli.report.tables import LEFT, ResultTable
from lcpcli.report.wording import ELLIPSIS

SPECIAL: dict[str, str | int | None] = {
    "\\": r"\textbackslash{}",
    "~": r"\textasciitilde{}",
    "^": r"\textasciicircum{}",
    "<": r"\textless{}",
    ">": r"\textgreater{}",
    "|": r"\textbar{}",
    "[": "{[}",
    **{mark: "\\" + mark for mark in "&%$#_{}"},
}
VARIABLES = ("z", "w", "x", "y")
NEEDED = r"% needs \usepackage{booktabs} and \usepackage{graphicx}, and \usepackage{longtable} for a table over pages"
PAGE_ROWS = 45  # of a table at most, so that it fits on a page with its caption
EXPONENT = re.compile(r"(?<![\w.])(\d(?:\.\d+)?)e([+-]?\d+)(?![\w.])")  # a number that has one
Places: TypeAlias = Collection[tuple[int, int]]  # cells, by row and column
FITTED = r"\resizebox{\ifdim\width>\textwidth\textwidth\else\width\fi}{!}{"  # shrinks a wide table, enlarges none


def latex(tables: Sequence[ResultTable]) -> str:
    """Return one table environment per problem, ready to be \\input."""
    lines = [NEEDED]
    for table, label in zip(tables, labels([table.title.split(":")[0] for table in tables]), strict=True):
        above = [text for text in (table.verdict, *table.facts) if text]
        caption, notes = f"{table.title}. {table.provenance}.", [*above, *table.remarks]
        parts = [tabular(table.header, table.groups, LEFT)] if table.groups else []
        if sum(map(len, table.groups)) > PAGE_ROWS:
            lines.append(_longtable(caption, label, parts.pop()))
            caption, label = "", ""
        if table.summary is not None:
            notes = [*filter(None, [table.summary.note]), *notes]
            parts.append(tabular(table.summary.header, [table.summary.rows], LEFT, table.summary.best))
        if parts or notes:
            lines.append(float_of(caption, label, parts, notes) + "\n")
    return "\n".join(lines)


def labels(names: Sequence[str]) -> list[str]:
    """Return a different label for each name, of letters, digits and hyphens only."""
    found: list[str] = []
    for name in names:
        plain = "tab:" + (re.sub(r"[^A-Za-z0-9]+", "-", name).strip("-") or "lcp")
        candidates = (plain if i == 1 else f"{plain}-{i}" for i in itertools.count(1))
        found.append(next(label for label in candidates if label not in found))
    return found


def float_of(caption: str, label: str, tables: Sequence[list[str]], notes: Sequence[str]) -> str:
    """Return a table environment: its tables below each other, none wider than the text, and the notes below them."""
    named = [rf"\caption{{{_text(caption)}}}", rf"\label{{{label}}}"] if label else []
    lines = [r"\begin{table}[htbp]", *named, r"\centering\small"]
    for table in tables:
        lines += [FITTED + table[0], *table[1:-1], table[-1] + r"}\par\medskip"]
    if notes:
        lines += [r"\raggedright", *(rf"{_text(note)}\par" for note in notes)]
    return "\n".join([*lines, r"\end{table}"])


def _longtable(caption: str, label: str, table: list[str]) -> str:
    """Return the lines of a table that continues over pages, each headed by the names of the columns."""
    begin, top, names, *rows, _ = table
    head = [rf"\caption{{{_text(caption)}}}\label{{{label}}}\\", top, names]
    lines = [begin.replace("tabular", "longtable"), *head, r"\endfirsthead", top, names, r"\endhead", *rows]
    return "\n".join([r"\begingroup\small\setlength{\tabcolsep}{4pt}", *lines, r"\end{longtable}", r"\endgroup", ""])


def tabular(
    header: list[str], groups: Sequence[list[list[str]]], left: Collection[str], best: Places = ()
) -> list[str]:
    """Return the lines of a table with a rule before each group.

    left : the names of the left-aligned columns. best : the cells of the last group in bold type.
    """
    lines = [
        rf"\begin{{tabular}}{{{''.join('l' if name in left else 'r' for name in header)}}}",
        r"\toprule",
        _row([_heading(name) for name in header]),
    ]
    for group in groups:
        marked = best if group is groups[-1] else ()
        rows = [[_cell(text, (i, j) in marked) for j, text in enumerate(cells)] for i, cells in enumerate(group)]
        lines += [r"\midrule", *map(_row, rows)]
    return [*lines, r"\bottomrule", r"\end{tabular}"]


def _row(cells: list[str]) -> str:
    return " & ".join(cells) + r" \\"


def _heading(name: str) -> str:
    if name[:1] in VARIABLES and name[1:].isdigit():
        return f"${name[0]}_{{{name[1:]}}}$"
    return f"${name}$" if name == "k" else _cell(name)


def _cell(text: str, is_bold: bool = False) -> str:
    cell = r"\dots" if text == ELLIPSIS else _text(text)
    return rf"\textbf{{{cell}}}" if is_bold else cell


def _text(text: str) -> str:
    """Return a text in LaTeX, with powers of ten for exponents, and the Greek letter of microseconds."""
    parts = re.split(EXPONENT, text)
    words = escape_latex(parts[0]) + "".join(
        _power(digits, int(exponent)) + escape_latex(after)
        for digits, exponent, after in zip(parts[1::3], parts[2::3], parts[3::3], strict=True)
    )
    return re.sub(r"\bus\b", r"$\\mu$s", words)


def _power(digits: str, exponent: int) -> str:
    if exponent == 0:
        return digits
    return f"$10^{{{exponent}}}$" if digits == "1" else rf"${digits} \cdot 10^{{{exponent}}}$"


def escape_latex(text: str) -> str:
    """Return a text with LaTeX's special characters escaped, and with hyphens separated, so that TeX does not make
    dashes of them."""
    return re.sub("-(?=-)", "-{}", text.translate(str.maketrans(SPECIAL)))


def markdown(tables: Sequence[ResultTable]) -> str:
    """Return one section per problem: a single result and its iterates, or the iterates and then one line per
    method."""
    sections = []
    for table in tables:
        remarks = [escape_markdown(line) for line in (*table.facts, *table.remarks)]
        rows = [row for group in table.groups for row in group]
        parts = [grid(table.header, rows, LEFT) if rows else ""]
        if table.verdict:
            parts = [f"**{escape_markdown(table.verdict)}**", *remarks, *parts]
        else:
            summary = table.summary
            parts += [*([grid(summary.header, summary.rows, LEFT, summary.best)] if summary else []), *remarks]
        whole = [f"### {escape_markdown(table.title)}", *parts, escape_markdown(table.provenance)]
        sections.append("\n\n".join(filter(None, whole)) + "\n")
    return "\n".join(sections)


def grid(header: list[str], rows: list[list[str]], left: Collection[str], best: Places = ()) -> str:
    """Return a table in Markdown. left : the names of the left-aligned columns. best : the cells in bold type."""
    marks = [":--" if name in left else "--:" for name in header]
    cells = [
        [f"**{escape_markdown(text)}**" if (i, j) in best else escape_markdown(text) for j, text in enumerate(row)]
        for i, row in enumerate(rows)
    ]
    return "\n".join(f"| {' | '.join(row)} |" for row in (map(escape_markdown, header), marks, *cells))


def escape_markdown(text: str) -> str:
    """Return a text with Markdown's special characters escaped."""
    return re.sub(r"([\\|*_<`\[$~]|&(?=[#\w]))", r"\\\1", text)
