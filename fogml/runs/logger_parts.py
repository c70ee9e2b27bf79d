"""A logger's text as UTF-8, in parts that end with a line."""

from __future__ import annotations

import codecs
from collections.abc import Iterator
from pathlib import Path

from fogml.errors import InputError
from fogml.runs.raw_table import empty_file

PART_BYTES = 1 << 23
"""Bytes of a text that are looked into at once; a part takes some ten times as much memory."""


def text_parts(path: Path, encoding: str, part_bytes: int) -> Iterator[tuple[bytes, bool]]:
    """Parts of a text, and whether each is the last one.

    Raises
    ------
    InputError
        If the file can't be read, is empty, or is no text of that encoding.
    """
    ready = begun = b""
    read = 0
    only_returns = False
    decoder = codecs.getincrementaldecoder(encoding)()
    try:
        with path.open("rb") as file:
            while raw := file.read(part_bytes):
                text = _decoded(path, decoder, raw, read, encoding)
                if read == 0:
                    text = text.removeprefix("\ufeff")
                    if "\0" in text[:4096]:
                        raise InputError(f"{path.name}: this is a binary file, a text file was expected")
                    only_returns = "\r" in text and "\n" not in text
                text = text.replace("\r", "\n") if only_returns else text
                read += len(raw)
                content = begun + text.encode()
                end = content.rfind(b"\n") + 1
                if end and ready.strip():
                    yield ready, False
                    ready = b""
                ready, begun = ready + content[:end], content[end:]
    except OSError as error:
        raise InputError(f"{path}: cannot be read ({error.strerror}); check the path") from None
    ready += begun + _decoded(path, decoder, b"", read, encoding).encode()
    if not ready.strip():
        raise empty_file(path.name)
    yield ready, True


def _decoded(path: Path, decoder: codecs.IncrementalDecoder, raw: bytes, read: int, encoding: str) -> str:
    before = read - len(decoder.getstate()[0])
    try:
        return decoder.decode(raw, final=not raw)
    except UnicodeError as error:
        place = f"byte {before + error.start}" if isinstance(error, UnicodeDecodeError) else "it"
        raise InputError(
            f"{path.name}: {place} is no {encoding} text; "
            "give the file's encoding in the profile (key 'encoding')"
        ) from None
