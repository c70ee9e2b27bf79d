"""Readers of autopilots' logs, ULog and DataFlash, and of seismometers' recordings, miniSEED.

An autopilot's log has a group for each kind of message and instance, a seismometer's one for each channel.
"""

from __future__ import annotations

import contextlib
import re
import struct
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fogml.outputs import scratch_folder
from fogml.readers.columns import Column, Container, Rows

_HEADER, _HEADER_BYTES = b"\xa3\x95", 3  # of a DataFlash message, with its type before its fields
_FORMAT_TYPE, _FORMAT_BYTES = 0x80, 89  # of the message that defines the others
_DEFINING = ("FMT", "FMTU", "UNIT", "MULT")
_READ_BYTES = 1 << 19
_TEXT_FIELDS = frozenset("anNZ")
_NO_MULTIPLIERS = (None, 1)
# What the units of DataFlash's UNIT messages are called in the run format.
_UNITS = {"rad/s": "rad/s", "deg/s": "deg/s", "degheading": "deg", "s": "s", "us": "us", "µs": "us"}


class ULog(Container):
    """A ULog file (PX4): the fields of each topic and instance, ``name.0`` of arrays; it states no units."""

    def __init__(self, path: str, keys: list[str]) -> None:
        import pyulog

        super().__init__()
        tables: dict[tuple[str, int], Rows] = {}
        spool = self.spool

        class Streamed(pyulog.ULog):
            """The library's reader, whose messages go into tables as they come."""

            class _MessageAddLogged(pyulog.ULog._MessageAddLogged):
                def __init__(self, *told: Any) -> None:
                    super().__init__(*told)
                    rows = tables.get((self.message_name, self.multi_id))
                    if rows is None or rows.layout != self.dtype:
                        rows = Rows(spool, self.dtype)
                    tables[self.message_name, self.multi_id] = rows
                    self.buffer = _Appended(rows)

        Streamed(path)
        for (topic, instance), rows in sorted(tables.items()):
            group = topic if instance == 0 else f"{topic}.{instance}"
            for name in rows.layout.names if rows.count else ():
                if rows.layout[name].kind in "fiub":
                    self.add_rows(group, name.replace("[", ".").replace("]", ""), None, rows, name)


class _Appended:
    """A table as the library's buffer of a topic: it is added to, and looks empty when all is read."""

    def __init__(self, rows: Rows) -> None:
        self.rows = rows

    def __iadd__(self, content: bytes) -> _Appended:
        self.rows += content
        return self

    def __len__(self) -> int:
        return 0


class DataFlash(Container):
    """A DataFlash log (ArduPilot): the fields of each message type and instance, with the units it states."""

    def __init__(self, path: str, keys: list[str]) -> None:
        super().__init__()
        lengths, definitions = _message_lengths(path)
        formats = _formats(definitions)
        tables = {
            kind: Rows(self.spool, layout)
            for kind, form in formats.items()
            if form.name not in (*_DEFINING, "PARM") and (layout := _layout(form, lengths[kind])) is not None
        }
        for kind, content in _messages(path, lengths):
            if kind in tables:
                tables[kind] += content
        for kind, rows in tables.items():
            if rows.count:
                self.message(formats[kind], rows)

    def message(self, form: Any, rows: Rows) -> None:
        """The fields of a message type, each instance a group."""
        for instance, own in self.instances(form, rows):
            group = form.name if instance in (None, 0) else f"{form.name}.{instance}"
            for place, name in enumerate(form.columns):
                if form.format[place] in _TEXT_FIELDS or name not in (own.layout.names or ()):
                    continue
                stated = str(form.get_unit(name))
                unit = "us" if name == "TimeUS" else _UNITS.get(stated, stated)
                self.add_rows(group, name, unit, own, name, partial(_scaled, form.msg_mults[place]))

    def instances(self, form: Any, rows: Rows) -> list[tuple[Any, Rows]]:
        """The rows of each instance, where the type has several."""
        name = form.instance_field
        if name not in (rows.layout.names or ()) or rows.layout[name].kind not in "iu":
            return [(None, rows)]
        found: dict[Any, Rows] = {}
        for start in range(0, rows.count, rows.block):
            stop = min(start + rows.block, rows.count)
            part = np.empty(stop - start, rows.layout)
            for field in rows.layout.names or ():
                part[field] = rows.read(field, start, stop)
            for instance in np.unique(part[name]).tolist():
                found.setdefault(instance, Rows(self.spool, rows.layout)).add(part[part[name] == instance])
        return sorted(found.items())


def _scaled(factor: Any, values: NDArray[Any]) -> NDArray[np.float64]:
    """A field's values with its multiplier."""
    found = values.astype(np.float64)
    return found if factor in _NO_MULTIPLIERS else found * factor


def _layout(form: Any, length: int) -> Any:
    """The fields of a message type in the bytes behind its header; None where they don't fit in it."""
    size, at, parts = length - _HEADER_BYTES, 0, []
    for name, code in zip(form.columns, re.findall(r"\d*[a-zA-Z]", form.msg_struct[1:]), strict=False):
        parts.append((name, f"S{code[:-1]}" if code.endswith("s") else "<" + code, at))
        at += struct.calcsize("<" + code)
    if not parts or at > size or len({name for name, *_ in parts}) < len(parts):
        return None
    names, formats, places = zip(*parts, strict=True)
    return np.dtype({"names": names, "formats": formats, "offsets": places, "itemsize": size})


def _messages(path: str, lengths: dict[int, int]) -> Iterator[tuple[int, bytes]]:
    """Type and content of each message whose length is known, read block by block.

    A message begins with two fixed bytes and its type; where these are not found, reading goes on at the next
    place that has them. `lengths` may grow meanwhile.
    """
    with open(path, "rb") as file:
        rest = b""
        while part := file.read(_READ_BYTES):
            part, at = rest + part, 0
            while at + _HEADER_BYTES <= len(part):
                length = lengths.get(part[at + 2], 0) if part.startswith(_HEADER, at) else 0
                if length < _HEADER_BYTES:
                    found = part.find(_HEADER, at + 1)
                    at = found if found >= 0 else len(part) - 1
                    continue
                if at + length > len(part):
                    break
                yield part[at + 2], part[at + _HEADER_BYTES : at + length]
                at += length
            rest = part[at:]


def _message_lengths(path: str) -> tuple[dict[int, int], bytes]:
    """The length of each message type, and the messages that define types, units and multipliers."""
    lengths, defining, held = {_FORMAT_TYPE: _FORMAT_BYTES}, {_FORMAT_TYPE}, bytearray()
    for kind, content in _messages(path, lengths):
        if kind in defining:
            held += _HEADER + bytes([kind]) + content
        if kind == _FORMAT_TYPE:
            lengths[content[0]] = content[1]
            if content[2:6].rstrip(b"\0").decode("ascii", errors="replace") in _DEFINING:
                defining.add(content[0])
    return lengths, bytes(held)


def _formats(definitions: bytes) -> dict[int, Any]:
    """The library's formats, units and multipliers by message type, from the messages that define these."""
    from pymavlink.DFReader import DFReader_binary

    with scratch_folder() as folder:
        (folder / "log.bin").write_bytes(definitions)
        # What it prints of itself and of clocks that no message has is of no use here.
        reader = DFReader_binary.__new__(DFReader_binary)
        with contextlib.suppress(AttributeError):
            reader.__init__(str(folder / "log.bin"), zero_time_base=True)
        formats: dict[int, Any] = reader.formats
        with contextlib.suppress(BufferError):
            reader.close()
    return formats


class MiniSeed(Container):
    """A miniSEED file: one group for each channel, its clock from start and rate of each segment.

    The records of a segment are found first, and unpacked when samples of them are asked for.
    """

    def __init__(self, path: str, keys: list[str]) -> None:
        from pymseed import MS3TraceList

        super().__init__()
        self.file = open(path, "rb")  # noqa: SIM115  closed by `close`
        traces = MS3TraceList.from_file(path, unpack_data=False, record_list=True)
        # Messages of the logger have no rate.
        sampled = [[segment for segment in trace if segment.samprate > 0.0] for trace in traces]
        first = min((segment.starttime for segments in sampled for segment in segments), default=0)
        self.origin_s = first / 1e9
        for trace, segments in zip(traces, sampled, strict=True):
            parts = [Segment.of(segment, first) for segment in segments]
            parts = [part for part in parts if part.ends[-1] and part.is_of_numbers(self.file)]
            if not parts:
                continue
            # FDSN:NET_STA_LOC_B_S_SS: band, source and subsource make the channel's code.
            code = "".join(trace.sourceid.split("_")[-3:])
            ends = np.cumsum([part.ends[-1] for part in parts])
            for name, unit, read in (("time", "s", Segment.times), (code, "count", self.samples)):
                reader = partial(_across, parts, ends, read)
                self.add(trace.sourceid, name, unit, Column(int(ends[-1]), reader))
        traces.close()

    def samples(self, segment: Segment, start: int, stop: int) -> Any:
        """Samples of a segment."""
        return segment.samples(self.file, start, stop)

    def close(self) -> None:
        """Let go of the file."""
        super().close()
        self.file.close()


def _across(parts: list[Segment], ends: Any, read: Callable[..., Any], start: int, stop: int) -> Any:
    """Rows of segments that come one after the other."""
    found = [np.empty(0)]
    for part, end in zip(parts, ends, strict=True):
        begin = end - part.ends[-1]
        if begin < stop and start < end:
            found.append(read(part, max(start - begin, 0), min(stop, end) - begin))
    return np.concatenate(found)


@dataclass(frozen=True)
class Segment:
    """Records without a gap: begin, interval [s]; place, length [bytes] of each, samples up to its end."""

    begin_s: float
    interval_s: float
    places: Any
    lengths: Any
    ends: Any

    @classmethod
    def of(cls, segment: Any, first_ns: int) -> Segment:
        """A segment of the library's list, its begin counted from a moment."""
        held = [(one.fileoffset, one.record.reclen, one.record.samplecnt) for one in segment.recordlist]
        places, lengths, counts = np.array(held, dtype=np.int64).reshape(-1, 3).T
        begin_s = (segment.starttime - first_ns) / 1e9
        return cls(begin_s, 1.0 / segment.samprate, places, lengths, np.cumsum(counts))

    def is_of_numbers(self, file: Any) -> bool:
        """Whether its samples are no text."""
        return self.record(file, 0).sampletype in ("i", "f", "d")

    def times(self, start: int, stop: int) -> Any:
        """Times of samples [s]."""
        return self.begin_s + self.interval_s * np.arange(start, stop)

    def samples(self, file: Any, start: int, stop: int) -> Any:
        """Samples from one place to another."""
        first, last = np.searchsorted(self.ends, (start, stop - 1), side="right").tolist()
        parts = [np.array(self.record(file, i).np_datasamples) for i in range(first, last + 1)]
        begin = int(self.ends[first - 1]) if first else 0
        return np.concatenate(parts).astype(np.float64)[start - begin : stop - begin]

    def record(self, file: Any, number: int) -> Any:
        """A record with its samples."""
        from pymseed import MS3Record

        file.seek(int(self.places[number]))
        return MS3Record.parse(file.read(int(self.lengths[number])), unpack_data=True)
