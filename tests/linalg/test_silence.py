"""A library prints nothing: HiGHS has a banner of its own."""

from __future__ import annotations

import subprocess
import sys

CODE = """
import numpy as np
from lcpcli.linalg import linear_program
ends = np.zeros(2), np.full(2, np.inf)
found = linear_program.minimized(np.ones(2), np.array([[1.0, 1.0]]), (np.ones(1), np.full(1, np.inf)), ends)
assert found.value == 1.0, found
"""


def test_a_linear_program_prints_nothing() -> None:
    done = subprocess.run([sys.executable, "-c", CODE], capture_output=True, text=True, check=False)
    assert (done.returncode, done.stdout, done.stderr) == (0, "", "")
