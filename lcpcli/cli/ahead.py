"""Inputs that are read in the background, so that waiting for the next one delays no result."""

from __future__ import annotations

from collections import deque
from collections.abc import Iterable
from threading import Condition, Event, Thread

from lcpcli import interrupts
from lcpcli.files.inputs import QColumns, Work

HELD = 2**25  # bytes of inputs that wait for something
READ = 512  # inputs that are read ahead
AT_ONCE = 2**19  # bytes of inputs that are taken together, if there is more than one
COLUMNS_FOR_ONE = 16  # of one M, which are solved together, for one problem


def size_of(work: Work) -> int:
    """The bytes of an input."""
    return work.Q.nbytes if isinstance(work, QColumns) else sum(map(len, work.contents))


class Ahead:
    """Inputs read by a thread of their own, as far as there is room. `news` is set whenever there are more, or no more.

    The thread may wait for standard input for ever; the program ends without it.
    """

    def __init__(self, works: Iterable[Work], news: Event) -> None:
        self._works, self._news = works, news
        self._read: deque[Work] = deque()
        self._bytes = 0
        self._room = Condition()
        self._over = False
        self._fault: BaseException | None = None
        thread = Thread(target=self._run, daemon=True)
        interrupts.reading.append(thread)
        thread.start()

    @property
    def ended(self) -> bool:
        """Whether there are no more. Raises what reading them has raised."""
        if not self._over or self._read:
            return False
        if self._fault is not None:
            raise self._fault
        return True

    def take(self, number: int, most: int) -> list[Work]:
        """Some that have been read, so many and at most `most`; several q for one M come alone, so many times more."""
        taken: list[Work] = []
        total = 0
        with self._room:
            while self._read and len(taken) < min(number, most) and total < AT_ONCE:
                work = self._read[0]
                if isinstance(work, QColumns):
                    if not taken:
                        return [self._part(work, COLUMNS_FOR_ONE * number)]
                    break
                taken.append(self._read.popleft())
                total += size_of(work)
            self._bytes -= total
            self._room.notify()
        return taken

    def _part(self, work: QColumns, size: int) -> Work:
        """The first columns, which are taken."""
        self._bytes -= size_of(self._read.popleft())
        if size >= len(work.names):
            return work
        rest = work.part(size, len(work.names))
        self._read.appendleft(rest)
        self._bytes += size_of(rest)
        return work.part(0, size)

    def _run(self) -> None:
        try:
            for work in self._works:
                with self._room:
                    self._room.wait_for(lambda: len(self._read) < READ and self._bytes < HELD)
                    self._read.append(work)
                    self._bytes += size_of(work)
                self._news.set()
        except BaseException as error:
            self._fault = error
        self._over = True
        self._news.set()
