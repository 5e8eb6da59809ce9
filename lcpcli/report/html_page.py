"""A report as one HTML page: it needs no network, can be read without JavaScript, and prints.

Tables sort by a click on a heading where JavaScript is on, and an iterate under the pointer shows all of its digits.
Figures are drawn if matplotlib is installed; else a note says how to install it.
"""

from __future__ import annotations

from base64 import b64encode
from collections.abc import Collection, Sequence
from dataclasses import dataclass
from html import escape
from importlib.util import find_spec
from itertools import zip_longest
from typing import TYPE_CHECKING

from lcpcli.report import columns
from lcpcli.report.tables import LEFT, ResultTable, shown_rows

if TYPE_CHECKING:
    from lcpcli.solving.result import Result
    from lcpcli.solving.trace import TraceRow

STYLE = """
:root { color-scheme: light dark; --line: #d0d7de; --soft: #f6f8fa; --good: #1a7f37; --bad: #c0272d }
@media (prefers-color-scheme: dark) {
  :root { --line: #3d444d; --soft: #1a2027; --good: #3fb950; --bad: #ff7b72 }
  body { background: #0d1117; color: #e6edf3 }
  figure img { filter: invert(0.92) hue-rotate(180deg) }
}
body { font: 16px/1.5 system-ui, sans-serif; margin: 0 auto; max-width: 76rem; padding: 1rem 1.5rem 3rem }
h1 { font-size: 1.5rem; margin: 0.5rem 0 }
h2 { font-size: 1.2rem; margin: 2rem 0 0.5rem; border-bottom: 1px solid var(--line); padding-bottom: 0.25rem }
p { margin: 0.4rem 0; overflow-wrap: anywhere }
.verdict { font-weight: 600; color: var(--bad) }
.settled { color: var(--good) }
.notes { opacity: 0.85; font-size: 0.9rem }
figure { margin: 1rem 0 }
figure img { width: min(100%, 60rem); height: auto; background: white }
.wide { overflow-x: auto; margin: 0.75rem 0 }
table { border-collapse: collapse; font-variant-numeric: tabular-nums; font-size: 0.9rem }
th, td { padding: 0.2rem 0.75rem; text-align: right; white-space: nowrap }
th.left, td.left { text-align: left }
thead th { position: sticky; top: 0; background: var(--soft); border-bottom: 1px solid var(--line) }
tbody + tbody tr:first-child td { border-top: 1px solid var(--line) }
tbody tr:hover { background: var(--soft) }
td.best { font-weight: 700 }
summary { cursor: pointer; margin-top: 0.75rem }
.sortable { cursor: pointer; user-select: none }
.sortable:hover { text-decoration: underline }
@media print { details > :not(summary) { display: block } }
"""

# A click on a heading sorts all rows by that column, numbers by value; another click reverses the order.
SCRIPT = """
const value = cell => parseFloat(cell.textContent);
for (const heading of document.querySelectorAll("thead th")) {
  heading.classList.add("sortable");
  heading.tabIndex = 0;
  const sort = () => {
    const table = heading.closest("table"), column = heading.cellIndex;
    const rows = [...table.querySelectorAll("tbody tr")];
    const turned = heading.getAttribute("aria-sort") === "ascending" ? -1 : 1;
    for (const other of table.querySelectorAll("th")) other.removeAttribute("aria-sort");
    heading.setAttribute("aria-sort", turned === 1 ? "ascending" : "descending");
    rows.sort((one, two) => {
      const [a, b] = [one.cells[column], two.cells[column]], [x, y] = [value(a), value(b)];
      const byText = a.textContent.localeCompare(b.textContent);
      return turned * (isNaN(x) && isNaN(y) ? byText : isNaN(x) ? 1 : isNaN(y) ? -1 : x - y);
    });
    const body = table.createTBody();
    body.append(...rows);
    for (const other of [...table.tBodies]) if (other !== body) other.remove();
  };
  heading.addEventListener("click", sort);
  heading.addEventListener("keydown", event => { if (event.key === "Enter") sort() });
}
"""

LEGEND = (
    "The summary has the iterations and the time until the error, relative to the solution, is at most 1e-3, 1e-6 and "
    "1e-9, and until the answer is verified. The error is the largest difference from the solution in a component of z."
)
NO_FIGURE = "The figure of error against time needs matplotlib: pip install 'linear-complementarity[plot]'."
MOST_OPEN = 30  # iterates that a page shows at once, about a screen; more are folded into one line


@dataclass(frozen=True)
class Section:
    """A section: a heading, paragraphs, a picture, tables and notes, in this order.

    paragraphs : texts, each with the class that gives it its look, "" for none. picture : in SVG, None for none.
    tables : as `grid` makes them.
    """

    title: str
    paragraphs: Sequence[tuple[str, str]] = ()
    picture: bytes | None = None
    tables: Sequence[str] = ()
    notes: Sequence[str] = ()


def of_results(tables: Sequence[ResultTable]) -> str:
    """Return the page on results, with one table per problem."""
    names = dict.fromkeys(table.title.split(":")[0] for table in tables)
    methods = dict.fromkeys(result.method for table in tables for result in table.results)
    title = ": ".join(filter(None, (", ".join(names), " and ".join(methods))))
    return page(title, list(map(_section, tables)))


def page(title: str, sections: Sequence[Section], provenance: Sequence[str] = ()) -> str:
    """Return a page. provenance : lines on what produced the page, below the title."""
    head = f'<meta charset="utf-8"><meta name="viewport" content="width=device-width"><title>{escape(title)}</title>'
    parts = [head, f"<style>{STYLE}</style>", f"<h1>{escape(title)}</h1>"]
    parts += [f'<p class="notes">{escape(line)}</p>' for line in provenance]
    for section in sections:
        parts.append(f"<h2>{escape(section.title)}</h2>")
        parts += [f'<p class="{look}">{escape(text)}</p>' for text, look in section.paragraphs]
        if section.picture is not None:
            data = f"data:image/svg+xml;base64,{b64encode(section.picture).decode()}"
            parts.append(f'<figure><img alt="{escape(section.title)}" src="{data}"></figure>')
        parts += section.tables
        parts += [f'<p class="notes">{escape(text)}</p>' for text in section.notes]
    return '<!doctype html>\n<html lang="en">\n' + "\n".join([*parts, f"<script>{SCRIPT}</script>"]) + "\n</html>\n"


def grid(
    header: Sequence[str],
    groups: Sequence[Sequence[Sequence[str]]],
    left: Collection[str],
    best: Collection[tuple[int, int]] = (),
    digits: Sequence[Sequence[str]] = (),
) -> str:
    """Return a table in HTML.

    left : the names of the left-aligned columns. best : the row and the column of each cell of the last group that is
    highlighted. digits : for each row of each group, the text that it shows under the pointer; empty for none.
    """
    looks = [' class="left"' if name in left else "" for name in header]
    head = "".join(f"<th{look}>{escape(name)}</th>" for name, look in zip(header, looks, strict=True))
    bodies = []
    for group, texts in zip_longest(groups, digits, fillvalue=()):
        rows, marked = [], best if group is groups[-1] else ()
        for i, (row, text) in enumerate(zip_longest(group, texts, fillvalue="")):
            own = [' class="best"' if (i, j) in marked else look for j, look in enumerate(looks)]
            cells = "".join(f"<td{look}>{escape(cell)}</td>" for cell, look in zip(row, own, strict=True))
            rows.append(f'<tr title="{escape(text)}">{cells}</tr>' if text else f"<tr>{cells}</tr>")
        bodies.append(f"<tbody>{''.join(rows)}</tbody>")
    return f'<div class="wide"><table><thead><tr>{head}</tr></thead>{"".join(bodies)}</table></div>'


def _section(table: ResultTable) -> Section:
    """Return the section on a problem: the verdict or the summary, the figure, and the iterates."""
    verdict = [(table.verdict, "verdict settled" if table.settled else "verdict")] if table.verdict else []
    paragraphs = [*verdict, *((text, "") for text in table.facts)]
    summary = table.summary
    grids = [grid(summary.header, [summary.rows], LEFT, summary.best)] if summary else []
    has_curves = any(result.trace or result.curve for result in table.results)
    picture = _figure(table.results) if has_curves and find_spec("matplotlib") is not None else None
    absent = [NO_FIGURE] if has_curves and picture is None else []
    notes = [*([LEGEND] if summary else []), *absent, *table.remarks, table.provenance]
    if table.groups:
        digits = [[_digits(row) for row in shown_rows(result)] for result in table.results]
        iterates = grid(table.header, [_labelled(group) for group in table.groups], LEFT, digits=digits)
        opened = " open" * (not table.results or sum(map(len, table.groups)) <= MOST_OPEN)
        heading = "Iterates" if table.results else "Solutions"
        grids.append(f"<details{opened}><summary>{heading}</summary>{iterates}</details>")
    return Section(table.title, paragraphs, picture, grids, notes)


def _digits(row: TraceRow) -> str:
    """Return an iterate with all of its digits."""
    measures = [f"{name} = {value!r}" for name, value in columns.values(row).items() if value is not None]
    return ", ".join([f"k = {row.k}", *(f"z{i} = {value!r}" for i, value in enumerate(row.z.tolist(), 1)), *measures])


def _labelled(group: Sequence[Sequence[str]]) -> list[list[str]]:
    """Return the rows with the name of the method in each, so that sorted rows keep it."""
    rows: list[list[str]] = []
    for name, *others in group:
        rows.append([name or rows[-1][0], *others])
    return rows


def _figure(runs: Sequence[Result]) -> bytes:
    """Return the figure of the runs on a problem."""
    from lcpcli.report import plotting

    return plotting.convergence(plotting.panels([runs]), "svg")
