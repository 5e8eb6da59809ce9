"""The tables of iterates in LaTeX, set like the paper's, with the rules of the booktabs package."""

from __future__ import annotations

from collections.abc import Sequence

from lcpcli.report.iterations import ELLIPSIS, IterationTable

SPECIAL = {
    "\\": r"\textbackslash{}",
    "~": r"\textasciitilde{}",
    "^": r"\textasciicircum{}",
    "<": r"\textless{}",
    ">": r"\textgreater{}",
    "|": r"\textbar{}",
    **{mark: "\\" + mark for mark in "&%$#_{}"},
}


def render(tables: Sequence[IterationTable]) -> str:
    """One table environment a problem, ready to be \\input."""
    return "\n".join(_environment(table) for table in tables)


def _environment(table: IterationTable) -> str:
    lines = [
        r"\begin{table}",
        rf"\caption{{{_escape(table.title)}}}",
        r"\centering",
        rf"\begin{{tabular}}{{l{'r' * (len(table.header) - 1)}}}",
        r"\toprule",
        _row([_heading(name) for name in table.header]),
    ]
    for group in table.groups:
        lines += [r"\midrule", *(_row([_cell(cell) for cell in row]) for row in group)]
    lines += [r"\bottomrule", r"\end{tabular}"]
    for summary in table.summary:
        facts = [f"{name} {cell}" for name, cell in zip(table.summary_header, summary, strict=True) if cell]
        lines.append(rf"\par\smallskip {_escape(', '.join(facts[1:]))} ({_escape(summary[0])})")
    return "\n".join([*lines, r"\end{table}"]) + "\n"


def _row(cells: list[str]) -> str:
    return " & ".join(cells) + r" \\"


def _heading(name: str) -> str:
    if name[0] == "z" and name[1:].isdigit():
        return f"$z_{{{name[1:]}}}$"
    return f"${name}$" if name == "k" else _cell(name)


def _cell(text: str) -> str:
    return r"\dots" if text == ELLIPSIS else _escape(text)


def _escape(text: str) -> str:
    return "".join(SPECIAL.get(mark, mark) for mark in text)
