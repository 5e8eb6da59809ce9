"""A terminal for tests of progress, and what it has shown."""

import re
from io import StringIO


class Terminal(StringIO):
    """A standard error that is a terminal."""

    def isatty(self):
        return True


def lines_in(stream):
    """The texts that a line of progress has shown one after the other, without the time
    and the character that turns; "" at the end if it has been erased."""
    text = re.sub(r"\x1b\[(?:\?25[lh]|[\d;]*m)", "", stream.getvalue())
    shown = [
        re.sub(r"^[-\\|/] | *\d+:\d\d:\d\d\s*$", "", part)
        for part in re.split(r"\r\x1b\[2K|\r\x1b\[1A\x1b\[2K", text)
    ]
    return [text for i, text in enumerate(shown) if i == 0 or text != shown[i - 1]]
