"""The reader of seismometers' recordings, miniSEED."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np

from fogml.readers.columns import Column, Container


class MiniSeed(Container):
    """A miniSEED file: one group for each channel, its clock from start and rate of each segment.

    The records of a segment are found first, and unpacked when samples of them are asked for.
    """

    def __init__(self, path: str, keys: list[str]) -> None:
        from pymseed import MS3TraceList

        super().__init__()
        self.file = open(path, "rb")  # noqa: SIM115  closed by `close`
        traces = MS3TraceList.from_file(path, unpack_data=False, record_list=True)
        starts = [segment.starttime for trace in traces for segment in trace]
        first = min(starts, default=0)
        self.origin_s = first / 1e9
        for trace in traces:
            parts = [Segment.of(segment, first) for segment in trace]
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
