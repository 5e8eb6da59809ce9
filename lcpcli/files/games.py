"""Games of two players: in Gambit's strategic form, .nfg, and in two tables, one with the payoffs of each player.

In .nfg, the payoffs of all pairs of strategies are listed, or outcomes with payoffs and then the outcome of each pair;
the first player's strategy changes fastest.
Numbers are integers, decimals or fractions, with or without commas between them; outcome 0 pays nothing. (Gambit,
Software Tools for Game Theory, https://www.gambit-project.org, file formats.)
"""

from __future__ import annotations

import json
import re
from collections.abc import Callable, Sequence
from decimal import Decimal
from fractions import Fraction
from pathlib import Path
from typing import Any, TypeVar

from lcpcli.errors import LCPError, OptionError, ProblemError, count, quoted
from lcpcli.files.contents import decode, parsed, place, unpacked
from lcpcli.files.fields import BOUNDS, THREE_PLAYERS
from lcpcli.files.formats import Number, form_of
from lcpcli.files.inputs import Input
from lcpcli.files.json_format import payoff_of
from lcpcli.rational.numbers import ratio

TOKEN = re.compile(r'"(?:\\.|[^"\\])*"|[{}]|[^\s,{}"]+|"')
LARGEST_TABLE = 100_000  # bytes: a larger table is not read again for a mere hint, which would take long
HINT = "give the payoffs of the row player and those of the column player"

T = TypeVar("T")
Pair = tuple[Fraction, Fraction]


def fields(content: bytes, number: Number = float) -> dict[str, Any]:  # noqa: ARG001 (as in every format)
    """Return the game in an .nfg file."""
    return _Reader(decode(unpacked(content))).game()


class _Reader:
    """The tokens of a file, taken one after another: texts in quotes, braces, and words."""

    def __init__(self, text: str) -> None:
        self._content = text
        self._tokens = [(match[0], match.start()) for match in TOKEN.finditer(text)]
        self._next = 0

    def game(self) -> dict[str, Any]:
        if [self._take() for _ in range(2)] != ["NFG", "1"]:
            raise self._error("is not the beginning of a game", "a file begins with NFG 1 R")
        self._take()  # R or D: how numbers are meant, which their digits tell
        title = self._text("the title")
        players, sides = self._texts("the names of the players"), self._braced("the strategies", self._strategies)
        if max(len(players), len(sides)) > 2:
            raise ProblemError("", *THREE_PLAYERS)
        if (fewest := min(len(players), len(sides))) < 2:
            raise ProblemError("", f"is a game of {count(fewest, 'player')}", "give one of two players")
        m, k = (own if isinstance(own, int) else len(own) for own in sides)
        if not m * k:
            raise self._error("a player has no strategy", "give each at least one")
        if self._peek()[:1] == '"':
            self._take()  # a comment
        cells = self._cells(m * k)
        if self._next < len(self._tokens):
            raise self._error(f"is more than the payoffs of {m} x {k} strategies", "remove it", self._take())
        A, B = ([[payoff_of(cells[j * m + i][player]) for j in range(k)] for i in range(m)] for player in (0, 1))
        named = ([] if isinstance(own, int) else own for own in sides)
        rows, columns = ([] if own == [str(i) for i in range(1, len(own) + 1)] else own for own in named)
        return {"A": A, "B": B, "rows": rows, "columns": columns, "name": title}

    def _cells(self, count: int) -> list[Pair]:
        """Read the payoffs of both players for this number of pairs of strategies."""
        if self._peek() != "{":
            return [self._pair() for _ in range(count)]
        self._take()
        outcomes, chosen = [(Fraction(0), Fraction(0))], list[Pair]()
        while self._peek() == "{":
            self._take()
            if self._peek()[:1] == '"':
                self._take()
            outcomes.append(self._pair())
            self._expect("}", "the end of an outcome")
        self._expect("}", "the end of the outcomes")
        for _ in range(count):
            number = self._whole("the number of an outcome")
            if number >= len(outcomes):
                raise self._error(f"is outcome {number} of {len(outcomes) - 1}", "name one that is given")
            chosen.append(outcomes[number])
        return chosen

    def _pair(self) -> Pair:
        return self._fraction(), self._fraction()

    def _strategies(self) -> list[str] | int:
        """Read the names of a player's strategies, or their number."""
        is_named = self._peek() == "{"
        return self._texts("the names of the strategies") if is_named else self._whole("the number of strategies")

    def _texts(self, what: str) -> list[str]:
        return self._braced(what, lambda: self._text(what))

    def _braced(self, what: str, item: Callable[[], T]) -> list[T]:
        self._expect("{", what)
        found = []
        while self._peek() != "}":
            found.append(item())
        self._take()
        return found

    def _text(self, what: str) -> str:
        return re.sub(r"\\(.)", r"\1", self._matching(r'"(?s:.)*"', what, "put texts in quotes")[1:-1])

    def _whole(self, what: str) -> int:
        return int(self._matching(r"[0-9]{1,9}", what, "give an integer"))

    def _matching(self, pattern: str, what: str, hint: str) -> str:
        token = self._take()
        if not re.fullmatch(pattern, token):
            raise self._error(f"has {quoted(token)} in place of {what}", hint)
        return token

    def _fraction(self) -> Fraction:
        token = self._take()
        try:
            return ratio(token)
        except ProblemError as error:
            raise self._error(error.fault, error.hint) from None

    def _expect(self, mark: str, what: str) -> None:
        token = self._take()
        if token != mark:
            raise self._error(f"has {quoted(token)} where {what} should be", f"write {mark} there")

    def _peek(self) -> str:
        if self._next == len(self._tokens):
            raise ProblemError("", "ends too early", "is it cut off?")
        return self._tokens[self._next][0]

    def _take(self) -> str:
        token = self._peek()
        self._next += 1
        return token

    def _error(self, fault: str, hint: str, token: str = "") -> ProblemError:
        """Return an error in the line of the last token."""
        line = self._content.count("\n", 0, self._tokens[self._next - 1][1]) + 1
        return ProblemError(f"line {line}", f"{quoted(token)} {fault}" if token else fault, hint)


def game_in(paths: Sequence[str]) -> Input:
    """Return the game as an input in JSON. The payoffs in the tables may be fractions; labels name the strategies."""
    if len(paths) != 2:
        raise OptionError("--game", f"takes two files, not {len(paths)}", HINT)
    (A, rows, columns), (B, own_rows, own_columns) = map(_table, paths)
    parts = [f'"{key}": [{", ".join(map(_row, table))}]' for key, table in (("A", A), ("B", B))]
    for key, *names in (("rows", rows, own_rows), ("columns", columns, own_columns)):
        parts.append(f'"{key}": {json.dumps(_shared(paths[1], key, *names))}')
    return Input((paths[0],), (f"{{{', '.join(parts)}}}".encode(),))


def hint(paths: Sequence[str]) -> str:
    """Return the line that says that two files may be the payoffs of a game; "" for other files.

    They may be if they are tables of the same shape and either are square, or have labels and no q, or have a shape
    that no problem has.
    """
    if len(paths) != 2 or not all(Path(path).is_file() and Path(path).stat().st_size < LARGEST_TABLE for path in paths):
        return ""
    try:
        (A, rows, columns), (B, _, others) = map(_table, paths)
    except LCPError:
        return ""
    m, k = len(A), len(A[0])
    is_labelled = bool(rows and columns) and not {"q", *BOUNDS} & {*columns, *others}
    if (m, k) != (len(B), len(B[0])) or k == 1 or (k == m + 1 and not is_labelled):
        return ""
    return f"if {' and '.join(map(place, paths))} are the payoffs of a game, add --game"


def _shared(path: str, key: str, names: list[str], others: list[str]) -> list[str]:
    """Return the names that two tables give the strategies of a player; none if their numbers of strategies differ.

    path : the file of the second table. Raises ProblemError if its names differ, or are in another order.
    """
    if names and others and len(names) != len(others):
        return []
    if names and others and names != others:
        if sorted(names) == sorted(others):
            fault = f"has the {key} {', '.join(others)}, the other table {', '.join(names)}"
            raise ProblemError(place(path), fault, "put them in the same order")
        own, other = next((own, name) for own, name in zip(others, names, strict=True) if own != name)
        fault = f"has {quoted(own)} among the {key} where the other table has {quoted(other)}"
        raise ProblemError(place(path), fault, "give both tables the same names, or one of them none")
    return names or others


def _row(values: Sequence[str]) -> str:
    """Return a row of payoffs in JSON, with all digits, fractions as texts."""
    return f"[{', '.join(json.dumps(value) if '/' in value else str(Decimal(value)) for value in values)}]"


def _table(path: str) -> tuple[list[list[str]], list[str], list[str]]:
    """Return the rows of a table, and the names of its rows and columns."""
    from lcpcli.files.csv_format import is_number, table_of

    def parse(content: bytes) -> tuple[list[list[str]], list[str], list[str]]:
        if form_of(path, content) != "csv_format":
            raise ProblemError("", "is not a table in CSV", "write the game as JSON, with the keys A and B")
        rows, bounds, *labels = table_of(content, str)
        if bounds:
            raise ProblemError("", f"has columns headed {', '.join(bounds)}", HINT)
        header, index = ([] if any(not name or is_number(name) for name in own) else own for own in labels)
        return rows, index, header

    return parsed(path, HINT, parse)
