"""Tables in LaTeX and in Markdown."""

from __future__ import annotations

import itertools
import re
from collections.abc import Collection, Sequence

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
NEEDED = r"% needs \usepackage{booktabs} and \usepackage{graphicx}"
FITTED = r"\resizebox{\ifdim\width>\textwidth\textwidth\else\width\fi}{!}{"  # shrinks a wide table, enlarges none


def latex(tables: Sequence[ResultTable]) -> str:
    """Return one table environment per problem, ready to be \\input."""
    lines = [NEEDED]
    for table, label in zip(tables, labels([table.title.split(":")[0] for table in tables]), strict=True):
        above = [text for text in (table.verdict, *table.facts) if text]
        parts = [tabular(table.header, table.groups, LEFT)] if table.groups else []
        if table.summary:
            parts.append(tabular(table.summary_header, [table.summary], LEFT))
        caption = f"{table.title}. {table.provenance}."
        lines.append(float_of(caption, label, parts, [*above, *table.remarks]) + "\n")
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
    lines = [
        r"\begin{table}[htbp]",
        rf"\caption{{{escape_latex(caption)}}}",
        rf"\label{{{label}}}",
        r"\centering\small",
    ]
    for table in tables:
        lines += [FITTED + table[0], *table[1:-1], table[-1] + r"}\par\medskip"]
    if notes:
        lines += [r"\raggedright", *(rf"{escape_latex(note)}\par" for note in notes)]
    return "\n".join([*lines, r"\end{table}"])


def tabular(header: list[str], groups: Sequence[list[list[str]]], left: Collection[str]) -> list[str]:
    """Return the lines of a table with a rule before each group. left : the names of the left-aligned columns."""
    lines = [
        rf"\begin{{tabular}}{{{''.join('l' if name in left else 'r' for name in header)}}}",
        r"\toprule",
        _row([_heading(name) for name in header]),
    ]
    for group in groups:
        lines += [r"\midrule", *(_row([_cell(text) for text in cells]) for cells in group)]
    return [*lines, r"\bottomrule", r"\end{tabular}"]


def _row(cells: list[str]) -> str:
    return " & ".join(cells) + r" \\"


def _heading(name: str) -> str:
    if name[:1] in VARIABLES and name[1:].isdigit():
        return f"${name[0]}_{{{name[1:]}}}$"
    return f"${name}$" if name == "k" else _cell(name)


def _cell(text: str) -> str:
    return r"\dots" if text == ELLIPSIS else escape_latex(text)


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
            parts += [grid(table.summary_header, table.summary, LEFT), *remarks]
        whole = [f"### {escape_markdown(table.title)}", *parts, escape_markdown(table.provenance)]
        sections.append("\n\n".join(filter(None, whole)) + "\n")
    return "\n".join(sections)


def grid(header: list[str], rows: list[list[str]], left: Collection[str]) -> str:
    """Return a table in Markdown. left : the names of the left-aligned columns."""
    marks = [":--" if name in left else "--:" for name in header]
    return "\n".join(f"| {' | '.join(map(escape_markdown, row))} |" for row in (header, marks, *rows))


def escape_markdown(text: str) -> str:
    """Return a text with Markdown's special characters escaped."""
    return re.sub(r"([\\|*_<`\[])", r"\\\1", text)
