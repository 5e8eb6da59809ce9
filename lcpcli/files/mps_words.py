"""What HiGHS complains of in a program, in words of our own, with the line where it stands."""

from __future__ import annotations

import re

from lcpcli.errors import ProblemError, quoted
from lcpcli.files.mps_lines import MPS, NUMBER, line_of, lines

LEAST, MOST = 1e-9, 1e15  # the sizes of entries that HiGHS takes
IN_ROWS, IN_COLUMNS = "ROWS section", "COLUMNS section"
LINEAR = "lcp solves programs with linear constraints and continuous variables only"
# A complaint, what is wrong with the names that it quotes, how to fix it, and the section if the complaint has none.
WORDS = (
    (r'of type "(\S+)"', "has a bound of the type {}", "use UP, LO, FX, FR, MI or PL", ""),
    (r'Row name "(.*)" in \w+ section is not defined', "names {}, which is not in ROWS", "declare it there", ""),
    (r'Row name "(.*)" in RANGES section is not valid', "gives a range to {}", "only rows L, G and E have one", ""),
    (r'"(.*)" in \w+ section has duplicate', "has {} a second time", "keep one", ""),
    (r'Column "(.*)" has duplicate nonzero \S+ in row "(.*)"', "gives {} a second entry in {}", "keep one", IN_COLUMNS),
    (r'Variables .* same name "(.*)"', "has {} again", "put all entries of a column together", IN_COLUMNS),
    (r'constraints .* same name "(.*)"', "declares {} a second time", "give each row a name of its own", IN_ROWS),
    (
        r"(?:Row|Col) \S+ has (?:lower|upper) bound of",
        "has a bound of 1e20 or more, which means none, where it cannot be none",
        "give a smaller one",
        "",
    ),
    (r"No objective", "has no objective, which is a row N", "add it to ROWS", ""),
    (r"Quadratic (?:rows|constraints)", "has quadratic constraints", LINEAR, ""),
    (r"SOS", "has special ordered sets", LINEAR, ""),
    (r"not symmetric", "has a QMATRIX that is not symmetric", "give both entries, or one of them in QUADOBJ", ""),
)
SECTIONS = (b"ROWS", b"COLUMNS", b"RHS", b"RANGES", b"BOUNDS", b"QUADOBJ", b"QMATRIX", b"ENDATA", b"NAME", b"OBJSENSE")
UNIDENTIFIED = re.compile(r'Entry "(.*)" in (\w+) section')


def fault(text: bytes, complaint: str) -> ProblemError:
    """The error for a complaint about a program."""
    if "|value|" in complaint:
        return _of_size(text)
    if match := UNIDENTIFIED.search(complaint):
        entry = match[1].encode().split()
        number = next((number for number, _, line in lines(text) if line.split() == entry), None)
        hint = "is the heading of the next section misspelt, or the first word of the line?"
        return ProblemError(f"line {number}" * bool(number), f"has {quoted(match[1])} in {match[2]}", hint)
    for pattern, wrong, hint, section in WORDS:
        if match := re.search(pattern, complaint):
            place = line_of(text, f"{complaint} in {section}" if section else complaint)
            return ProblemError(place, wrong.format(*map(quoted, match.groups())), hint)
    for number, heading, line in lines(text):
        if line[:1].isalpha() and heading not in SECTIONS and MPS.search(text):
            fault = f"has the heading {quoted(heading.decode('utf-8', 'replace'))}"
            return ProblemError(
                f"line {number}", fault, f"the sections are {', '.join(map(bytes.decode, SECTIONS[:8]))}"
            )
    about = [quoted(name) for name in re.findall(r'"([^"]+)"', complaint)]
    because = f" because of {', '.join(about)}" if about else ""
    return ProblemError(line_of(text, complaint), f"cannot be read{because}", "compare it with a file that is read")


def _of_size(text: bytes) -> ProblemError:
    """The error for an entry that is too small or too large."""
    for number, _, line in lines(text):
        for word in line.split()[1:]:
            if re.fullmatch(NUMBER, word) and float(word) and not LEAST < abs(float(word)) < MOST:
                shown = quoted(word.decode("ascii"))
                hint = "change the units of its row or its column, or write the program as .json"
                return ProblemError(
                    f"line {number}", f"has the entry {shown}, not of a size between 1e-9 and 1e15", hint
                )
    return ProblemError("", "has an entry not of a size between 1e-9 and 1e15", "change the units")
