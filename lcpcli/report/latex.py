"""The tables of iterates in LaTeX, laid out like the paper's, with the rules of the booktabs package."""

from __future__ import annotations

import itertools
import re
from collections.abc import Collection, Sequence

from lcpcli.report.numbers import ELLIPSIS
from lcpcli.report.result_table import LEFT, ResultTable

SPECIAL = {
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


def render(tables: Sequence[ResultTable]) -> str:
    """One table environment per problem, ready to be \\input."""
    names = labels([table.title.split(":")[0] for table in tables])
    return "\n".join([NEEDED, *(_environment(table, name) for table, name in zip(tables, names, strict=True))])


def labels(names: Sequence[str]) -> list[str]:
    """A label for each name, of letters, digits and hyphens only, no two the same."""
    found: list[str] = []
    for name in names:
        plain = "tab:" + (re.sub(r"[^A-Za-z0-9]+", "-", name).strip("-") or "lcp")
        candidates = (plain if i == 1 else f"{plain}-{i}" for i in itertools.count(1))
        found.append(next(label for label in candidates if label not in found))
    return found


def _environment(table: ResultTable, label: str) -> str:
    caption = f"{table.title}. {table.provenance}."
    above = [text for text in (table.verdict, *table.facts) if text]
    tables = [tabular(table.header, table.groups, LEFT)] if table.groups else []
    if table.summary:
        tables.append(tabular(table.summary_header, [table.summary], LEFT))
    return float_of(caption, label, tables, [*above, *table.remarks]) + "\n"


def float_of(caption: str, label: str, tables: Sequence[list[str]], notes: Sequence[str]) -> str:
    """A table environment: its tables below each other, none wider than the text, and the notes below them."""
    lines = [r"\begin{table}[htbp]", rf"\caption{{{escape(caption)}}}", rf"\label{{{label}}}", r"\centering\small"]
    for table in tables:
        lines += [FITTED + table[0], *table[1:-1], table[-1] + r"}\par\medskip"]
    if notes:
        lines += [r"\raggedright", *(rf"{escape(note)}\par" for note in notes)]
    return "\n".join([*lines, r"\end{table}"])


def tabular(header: list[str], groups: Sequence[list[list[str]]], left: Collection[str]) -> list[str]:
    """The lines of a table with a rule before each group; `left` are the names of the left-aligned columns."""
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
    return r"\dots" if text == ELLIPSIS else escape(text)


def escape(text: str) -> str:
    """Text with LaTeX's special characters escaped, and hyphens kept apart, of which TeX would make a dash."""
    return re.sub("-(?=-)", "-{}", "".join(SPECIAL.get(mark, mark) for mark in text))
