"""What reading a file of strangers may take."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path

from fogml.errors import InputError
from fogml.numerals import short


@dataclass(frozen=True)
class ReadingLimits:
    """What reading a file may take before it counts as damaged.

    Attributes
    ----------
    cpu_s
        Time of computing for one answer [s]: a catalogue, or one column's samples of a block. A million
        samples take 0.1 s; ten slow machines' worth of that is spared.
    cpu_s_per_mb
        More of it for each megabyte of the file [s]; variables of MATLAB files are unpacked whole, at over
        50 MB/s.
    wall_s
        Time for one answer by the clock [s], for a drive that does not answer; twice the time of computing
        that the file's size allows comes on top, as other programs may want the processor too.
    memory_mb
        Memory beside that of the program itself [MB]: a block of a million rows of 30 columns takes 240.
    memory_per_byte
        More of it for each byte of the file: a variable of a MATLAB file is held whole, and recorded noise
        does not pack to less than a tenth.
    expansion
        Most bytes that a byte of the file stands for; deflate's own limit is 1032 (zlib technical details).
    spare_mb
        What a file may stand for in any case [MB].
    long_mb
        A larger file [MB], or a Parquet file of more values, is not read into memory: its columns go block by
        block into temporary files (``TMPDIR``). Smaller ones are quicker to hold; a run of them takes a few
        times as much while it is looked into.
    repair_mb
        Largest file [MB] that `repair` takes, which holds it whole and several times over; of Parquet what
        its values take.
    mark_characters
        Of a text in a column, such as a unit's name or a mark: those of laboratories have some tens.
    """

    cpu_s: float = 10.0
    cpu_s_per_mb: float = 0.2
    wall_s: float = 600.0
    memory_mb: float = 1024.0
    memory_per_byte: float = 20.0
    expansion: float = 1032.0
    spare_mb: float = 16.0
    long_mb: float = 64.0
    repair_mb: float = 1000.0
    mark_characters: int = 1000

    def at_least(self, cpu_s_per_mb: float, memory_per_byte: float) -> ReadingLimits:
        """The limits for a format that takes so much more than others."""
        return replace(
            self,
            cpu_s_per_mb=max(self.cpu_s_per_mb, cpu_s_per_mb),
            memory_per_byte=max(self.memory_per_byte, memory_per_byte),
        )

    def check_repair(self, path: Path, size_mb: float) -> None:
        """Refuse to repair a file that is too long to be held."""
        if size_mb > self.repair_mb:
            raise InputError(
                f"{path.name}: {size_mb:.0f} MB, and --repair holds a file in memory, up to "
                f"{self.repair_mb:.0f} MB; cut it into legs by an import profile, and repair those that "
                "need it"
            )

    def unpacked(self, path: Path) -> int:
        """Most bytes that a file may stand for."""
        size = path.stat().st_size if path.exists() else 0
        return int(self.expansion * size + 1e6 * self.spare_mb)

    def check_size(self, path: Path, values: float) -> None:
        """Refuse a file that states more values of 8 bytes than it can hold."""
        if 8.0 * values > self.unpacked(path):
            raise InputError(
                f"{path.name}: damaged: it states {short(values)} values, more than a file of its size can "
                "hold; copy or export it again"
            )


DEFAULT_LIMITS = ReadingLimits()
