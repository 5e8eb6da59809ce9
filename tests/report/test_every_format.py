"""Every command has every format, whose texts parse back to every digit; pages in HTML
need no network."""

import csv
import json
import re
from html.parser import HTMLParser
from io import StringIO
from pathlib import Path

import pytest

from lcpcli import Problem, Trace, read, run
from lcpcli.files import contents
from lcpcli.report import latex, result_csv
from lcpcli.report.document import FORMATS, Document, Section, Table, typeset
from lcpcli.report.latex import escape_latex
from lcpcli.report.markdown import escape_markdown

from ..conftest import save_json

EXAMPLE = contents.shipped_path(contents.PAPER_EXAMPLES[0])
SMALL = {"name": "a_b|c", "M": [[2, 1], [1, 2]], "q": [-5, -6], "names": ["a_b", "c|d"]}
COMMANDS = {
    "solve": f"solve {EXAMPLE} --method newton",
    "all solutions": "solve small.json --all",
    "compare": "compare small.json --method newton --method lemke --every 40",
    "check": "check small.json 1,2",
    "inspect": "inspect small.json",
    "path": "path small.json --direction 1,1 --to 9",
    "bench": f"bench {EXAMPLE} --method newton --method lemke --budget 0",
}
VOID = {"meta", "img", "hr"}


class Page(HTMLParser):
    """Collects tags, which must be closed in the order in which they were opened, and
    the cells of tables."""

    def __init__(self, text):
        super().__init__()
        self.open, self.tags = [], []
        self.tables: list[list[list[str]]] = []
        self.feed(text)
        assert self.open == []

    def handle_starttag(self, tag, attrs):
        self.tags.append((tag, dict(attrs)))
        if tag not in VOID:
            self.open.append(tag)
        if tag == "table":
            self.tables.append([])
        elif tag == "tr":
            self.tables[-1].append([])
        elif tag in ("td", "th"):
            self.tables[-1][-1].append("")

    def handle_endtag(self, tag):
        assert self.open.pop() == tag

    def handle_data(self, data):
        if self.open and self.open[-1] in ("td", "th"):
            self.tables[-1][-1][-1] += data


VERDICTS = {  # that commands say on standard error where their results are in a file
    "solve": ".*: solved by ",
    "all solutions": "small.json: 1 solution",
    "compare": "2 of 2 runs solved",
    "check": "small.json: z ",
    "inspect": "small.json: there is exactly one solution",
    "path": "small.json: the path reaches ",
    "bench": "2 of 2 measurements succeeded",
}


@pytest.fixture(autouse=True)
def _files(in_folder):
    save_json(in_folder / "small.json", SMALL)


@pytest.mark.parametrize("form", FORMATS)
@pytest.mark.parametrize("name", COMMANDS)
def test_a_command_has_the_format_on_the_screen_or_in_an_output_file(
    name, form, lcp, monkeypatch, request
):
    if name != "bench":  # which is of times alone
        request.getfixturevalue("still")
    if name not in ("bench", "all solutions") or form != "html":
        # Without a figure.
        monkeypatch.setattr("lcpcli.report.html_page.find_spec", lambda _: None)
    file = f"out{FORMATS[form].suffix}"
    saved = lcp(f"{COMMANDS[name]} -o {file}")
    assert saved.code == int(name == "check")
    assert saved.out == ""
    assert re.fullmatch(f"lcp: {VERDICTS[name]}.*\n", saved.err), saved.err
    if form == "html":
        text = Path(file).read_text(encoding="utf-8")
        assert text.startswith("<!doctype html>")
        assert text.endswith("</html>\n")
        assert Page(text).tables
    else:
        shown = lcp(f"{COMMANDS[name]} --format {form} -o -")
        one, other = shown.out, Path(file).read_text(encoding="utf-8")
        if (name, form) == ("compare", "json"):  # whose file has one list
            one = "[\n" + ",\n".join(one.splitlines()) + "\n]\n"
        assert one == other or (
            name == "bench" and one.count("\n") == other.count("\n")
        )
    if name != "inspect":
        assert lcp(f"{COMMANDS[name]} -q -o {file}").err == ""


def test_a_file_has_the_whole_reason_of_a_failure(lcp, monkeypatch):
    """A wide table is folded or wrapped, and no cell is cut."""
    # Without a figure.
    monkeypatch.setattr("lcpcli.report.html_page.find_spec", lambda _: None)
    arguments = f"bench {EXAMPLE} --method shi:p=10 --budget 0"
    assert lcp(f"{arguments} -o record.json").code == 0
    statements = [
        row["statement"]
        for row in json.loads(Path("record.json").read_text())["measurements"]
    ]
    assert any(len(statement) > 60 for statement in statements)
    for form in (name for name, each in FORMATS.items() if each.renderer):
        text = " ".join(lcp(f"bench --resume record.json --format {form}").out.split())
        for statement in statements:
            assert [word for word in statement.split() if word.isalpha()][-1] in text


def test_a_page_is_well_formed_has_its_figure_and_every_iterate_and_needs_no_network(
    lcp, tmp_path
):
    pytest.importorskip("matplotlib")
    asked = f"compare {EXAMPLE} --method newton --method fixed-point"
    assert lcp(f"{asked} -o {tmp_path / 'report.html'}").code == 0
    text = (tmp_path / "report.html").read_text(encoding="utf-8")
    page = Page(text)
    addresses = [
        value
        for _, attributes in page.tags
        for key, value in attributes.items()
        if key in ("src", "href")
    ]
    assert addresses
    assert all(address.startswith("data:") for address in addresses)
    assert not re.search(r"https?://|url\(", re.sub(r"data:[^\"]+", "", text))
    summary, iterates = page.tables
    assert [row[0] for row in summary] == ["method", "newton", "fixed-point"]
    records = lcp(f"{asked} --format json --trace").records
    traces = {record["method"]: record["trace"][1:] for record in records}
    assert [tuple(row[:2]) for row in iterates[1:]] == [
        ("" if k else method, str(row["k"]))
        for method, rows in traces.items()
        for k, row in enumerate(rows)
    ]


def test_a_page_without_its_figure_says_what_is_missing(lcp, monkeypatch):
    monkeypatch.setattr("lcpcli.report.html_page.find_spec", lambda _: None)
    page = lcp(f"solve {EXAMPLE} --method newton --format html").out
    assert "<figure>" not in page
    assert "needs matplotlib: pip install matplotlib" in page


def test_a_page_leads_with_the_answer(lcp, tmp_path):
    program = {"c": [3, 2], "A": [[1, 1]], "row_upper": [4], "upper": [3, None]}
    save_json(tmp_path / "p.json", program | {"sense": "max"})
    page = lcp("solve p.json --format html").out
    words = "solved by", "x = (3, 1)", "maximizer", "z = (3", "slack", "Iterates"
    places = list(map(page[page.index("<h1>") :].index, words))
    assert places == sorted(places)
    assert "<figure>" not in page[: page.index("slack")]


def table(text):
    """The rows of a CSV text, without the comments before its header."""
    return list(
        csv.DictReader(line for line in StringIO(text) if not line.startswith("#"))
    )


def test_csv_parses_back_to_every_digit(lcp):
    rows = table(lcp(f"compare {EXAMPLE} --format csv --trace --k-star 10").out)
    trace = Trace()
    run(read(EXAMPLE), "fixed-point", trace=trace)
    kept = [row for row in rows if row["method"] == "fixed-point"]
    assert len(kept) == len(trace.rows)
    for text, row in zip(kept, trace.rows, strict=True):
        assert int(text["k"]) == row.k
        assert [float(text[f"z{i + 1}"]) for i in range(4)] == row.z.tolist()
        assert float(text["residual"]) == row.residual
        assert float(text["error"]) == row.error


def test_latex_and_markdown_escape_what_they_must():
    assert escape_latex("a_b & 50% | <x> --y 1e-3") == (
        r"a\_b \& 50\% \textbar{} \textless{}x\textgreater{} -{}-y 1e-3"
    )
    assert escape_markdown("a|b\\ &lt;&#60; & $x$ ~s~ `t` *u* _v_ <w> [x] %") == (
        r"a\|b\\ \&lt;\&#60; & \$x\$ \~s\~ \`t\` \*u\* \_v\_ \<w> \[x] %"
    )


def text_of(form, *tables, verdict="", width=None):
    section = Section("t", verdict, True, tables=tables)
    return typeset(Document("t", [section]), form, width)


def test_a_table_that_just_fits_is_not_folded():
    wide = ("a" * 20, "b" * 20, "c" * 20)
    table = Table(wide, [[wide]], words={0})
    for width, parts in ((62, [wide]), (61, [wide[:2], (wide[0], wide[2])])):
        text = text_of("table", table, width=width)
        headings = [line.split() for line in text.splitlines() if "a" in line][::2]
        assert headings == [list(part) for part in parts]


def test_tables_that_a_page_folds_come_last():
    text = text_of(
        "html",
        Table(("a",), [[["long"]]], name="Iterates"),
        Table(("a",), [[["short"]]]),
    )
    assert text.index("short") < text.index("long")


def test_a_cell_in_brackets_is_no_argument_of_the_end_of_a_row_in_LaTeX():
    text = text_of("latex", Table(("name", "k"), [[["one", "1"], ["[2]", "2"]]]))
    assert "\\\\\n[" not in text
    assert "{[}2]" in text


def test_a_long_table_and_its_notes_have_one_caption_and_one_label():
    table = Table(("k", "z1"), [[[str(k), "0.5"] for k in range(60)]])
    text = text_of("latex", table, verdict="solved")
    assert text.count(r"\label{") == text.count(r"\caption{") == 1
    assert text.count(r"\end{longtable}") == 1
    first, others = text.partition(r"\endhead")[0].split(r"\endfirsthead")
    assert r"$z_{1}$" in others, "on each page"
    assert r"$z_{1}$" in first


def test_numbers_are_powers_of_ten_and_nothing_is_advice_to_whoever_ran_it(lcp):
    commands = {
        "not solved": f"solve {EXAMPLE} --method shi --p 10",
        "several problems": f"compare {EXAMPLE} tridiagonal-100",
        "solved": f"solve {EXAMPLE}",
    }
    texts = {name: lcp(f"{line} --format latex").out for name, line in commands.items()}
    assert "z = (1, 0, 1, 0)" in texts["solved"]
    assert r"\label{tab:tridiagonal-100}" in texts["several problems"]
    assert r"$z_{100}$" in texts["several problems"]
    for text in texts.values():
        assert not re.search(r"(?<!\w)\d(\.\d+)?e[+-]?\d", text)
        assert "10^{-" in text
        assert not re.search(r"\btry -|other programs|-o FILE|\bus\b", text)


def test_labels_of_like_names_differ():
    names = ["a b", "a_b", "", "é", "a_b & 50%"]
    assert latex.labels(names) == [
        "tab:a-b",
        "tab:a-b:2",
        "tab:lcp",
        "tab:lcp:4",
        "tab:a-b-50",
    ]


def test_iterates_in_csv_have_the_components_of_the_largest_problem():
    problems = Problem([[1]], [-1]), Problem([[1, 0], [0, 1]], [-1, -3])
    results = [run(each, "newton", trace=Trace()) for each in problems]
    (header, *_, last), _ = result_csv.iterates(results)
    assert len(last) == len(header)
    assert {1.0, 3.0} <= {*last}
