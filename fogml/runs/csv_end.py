"""The end of a CSV file: whether a recording was cut off within its last number."""

from __future__ import annotations

import re
from pathlib import Path

from fogml.errors import InputError, quoted
from fogml.runs.csv_dialect import number
from fogml.runs.findings import Finding

_TAIL_BYTES = 1 << 15
_LEAST_LINES = 20


def note_of_end(path: Path) -> list[Finding]:
    """A note where the last line has no end: a recording cut there reads as a shorter number."""
    if _tail(path, 1) in (b"\r", b"\n"):
        return []
    message = "the last line has no line end; if the recording was cut there, its last value may be cut too"
    return [Finding("unfinished_line", message)]


def cut_line(path: Path, separator: str | None, decimal: str) -> str | None:
    """The last line where it is evidently cut within its last number, else None.

    Parameters
    ----------
    path
        The file.
    separator
        Between fields; None for blanks.
    decimal
        Decimal mark.

    Notes
    -----
    It has no end, and its last number has fewer decimals (or, for whole numbers, fewer digits)
    than that of every one of at least 20 lines before it: what wrote these was stopped there.
    """
    tail = _tail(path, _TAIL_BYTES)
    if tail.endswith((b"\r", b"\n")):
        return None
    # The first line of the tail may be a part of one.
    lines = [line for line in re.split(r"[\r\n]+", tail.decode("latin-1"))[1:] if line.strip()]
    fields = [line.rsplit(separator, 1)[-1].strip(' "') for line in lines]
    if len(fields) <= _LEAST_LINES or any(number(field, decimal) is None for field in fields):
        return None
    sizes = [_digits(field, decimal) for field in fields]
    (whole, decimals), before = sizes[-1], sizes[:-1]
    least = min(size[1] for size in before)
    is_cut = decimals < least if least else whole < min(size[0] for size in before)
    return lines[-1] if is_cut else None


def cut_error(path: Path, line: str, cure: str = "--repair drops the row") -> InputError:
    """What to say of a file that ends with such a line, and what else than a new copy helps."""
    shown = quoted(line.strip())
    return InputError(
        f"{path.name}, last line: the file ends in the middle of a number, {shown}; "
        f"copy or export it again, or {cure}"
    )


def _tail(path: Path, size: int) -> bytes:
    with path.open("rb") as file:
        file.seek(max(path.stat().st_size - size, 0))
        return file.read(size)


def _digits(field: str, decimal: str) -> tuple[int, int]:
    """Digits before and after the decimal mark."""
    whole, _, after = re.split("[eE]", field)[0].lstrip("+-").partition(decimal)
    return len(whole), len(after)
