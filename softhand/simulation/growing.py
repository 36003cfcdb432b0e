"""Arrays that grow as a run goes on: in memory, and in files without a name once they are large."""

from __future__ import annotations

import os
import tempfile
from contextlib import suppress
from math import prod
from typing import IO

import numpy as np

from softhand.numerics.arrays import AnyArray

IN_MEMORY = 16_000_000
"""Bytes of all arrays of a run that stay in memory."""


class Growing:
    """Some arrays by name to which rows are added, all as many.

    `arrays` gives them with all rows; from a file they are read as they are needed, and cannot be written.
    """

    def __init__(self) -> None:
        self._parts: dict[str, list[AnyArray]] = {}
        self._files: dict[str, IO[bytes]] = {}
        self._in_memory = 0
        self._to_files = True

    def add(self, rows: dict[str, AnyArray]) -> None:
        """Add rows, of the same names, shapes and types each time, shape (rows, ...)."""
        for name, array in rows.items():
            own = np.array(array, order="C")
            self._parts.setdefault(name, []).append(own)
            self._in_memory += own.nbytes
        if self._in_memory > IN_MEMORY and self._to_files:
            self._put_into_files()

    def arrays(self) -> dict[str, AnyArray]:
        """Each with all rows so far."""
        return {name: self._array(name) for name in self._parts}

    def _put_into_files(self) -> None:
        """What is in memory goes to disk; where that is full it stays, from now on."""
        for name in self._parts:
            self._to_files &= self._append(name)

    def _append(self, name: str) -> bool:
        """Rows in memory to the end of their file; False, and they stay, if that fails."""
        parts, place = self._parts[name], 0
        try:
            if name not in self._files:
                self._files[name] = tempfile.TemporaryFile(prefix="softhand-")  # noqa: SIM115  read at the end
            place = self._files[name].seek(0, os.SEEK_END)
            for part in parts:
                self._files[name].write(part.tobytes())
            self._files[name].flush()
        except OSError:
            with suppress(OSError, KeyError):  # of what was written in part
                self._files[name].truncate(place)
            return False
        self._in_memory -= sum(part.nbytes for part in parts)
        parts[:] = [parts[0][:0]]
        return True

    def _array(self, name: str) -> AnyArray:
        if name in self._files and any(map(len, self._parts[name])):
            self._append(name)
        parts, file = self._parts[name], self._files.get(name)
        rest = parts[0] if len(parts) == 1 else np.concatenate(parts)
        if file is None:
            return rest
        shape, dtype = rest.shape[1:], rest.dtype
        size = file.seek(0, os.SEEK_END) // (dtype.itemsize * prod(shape))
        stored = np.asarray(np.memmap(file, dtype, "r", shape=(size, *shape))) if size else rest[:0]
        return np.concatenate([stored, rest]) if len(rest) else stored
