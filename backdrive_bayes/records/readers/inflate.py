"""Decompression that stops at a bound instead of filling the memory."""

from __future__ import annotations

import gzip
import io
import lzma
import zlib
from pathlib import Path

from backdrive_bayes.errors import BadInput
from backdrive_bayes.records.readers import limits

BROKEN = (EOFError, gzip.BadGzipFile, lzma.LZMAError, zlib.error)
_XZ_MEMORY_BYTES = 128 * 2**20


class BoundedStream(io.RawIOBase):
    """Read-only byte stream that raises BadInput once more than ``limits`` allow has come out of ``path``.

    ``seen`` counts how often ``mark`` has passed.
    """

    def __init__(self, path: Path, mark: bytes = b","):
        self._mark, self.seen = mark, 0
        self._path, self._size, self._count = path, path.stat().st_size, 0
        self._file = path.open("rb")
        self._stream = _inflater(path, self._file)

    def readable(self) -> bool:
        """Say that bytes may be read."""
        return True

    def readinto(self, buffer) -> int:
        """Fill ``buffer`` with the next inflated bytes."""
        try:
            chunk = self._stream.read(min(len(buffer), 1 << 20))
        except BROKEN as error:
            raise BadInput(self._path, "an intact compressed file", str(error) or type(error).__name__) from error
        self._count += len(chunk)
        self._check()
        self.seen += chunk.count(self._mark)
        buffer[: len(chunk)] = chunk
        return len(chunk)

    def close(self) -> None:
        """Close the stream and the file beneath it."""
        if not self.closed:
            self._stream.close()
            self._file.close()
        super().close()

    def _check(self) -> None:
        bomb = self._count > limits.FREE_INFLATED_BYTES and self._count > limits.MAX_INFLATION * self._size
        if bomb or self._count > limits.MAX_BYTES:
            raise BadInput(
                self._path,
                f"at most 2 GB, and {limits.MAX_INFLATION} times the file's size, once inflated",
                f"more: {self._count / 1e6:.0f} MB already from {self._size / 1e6:.3g} MB",
            )


def _inflater(path: Path, file):
    if path.name.lower().endswith(".gz"):
        return gzip.GzipFile(fileobj=file)
    if path.name.lower().endswith(".xz"):
        return _BoundedXz(file)
    return file


class _BoundedXz(io.RawIOBase):
    """XZ reader whose dictionary may not claim more than 128 MB (``lzma.LZMAFile`` has no such bound)."""

    def __init__(self, file):
        self._file, self._decoder = file, lzma.LZMADecompressor(memlimit=_XZ_MEMORY_BYTES)

    def read(self, size: int = -1) -> bytes:
        """Return up to ``size`` inflated bytes, empty at the end of the last stream."""
        while True:
            if self._decoder.eof and not self._next_stream():
                return b""
            fresh = self._file.read(1 << 16) if self._decoder.needs_input else b""
            if self._decoder.needs_input and not fresh:
                raise EOFError("compressed file ended before the end-of-stream marker was reached")
            chunk = self._decoder.decompress(fresh, size)
            if chunk:
                return chunk

    def _next_stream(self) -> bool:
        rest = self._decoder.unused_data or self._file.read(1 << 16)
        rest = rest.lstrip(b"\0")
        if not rest:
            return False
        self._file.seek(-len(rest), io.SEEK_CUR)
        self._decoder = lzma.LZMADecompressor(memlimit=_XZ_MEMORY_BYTES)
        return True
