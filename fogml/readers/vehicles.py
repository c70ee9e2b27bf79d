"""Readers of autopilots' logs, ULog and DataFlash: a group for each kind of message and instance."""

from __future__ import annotations

import contextlib
import re
import struct
from collections.abc import Iterator
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fogml.outputs import scratch_folder
from fogml.readers.columns import Container, Rows

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
