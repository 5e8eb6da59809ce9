"""The cache of the kernels, which numba keeps in files: what is damaged, or was made
from other sources, is removed from it, and one process at a time compiles a module.

Numba verifies nothing. It unpickles what it finds, so that a file that was cut off ends
every later run with a traceback, and it calls the machine code as it is: with 200 bytes
overwritten, 2 of 5 files were seen to be used all the same, and 1 ended the process by
a signal. Its index knows of changes in the file of a kernel, not in those that the
kernel uses, whose constants and functions are part of the machine code.

Beside the files of numba, `lcpcli.json` has a checksum of each, one of the sources, and
the modules that have been loaded without compiling anything. A file without a checksum
is whole, as numba moves it into place: it is that of a process that was killed.
"""

from __future__ import annotations

import json
import os
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager, suppress
from pathlib import Path
from tempfile import TemporaryFile
from typing import Any
from zlib import crc32

import numba
from llvmlite.binding import get_host_cpu_name
from numba import njit

from lcpcli.basis.tableau import follow
from lcpcli.errors import OptionError
from lcpcli.locks import lock
from lcpcli.methods.direct import safeguarded
from lcpcli.verify.enclosure import regular_change

PACKAGE = Path(__file__).parents[1]
# Files with functions and constants that kernels use, and those of the kernels.
SOURCES = (
    *(f"auto/{name}" for name in ("attempts",)),
    *(f"basis/{name}" for name in ("exchanges", "free_variables", "tableau")),
    *(f"linalg/{name}" for name in ("doubles", "factors", "matrices", "units")),
    *(f"methods/{name}" for name in ("direct", "final_states", "newton")),
    *(f"verify/{name}" for name in ("enclosure", "measure")),
    "model/box",
    "kernels/overloads",
    "kernels/kernels",
    "kernels/measure_kernels",
    "kernels/mixed_kernels",
    "kernels/pivoting_kernels",
)
RECORD = "lcpcli.json"
# Of the names of the files of this interpreter, as numba writes them.
TAG = f".py{sys.version_info[0]}{sys.version_info[1]}{getattr(sys, 'abiflags', '')}."
# Bytes that are tried before kernels are compiled, in files of the size of the largest
# one: all of them have 7.3 MB, and an error after each first kernel would come in every
# run.
LARGEST, MANY = 2**21, 4
# Seconds: the longest wait for another process that compiles, and between two looks.
LONGEST_WAIT, LOOK = 600.0, 0.05
# Seconds after which a temporary file of numba was left by a process that was killed.
LEFT_OVER = 3600.0
HINT = "set NUMBA_CACHE_DIR to a folder that can be written"


def _here() -> None:
    """A function in the folder of the kernels."""


class Cache:
    """The files of this version of Python in the folders that numba chooses, which are
    those of the sources where these can be written. Raises OptionError if it finds
    none."""

    def __init__(self) -> None:
        try:
            self.folders = {
                room: Path(njit(cache=True)(function).stats.cache_path)
                for room, function in {
                    "kernels": _here,
                    "basis": follow,
                    "methods": safeguarded,
                    "verify": regular_change,
                }.items()
            }
        except RuntimeError:
            raise OptionError(
                "numba", "has no folder for compiled kernels", HINT
            ) from None
        self.folder = self.folders["kernels"]
        self._made_with = f"{numba.__version__}{TAG}{get_host_cpu_name()}"
        self._sources = _sources()

    def has_loaded(self, module: str) -> bool:
        """Return whether a process like this one has loaded a module."""
        modules = self._recorded().get("modules", {})
        return module in modules.get(self._made_with, ())

    def repair(self) -> bool:
        """Remove the files that are not as they were recorded, or all if they were made
        from other sources; return whether any was damaged."""
        record = self._recorded()
        if record.get("sources") == self._sources and not self._changed(record):
            return False
        with self._alone(f"{RECORD}.lock"):
            return self._repair()

    def _repair(self) -> bool:
        record = self._recorded()
        if record.get("sources") != self._sources:
            # A record that cannot be read is not that of another version.
            is_damaged = not record and (self.folder / RECORD).exists()
            paths = [path for _, path in self._files("")]
            record = {"sources": self._sources, "files": {}, "modules": {}}
        else:
            changed, files = self._changed(record), dict(self._files())
            paths = [files[name] for name in changed if name in files]
            is_damaged = bool(paths)
            for name in changed:
                del record["files"][name]
            if changed:
                record["modules"].pop(self._made_with, None)
        for path in paths:
            path.unlink(missing_ok=True)
        self._write(record)
        return is_damaged

    def _changed(self, record: dict[str, Any]) -> list[str]:
        """Return the names of files that are not as they were recorded, or missing."""
        here = self._checksums()
        return [
            name
            for name, checksum in record["files"].items()
            if TAG in name and here.get(name) != checksum
        ]

    def note(self, module: str | None = None) -> None:
        """Record the files as they are, and that a module was loaded. That fails
        silently, as its loss costs little."""
        with suppress(OSError), self._alone(f"{RECORD}.lock"):
            record = self._recorded()
            if record.get("sources") != self._sources:
                return
            record["files"] |= self._checksums()
            if module is not None:
                own = record["modules"].setdefault(self._made_with, [])
                own += [module] * (module not in own)
            self._write(record)

    def forget(self) -> None:
        """Remove all files of this interpreter."""
        with suppress(OSError), self._alone(f"{RECORD}.lock"):
            for _, path in self._files():
                path.unlink(missing_ok=True)
            (self.folder / RECORD).unlink(missing_ok=True)

    @contextmanager
    def compiling(self, module: str, wait: Callable[[], None] | None) -> Iterator[bool]:
        """Open a context in which no other process compiles a module, and there is room
        for its files; yield False if another one does, unless `wait` is given, which is
        called while it does."""
        with self._alone(f"lcpcli-{module}.lock", wait) as is_alone:
            if is_alone:
                self._require_room()
            yield is_alone

    def _require_room(self) -> None:
        for folder in self.folders.values():
            for path in folder.glob("*.nb?.tmp.*"):
                with suppress(OSError):
                    if path.stat().st_mtime < time.time() - LEFT_OVER:
                        path.unlink()
        with ExitStack() as stack:
            for _ in range(MANY):
                file = stack.enter_context(TemporaryFile(dir=self.folder))
                file.write(bytes(LARGEST))
                file.flush()

    @contextmanager
    def _alone(
        self, name: str, wait: Callable[[], None] | None = lambda: None
    ) -> Iterator[bool]:
        end = time.monotonic() + LONGEST_WAIT
        with (self.folder / name).open("ab") as file:
            while not (is_alone := lock(file)) and wait is not None:
                if time.monotonic() > end:
                    raise TimeoutError
                wait()
                time.sleep(LOOK)
            yield is_alone

    def _recorded(self) -> dict[str, Any]:
        """Return the record; {} if there is none, or it is damaged."""
        with suppress(OSError, ValueError, RecursionError):
            record = json.loads((self.folder / RECORD).read_bytes())
            if isinstance(record, dict) and all(
                isinstance(record.get(name), dict) for name in ("files", "modules")
            ):
                return record
        return {}

    def _write(self, record: dict[str, Any]) -> None:
        temporary = self.folder / f"{RECORD}.tmp"
        temporary.write_text(json.dumps(record), encoding="utf-8")
        os.replace(temporary, self.folder / RECORD)

    def _files(self, tag: str = TAG) -> Iterator[tuple[str, Path]]:
        """Yield the files of numba with their names in the record."""
        for room, folder in self.folders.items():
            for path in folder.glob("*.nb[ci]"):
                if tag in path.name:
                    yield f"{room}/{path.name}", path

    def _checksums(self) -> dict[str, int]:
        found = {}
        for name, path in self._files():
            with suppress(FileNotFoundError):
                found[name] = crc32(path.read_bytes())
        return found


def _sources() -> int:
    total = 0
    for name in SOURCES:
        with suppress(OSError):  # of a package without sources, which never change
            total = crc32((PACKAGE / f"{name}.py").read_bytes(), total)
    return total
