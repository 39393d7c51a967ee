"""Arrays of a file too large for memory, in unnamed files that the system removes when nothing uses them any longer."""

import mmap
import os
import tempfile
from collections.abc import Iterable
from dataclasses import dataclass, field
from itertools import chain, takewhile
from pathlib import Path

from sensorgen.core.errors import BadInput

MOST_BYTES = 1 << 31  # of a file, and of all that it unpacks to
_MEMORY_BYTES = 1 << 22  # of one array: a smaller one stays in memory
_BLOCK = 1 << 20
_TRIFLE_BYTES = 1 << 26  # up to which no ratio is suspicious
_PACKED_TO = 100  # bytes that one byte packs at most: noise does not pack by more than two


@dataclass
class FileSpool:
    """Content of one file, beside memory and within :data:`MOST_BYTES`.

    Content goes to ``TMPDIR``, else to ``/var/tmp``, as ``/tmp`` may itself be memory.
    """

    _maps: list[mmap.mmap] = field(default_factory=list)
    _bytes: int = 0

    def declare(self, size: int, stored: int) -> None:
        """Refuse an array before it is read.

        Parameters
        ----------
        size, stored : int
            What it says that it unpacks to, and what it takes in the file [bytes].

        Raises
        ------
        BadInput
            With all before, more than :data:`MOST_BYTES`; or packed as no measurement packs.
        """
        self._bytes += size
        if self._bytes > MOST_BYTES:
            raise BadInput(f"{self._bytes / 2**30:.3g} GB unpacked; expected up to {MOST_BYTES / 2**30:.3g} GB")
        if size > _TRIFLE_BYTES and size > _PACKED_TO * stored:
            raise BadInput(f"{size / 2**30:.3g} GB packed into {stored} bytes: no measurement; expected a recording")

    def held(self, blocks: Iterable[bytes]) -> memoryview:
        """Content in one piece, piece by piece in order."""
        first: list[bytes] = []
        rest = iter(blocks)
        while sum(map(len, first)) <= _MEMORY_BYTES:
            block = next(rest, None)
            if block is None:
                return memoryview(b"".join(first))
            first.append(block)
        beside = None if os.environ.get("TMPDIR") or not Path("/var/tmp").is_dir() else "/var/tmp"  # noqa: S108
        with tempfile.TemporaryFile(dir=beside) as file:
            for block in chain(first, rest):
                file.write(block)
            file.flush()
            mapped = mmap.mmap(file.fileno(), 0, access=mmap.ACCESS_READ)
        self._maps.append(mapped)
        return memoryview(mapped)

    def file(self, path: Path) -> memoryview:
        """A file's content: a copy, so that a file that is cut off meanwhile does no harm."""
        with path.open("rb") as file:
            pieces = (file.read(min(_BLOCK, MOST_BYTES - at)) for at in range(0, MOST_BYTES, _BLOCK))
            return self.held(takewhile(bool, pieces))

    def relieve(self) -> None:
        """Give the memory back that was taken to read the arrays; they stay readable."""
        for mapped in self._maps:
            if hasattr(mmap, "MADV_DONTNEED"):
                mapped.madvise(mmap.MADV_DONTNEED)
