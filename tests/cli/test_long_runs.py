"""Ctrl-C in the middle of long runs: what was found is printed, and the exit code is
130. How long that takes is printed, as `pytest -s` shows, and never compared."""

import os
import subprocess
import sys
import time

import numpy as np
import pytest

from lcpcli import Problem
from lcpcli.files import writing

from .conftest import GOOD, MAIN

pytestmark = [
    pytest.mark.skipif(sys.platform == "win32", reason="has no such signals"),
    pytest.mark.slow("each runs for seconds"),
]
LONGEST = 600.0  # seconds until something that must happen has not
# A process that gets Ctrl-C in a moment after a call of a function, its so many-th.
STOPPED = f"""
import os, pkgutil, signal, sys, threading, time
place, number, file, *sys.argv[1:] = sys.argv[1:]
function, calls = pkgutil.resolve_name(place), 0

def press():
    with open(file, "w") as stream:
        stream.write(str(time.monotonic()))
    os.kill(os.getpid(), signal.SIGINT)

def counted(*given, **named):
    global calls
    calls += 1
    if calls == int(number):
        threading.Timer(0.3, press).start()
    return function(*given, **named)

owner, _, name = place.rpartition(".")
setattr(pkgutil.resolve_name(owner), name, counted)
{MAIN}
"""


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """A problem that takes long steps in compiled code, and a large proof; and many
    small ones."""
    folder, rng = tmp_path_factory.mktemp("long"), np.random.default_rng(0)
    for name, n in (("large", 450), ("dense", 2000)):
        A = rng.standard_normal((n, n))
        problem = Problem(A @ A.T / n + np.eye(n), rng.standard_normal(n))
        writing.write(problem, folder / f"{name}.npz")
    (folder / "many.jsonl").write_text(f"{GOOD}\n" * 20_000)
    return folder


# The command, the call after which it gets Ctrl-C, and words that it prints; where
# signals come in the steps of this process, test_stopped has them.
RUNS = {
    "a proof": (
        "solve large.npz --exact",
        ("solving.proof.from_point", 1),
        "interrupted; no exact proof is known",
    ),
    "a comparison": (
        "compare dense.npz",
        ("solving.driver.run", 2),
        "dense: n = 2000",
    ),
    "many problems in processes": (
        "solve many.jsonl --jobs 2",
        ("cli.pools.Local.submit", 8),
        "many.jsonl",
    ),
}


@pytest.mark.parametrize("name", RUNS)
def test_ctrl_c_ends_a_long_run_with_what_it_has_found(name, folder, tmp_path):
    if "--exact" in RUNS[name][0]:
        pytest.importorskip("flint")
    line, (place, number), words = RUNS[name]
    pressed = tmp_path / "pressed"
    command = [sys.executable, "-c", STOPPED, f"lcpcli.{place}", str(number)]
    process = subprocess.Popen(
        [*command, str(pressed), *line.split()],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        cwd=folder,
        # With several threads, processes are no copies of it, as on other systems.
        env=os.environ | {"OPENBLAS_NUM_THREADS": "2"},
    )
    out, err = process.communicate(timeout=LONGEST)
    ended = time.monotonic()
    assert pressed.exists(), "the run has ended before"
    print(f"\n{name}: {ended - float(pressed.read_text()):.2f} s after Ctrl-C")
    assert (process.returncode, words in out) == (130, True), (out[-2000:], err)
    assert err.strip().count("\n") == 0, err
