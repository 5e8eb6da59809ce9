"""Programs in LP format, which HiGHS converts to MPS. Files with warnings are refused; numbers have up to 15 digits."""

from __future__ import annotations

import math
import re
import tempfile
from pathlib import Path

from lcpcli.errors import ProblemError
from lcpcli.linalg.linear_program import solver

PACKAGE = "highspy"
INSTALL = "pip install 'linear-complementarity[mps]'"
TOLD = ("inconsistent bounds", "Parser error")  # complaints about faults that are reported elsewhere
HINT = "compare it with a file in the LP format that is read; quadratic constraints and integer variables are not"
PLACE = re.compile(r":(\d+):\d+$", re.MULTILINE)  # line and column, after the name of a file


def as_mps(text: bytes) -> bytes:
    """Return a program in MPS; raise ProblemError for the first complaint of HiGHS."""
    try:
        import highspy
    except ModuleNotFoundError:
        raise ProblemError("", f"is read by {PACKAGE}, which is not installed", INSTALL) from None
    options = {"log_to_console": False, "infinite_bound": math.inf}  # by default, sides of 1e20 or more would be lost
    highs = solver(highspy, options)
    events: list[str] = []
    highs.cbLogging.subscribe(lambda event: events.append(event.message))
    with tempfile.TemporaryDirectory() as folder:
        given, made = (Path(folder) / name for name in ("program.lp", "program.mps"))
        given.write_bytes(text)
        try:
            status = highs.readModel(str(given))
        except UnicodeDecodeError:  # a complaint that quotes bytes that are no text
            status = highspy.HighsStatus.kError
        for line in events:
            if line.startswith(("WARNING", "ERROR")) and not any(words in line for words in TOLD):
                raise ProblemError("", f"cannot be read ({_complaint(line)})", HINT)
        if status == highspy.HighsStatus.kError or not highs.getNumCol():
            raise ProblemError("", "is not a program in MPS or in the LP format", "is it complete?")
        highs.writeModel(str(made))
        return made.read_bytes().partition(b"\n")[2]  # without the name, which is that of the temporary file


def _complaint(event: str) -> str:
    """Return the first line of a complaint, with the line of the file if the next ones show it, as since version 1.16
    of HiGHS."""
    first, _, rest = event.partition(":")[2].strip().partition("\n")
    place = PLACE.search(rest)
    return " ".join(first.split()) if place is None else f"line {place[1]}: {first}"
