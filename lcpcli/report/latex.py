"""The tables of iterates in LaTeX, laid out like the paper's, with the rules of the booktabs package."""

from __future__ import annotations

from collections.abc import Collection, Sequence

from lcpcli.report.iterations import LEFT, IterationTable
from lcpcli.report.numbers import ELLIPSIS

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


def render(tables: Sequence[IterationTable]) -> str:
    """One table environment per problem, ready to be \\input."""
    return "\n".join(_environment(table) for table in tables)


def _environment(table: IterationTable) -> str:
    lines = [
        r"\begin{table}",
        rf"\caption{{{escape(f'{table.title}. {table.provenance}.')}}}",
        r"\centering",
        *tabular(table.header, table.groups, LEFT),
    ]
    for summary in table.summary:
        facts = [f"{name} {value}" for name, value in zip(table.summary_header, summary, strict=True) if value]
        lines.append(rf"\par\smallskip {escape(', '.join(facts[1:]))} ({escape(summary[0])})")
    return "\n".join([*lines, r"\end{table}"]) + "\n"


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
    if name[0] == "z" and name[1:].isdigit():
        return f"$z_{{{name[1:]}}}$"
    return f"${name}$" if name == "k" else _cell(name)


def _cell(text: str) -> str:
    return r"\dots" if text == ELLIPSIS else escape(text)


def escape(text: str) -> str:
    """Text with LaTeX's special characters escaped."""
    return "".join(SPECIAL.get(mark, mark) for mark in text)
