"""The start of `lcp solve`, whole processes beside one that only imports what both
need: start_up.py [pairs]

The processes run in turn, and the ratio is taken pair by pair, as other programs
disturb the times of all alike. They run in an environment where Python keeps compiled
modules, as an installation does.
"""

from __future__ import annotations

import json
import os
import subprocess
import sys
import tempfile
from collections.abc import Sequence
from functools import partial
from pathlib import Path
from statistics import median

import numpy as np
from measuring import in_turns, show

PAIRS = 25
KEPT = {
    "PYTHONDONTWRITEBYTECODE": "",
    "PYTHONPATH": os.pathsep.join(filter(None, sys.path)),
}
RUN = "import sys; sys.argv[0] = 'lcp'; from lcpcli.cli.main import main; main()"
NUMBERS, TEXT = (
    "import numpy, click, json",
    "import numpy, click, json, rich.console, rich.table",
)
HEADER, WIDTHS = (
    ("problem", "format", "wall/ms", "baseline/ms", "ratio", "modules"),
    (28, 6, 8, 11, 6, 8),
)
COUNT = (
    "import atexit, sys; atexit.register(lambda: print(sum(m.split('.')[0] == "
    "'lcpcli' for m in sys.modules)));"
)


def problems() -> dict[str, tuple[np.ndarray, np.ndarray]]:
    generator = np.random.default_rng(0)
    A = generator.integers(-5, 6, (50, 50))
    return {
        "diagonally dominant, n = 4": (
            np.eye(4) * 3 + np.tri(4, 4, 1) * np.tri(4, 4, 1).T,
            np.array([-5, 3, -4, 1]),
        ),
        "several solutions, n = 4": (np.kron(np.eye(2), [[1, 2], [2, 1]]), -np.ones(4)),
        "positive definite, n = 50": (
            A @ A.T + A - A.T + np.eye(50),
            generator.integers(-9, 10, 50),
        ),
        "several solutions, n = 20": (
            np.kron(np.eye(10), [[1, 2], [2, 1]]),
            -np.ones(20),
        ),
    }


def start(code: str, *arguments: str) -> str:
    """What a process prints."""
    command = [sys.executable, "-c", code, *arguments]
    return subprocess.run(
        command, check=True, env=os.environ | KEPT, capture_output=True, text=True
    ).stdout


def row(name: str, file: str, form: str, pairs: int) -> Sequence[object]:
    command, baseline = (
        ("solve", file, "--format", form),
        NUMBERS if form == "json" else TEXT,
    )
    wall, alone = in_turns(
        partial(start, RUN, *command), partial(start, baseline), most=pairs
    )
    ratio = median(one / other for one, other in zip(wall, alone, strict=True))
    modules = start(COUNT + RUN, *command).splitlines()[-1]
    return name, form, 1e3 * median(wall), 1e3 * median(alone), ratio, modules


def main() -> None:
    pairs = int(sys.argv[1]) if len(sys.argv) > 1 else PAIRS
    show(HEADER, WIDTHS)
    with tempfile.TemporaryDirectory() as folder:
        for name, (M, q) in problems().items():
            file = Path(folder) / "problem.json"
            file.write_text(json.dumps({"M": M.tolist(), "q": q.tolist()}))
            for form in ("json", "table"):
                show(row(name, str(file), form, pairs), WIDTHS)


if __name__ == "__main__":
    main()
