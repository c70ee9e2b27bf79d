"""Readers of autopilots' logs, ULog and DataFlash: a group for each kind of message and instance."""

from __future__ import annotations

import contextlib
import re
import struct
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fogml.readers.columns import Column, Container, Kept

_HEADER_BYTES = 3  # of a DataFlash message, before its fields
_TEXT_FIELDS = frozenset("anNZ")
_NO_MULTIPLIERS = (None, 1)
_NUMPY = dict(
    zip("IiHhBbQqefd", ["u4", "i4", "u2", "i2", "u1", "i1", "u8", "i8", "f2", "f4", "f8"], strict=True)
)
# What the units of DataFlash's UNIT messages are called in the run format.
_UNITS = {"rad/s": "rad/s", "deg/s": "deg/s", "degheading": "deg", "s": "s", "us": "us", "µs": "us"}


class ULog(Container):
    """A ULog file (PX4): the fields of each topic and instance, ``name.0`` of arrays; it states no units."""

    def __init__(self, path: str, keys: list[str]) -> None:
        import pyulog

        super().__init__()
        for data in pyulog.ULog(path).data_list:
            group = data.name if data.multi_id == 0 else f"{data.name}.{data.multi_id}"
            for name, values in data.data.items():
                if values.dtype.kind in "fiub":
                    self.add_values(group, name.replace("[", ".").replace("]", ""), None, values)


class DataFlash(Container):
    """A DataFlash log (ArduPilot): the fields of each message type and instance, with the units it states."""

    def __init__(self, path: str, keys: list[str]) -> None:
        from pymavlink.DFReader import DFReader_binary

        super().__init__()
        # What it prints of itself and of clocks that no message has is of no use here.
        with contextlib.suppress(AttributeError):
            self.file = DFReader_binary(path, zero_time_base=True)
        self.content = np.frombuffer(self.file.data_map, dtype=np.uint8)
        self.kept = Kept(self.records, 2)
        for kind, offsets in enumerate(self.file.offsets):
            form = self.file.formats.get(kind)
            if form is not None and len(offsets) and form.name not in ("FMT", "FMTU", "UNIT", "MULT", "PARM"):
                self.message(kind, form)

    def message(self, kind: int, form: Any) -> None:
        """The fields of a message type, each instance a group."""
        records = self.kept(kind)
        instances: list[int | None] = [None]
        if form.instance_field in (records.dtype.names or ()):
            instances = sorted(set(records[form.instance_field].tolist()))
        for instance in instances:
            group = form.name if instance in (None, 0) else f"{form.name}.{instance}"
            for place, name in enumerate(form.columns):
                if form.format[place] in _TEXT_FIELDS:
                    continue
                count = len(records)
                if instance is not None:
                    count = int(np.count_nonzero(records[form.instance_field] == instance))
                stated = str(form.get_unit(name))
                unit = "us" if name == "TimeUS" else _UNITS.get(stated, stated)
                reader = Column(count, partial(self.part, kind, instance, place))
                self.add(group, name, unit, reader)

    def records(self, kind: int) -> NDArray[Any]:
        """The messages of a type, fields by name."""
        form = self.file.formats[kind]
        offsets = np.asarray(self.file.offsets[kind], dtype=np.int64) + _HEADER_BYTES
        size = struct.calcsize(form.msg_struct)
        parts, at = [], 0
        for name, code in zip(form.columns, re.findall(r"\d*[a-zA-Z]", form.msg_struct[1:]), strict=False):
            parts.append((name, f"S{code[:-1]}" if code.endswith("s") else "<" + code, at))
            at += struct.calcsize("<" + code)
        names, formats, places = zip(*parts, strict=True)
        layout = np.dtype({"names": names, "formats": formats, "offsets": places, "itemsize": size})
        offsets = offsets[offsets + size <= len(self.content)]
        return self.content[offsets[:, None] + np.arange(size)].reshape(-1).view(layout)

    def part(self, kind: int, instance: int | None, place: int, start: int, stop: int) -> NDArray[np.float64]:
        """Rows `start` to `stop` of `values`."""
        return self.values(kind, instance, place)[start:stop]

    def values(self, kind: int, instance: int | None, place: int) -> NDArray[np.float64]:
        """A field of an instance's messages, with its multiplier."""
        form = self.file.formats[kind]
        records = self.kept(kind)
        found = records[form.columns[place]].astype(np.float64)
        factor = form.msg_mults[place]
        if factor not in _NO_MULTIPLIERS:
            found = found * factor
        return found if instance is None else found[records[form.instance_field] == instance]

    def close(self) -> None:
        """Let go of the file."""
        super().close()
        del self.content
        self.kept.held.clear()
        with contextlib.suppress(BufferError):
            self.file.close()
