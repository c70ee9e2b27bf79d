"""The bytes of a CSV file as its parsers take them: UTF-8 for UTF-16, no padding, no lines after the data."""

from __future__ import annotations

import codecs
import io
from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, BinaryIO, cast

_PART_BYTES = 1 << 20
LINES_BYTES = 1 << 23
"""Of a long file, parsed at once and then let go: some 100,000 rows."""
_BYTE_ORDER_MARKS = {b"\xff\xfe": "utf-16-le", b"\xfe\xff": "utf-16-be"}


@dataclass(frozen=True)
class CsvSource:
    """Where a CSV file's text is.

    Attributes
    ----------
    path
        The file.
    wide
        Python's name of its encoding where that is UTF-16, which is read as UTF-8.
    end
        Bytes of the file that hold its table; all of it for None.
    padded
        Whether zero bytes pad its fields; they are read as blanks.
    """

    path: Path
    wide: str | None = None
    end: int | None = None
    padded: bool = False

    @property
    def is_plain(self) -> bool:
        """Whether the file's bytes are read as they are."""
        return self.wide is None and self.end is None and not self.padded

    def open(self) -> BinaryIO:
        """The table's bytes from the beginning."""
        if self.is_plain:
            return self.path.open("rb")
        return cast(BinaryIO, io.BufferedReader(_Converted(self), _PART_BYTES))

    def whole_lines(self) -> Iterator[memoryview]:
        """The table's bytes in parts that end where a line does, used before the next is asked for.

        Raises
        ------
        pyarrow.ArrowInvalid
            Where a line is longer than a part, which is none for the fast parser.
        """
        import pyarrow as arrow

        buffer, rest = bytearray(LINES_BYTES), b""
        view = memoryview(buffer)
        with self.open() as file:
            while read := file.readinto(view[len(rest) :]):  # type: ignore[attr-defined]
                filled = len(rest) + read
                end = max(buffer.rfind(b"\n", 0, filled), buffer.rfind(b"\r", 0, filled)) + 1
                if end == 0 and filled == LINES_BYTES:
                    raise arrow.ArrowInvalid("a line longer than a part")
                yield view[:end]
                rest = bytes(view[end:filled])
                buffer[: len(rest)] = rest
        yield view[: len(rest)]

    def tail(self, size: int) -> bytes:
        """The last bytes of the table, as `open` would give them, of so many in the file or one more."""
        stop = self.stop
        start = max(stop - size, 0)
        with self.path.open("rb") as file:
            file.seek(start - start % 2 if self.wide else start)
            content = file.read(stop - file.tell())
        if self.wide:
            content = content.decode(self.wide, errors="replace").removeprefix("\ufeff").encode()
        return content.replace(b"\0", b" ") if self.padded else content

    @property
    def stop(self) -> int:
        """Where the table ends in the file [bytes]."""
        size = self.path.stat().st_size
        return size if self.end is None else min(self.end, size)

    def without(self, text: str, encoding: str) -> CsvSource:
        """The source without a text at its end."""
        return replace(self, end=self.stop - len(text.encode(self.wide or encoding, errors="replace")))


def csv_source(path: Path, head: bytes) -> CsvSource:
    """How a file is to be opened, told from its first bytes and its last ones."""
    wide = _BYTE_ORDER_MARKS.get(head[:2])
    if wide is None and len(head) > 3:
        # UTF-16 without its mark: every other byte of plain letters is zero.
        for at, name in enumerate(("utf-16-be", "utf-16-le")):
            if not any(head[at:256:2]) and all(head[1 - at : 256 : 2]):
                wide = name
    if wide:
        return CsvSource(path, wide)
    end = _without_padding(path)
    size = path.stat().st_size
    kept = head[: end if end < size else len(head)]
    return CsvSource(path, None, end if end < size else None, b"\0" in kept)


def _without_padding(path: Path) -> int:
    """Bytes of a file before the zero bytes at its end."""
    with path.open("rb") as file:
        end = file.seek(0, io.SEEK_END)
        while end > 0:
            start = max(end - _PART_BYTES, 0)
            file.seek(start)
            part = file.read(end - start).rstrip(b"\0")
            if part:
                return start + len(part)
            end = start
    return 0


class _Converted(io.RawIOBase):
    """A source's bytes, converted as they are read."""

    def __init__(self, source: CsvSource) -> None:
        self.file = source.path.open("rb")
        self.left = source.stop
        self.padded = source.padded
        self.decoder = codecs.getincrementaldecoder(source.wide)(errors="replace") if source.wide else None
        self.ahead = b""
        self.begun = False

    def readable(self) -> bool:
        return True

    def close(self) -> None:
        self.file.close()
        super().close()

    def readinto(self, buffer: Any) -> int:
        while not self.ahead and self.left > 0:
            part = self.file.read(min(_PART_BYTES, self.left))
            self.left = self.left - len(part) if part else 0
            if self.decoder is not None:
                text = self.decoder.decode(part, final=self.left == 0)
                part = (text if self.begun else text.removeprefix("\ufeff")).encode()
                self.begun = True
            self.ahead = part.replace(b"\0", b" ") if self.padded else part
        count = min(len(buffer), len(self.ahead))
        buffer[:count] = self.ahead[:count]
        self.ahead = self.ahead[count:]
        return count
