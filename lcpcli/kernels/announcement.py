"""The message that kernels are compiled, which takes seconds once on a machine."""

from __future__ import annotations

import logging
from contextlib import AbstractContextManager

from numba.core import event

ANNOUNCEMENT = "lcpcli: compiling the kernels of the extra fast, once on a machine, which takes about a minute"


class Announcement(event.Listener):
    """The message that kernels are compiled, when the first of them is."""

    is_due = True

    def on_start(self, event: event.Event) -> None:  # noqa: ARG002
        if self.is_due:
            logging.getLogger("lcpcli").warning(ANNOUNCEMENT)
        self.is_due = False

    def on_end(self, event: event.Event) -> None:
        pass


ONCE = Announcement()  # in a process, for all modules of kernels


def announced() -> AbstractContextManager[None]:
    """Open a context in which the first kernel that is compiled is announced."""
    manager: AbstractContextManager[None] = event.install_listener("numba:compile", ONCE)
    return manager
