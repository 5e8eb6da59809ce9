"""The start of `lcp solve`, whole processes beside one that only imports what both need: start_up.py [pairs]

The processes run in turn, and the ratio is taken pair by pair, as other programs disturb the times of all alike. They
run in an environment where Python keeps compiled modules, as an installation does.
"""

from __future__ import annotations

import json
import os
import statistics
import subprocess
import sys
import tempfile
import time
from collections.abc import Sequence
from pathlib import Path

import numpy as np

PAIRS = 25
KEPT = {"PYTHONDONTWRITEBYTECODE": "", "PYTHONPATH": os.pathsep.join(filter(None, sys.path))}
RUN = "import sys; sys.argv[0] = 'lcp'; from lcpcli.cli.main import main; main()"
NUMBERS, TEXT = "import numpy, click, json", "import numpy, click, json, rich.console, rich.table"
HEADER = f"{'problem':28} {'format':6} {'wall':>8} {'baseline':>9} {'ratio':>6} {'modules':>8}"
COUNT = "import atexit, sys; atexit.register(lambda: print(sum(m.split('.')[0] == 'lcpcli' for m in sys.modules)));"


def problems() -> dict[str, tuple[np.ndarray, np.ndarray]]:
    generator = np.random.default_rng(0)
    A = generator.integers(-5, 6, (50, 50))
    return {
        "diagonally dominant, n = 4": (np.eye(4) * 3 + np.tri(4, 4, 1) * np.tri(4, 4, 1).T, np.array([-5, 3, -4, 1])),
        "several solutions, n = 4": (np.kron(np.eye(2), [[1, 2], [2, 1]]), -np.ones(4)),
        "positive definite, n = 50": (A @ A.T + A - A.T + np.eye(50), generator.integers(-9, 10, 50)),
        "several solutions, n = 20": (np.kron(np.eye(10), [[1, 2], [2, 1]]), -np.ones(20)),
    }


def seconds(code: str, arguments: Sequence[str]) -> float:
    began = time.perf_counter()
    subprocess.run([sys.executable, "-c", code, *arguments], check=True, env=os.environ | KEPT, capture_output=True)
    return time.perf_counter() - began


def row(name: str, file: str, form: str, pairs: int) -> str:
    command, baseline = ["solve", file, "--format", form], NUMBERS if form == "json" else TEXT
    for code in (RUN, baseline):  # compiles what is not yet compiled
        seconds(code, command)
    both = [(seconds(RUN, command), seconds(baseline, [])) for _ in range(pairs)]
    wall, alone = (statistics.median(times) for times in zip(*both, strict=True))
    ratio = statistics.median(one / other for one, other in both)
    counted = subprocess.run([sys.executable, "-c", COUNT + RUN, *command], capture_output=True, text=True, check=True)
    modules = counted.stdout.splitlines()[-1]
    return f"{name:28} {form:6} {1e3 * wall:5.0f} ms {1e3 * alone:6.0f} ms {ratio:6.2f} {modules:>8}"


def main() -> None:
    pairs = int(sys.argv[1]) if len(sys.argv) > 1 else PAIRS
    print(HEADER)
    with tempfile.TemporaryDirectory() as folder:
        for name, (M, q) in problems().items():
            file = Path(folder) / "problem.json"
            file.write_text(json.dumps({"M": M.tolist(), "q": q.tolist()}))
            for form in ("json", "table"):
                print(row(name, str(file), form, pairs), flush=True)


if __name__ == "__main__":
    main()
