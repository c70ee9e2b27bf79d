"""Tables that lie compressed: a text packed by gzip, bzip2, xz or zstd, or alone in a zip archive."""

from __future__ import annotations

import bz2
import gzip
import lzma
import zipfile
from typing import Any

import numpy as np

from fogml.readers.columns import BLOCK_BYTES, Container, Rows, Spool

_ZIP = b"PK\x03\x04"
_ENCRYPTED = 1


class Text:
    """The text that a file unpacks to."""

    ndim = 1
    dtype = np.dtype("S")

    def __init__(self, spool: Spool, file: Any) -> None:
        self.content = Rows(spool, np.uint8)
        while part := file.read(BLOCK_BYTES):
            self.content += part
        self.shape = (self.content.count,)

    def text(self, start: int, stop: int) -> Any:
        """Bytes of the text from one place to another."""
        return self.content.read(None, start, stop)


class Packed(Container):
    """A compressed file: its text, or of an archive of several files their names alone."""

    def __init__(self, path: str, keys: list[str]) -> None:
        super().__init__()
        with open(path, "rb") as file:
            head = file.read(8)
        if head.startswith(_ZIP):
            self.archive(path)
        else:
            with _opened(path, head) as unpacked:
                self.add("", "", None, Text(self.spool, unpacked))

    def archive(self, path: str) -> None:
        """The file in an archive; what the system of its maker put beside it does not count."""
        with zipfile.ZipFile(path) as archive:
            held = [
                member
                for member in archive.infolist()
                if not member.is_dir()
                and not member.filename.startswith("__MACOSX/")
                and not member.filename.rpartition("/")[2].startswith(".")
            ]
            if len(held) == 1 and held[0].flag_bits & _ENCRYPTED:
                raise ValueError("it is encrypted, and no password is asked for")
            for member in held:
                if len(held) > 1:
                    self.add("", member.filename, None, np.empty(0))
                else:
                    with archive.open(member) as file:
                        self.add("", member.filename, None, Text(self.spool, file))


def _opened(path: str, head: bytes) -> Any:
    if head.startswith(b"\x1f\x8b"):
        return gzip.open(path)
    if head.startswith(b"BZh"):
        return bz2.open(path)
    if head.startswith(b"\xfd7zXZ"):
        return lzma.open(path)
    import pyarrow

    return pyarrow.input_stream(path, compression="zstd")
