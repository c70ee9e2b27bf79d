"""Readers of tables and test-bench recordings: NumPy archives, TDMS, MDF4."""

from __future__ import annotations

import zipfile
from datetime import datetime
from functools import partial
from typing import Any

import numpy as np

from fogml.readers.columns import BLOCK_BYTES, MOST_COLUMNS, Column, Container, Rows

_UNIT_PROPERTIES = ("unit_string", "Unit", "unit", "NI_UnitDescription", "Units")


class Npz(Container):
    """A NumPy archive: one array per column, a matrix as its columns; objects are never unpickled."""

    def __init__(self, path: str, keys: list[str]) -> None:
        super().__init__()
        self.first: np.datetime64 | None = None
        with zipfile.ZipFile(path) as archive:
            for member in archive.namelist():
                with archive.open(member) as file:
                    self.member(member.removesuffix(".npy"), file)

    def member(self, name: str, file: Any) -> None:
        """The columns of an array that is unpacked as it is read."""
        version = np.lib.format.read_magic(file)
        read_header = getattr(np.lib.format, f"read_array_header_{version[0]}_0", None)
        if read_header is None:
            raise ValueError(f"{name}: an array of version {version[0]}")
        shape, by_columns, kind = read_header(file)
        if kind.names:
            if len(shape) == 1 and not kind.hasobject:
                rows = self.rows(file, kind, shape[0])
                for field in kind.names:
                    if kind[field].kind in "fiub" and not kind[field].shape:
                        self.add_rows(name, field, None, rows, field)
        elif kind.kind in "fiub" and len(shape) in (1, 2) and max(shape) == np.prod(shape) > 1:
            self.add_rows("", name, None, self.rows(file, kind, max(shape)))
        elif kind.kind == "M" and len(shape) == 1 and shape[0]:
            rows = self.rows(file, kind, shape[0])
            if self.first is None:
                self.first = rows.read(None, 0, 1)[0]
                self.origin_s = _seconds(self.first)
            self.add_rows("", name, "s", rows, None, partial(_seconds_since, self.first))
        elif (
            kind.kind in "fiub"
            and len(shape) == 2
            and 0 < shape[1] <= min(shape[0], MOST_COLUMNS - len(self.arrays))
        ):
            names = [f"{name} column {i + 1}" for i in range(shape[1])]
            if by_columns:
                for column in names:
                    part = _Limited(file, shape[0] * kind.itemsize)
                    self.add_rows(name, column, None, self.rows(part, kind, shape[0]))
            else:
                rows = self.rows(file, np.dtype([(column, kind) for column in names]), shape[0])
                for column in names:
                    self.add_rows(name, column, None, rows, column)

        elif kind.kind in "fiu" and np.prod(shape) == 1:
            self.beside[name] = np.frombuffer(file.read(kind.itemsize), kind)
        elif (kind.hasobject or kind.kind in "SU") and np.prod(shape) > 1:
            what = "objects, which may run what they hold" if kind.hasobject else "texts"
            self.refuse(name, f"holds {what}; save it as float64 or datetime64")

    def rows(self, file: Any, kind: np.dtype[Any], count: int) -> Rows:
        """A table of what a file holds from here on, so many rows."""
        rows = Rows(self.spool, kind)
        while part := file.read(BLOCK_BYTES):
            rows += part
        if rows.count != count:
            raise ValueError(f"an array of {count} rows was stated, and {rows.count} are there")
        return rows


class _Limited:
    """The next bytes of a file, and no more."""

    def __init__(self, file: Any, size: int) -> None:
        self.file, self.left = file, size

    def read(self, size: int) -> bytes:
        found: bytes = self.file.read(min(size, self.left))
        self.left -= len(found)
        return found


def _seconds_since(first: np.datetime64, moments: Any) -> Any:
    return (moments - first) / np.timedelta64(1, "s")


class Tdms(Container):
    """A TDMS file: groups of channels; the clock of a waveform where no channel is one."""

    def __init__(self, path: str, keys: list[str]) -> None:
        from nptdms import TdmsFile

        super().__init__()
        self.file = TdmsFile.open(path)
        channels = [(group.name, channel) for group in self.file.groups() for channel in group.channels()]
        starts = [start for _, channel in channels if (start := _begin_s(channel)) is not None]
        # Stamps of before 1970 are none that a clock gave.
        self.origin_s = min([start for start in starts if start > 0.0] or starts, default=None)
        self.clocks: dict[str, tuple[float, float]] = {}
        self.beside = dict(self.file.properties)
        for group in self.file.groups():
            self.beside |= group.properties
        for group, channel in channels:
            self.channel(group, channel)

    def channel(self, group: str, channel: Any) -> None:
        """A channel, and its clock unless the group has that; one of another clock is a group of its own."""
        kind = getattr(channel.dtype, "kind", "O")
        count = len(channel)
        start = _begin_s(channel)
        begin = 0.0 if start is None or self.origin_s is None else start - self.origin_s
        if kind == "M" and count:
            first = channel[0]
            moments = Column(count, lambda a, b: begin + (channel[a:b] - first) / np.timedelta64(1, "s"))
            self.add(group, channel.name, "s", moments)
        if kind not in "fiu" or not count:
            return
        increment = channel.properties.get("wf_increment")
        if increment:
            step = float(increment)
            begin += float(channel.properties.get("wf_start_offset", 0.0))
            clock = next((d for d in self.described if (d["group"], d["name"]) == (group, "time")), None)
            # A recorded clock is of all channels that are as long.
            held = self.clocks.get(group, (begin, step))
            apart = abs(held[0] - begin) > 0.5 * step or abs(held[1] / step - 1.0) > 1e-6
            if clock is not None and (apart or clock["shape"] != [count]):
                group, clock = f"{group}/{channel.name}", None
            if clock is None:
                self.clocks[group] = begin, step
                self.add(group, "time", "s", Column(count, lambda a, b: begin + step * np.arange(a, b)))
        unit = next((channel.properties[p] for p in _UNIT_PROPERTIES if p in channel.properties), None)
        self.add(group, channel.name, unit, Column(count, lambda a, b: channel[a:b]))

    def close(self) -> None:
        """Let go of the file."""
        super().close()
        self.file.close()


def _begin_s(channel: Any) -> float | None:
    """Seconds from 1970 to a waveform's beginning, or to the first of a channel of stamps; None of others."""
    if getattr(channel.dtype, "kind", "O") == "M" and len(channel):
        return _seconds(channel[0])
    return _seconds(channel.properties.get("wf_start_time"))


def _seconds(moment: Any) -> float | None:
    """Seconds since 1970 of a date."""
    if isinstance(moment, np.datetime64):
        return float(moment.astype("datetime64[ns]").astype(np.int64) / 1e9)
    return float(moment.timestamp()) if isinstance(moment, datetime) else None


class Mdf(Container):
    """An MDF4 file: channel groups, each with its master clock."""

    def __init__(self, path: str, keys: list[str]) -> None:
        from asammdf import MDF

        super().__init__()
        # Given a path, the library unpacks a channel of over 200 MB whole for each part of it.
        self.opened = open(path, "rb")  # noqa: SIM115  closed by `close`
        self.file = MDF(self.opened, use_display_names=False)
        self.origin_s = _seconds(self.file.start_time)
        groups: Any = self.file.groups
        for index, group in enumerate(groups):
            count = int(group.channel_group.cycles_nr)
            named = getattr(group.channel_group, "acq_name", None) or f"group {index}"
            master = self.file.masters_db.get(index)
            for place, channel in enumerate(group.channels):
                if count and channel.channel_type in (0, 2, 3):
                    is_clock = place == master
                    conversion = getattr(channel, "conversion", None)
                    unit = channel.unit or (conversion.unit if conversion else "") or None
                    reader = Column(count, partial(self.samples, index, place))
                    self.add(named, "time" if is_clock else channel.name, "s" if is_clock else unit, reader)

    def samples(self, group: int, place: int, start: int, stop: int) -> Any:
        """Samples of a channel, NaN where they are marked invalid."""
        # Otherwise the library leaves out what is invalid, and later samples move up.
        found, invalid = self.file.get(
            group=group, index=place, record_offset=start, record_count=stop - start,
            samples_only=True, ignore_invalidation_bits=True,
        )  # fmt: skip
        samples = np.asarray(found, dtype=np.float64)
        return samples if invalid is None else np.where(invalid, np.nan, samples)

    def close(self) -> None:
        """Let go of the file."""
        super().close()
        self.file.close()
        self.opened.close()
