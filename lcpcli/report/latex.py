"""Reports in LaTeX."""

from __future__ import annotations

import re
from collections.abc import Sequence

from lcpcli.report.document import Document, Section, Table
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
NEEDED = (
    r"% needs \usepackage{booktabs} and \usepackage{graphicx}, and "
    r"\usepackage{longtable} for a table over pages"
)
PAGE_ROWS = 45  # rows of a table that fit on a page with its caption
# A number with an exponent. Before another number it belongs to a name.
EXPONENT = re.compile(r"(?<![\w.])(\d(?:\.\d+)?)e([+-]?\d+)(?![\w.]| -?\d)")
# Shrinks a wide table, enlarges none.
FITTED = r"\resizebox{\ifdim\width>\textwidth\textwidth\else\width\fi}{!}{"


def render(document: Document, _: int | None, __: bool) -> str:
    """Return one table environment per section, ready to be \\input; sections without
    tables are comments, unless they have a verdict."""
    lines = [NEEDED]
    for section, label in zip(
        document.sections,
        labels([each.title for each in document.sections]),
        strict=True,
    ):
        if section.verdict or section.tables:
            lines += _section(section, label)
        else:
            lines += [
                f"% {' '.join(line.split())}"
                for line in (section.title, *section.facts)
            ]
    return "\n".join(lines).rstrip("\n") + "\n"


def _section(section: Section, label: str) -> list[str]:
    """Return a float for a section, below a longtable if the first of its tables is too
    long for a page."""
    caption = " ".join(
        f"{text}." for text in (section.title, section.provenance) if text
    )
    lines = []
    notes = [section.verdict, *section.facts, *section.remarks]
    tables = list(section.tables)
    named = [rf"\caption{{{_text(caption)}}}", rf"\label{{{label}}}"]
    if tables and len(tables[0].rows) > PAGE_ROWS:
        begin, top, names, *rows, _ = _tabular(tables.pop(0))
        lines = [
            r"\begingroup\small\setlength{\tabcolsep}{4pt}",
            begin.replace("tabular", "longtable"),
        ]
        lines += [
            "".join(named) + r"\\",
            top,
            names,
            r"\endfirsthead",
            top,
            names,
            r"\endhead",
            *rows,
        ]
        lines, named = [*lines, r"\end{longtable}", r"\endgroup", ""], []
    notes = [*(note for table in tables for note in table.notes), *filter(None, notes)]
    if not tables and not notes:
        return lines
    lines += [r"\begin{table}[htbp]", *named, r"\centering\small"]
    for table in tables:  # below each other, none wider than the text
        begin, *rows, end = _tabular(table)
        lines += [FITTED + begin, *rows, end + r"}\par\medskip"]
    lines += (
        [r"\raggedright", *(rf"{_text(note)}\par" for note in notes)] if notes else []
    )
    return [*lines, r"\end{table}", ""]


def labels(titles: Sequence[str]) -> list[str]:
    """Return a different label for each title, of letters, digits and hyphens, by what
    is before a colon."""
    plain = [
        re.sub(r"[^A-Za-z0-9]+", "-", title.partition(":")[0]).strip("-") or "lcp"
        for title in titles
    ]
    return [
        f"tab:{text}" + f":{i + 1}" * (text in plain[:i])
        for i, text in enumerate(plain)
    ]


def _tabular(table: Table) -> list[str]:
    wide = r"p{0.5\textwidth}"
    kinds = "".join(
        wide if j in table.texts else "rl"[j in table.words]
        for j in range(len(table.header))
    )
    lines = [rf"\begin{{tabular}}{{{kinds}}}", r"\toprule"]
    lines += [_row([_heading(name) for name in table.header])] * any(table.header)
    for group in table.groups:
        if len(lines) > 2:
            lines.append(r"\midrule")
        lines += [
            _row([_cell(text, j in table.words) for j, text in enumerate(cells)])
            for cells in group
        ]
    return [*lines, r"\bottomrule", r"\end{tabular}"]


def _row(cells: list[str]) -> str:
    return " & ".join(cells) + r" \\"


GREEK = {name: f"\\{name}" for name in ("alpha", "xi")}
# Headings that are symbols, and the beginnings of those with an index; names of options
# stay words.
SYMBOLS = {"k": "k", "f": "f", "F": "F", **GREEK}
INDEXED = {**{letter: letter for letter in "zwxyduvs"}, **GREEK}
SYMBOL_WITH_INDEX = re.compile(r"([a-z]+)(\d+)")


def _heading(name: str) -> str:
    if name in SYMBOLS:
        return f"${SYMBOLS[name]}$"
    match = SYMBOL_WITH_INDEX.fullmatch(name)
    if match and match[1] in INDEXED:
        return f"${INDEXED[match[1]]}_{{{match[2]}}}$"
    return (
        _cell(name)
        if name.startswith(("time/", "to ")) or name == ELLIPSIS
        else escape_latex(name)
    )


def _cell(text: str, is_word: bool = False) -> str:
    """Return a cell; a number among words is a name."""
    escape = escape_latex if is_word and EXPONENT.fullmatch(text) else _text
    return r"\dots" if text == ELLIPSIS else escape(text)


def _text(text: str) -> str:
    """Return a text in LaTeX, with powers of ten for exponents, and the Greek letter of
    microseconds."""
    return re.sub(
        r"(?<=\d )us\b|(?<=/)us\b", r"$\\mu$s", EXPONENT.sub(_power, escape_latex(text))
    )


def _power(number: re.Match[str]) -> str:
    digits, exponent = number[1], int(number[2])
    if exponent == 0:
        return digits
    return (
        f"$10^{{{exponent}}}$"
        if digits == "1"
        else rf"${digits} \cdot 10^{{{exponent}}}$"
    )


def escape_latex(text: str) -> str:
    """Return a text with LaTeX's special characters escaped, and with hyphens
    separated, so that TeX does not make dashes of them."""
    return re.sub("-(?=-)", "-{}", text.translate(str.maketrans(SPECIAL)))
