"""What lcp path shows, and where it is written."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from contextlib import ExitStack
from fractions import Fraction
from functools import partial
from typing import TYPE_CHECKING, TypeAlias

from lcpcli.cli.output import Destination
from lcpcli.cli.terminal import emit
from lcpcli.files.atomic_write import gradual_writing

if TYPE_CHECKING:
    from lcpcli.parametric.parts import Take
    from lcpcli.parametric.path import Path

Number: TypeAlias = "float | Fraction"


class Report:
    """What is shown of a path: its parts as they are found, in formats with all numbers, or all of it at the end.

    names : of the unknowns that are shown. take : as for `follow`; None if the path is needed as a whole.
    """

    def __init__(
        self,
        destination: Destination,
        at: Sequence[Number],
        files: Sequence[str],
        names: Sequence[str],
        stack: ExitStack,
    ) -> None:
        from lcpcli.report.path_writing import WRITERS

        self._destination, self._at, self._names, self._stack = destination, at, names, stack
        writer = WRITERS.get(destination.form)
        self._writer = writer(at, files, self._write, names) if writer else None
        self._add: Callable[[str], object] | None = None
        self.take: Take | None = None if self._writer is None else self._writer.part

    def end(self, last: Path) -> None:
        """Show the rest, from the last part or the whole path."""
        if self._writer is not None:
            self._writer.end(last)
            return
        from lcpcli.report import formats, path_table

        form, width = self._destination.form, self._destination.width
        self._destination.show(partial(formats.typeset, path_table.build(last, form, self._at, width, self._names)))

    def _write(self, text: str) -> None:
        """Write a text to standard output, or to the file, which appears as a whole at the end."""
        if self._destination.path is None:
            emit(text, False)
            return
        if self._add is None:
            self._add = self._stack.enter_context(gradual_writing(self._destination.path))
        self._add(text)


def forgotten(_: Path) -> Callable[[], object]:
    """Take a part of a path that is not shown."""
    return bool
