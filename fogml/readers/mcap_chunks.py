"""Messages of an MCAP file in the order of their times, a chunk at a time.

A chunk's records are cut by their lengths and sorted together. The library's reader makes an object of each
and keeps them in a heap, which takes more time than decoding them.
"""

from __future__ import annotations

import math
import struct
from bisect import bisect_left
from collections.abc import Collection, Iterator, Sequence
from operator import attrgetter, itemgetter
from typing import Any, BinaryIO

_RECORD = struct.Struct("<BQ")
"""Kind of a record, and bytes that follow."""
_MESSAGE = struct.Struct("<HIQQ")
"""A message's channel, number, and times of recording and publication [ns]; its content follows."""
_time_of = itemgetter(0)


def messages(
    file: BinaryIO, chunks: Sequence[Any], channels: Collection[int]
) -> Iterator[tuple[int, int, bytes]]:
    """Time of recording [ns], channel and content of each message of some channels.

    Parameters
    ----------
    file
        The MCAP file.
    chunks
        The library's indexes of its chunks.
    channels
        Numbers of the channels.
    """
    wanted = frozenset(channels)
    held = [c for c in chunks if not c.message_index_offsets or wanted & c.message_index_offsets.keys()]
    held.sort(key=attrgetter("message_start_time", "chunk_start_offset"))
    ahead: list[tuple[int, int, bytes]] = []
    for place, chunk in enumerate(held):
        ahead += (message for message in _messages_of(_content(file, chunk)) if message[1] in wanted)
        ahead.sort(key=_time_of)
        # What a later chunk may hold messages before waits for it.
        until = held[place + 1].message_start_time if place + 1 < len(held) else math.inf
        ready = bisect_left(ahead, until, key=_time_of)
        yield from ahead[:ready]
        del ahead[:ready]


def _content(file: BinaryIO, chunk: Any) -> bytes:
    """The records of a chunk."""
    from mcap.data_stream import ReadDataStream
    from mcap.records import Chunk
    from mcap.stream_reader import get_chunk_data_stream

    file.seek(chunk.chunk_start_offset + _RECORD.size)
    stream, size = get_chunk_data_stream(Chunk.read(ReadDataStream(file)))
    content: bytes = stream.read(size)
    return content


def _messages_of(content: bytes) -> Iterator[tuple[int, int, bytes]]:
    from mcap.opcode import Opcode

    kind_of_message, at = int(Opcode.MESSAGE), 0
    while at < len(content):
        kind, length = _RECORD.unpack_from(content, at)
        at += _RECORD.size
        if kind == kind_of_message:
            channel, _, recorded_ns, _ = _MESSAGE.unpack_from(content, at)
            yield recorded_ns, channel, content[at + _MESSAGE.size : at + length]
        at += length
