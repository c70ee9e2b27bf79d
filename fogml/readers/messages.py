"""Readers of robots' recordings: ROS 1 and 2 bags, MCAP; one group for each topic, its numbers by path.

Messages of an MCAP file in the order of their times, a chunk at a time.

A chunk's records are cut by their lengths and sorted together. The library's reader makes an object of each
and keeps them in a heap, which takes more time than decoding them.
"""

from __future__ import annotations

import json
import math
import struct
from bisect import bisect_left
from collections import Counter, defaultdict
from collections.abc import Callable, Collection, Iterable, Iterator, Mapping, Sequence
from functools import cache, partial
from operator import attrgetter, itemgetter
from pathlib import Path
from typing import Any, BinaryIO

from fogml.readers.columns import Column, Container, Rows, numbers, stamps_in, values_of

_RECORD = struct.Struct("<BQ")
"""Kind of a record, and bytes that follow."""
_MESSAGE = struct.Struct("<HIQQ")
"""A message's channel, number, and times of recording and publication [ns]; its content follows."""
_time_of = itemgetter(0)


def messages(
    file: BinaryIO, chunks: Sequence[Any], channels: Collection[int]
) -> Iterator[tuple[int, int, bytes]]:
    """Time of recording [ns], channel and content of each message of some channels."""
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


_MOST_FIELDS = 100
"""Columns of a topic, beside those asked for by name: the widest type that ROS ships holds 41 numbers
(``sensor_msgs/CameraInfo``), an ``Imu`` 39; lists of a message's own may be of any length."""
_STAMPS = ("header.stamp", "stamp", "timestamp")
"""Where a message says when it was taken; it counts where it is a time of seconds and their parts."""
_CLOCK = "time"


class Messages(Container):
    """Topics of messages; a topic is unpacked, block by block, when the first of its columns is asked for."""

    def __init__(self, keys: Collection[str] = ()) -> None:
        super().__init__()
        self.wanted = frozenset(keys)
        self.kept = cache(self.unpacked)
        self.stamps: dict[str, frozenset[str]] = {}
        self.fields: dict[str, tuple[list[str], Callable[[Any], Sequence[float]], int]] = {}

    def messages(self, topic: str) -> Iterator[tuple[int, Any]]:
        """Times of recording [ns] and messages of a topic, in order."""
        raise NotImplementedError

    def topics(self, told: Iterable[tuple[str, str, int]]) -> None:
        """The topics of connections, each with its topic, type and number of messages."""
        kinds: dict[str, str] = {}
        counts: Counter[str] = Counter()
        for topic, kind, count in told:
            kinds.setdefault(topic, kind)
            counts[topic] += count
        for topic, count in counts.items():
            if count:
                self.topic(topic, kinds[topic], count)

    def topic(self, topic: str, kind: str, count: int) -> None:
        """The columns of a topic of so many messages."""
        first = next(self.messages(topic), None)
        held = [] if first is None else [name for name, _ in numbers(first[1])]
        if first is None or not held:
            return
        rest = (name for name in held[_MOST_FIELDS:] if {name, f"{topic}/{name}"} & self.wanted)
        names = [*held[:_MOST_FIELDS], *rest]
        if len(held) > _MOST_FIELDS:
            self.left_out[topic] = len(held), _MOST_FIELDS
        self.fields[topic] = names, values_of(first[1], names), count
        self.stamps[topic] = stamps_in(first[1])
        self.add(topic, _CLOCK, "s", Column(count, partial(self.part, topic, _CLOCK)))
        for place, name in enumerate(names):
            self.add(topic, name, None, Column(count, partial(self.part, topic, str(place))))
            self.described[-1]["type"] = kind

    def part(self, topic: str, field: str, start: int, stop: int) -> Any:
        """Rows `start` to `stop` of a topic's column."""
        return self.kept(topic).read(field, start, stop)

    def unpacked(self, topic: str) -> Rows:
        """Times since the recording began [s] and numbers of a topic, by place."""
        names, values, count = self.fields[topic]
        rows = Rows(self.spool, [(name, "<f8") for name in (_CLOCK, *map(str, range(len(names))))])
        pack = struct.Struct(f"<{1 + len(names)}d").pack
        stamp = next((names.index(name) for name in _STAMPS if name in self.stamps[topic]), None)
        for recorded_ns, message in self.messages(topic):
            found = values(message)
            # Stamps of 0 are none.
            stated = found[stamp] if stamp is not None else 0.0
            since = stated - self.begin_s if stated > 0.0 else (recorded_ns - self.begin_ns) / 1e9
            rows += pack(since, *found)
        if rows.count != count:
            raise ValueError(f"{topic} holds {rows.count} messages, and its index states {count}")
        return rows

    begin_ns = 0

    @property
    def begin_s(self) -> float:
        """When the recording began [s since 1970]."""
        return self.begin_ns / 1e9


class RosBag(Messages):
    """A bag of ROS 1, or of ROS 2 by its database beside ``metadata.yaml``."""

    def __init__(self, path: str, keys: list[str]) -> None:
        from rosbags.highlevel import AnyReader
        from rosbags.typesys import Stores, get_typestore

        super().__init__(keys)
        place = Path(path)
        place = place.parent if place.suffix == ".db3" else place
        self.file = AnyReader([place], default_typestore=get_typestore(Stores.LATEST))
        if not self.file.is2:
            self.file.readers = [_chunk_by_chunk(place)]
        self.file.open()
        self.begin_ns = self.file.start_time
        self.origin_s = self.begin_s
        self.topics((each.topic, each.msgtype, each.msgcount) for each in self.file.connections)

    def messages(self, topic: str) -> Iterator[tuple[int, Any]]:
        """As `Messages`."""
        connections = [c for c in self.file.connections if c.topic == topic]
        for connection, recorded_ns, raw in self.file.messages(connections=connections):
            yield recorded_ns, self.file.deserialize(raw, connection.msgtype)

    def close(self) -> None:
        """Let go of the file."""
        super().close()
        self.file.close()


def _chunk_by_chunk(path: Path) -> Any:
    """The library's reader of ROS 1 bags, which holds the index of one chunk at a time, not of all."""
    from rosbags.rosbag1 import Reader

    class ChunkByChunk(Reader):
        def open(self) -> None:
            super().open()
            counts: dict[int, int] = {}
            for info in self.chunk_infos:
                for connection, count in info.connection_counts.items():
                    counts[connection] = counts.get(connection, 0) + count
            self.connections = [each._replace(msgcount=counts.get(each.id, 0)) for each in self.connections]

        def read_index_data(self, pos: int, indexes: Any) -> None:
            """Leave the index for when its chunk is read."""

        def messages(
            self, connections: Collection[Any] = (), start: int | None = None, stop: int | None = None
        ) -> Any:
            assert self.bio is not None
            wanted = list(connections or self.connections)
            chunks = sorted(self.chunk_infos, key=lambda info: info.start_time)
            ahead: dict[int, list[Any]] = {each.id: [] for each in wanted}
            for place, info in enumerate(chunks):
                found: dict[int, list[Any]] = defaultdict(list)
                chunk = self.chunks[info.pos]
                self.bio.seek(chunk.datapos + chunk.datasize)
                for _ in info.connection_counts:
                    super().read_index_data(info.pos, found)
                until = chunks[place + 1].start_time if place + 1 < len(chunks) else math.inf
                ready: dict[int, list[Any]] = {}
                for number, held in ahead.items():
                    entries = sorted([*held, *found[number]])
                    # What a later chunk may hold messages before waits for it.
                    ready[number] = [entry for entry in entries if entry.time < until]
                    ahead[number] = [entry for entry in entries if entry.time >= until]
                self.indexes = ready
                yield from super().messages(wanted, start, stop)

    return ChunkByChunk(path)


class Mcap(Messages):
    """An MCAP file with messages of ROS 2 or in JSON."""

    def __init__(self, path: str, keys: list[str]) -> None:
        from mcap.reader import make_reader
        from mcap_ros2.decoder import DecoderFactory

        super().__init__(keys)
        self.opened = Path(path).open("rb")  # noqa: SIM115  closed by `close`
        self.decoders: list[Any] = [DecoderFactory(), _Json()]
        self.file = make_reader(self.opened, decoder_factories=self.decoders)
        summary = self.file.get_summary()
        if summary is None:
            raise ValueError("no summary at its end")
        self.begin_ns = summary.statistics.message_start_time if summary.statistics else 0
        self.origin_s = self.begin_s
        self.summary = summary
        counts = summary.statistics.channel_message_counts if summary.statistics else self.counted()
        schemas = summary.schemas
        self.topics(
            (
                one.topic,
                schemas[one.schema_id].name if one.schema_id in schemas else "",
                counts.get(one.id, 0),
            )
            for one in summary.channels.values()
            if one.message_encoding in ("cdr", "json")
        )

    def counted(self) -> Mapping[int, int]:
        """Messages of each channel, where the file does not state them."""
        return Counter(found.channel_id for _, _, found in self.file.iter_messages(log_time_order=False))

    def messages(self, topic: str) -> Iterator[tuple[int, Any]]:
        """As `Messages`; a file without an index of its chunks is read in its own order, not sorted whole."""
        if not self.summary.chunk_indexes:
            for _, _, record, found in self.file.iter_decoded_messages(topics=[topic], log_time_order=False):
                yield record.log_time, found
            return
        channels = {number: one for number, one in self.summary.channels.items() if one.topic == topic}
        decoders = {number: self.decoder(one) for number, one in channels.items()}
        chunks = self.summary.chunk_indexes
        for recorded_ns, number, content in messages(self.opened, chunks, decoders):
            yield recorded_ns, decoders[number](content)

    def decoder(self, channel: Any) -> Callable[[bytes], Any]:
        """What decodes a channel's messages."""
        schema = self.summary.schemas.get(channel.schema_id)
        found = (each.decoder_for(channel.message_encoding, schema) for each in self.decoders)
        decoder = next((each for each in found if each is not None), None)
        if decoder is None:
            raise ValueError(f"{channel.topic} is in {channel.message_encoding}, which is not read")
        return decoder

    def close(self) -> None:
        """Let go of the file."""
        super().close()
        self.opened.close()


class _Json:
    """Decodes channels of JSON."""

    def decoder_for(self, message_encoding: str, schema: Any) -> Any:
        """The decoder of a channel, None where it is of another encoding."""
        return json.loads if message_encoding == "json" else None
