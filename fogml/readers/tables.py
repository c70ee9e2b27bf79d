"""Readers of tables and test-bench recordings: NumPy archives, worksheets, TDMS, MDF4, miniSEED."""

from __future__ import annotations

import csv
import io
from datetime import date, datetime, time, timedelta
from functools import partial
from typing import Any

import numpy as np

from fogml.readers.columns import Column, Container, Kept

_UNIT_PROPERTIES = ("unit_string", "Unit", "unit", "NI_UnitDescription", "Units")


class Npz(Container):
    """A NumPy archive: one array per column, a matrix as its columns; objects are never unpickled."""

    def __init__(self, path: str, keys: list[str]) -> None:
        super().__init__()
        self.file = np.load(path, allow_pickle=False)
        self.held = Kept(self.file.__getitem__, 4)
        for name in self.file.files:
            array = self.file[name]
            if array.dtype.names:
                for field in array.dtype.names:
                    self.add_values(name, field, None, array[field])
            elif array.dtype.kind in "fiub" and array.ndim == 1:
                self.add("", name, None, Column(len(array), partial(self.part, name)))
            elif array.dtype.kind == "M" and array.ndim == 1 and len(array):
                seconds = (array - array[0]) / np.timedelta64(1, "s")
                self.origin_s = float(array[0].astype("datetime64[ns]").astype(np.int64) / 1e9)
                self.add_values("", name, "s", seconds)
            elif array.dtype.kind in "fiub" and array.ndim == 2 and array.shape[1] <= 64:
                for i in range(array.shape[1]):
                    self.add_values(name, f"{name} column {i + 1}", None, array[:, i])

    def part(self, name: str, start: int, stop: int) -> Any:
        """Rows `start` to `stop` of an array."""
        return self.held(name)[start:stop]

    def close(self) -> None:
        """Let go of the file."""
        super().close()
        self.file.close()


class Sheet:
    """A worksheet as the text of a CSV file."""

    ndim = 1
    dtype = np.dtype("S")

    def __init__(self, rows: Any) -> None:
        text = io.StringIO()
        writer = csv.writer(text, lineterminator="\n")
        for row in rows:
            writer.writerow([_cell(value) for value in row])
        self.content = text.getvalue().encode()
        self.shape = (len(self.content),)


class Workbook(Container):
    """A workbook: the text of each worksheet that is not empty, under its name."""

    def __init__(self, path: str, keys: list[str]) -> None:
        from python_calamine import CalamineWorkbook

        super().__init__()
        with CalamineWorkbook.from_path(path) as book:
            for name in book.sheet_names:
                held = book.get_sheet_by_name(name)
                # Rows above the first cell count, as they do in the program that shows them.
                sheet = Sheet([*[[]] * (held.start or (0, 0))[0], *held.iter_rows()])
                if sheet.content.strip(b",\n"):
                    self.add("", name, None, sheet)


def _cell(value: Any) -> str:
    """A cell as text, dates by ISO 8601, whole numbers without decimals."""
    if value is None or isinstance(value, str):
        return (value or "").replace("\0", "")
    if isinstance(value, bool):
        return str(int(value))
    if isinstance(value, float):
        return str(int(value)) if value.is_integer() and abs(value) < 1e15 else repr(value)
    if isinstance(value, datetime):
        return value.isoformat(" ")
    if isinstance(value, timedelta):
        return repr(value.total_seconds())
    return value.isoformat() if isinstance(value, date | time) else str(value)


class Tdms(Container):
    """A TDMS file: groups of channels; the clock of a waveform where no channel is one."""

    def __init__(self, path: str, keys: list[str]) -> None:
        from nptdms import TdmsFile

        super().__init__()
        self.file = TdmsFile.open(path)
        starts = [
            start
            for group in self.file.groups()
            for channel in group.channels()
            if (start := _seconds(channel.properties.get("wf_start_time"))) is not None
        ]
        self.origin_s = min(starts, default=None)
        for group in self.file.groups():
            for channel in group.channels():
                self.channel(group.name, channel)

    def channel(self, group: str, channel: Any) -> None:
        """A channel, and its clock unless the group has one of that length."""
        kind = getattr(channel.dtype, "kind", "O")
        count = len(channel)
        if kind == "M" and count:
            first = channel[0]
            self.add(
                group,
                channel.name,
                "s",
                Column(count, lambda a, b: (channel[a:b] - first) / np.timedelta64(1, "s")),
            )
        if kind not in "fiu" or not count:
            return
        increment = channel.properties.get("wf_increment")
        if increment:
            start = _seconds(channel.properties.get("wf_start_time"))
            begin = float(channel.properties.get("wf_start_offset", 0.0))
            begin += 0.0 if start is None or self.origin_s is None else start - self.origin_s
            clocks = [d for d in self.described if (d["group"], d["name"]) == (group, "time")]
            if not clocks:
                step = float(increment)
                self.add(group, "time", "s", Column(count, lambda a, b: begin + step * np.arange(a, b)))
        unit = next((channel.properties[p] for p in _UNIT_PROPERTIES if p in channel.properties), None)
        self.add(group, channel.name, unit, Column(count, lambda a, b: channel[a:b]))

    def close(self) -> None:
        """Let go of the file."""
        super().close()
        self.file.close()


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
        self.file = MDF(path, use_display_names=False)
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
        """Samples of a channel."""
        found = self.file.get(group=group, index=place, record_offset=start, record_count=stop - start)
        return np.asarray(found.samples, dtype=np.float64)

    def close(self) -> None:
        """Let go of the file."""
        super().close()
        self.file.close()


class MiniSeed(Container):
    """A miniSEED file: one group for each channel, its clock from start and rate of each segment."""

    def __init__(self, path: str, keys: list[str]) -> None:
        from pymseed import MS3TraceList

        super().__init__()
        self.traces = MS3TraceList.from_file(path, unpack_data=True)
        starts = [segment.starttime for trace in self.traces for segment in trace]
        first = min(starts, default=0)
        self.origin_s = first / 1e9
        for trace in self.traces:
            parts = [segment for segment in trace if segment.sampletype in ("i", "f", "d")]
            if not parts:
                continue
            times = [(p.starttime - first) / 1e9 + np.arange(p.numsamples) / p.samprate for p in parts]
            values = [np.asarray(part.np_datasamples, dtype=np.float64) for part in parts]
            # FDSN:NET_STA_LOC_B_S_SS: band, source and subsource make the channel's code.
            code = "".join(trace.sourceid.split("_")[-3:])
            self.add_values(trace.sourceid, "time", "s", np.concatenate(times))
            self.add_values(trace.sourceid, code, "count", np.concatenate(values))
