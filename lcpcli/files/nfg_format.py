"""Games of two players in Gambit's strategic form, .nfg: payoffs one after another, or outcomes and which one each has.

The first player's strategy changes fastest. Numbers are integers, decimals or fractions, with or without commas between
them; outcome 0 pays nothing. (Gambit, Software Tools for Game Theory, https://www.gambit-project.org, file formats.)
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from fractions import Fraction
from typing import TYPE_CHECKING

from lcpcli.errors import ProblemError, count, quoted
from lcpcli.files.content import decode, unpacked
from lcpcli.files.keys import THREE_PLAYERS
from lcpcli.model.problem import Problem
from lcpcli.model.reductions import from_game
from lcpcli.rational.numbers import ratio
from lcpcli.typing import Vector

if TYPE_CHECKING:
    from lcpcli.rational.problem import ExactParts

TOKEN = re.compile(r'"(?:\\.|[^"\\])*"|[{}]|[^\s,{}"]+|"')
NO_VECTOR = ("is a game", "name a file that holds a vector")
CUT_OFF = "is it cut off?"


def parse(content: bytes) -> Problem:
    """The problem of the game in a file."""
    return _Reader(decode(unpacked(content))).problem()


def parse_exact(content: bytes) -> ExactParts:
    """The same with the payoffs as written."""
    from lcpcli.rational.problem import decimal_parts_of

    return decimal_parts_of(parse(content))


def parse_vector(field: str, content: bytes, n: int | None = None) -> Vector:  # noqa: ARG001 (as in every format)
    raise ProblemError("", *NO_VECTOR)


def parse_exact_vector(field: str, content: bytes) -> list[Fraction]:  # noqa: ARG001
    raise ProblemError("", *NO_VECTOR)


def render(problem: Problem) -> dict[str, bytes]:  # noqa: ARG001 (`writing` refuses the suffix first)
    raise ProblemError("", "is of a format that is only read")


class _Reader:
    """The tokens of a file, taken one after another: texts in quotes, braces, and words."""

    def __init__(self, text: str) -> None:
        self._text = text
        self._tokens = [(match[0], match.start()) for match in TOKEN.finditer(text)]
        self._next = 0

    def problem(self) -> Problem:
        if [self._take() for _ in range(2)] != ["NFG", "1"]:
            raise self._error("is not the beginning of a game", "a file begins with NFG 1 R")
        self._take()  # R or D: how numbers are meant, which their digits tell
        title = self._text_token("the title")
        self._refuse_other_players(len(self._texts("the names of the players")))
        m, k, names = self._strategies()
        if self._peek()[:1] == '"':
            self._take()  # a comment
        cells = self._outcomes(m * k) if self._peek() == "{" else self._payoffs(m * k)
        if self._next < len(self._tokens):
            raise self._error(f"is more than the payoffs of {m} x {k} strategies", "remove it", self._take())
        A, B = ([[_number(cells[j * m + i][player]) for j in range(k)] for i in range(m)] for player in (0, 1))
        return from_game(A, B, rows=names[0], columns=names[1], name=title)

    def _strategies(self) -> tuple[int, int, list[list[str]]]:
        """How many strategies each player has, and their names, none if they are numbers."""
        self._expect("{", "the strategies")
        counts, names = [], []
        while self._peek() != "}":
            if self._peek() == "{":
                names.append(self._texts("the names of the strategies"))
                counts.append(len(names[-1]))
            else:
                names.append([])
                counts.append(self._whole("the number of strategies"))
        self._take()
        self._refuse_other_players(len(counts))
        if not all(counts):
            raise self._error("a player has no strategy", "give each at least one")
        named = [[] if own == [str(i) for i in range(1, len(own) + 1)] else own for own in names]
        return counts[0], counts[1], named

    def _payoffs(self, cells: int) -> list[Sequence[Fraction]]:
        values = [self._fraction() for _ in range(2 * cells)]
        return [values[2 * cell : 2 * cell + 2] for cell in range(cells)]

    def _outcomes(self, cells: int) -> list[Sequence[Fraction]]:
        self._expect("{", "the outcomes")
        outcomes: list[Sequence[Fraction]] = [(Fraction(0), Fraction(0))]
        while self._peek() == "{":
            self._take()
            if self._peek()[:1] == '"':
                self._take()
            outcomes.append((self._fraction(), self._fraction()))
            self._expect("}", "the end of an outcome")
        self._expect("}", "the end of the outcomes")
        chosen = []
        for _ in range(cells):
            number = self._whole("the number of an outcome")
            if number >= len(outcomes):
                raise self._error(f"is outcome {number} of {len(outcomes) - 1}", "name one that is given")
            chosen.append(outcomes[number])
        return chosen

    def _texts(self, what: str) -> list[str]:
        self._expect("{", what)
        found = []
        while self._peek() != "}":
            found.append(self._text_token(what))
        self._take()
        return found

    def _text_token(self, what: str) -> str:
        token = self._take()
        if len(token) < 2 or token[0] != '"':
            raise self._error(f"has {quoted(token)} in place of {what}", "put texts in quotes")
        return re.sub(r"\\(.)", r"\1", token[1:-1])

    def _whole(self, what: str) -> int:
        token = self._take()
        if not (token.isascii() and token.isdigit()) or len(token) > 9:
            raise self._error(f"has {quoted(token)} in place of {what}", "give an integer")
        return int(token)

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
            raise ProblemError("", "ends too early", CUT_OFF)
        return self._tokens[self._next][0]

    def _take(self) -> str:
        token = self._peek()
        self._next += 1
        return token

    def _refuse_other_players(self, players: int) -> None:
        if players > 2:
            raise ProblemError("", *THREE_PLAYERS)
        if players < 2:
            raise ProblemError("", f"is a game of {count(players, 'player')}", "give one of two players")

    def _error(self, fault: str, hint: str, token: str = "") -> ProblemError:
        """An error in the line of the last token."""
        line = self._text.count("\n", 0, self._tokens[self._next - 1][1]) + 1
        return ProblemError(f"line {line}", f"{quoted(token)} {fault}" if token else fault, hint)


def _number(value: Fraction) -> Fraction | float:
    """A payoff as a double if its shortest decimal is the payoff."""
    try:
        double = float(value)
    except OverflowError:
        return value
    return double if Fraction(repr(double)) == value else value
