"""Readers of robots' recordings: ROS 1 and 2 bags, MCAP; one group for each topic, its numbers by path."""

from __future__ import annotations

import json
from collections.abc import Iterator
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fogml.readers.columns import Column, Container, Kept

_DEEPEST = 5
_LONGEST_ARRAY = 16
_CLOCK = "time"
_STAMPS = {("sec", "nanosec"), ("secs", "nsecs"), ("sec", "nsec")}


def numbers(message: Any, above: str = "", depth: int = 0) -> Iterator[tuple[str, float]]:
    """The numbers of a message by their paths, those of short arrays by place; stamps as seconds."""
    if isinstance(message, bool | int | float | np.number):
        yield above, float(message)
    elif isinstance(message, dict):
        yield from _fields(message, above, depth)
    elif isinstance(message, list | tuple | np.ndarray):
        if len(message) <= _LONGEST_ARRAY:
            for i, item in enumerate(message):
                yield from numbers(item, f"{above}.{i}", depth + 1)
    elif not isinstance(message, str | bytes | None.__class__):
        known: Any = getattr(message, "__dataclass_fields__", None)
        names = tuple(known or getattr(message, "__slots__", ()))
        yield from _fields({n: getattr(message, n) for n in names if not n.startswith("__")}, above, depth)


def _fields(fields: dict[str, Any], above: str, depth: int) -> Iterator[tuple[str, float]]:
    if tuple(fields) in _STAMPS:
        whole, parts = fields.values()
        yield above, float(whole) + 1e-9 * float(parts)
        return
    if depth < _DEEPEST:
        for name, item in fields.items():
            yield from numbers(item, f"{above}.{name}" if above else str(name), depth + 1)


class Messages(Container):
    """Topics of messages; a topic is unpacked when the first of its columns is asked for."""

    def __init__(self) -> None:
        super().__init__()
        self.kept = Kept(self.unpacked, 2)

    def messages(self, topic: str) -> Iterator[tuple[int, Any]]:
        """Times of recording [ns] and messages of a topic, in order."""
        raise NotImplementedError

    def topic(self, topic: str, kind: str) -> None:
        """The columns of a topic."""
        first = next(self.messages(topic), None)
        if first is None or not (names := [name for name, _ in numbers(first[1])]):
            return
        table = self.kept(topic)
        self.add(topic, _CLOCK, "s", Column(len(table), partial(self.part, topic, 0)))
        for place, name in enumerate(names[:100], start=1):
            reader = Column(len(table), partial(self.part, topic, place))
            self.add(topic, name, None, reader)
            self.described[-1]["type"] = kind

    def part(self, topic: str, place: int, start: int, stop: int) -> Any:
        """Rows `start` to `stop` of a topic's column."""
        return self.kept(topic)[start:stop, place]

    def unpacked(self, topic: str) -> NDArray[np.float64]:
        """Times since the recording began [s] and numbers of a topic, shape (messages, columns)."""
        rows, width = [], None
        for recorded_ns, message in self.messages(topic):
            found = dict(numbers(message))
            width = width if width is not None else list(found)
            stamp = found.get("header.stamp", 0.0)
            # Stamps of 0 are none.
            since = stamp - self.begin_s if stamp > 0.0 else (recorded_ns - self.begin_ns) / 1e9
            rows.append([since, *(found.get(name, np.nan) for name in width[:100])])
        return np.array(rows, dtype=np.float64)

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

        super().__init__()
        place = Path(path)
        place = place.parent if place.suffix == ".db3" else place
        self.file = AnyReader([place], default_typestore=get_typestore(Stores.LATEST))
        self.file.open()
        self.begin_ns = self.file.start_time
        self.origin_s = self.begin_s
        for connection in self.file.connections:
            if connection.msgcount:
                self.topic(connection.topic, connection.msgtype)

    def messages(self, topic: str) -> Iterator[tuple[int, Any]]:
        """As `Messages`."""
        connections = [c for c in self.file.connections if c.topic == topic]
        for connection, recorded_ns, raw in self.file.messages(connections=connections):
            yield recorded_ns, self.file.deserialize(raw, connection.msgtype)

    def close(self) -> None:
        """Let go of the file."""
        super().close()
        self.file.close()


class Mcap(Messages):
    """An MCAP file with messages of ROS 2 or in JSON."""

    def __init__(self, path: str, keys: list[str]) -> None:
        from mcap.reader import make_reader
        from mcap_ros2.decoder import DecoderFactory

        super().__init__()
        self.opened = Path(path).open("rb")  # noqa: SIM115  closed by `close`
        decoders: list[Any] = [DecoderFactory(), _Json()]
        self.file = make_reader(self.opened, decoder_factories=decoders)
        summary = self.file.get_summary()
        if summary is None:
            raise ValueError("no summary at its end")
        self.begin_ns = summary.statistics.message_start_time if summary.statistics else 0
        self.origin_s = self.begin_s
        for channel in summary.channels.values():
            schema = summary.schemas.get(channel.schema_id)
            if channel.message_encoding in ("cdr", "json"):
                self.topic(channel.topic, schema.name if schema else "")

    def messages(self, topic: str) -> Iterator[tuple[int, Any]]:
        """As `Messages`."""
        for _, _, record, message in self.file.iter_decoded_messages(topics=[topic]):
            yield record.log_time, message

    def close(self) -> None:
        """Let go of the file."""
        super().close()
        self.opened.close()


class _Json:
    """Decodes channels of JSON."""

    def decoder_for(self, message_encoding: str, schema: Any) -> Any:
        """The decoder of a channel, None where it is of another encoding."""
        return json.loads if message_encoding == "json" else None
