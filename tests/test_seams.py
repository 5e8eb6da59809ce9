"""Samples of the scripts in tests/seams that compare two checkouts, here this one with itself or with a faulty copy."""

from __future__ import annotations

import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

SEAMS, ROOT = Path(__file__).with_name("seams"), Path(__file__).parents[1]
pytestmark = pytest.mark.slow  # dozens of processes


def script(name: str, *words: object, **settings: object) -> subprocess.CompletedProcess[str]:
    command = [sys.executable, str(SEAMS / name), *map(str, words)]
    return subprocess.run(command, capture_output=True, text=True, cwd=ROOT, **settings)  # type: ignore[call-overload]


def copy_with(folder: Path, module: str, old: str, new: str) -> Path:
    """A copy of the checkout in which one line reads differently."""
    for part in ("lcpcli", "problems", "tests/seams"):
        shutil.copytree(ROOT / part, folder / part, ignore=shutil.ignore_patterns("__pycache__"))
    path = folder / "lcpcli" / module
    text = path.read_text()
    assert text.count(old) == 1
    path.write_text(text.replace(old, new))
    return folder


def test_outputs_are_the_same_twice_and_a_fault_is_named(tmp_path: Path) -> None:
    only = ("--only", "solve mixed.json", "check from.json", "solve absent.json")
    for name in ("first", "second"):
        assert script("golden.py", "-o", tmp_path / name, *only).returncode == 0
    same = script("golden.py", "--compare", tmp_path / "first", tmp_path / "second")
    assert (same.returncode, same.stdout.endswith(" 0 differ\n")) == (0, True), same.stdout
    fault = copy_with(tmp_path / "fault", "report/result_csv.py", "csv.writer(out,", "csv.writer(out, delimiter=';',")
    script("golden.py", "-o", tmp_path / "third", *only, env=os.environ | {"PYTHONPATH": str(fault)})
    other = script("golden.py", "--compare", tmp_path / "first", tmp_path / "third")
    assert (other.returncode, "$ lcp solve mixed.json --format csv" in other.stdout) == (1, True)
    assert "--format json" not in other.stdout


def test_a_checkout_is_compared_with_itself_and_with_a_slower_one() -> None:
    outcome = script("bench.py", ROOT, "--only", "lcp 4", "--budget", "0.2")
    rows = re.findall(r"^(lcp 4.*?) {2,}.* (\S+)$", outcome.stdout, re.MULTILINE)
    assert [name for name, _ in rows] == ["lcp 4", "lcp 4 compiled", "lcp 4 loop"], outcome
