"""The environment of a bench: the machine, and the versions of all software involved."""

from __future__ import annotations

import os
import platform
from collections.abc import Sequence
from dataclasses import dataclass
from importlib.metadata import version
from pathlib import Path

from lcpcli import __version__
from lcpcli.linalg import threads
from lcpcli.peers import registry as peers


@dataclass(frozen=True)
class Machine:
    """Processor, number of cores, memory in bytes and system; None for what the system does not report.

    threads : for dense linear algebra; None if the BLAS decides.
    """

    processor: str
    cores: int | None
    memory: int | None
    system: str
    threads: int | None


def machine() -> Machine:
    """This machine."""
    return Machine(
        _processor(), os.cpu_count(), _memory(), f"{platform.system()} {platform.release()}", threads.in_environment()
    )


def versions(names: Sequence[str]) -> dict[str, str | None]:
    """The versions of Python, of this program, of its numerical libraries, and of the named peers."""
    own: dict[str, str | None] = {"python": platform.python_version(), "lcpcli": __version__}
    own |= {name: version(name) for name in ("numpy", "scipy")}
    return own | {name: peers.load(name).version() for name in names}


def _processor() -> str:
    """The processor's name; on Linux only this file has it."""
    try:
        lines = Path("/proc/cpuinfo").read_text(encoding="utf-8").splitlines()
    except OSError:
        lines = []
    names = [line.partition(":")[2].strip() for line in lines if line.startswith("model name")]
    return names[0] if names else platform.processor() or platform.machine()


def _memory() -> int | None:
    try:
        return os.sysconf("SC_PHYS_PAGES") * os.sysconf("SC_PAGE_SIZE")
    except (AttributeError, ValueError, OSError):
        return None
