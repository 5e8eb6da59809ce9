"""Every command has every format, on standard output and in files; a page in HTML is whole and needs no network."""

from __future__ import annotations

import csv
import json
import re
from collections.abc import Callable
from html.parser import HTMLParser
from pathlib import Path
from typing import Any

import pytest

from lcpcli.files import contents
from lcpcli.report.document import FORMATS

EXAMPLE = contents.shipped_path(contents.PAPER_EXAMPLES[0])
SMALL = {"name": "a_b|c", "M": [[2, 1], [1, 2]], "q": [-5, -6], "names": ["a_b", "c|d"]}
COMMANDS = {
    "solve": ("solve", EXAMPLE, "--method", "newton"),
    "all solutions": ("solve", "small.json", "--all"),
    "compare": ("compare", "small.json", "--method", "newton", "--method", "lemke", "--every", "40"),
    "check": ("check", "small.json", "1,2"),
    "inspect": ("inspect", "small.json"),
    "path": ("path", "small.json", "--direction", "1,1", "--to", "9"),
    "bench": ("bench", EXAMPLE, "--method", "newton", "--method", "lemke", "--budget", "0"),
}
VOID = {"meta", "img", "hr"}
Lcp = Callable[..., Any]


class Page(HTMLParser):
    """Collects tags, which must be closed in the order in which they were opened, and the cells of tables."""

    def __init__(self, text: str) -> None:
        super().__init__()
        self.open, self.tags = list[str](), list[tuple[str, dict[str, str | None]]]()
        self.tables: list[list[list[str]]] = []
        self.feed(text)
        assert self.open == []

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.tags.append((tag, dict(attrs)))
        if tag not in VOID:
            self.open.append(tag)
        if tag == "table":
            self.tables.append([])
        elif tag == "tr":
            self.tables[-1].append([])
        elif tag in ("td", "th"):
            self.tables[-1][-1].append("")

    def handle_endtag(self, tag: str) -> None:
        assert self.open.pop() == tag

    def handle_data(self, data: str) -> None:
        if self.open and self.open[-1] in ("td", "th"):
            self.tables[-1][-1][-1] += data


def of_json(text: str) -> None:
    try:
        json.loads(text)
    except ValueError:
        assert all(json.loads(line) for line in text.splitlines())


def of_csv(text: str) -> None:
    rows = list(csv.reader(line for line in text.splitlines() if not line.startswith("#")))
    assert len(rows) > 1
    assert {len(row) for row in rows} == {len(rows[0])}


def of_markdown(text: str) -> None:
    assert text.startswith("##")
    rows = [line for line in text.splitlines() if line.startswith("| ")]
    assert [row for row in rows if not row.endswith(" |")] == []
    assert ":-- |" in text
    assert "a_b" not in text
    assert "b|c" not in text


def of_latex(text: str) -> None:
    assert text.startswith("% needs")
    assert "a_b" not in text
    for name in ("table", "tabular"):
        assert text.count(rf"\begin{{{name}}}") == text.count(rf"\end{{{name}}}") > 0
    assert text.count("{") - text.count(r"\{") == text.count("}") - text.count(r"\}")


def of_html(text: str) -> None:
    assert text.startswith("<!doctype html>")
    assert text.endswith("</html>\n")
    assert Page(text).tables


def of_table(text: str) -> None:
    assert "----" in text
    assert [line for line in text.splitlines() if line != line.rstrip()] == []


VERDICTS = {  # of commands that say on standard error how they ended
    "solve": ".*: solved by ",
    "all solutions": "small.json: 1 solution",
    "compare": "2 of 2 runs solved",
    "check": "small.json: z ",
    "inspect": "small.json: there is exactly one solution",
    "path": "small.json: the path reaches ",
    "bench": "2 of 2 measurements succeeded",
}


@pytest.fixture(autouse=True)
def _in_folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    Path("small.json").write_text(json.dumps(SMALL))


@pytest.mark.parametrize("form", FORMATS)
@pytest.mark.parametrize("name", COMMANDS)
def test_a_command_has_the_format_in_an_output_file_which_takes_the_place_of_the_screen(
    name: str, form: str, lcp: Lcp, monkeypatch: pytest.MonkeyPatch
) -> None:
    if name not in ("bench", "all solutions"):
        monkeypatch.setattr("lcpcli.report.html_page.find_spec", lambda _: None)  # without a figure
    saved = lcp(*COMMANDS[name], "-o", f"out{FORMATS[form].suffix}")
    assert (saved.code, saved.out) == (int(name == "check"), "")
    assert re.fullmatch(f"lcp: {VERDICTS[name]}.*\n" if name in VERDICTS else "", saved.err), saved.err
    if name in VERDICTS:
        assert lcp(*COMMANDS[name], "-q", "-o", f"out{FORMATS[form].suffix}").err == ""
    globals()[f"of_{form}"](Path(f"out{FORMATS[form].suffix}").read_text())


@pytest.mark.parametrize("form", FORMATS)
def test_a_command_has_the_format_on_standard_output(form: str, lcp: Lcp) -> None:
    shown = lcp(*COMMANDS["check"], "--format", form)
    globals()[f"of_{form}"](shown.out)
    assert lcp(*COMMANDS["check"], "--format", form, "-o", "-") == shown


@pytest.mark.parametrize("name", ["result.pdf", "result.xlsx"])
def test_an_unknown_suffix_is_refused_unless_the_format_is_given(name: str, lcp: Lcp) -> None:
    refused = lcp("solve", EXAMPLE, "-o", name)
    assert refused.code == 2
    assert "is not a format; use .txt, .json, .csv, .md" in refused.err
    assert lcp("solve", EXAMPLE, "-o", name, "--format", "json").code == 0


def test_a_file_has_the_whole_reason_of_a_failure(lcp: Lcp, monkeypatch: pytest.MonkeyPatch) -> None:
    """A wide table is folded or wrapped, and no cell is cut."""
    monkeypatch.setattr("lcpcli.report.html_page.find_spec", lambda _: None)  # without a figure
    arguments = ("bench", EXAMPLE, "--method", "shi:p=10", "--method", "fixed-point:omega=1e9", "--budget", "0")
    assert lcp(*arguments, "-o", "record.json").code == 0
    statements = [row["statement"] for row in json.loads(Path("record.json").read_text())["measurements"]]
    assert any(len(statement) > 60 for statement in statements)
    for form in (name for name, each in FORMATS.items() if each.renderer):
        text = " ".join(lcp("bench", "--resume", "record.json", "--format", form).out.split())
        for statement in statements:
            assert [word for word in statement.split() if word.isalpha()][-1] in text


def test_a_page_is_well_formed_has_its_figure_and_every_iterate_and_needs_no_network(lcp: Lcp, tmp_path: Path) -> None:
    asked = ("compare", EXAMPLE, "--method", "newton", "--method", "fixed-point")
    assert lcp(*asked, "-o", str(tmp_path / "report.html")).code == 0
    text = (tmp_path / "report.html").read_text(encoding="utf-8")
    page = Page(text)
    addresses = [value for _, attributes in page.tags for key, value in attributes.items() if key in ("src", "href")]
    assert all(address is not None and address.startswith("data:") for address in addresses)
    assert not re.search(r"https?://", re.sub(r"data:[^\"]+", "", text))
    assert "url(" not in text
    assert [tag for tag, _ in page.tags if tag == "img"]
    summary, iterates = page.tables
    assert [row[0] for row in summary] == ["method", "newton", "fixed-point"]
    records = [json.loads(line) for line in lcp(*asked, "--format", "json", "--trace").out.splitlines()]
    traces = {record["method"]: record["trace"][1:] for record in records}
    assert [tuple(row[:2]) for row in iterates[1:]] == [
        (method, str(row["k"])) for method, rows in traces.items() for row in rows
    ]
    shown = [attributes["title"] for tag, attributes in page.tags if tag == "tr" and "title" in attributes]
    assert [re.findall(r"z\d+ = ([^,]+)", digits or "") for digits in shown] == [
        [repr(value) for value in row["z"]] for rows in traces.values() for row in rows
    ]


def test_a_page_without_its_figure_says_what_is_missing(lcp: Lcp, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("lcpcli.report.html_page.find_spec", lambda _: None)
    page = lcp("solve", EXAMPLE, "--method", "newton", "--format", "html").out
    assert "<figure>" not in page
    assert "needs matplotlib: pip install &#x27;linear-complementarity[plot]&#x27;" in page


def test_names_cannot_break_out_of_the_page(lcp: Lcp, tmp_path: Path) -> None:
    name = '</title><script>alert("x")</script>&'
    (tmp_path / "p.json").write_text(json.dumps({"name": name, "M": [[2]], "q": [-1]}))
    text = lcp("solve", str(tmp_path / "p.json"), "--format", "html").out
    assert len([tag for tag, _ in Page(text).tags if tag == "script"]) == 1
    assert "alert(" in text


def test_a_page_leads_with_the_answer(lcp: Callable[..., Any], tmp_path: Path) -> None:
    file = tmp_path / "p.lp"
    file.write_text("Maximize\n obj: 3 x + 2 y\nSubject To\n wood: x + y <= 4\nBounds\n x <= 3\nEnd\n")
    page = lcp("solve", str(file), "--format", "html").out
    page = page[page.index("<h1>") :]
    places = [page.index(word) for word in ("solved by", "x = (x 3, y 1)", "maximizer", "z = (3", "slack", "Iterates")]
    assert places == sorted(places)
    assert "<figure>" not in page[: page.index("slack")]
