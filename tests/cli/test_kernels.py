"""The commands with compiled kernels: what asks for them, what says so, and how they
are compiled ahead of time."""

import json
import re
from pathlib import Path

import pytest

import lcpcli
from lcpcli import options
from lcpcli.cli import help
from lcpcli.version import VERSION

from .. import kernels_together  # noqa: F401
from .conftest import assert_refused

numba = pytest.importorskip("numba")
ahead = pytest.importorskip("lcpcli.kernels.loading")
pytestmark = pytest.mark.usefixtures("kernels_by_default")


def test_records_figures_and_the_version_say_that_a_process_uses_the_kernels(
    folder, lcp
):
    (folder / "two.jsonl").write_text(2 * '{"M": [[2, 1], [1, 2]], "q": [-5, -6]}\n')
    commands = (
        "good.json",
        "two.jsonl --jobs 2",
        "two.jsonl --sequence",
        "M.csv q.csv",
    )
    for command in (f"solve {files} --format json" for files in commands):
        lcpcli.use_kernels(False)
        assert {"compiled" in each["options"] for each in lcp(command).records} == {
            False
        }
        lcpcli.use_kernels()
        assert {each["options"]["compiled"] for each in lcp(command).records} == {True}
    first = lcp("--version").out.splitlines()[0]
    assert (
        first
        == f"lcp, version {VERSION}, with kernels compiled by numba {numba.__version__}"
    )
    assert "; auto: compiled=true\n" in lcp("solve good.json").out
    assert "compiled" not in lcp("solve good.json --method newton").out


def test_a_bench_records_the_version_of_numba_and_is_not_resumed_without_the_kernels(
    folder, lcp
):
    bench = "bench good.json --method auto --budget 0"
    lcpcli.use_kernels()
    assert lcp(f"{bench} -o bench.json").code == 0
    assert (
        json.loads((folder / "bench.json").read_text())["versions"]["numba"]
        == numba.__version__
    )
    lcpcli.use_kernels(False)
    unfinished = json.loads((folder / "bench.json").read_text()) | {"measurements": []}
    (folder / "bench.json").write_text(json.dumps(unfinished))
    assert_refused(
        lcp("bench --resume bench.json"),
        f"was measured with numba {numba.__version__}, not None",
    )
    assert "numba" not in lcp(f"{bench} --format json").record["versions"]


def test_another_value_of_the_variable_is_refused(folder, lcp, kernels_by_default):
    (folder / "two.jsonl").write_text(2 * '{"M": [[2, 1], [1, 2]], "q": [-5, -6]}\n')
    kernels_by_default("yes")
    for command in (
        "solve two.jsonl",
        "solve good.json --method shi",
        "compare good.json",
        "bench good.json",
        "-V",
    ):
        assert_refused(lcp(command), "lcp: LCPCLI_KERNELS: is 'yes'; set it to 1 ")
    assert lcp("help speed").code == lcp("completion bash").code == 0


def test_without_numba_there_is_nothing_to_compile(
    monkeypatch, lcp, kernels_by_default
):
    for module in (help, options):
        monkeypatch.setattr(module, "has_numba", lambda: False)
    assert_refused(
        lcp("kernels"),
        "lcp: kernels: needs numba; pip install numba",
    )
    kernels_by_default("1")
    assert_refused(lcp("--version"), "lcp: LCPCLI_KERNELS: needs numba; pip install")


def test_the_number_of_kernels_and_the_folder_of_the_cache_are_said_in_one_line(lcp):
    outcome = lcp("kernels")
    assert (outcome.code, outcome.err) == (0, "")
    found = re.fullmatch(
        r"(\d+) kernels? compiled, (\d+) already there; the cache is in (.*)\n",
        outcome.out,
    )
    assert found
    assert int(found[1]) + int(found[2]) == ahead.KERNELS
    assert [*Path(found[3]).rglob("*solve_rows*.nbi")] != []
