"""The page in HTML: one file without a network, whole without JavaScript, well-formed, with everything a table has."""

from __future__ import annotations

import json
import re
from collections.abc import Callable
from html.parser import HTMLParser
from pathlib import Path
from typing import Any

import pytest

from lcpcli.files import contents

FIRST = contents.shipped_path("paper-example-1.json")
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


def test_a_page_is_well_formed_has_its_figure_and_every_iterate_and_needs_no_network(lcp: Lcp, tmp_path: Path) -> None:
    asked = ("compare", FIRST, "--method", "newton", "--method", "fixed-point")
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
    page = lcp("solve", FIRST, "--method", "newton", "--format", "html").out
    assert "<figure>" not in page
    assert "needs matplotlib: pip install &#x27;linear-complementarity[plot]&#x27;" in page


def test_names_cannot_break_out_of_the_page(lcp: Lcp, tmp_path: Path) -> None:
    name = '</title><script>alert("x")</script>&'
    (tmp_path / "p.json").write_text(json.dumps({"name": name, "M": [[2]], "q": [-1]}))
    text = lcp("solve", str(tmp_path / "p.json"), "--format", "html").out
    assert len([tag for tag, _ in Page(text).tags if tag == "script"]) == 1
    assert "alert(" in text
