"""Every command has every format, on standard output and in a file whose suffix asks for it."""

from __future__ import annotations

import csv
import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from lcpcli.files import contents
from lcpcli.report.formats import FORMATS

from .test_html_page import Page

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
Lcp = Callable[..., Any]


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


@pytest.fixture(autouse=True)
def _in_folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    Path("small.json").write_text(json.dumps(SMALL))


@pytest.mark.parametrize("form", FORMATS)
@pytest.mark.parametrize("name", COMMANDS)
def test_a_command_has_the_format_in_an_output_file_which_takes_the_place_of_the_screen(
    name: str, form: str, lcp: Lcp, monkeypatch: pytest.MonkeyPatch
) -> None:
    if name != "bench":
        monkeypatch.setattr("lcpcli.report.html_page.find_spec", lambda _: None)  # without a figure
    saved = lcp(*COMMANDS[name], "-o", f"out{FORMATS[form].suffix}")
    assert (saved.code, saved.out, saved.err) == (int(name == "check"), "", "")
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
