"""The lines of an MPS file: what HiGHS reads otherwise than it stands there, and where something stands."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator, Sequence
from fractions import Fraction

from lcpcli.errors import ProblemError, quoted
from lcpcli.rational.numbers import fraction

MPS = re.compile(rb"^ROWS\b", re.MULTILINE)  # tells it from the LP format
NUMBER = rb"[-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?"
INFINITE = rb"[-+]?[iI][nN][fF](?:[iI][nN][iI][tT][yY])?"
SENSES = (b"MIN", b"MAX", b"MINIMIZE", b"MAXIMIZE")
OF_ENTRIES = (b"COLUMNS", b"RHS", b"RANGES", b"QUADOBJ", b"QMATRIX")  # sections of names followed by numbers
HEADING = re.compile(rb"\n([A-Z]+)[^\n]*")
USUAL = rb"[ \t]+\S+[ \t]+\S+[ \t]+%b(?:[ \t]+\S+[ \t]+%b)?[ \t]*\r?\n" % (NUMBER, NUMBER)  # a line of entries
OTHERS = re.compile(rb"\n(?!%b)(?=[^*\r\n]*\S)(?=([^\n]*))" % USUAL)
VALUE = re.compile(
    rb"(?<=[ \t])(%b)(?=[ \t]+\S+[ \t]+%b[ \t]*\r?\n|[ \t]*\r?\n)" % (NUMBER, NUMBER)
)  # in a line of entries
WITHOUT_NUMBER = (b"FR", b"MI", b"PL", b"BV")  # bounds
BOUNDS = re.compile(
    rb"\n[ \t]+(?:UP|LO|FX)[ \t](?=[^\n]*[ \t](?!(?:%b|%b)[ \t]*\r?\n)\S+[ \t]*\r?\n)" % (NUMBER, INFINITE)
)


def refuse_misread(text: bytes) -> None:
    """Refuse a file that is cut off, and an entry or a bound whose number is none: HiGHS reads it as 0."""
    places = _sections(text)
    if b"ENDATA" not in places:
        raise ProblemError("", "has no ENDATA", "is it cut off?")
    if b"OBJSENSE" in places:
        _refuse_sense(text, text.rfind(b"\n", 0, places[b"OBJSENSE"][0] - 1) + 1, places[b"OBJSENSE"][1])
    rows: set[bytes] = set()
    for section in filter(places.__contains__, OF_ENTRIES):
        for match in OTHERS.finditer(text, *places[section]):
            rows = rows or {line.split()[-1] for line in text[slice(*places[b"ROWS"])].splitlines() if line.strip()}
            for word in _numbers(match[1].split(), rows):
                if not re.fullmatch(NUMBER, word):
                    raise _misread(text, match.start() + 1, word)
    if b"BOUNDS" in places and (wrong := BOUNDS.search(text, *places[b"BOUNDS"])):
        line = text[wrong.start() + 1 :].partition(b"\n")[0]
        raise _misread(text, wrong.start() + 1, line.split()[-1])


def _refuse_sense(text: bytes, start: int, end: int) -> None:
    words = text[start:end].split()[1:]
    if len(words) != 1 or words[0].upper() not in SENSES:
        line = text.count(b"\n", 0, start) + 1
        shown = quoted(b" ".join(words).decode("utf-8", "replace"))
        raise ProblemError(f"line {line}", f"has {shown} as the sense of the objective", "give MIN or MAX")


def _numbers(words: list[bytes], rows: set[bytes]) -> list[bytes]:
    """The words of an entry that have to be numbers; names in fixed format may consist of several words."""
    if b"'MARKER'" in words:
        return []
    return [words[2], words[4]] if len(words) == 5 and words[1] in rows and words[3] in rows else words[-1:]


def undeclared(text: bytes, names: Sequence[str]) -> str:
    """The first of some names of columns that does not occur in COLUMNS; "" if all do."""
    if not names:
        return ""
    start, end = _sections(text).get(b"COLUMNS", (0, 0))
    declared = {line.split(None, 1)[0] for line in text[start:end].splitlines() if line.strip()}
    return next((name for name in names if name.encode() not in declared), "")


def unknown_row(text: bytes) -> str:
    """The first name in COLUMNS, RHS or RANGES that is not in ROWS; "" if all are."""
    rows, unknown = set(), ""
    for _, section, line in lines(text):
        words = line.split()
        if section == b"ROWS":
            rows |= set(words[1:])
        if section in (b"COLUMNS", b"RHS", b"RANGES") and len(words) in (3, 5) and line[:1].isspace() and not unknown:
            unknown = next((word.decode("utf-8", "replace") for word in words[1::2] if word not in rows), "")
    return unknown


def spaced_row(text: bytes) -> str:
    """The first line of ROWS with more than a kind and a name; "" if there is none."""
    found = (number for number, section, line in lines(text) if section == b"ROWS" and len(line.split()) > 2)
    return next((f"line {number}" for number in found), "")


def as_written(text: bytes, number: Callable[[str], float]) -> bytes:
    """The text with the doubles that are made of its numbers, where these are not the nearest ones."""
    sections, parts, end = _sections(text), list[bytes](), 0
    spans = sorted(sections[name] for name in (*OF_ENTRIES, b"BOUNDS") if name in sections)
    for match in (match for span in spans for match in VALUE.finditer(text, *span)):
        before = text[text.rfind(b"\n", 0, match.start()) + 1 : match.start()].split()
        if not before or before[0] in WITHOUT_NUMBER:
            continue  # it is a name
        written = match[1].decode("ascii")
        double = number(written)
        if double != float(written):
            parts += [text[end : match.start(1)], repr(double).encode()]
            end = match.end(1)
    return b"".join([*parts, text[end:]])


def range_sides(text: bytes) -> dict[str, tuple[Fraction, Fraction]]:
    """The two sides of the rows that have a range, as written."""
    sections = _sections(text)
    sizes = _values(text, sections.get(b"RANGES", (0, 0)))
    kinds = {words[-1]: words[0] for words in map(bytes.split, text[slice(*sections[b"ROWS"])].splitlines()) if words}
    given = _values(text, sections.get(b"RHS", (0, 0))) if sizes else {}
    found = {}
    for row, size in sizes.items():
        side, kind = given.get(row, Fraction(0)), kinds.get(row, b"")
        goes_up = kind in (b"G", b"g") or (kind in (b"E", b"e") and size > 0)
        ends = (side, side + abs(size)) if goes_up else (side - abs(size), side)
        found[row.decode("utf-8", "replace")] = ends
    return found


def _values(text: bytes, span: tuple[int, int]) -> dict[bytes, Fraction]:
    """The numbers in the lines of a section, by the names before them."""
    entries = [line.split() for line in text[slice(*span)].splitlines() if not line.startswith(b"*")]
    words = [words[len(words) % 2 :] for words in entries]
    pairs = [pair for line in words for pair in zip(line[::2], line[1::2], strict=True)]
    return {name: fraction(value.decode("ascii")) for name, value in pairs if re.fullmatch(NUMBER, value)}


def line_of(text: bytes, complaint: str) -> str:
    """The last line with all the names that a complaint quotes, in the section that it names; "" if there is none."""
    names = {name.encode() for name in re.findall(r'"([^"]*)"', complaint)}
    named = re.search(r"(\w+) section", complaint)
    found = [
        number
        for number, section, line in lines(text)
        if names and (named is None or named[1].encode() == section) and names <= set(line.split())
    ]
    return f"line {found[-1]}" if found else ""


def lines(text: bytes) -> Iterator[tuple[int, bytes, bytes]]:
    """The lines with their numbers and sections."""
    section = b""
    for number, line in enumerate(text.splitlines(), 1):
        if line[:1].strip() and not line.startswith(b"*"):
            section = line.split()[0]
        yield number, section, line


def _sections(text: bytes) -> dict[bytes, tuple[int, int]]:
    """Where the lines of each section begin, at the end of its own line, and end."""
    found = [*HEADING.finditer(text)]
    ends = [match.start() + 1 for match in found[1:]] + [len(text)]
    return {match[1]: (match.end(), end) for match, end in zip(found, ends, strict=True)}


def _misread(text: bytes, start: int, word: bytes) -> ProblemError:
    line = text.count(b"\n", 0, start) + 1
    fault = f"has {quoted(word.decode('utf-8', 'replace'))} in place of a number"
    return ProblemError(f"line {line}", fault, "give a number")
