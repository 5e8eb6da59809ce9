"""The cache of the compiled kernels, which numba stores in files: damaged files, and
those made from other sources, are removed, and only one process at a time compiles a
module.

numba verifies nothing. It unpickles the files it finds, so that a truncated file makes
every later run fail with a traceback, and it calls the machine code unchecked: of 5
files with 200 bytes overwritten, 2 were seen to be used all the same, and 1 ended the
process by a signal. Its index detects changes in the file of a kernel, but not in the
files that the kernel uses, whose constants and functions are part of the machine code.

In addition to numba's files, `lcpcli.json` has a checksum of each, one of the sources,
and the modules that have been loaded without compiling anything. A file without a
checksum is complete, as numba moves only complete files to their final names: it comes
from a process that was killed.
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
# The files with functions and constants that kernels use, and the files of the kernels.
SOURCES = (
    *(f"auto/{name}" for name in ("attempts",)),
    *(f"basis/{name}" for name in ("exchanges", "free_variables", "tableau")),
    *(f"linalg/{name}" for name in ("doubles", "factors", "matrices", "units")),
    *(f"methods/{name}" for name in ("direct", "newton")),
    *(f"verify/{name}" for name in ("enclosure", "final_states", "measure")),
    "model/box",
    "kernels/overloads",
    "kernels/contact_kernels",
    "kernels/kernels",
    "kernels/measure_kernels",
    "kernels/mixed_kernels",
    "kernels/pivoting_kernels",
)
RECORD = "lcpcli.json"
# The part of file names by which numba identifies this interpreter.
TAG = f".py{sys.version_info[0]}{sys.version_info[1]}{getattr(sys, 'abiflags', '')}."
# Before kernels are compiled, 4 files of the size of the largest one are written as a
# test: all kernels have 7.3 MB, and on a full disk every run would compile them again
# and fail.
LARGEST, MANY = 2**21, 4
# Seconds: the longest wait for another process that compiles, and between two checks.
LONGEST_WAIT, LOOK = 600.0, 0.05
# A temporary file of numba that is older than this, in seconds, belongs to a process
# that was killed.
LEFT_OVER = 3600.0
HINT = "set NUMBA_CACHE_DIR to a folder that can be written"


def _here() -> None:
    """A function that is never called: its cache is in the folder of the kernels."""


class Cache:
    """The files of this version of Python in the folders that numba chooses: those of
    the sources if they can be written. Raises OptionError if there is no such folder.
    """

    def __init__(self) -> None:
        try:
            self.folders = {
                subpackage: Path(njit(cache=True)(function).stats.cache_path)
                for subpackage, function in {
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
        """Remove the files that differ from the record, or all if they were made from
        other sources; return whether any was damaged.
        """
        record = self._recorded()
        if record.get("sources") == self._sources and not self._changed(record):
            return False
        with self._alone(f"{RECORD}.lock"):
            return self._repair()

    def _repair(self) -> bool:
        """Repair the cache as `repair` does, while no other process may."""
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
        """Return the names of files that differ from the record, or are missing."""
        checksums = self._checksums()
        return [
            name
            for name, checksum in record["files"].items()
            if TAG in name and checksums.get(name) != checksum
        ]

    def note(self, module: str | None = None) -> None:
        """Record the files as they are, and that a module was loaded. Errors are
        ignored, as the loss of the record costs little.
        """
        with suppress(OSError), self._alone(f"{RECORD}.lock"):
            record = self._recorded()
            if record.get("sources") != self._sources:
                return
            record["files"] |= self._checksums()
            if module is not None:
                loaded_modules = record["modules"].setdefault(self._made_with, [])
                if module not in loaded_modules:
                    loaded_modules.append(module)
            self._write(record)

    def forget(self) -> None:
        """Remove all files of this interpreter."""
        with suppress(OSError), self._alone(f"{RECORD}.lock"):
            for _, path in self._files():
                path.unlink(missing_ok=True)
            (self.folder / RECORD).unlink(missing_ok=True)

    @contextmanager
    def compiling(self, module: str, wait: Callable[[], None] | None) -> Iterator[bool]:
        """Open a context in which no other process compiles a module, and there is
        enough space for its files. If another process compiles, call `wait` until it is
        finished; yield False if `wait` is None.
        """
        with self._alone(f"lcpcli-{module}.lock", wait) as is_alone:
            if is_alone:
                self._require_room()
            yield is_alone

    def _require_room(self) -> None:
        """Remove temporary files of killed processes; raise OSError if the disk is
        full."""
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
        """Open a context with a lock on a file, for which `wait` is called until it is
        free; yield whether the lock was obtained. Raises TimeoutError."""
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
        for subpackage, folder in self.folders.items():
            for path in folder.glob("*.nb[ci]"):
                if tag in path.name:
                    yield f"{subpackage}/{path.name}", path

    def _checksums(self) -> dict[str, int]:
        checksums = {}
        for name, path in self._files():
            with suppress(FileNotFoundError):
                checksums[name] = crc32(path.read_bytes())
        return checksums


def _sources() -> int:
    """Return a checksum of the source files."""
    total = 0
    for name in SOURCES:
        with suppress(OSError):  # of a package without sources, which never change
            total = crc32((PACKAGE / f"{name}.py").read_bytes(), total)
    return total
