"""Programs in LP format, which HiGHS turns into MPS. Files with warnings are refused; numbers have up to 15 digits."""

from __future__ import annotations

import math
import tempfile
from pathlib import Path

from lcpcli.errors import ProblemError

PACKAGE = "highspy"
INSTALL = "pip install 'linear-complementarity[mps]'"
TOLD = ("inconsistent bounds", "Parser error")  # complaints about faults that are reported elsewhere
HINT = "compare it with a file that is read; quadratic constraints and integer variables are not"


def as_mps(text: bytes) -> bytes:
    """Return a program in MPS; raise ProblemError for the first complaint of HiGHS."""
    try:
        import highspy
    except ModuleNotFoundError:
        raise ProblemError("", f"is read by {PACKAGE}, which is not installed", INSTALL) from None
    highs = highspy.Highs()
    highs.setOptionValue("log_to_console", False)
    highs.setOptionValue("infinite_bound", math.inf)  # by default, sides of 1e20 or more would be lost
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
                complaint = " ".join(line.partition(":")[2].split())
                raise ProblemError("", f"cannot be read ({complaint})", HINT)
        if status == highspy.HighsStatus.kError or not highs.getNumCol():
            raise ProblemError("", "is not a program in MPS or in the LP format", "is it complete?")
        highs.writeModel(str(made))
        return made.read_bytes().partition(b"\n")[2]  # without the name, which is that of the temporary file
