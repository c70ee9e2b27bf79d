"""A file's table before it is a run: header cells, values, and how to name its rows in messages."""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from datetime import UTC, datetime, timedelta
from pathlib import Path
from typing import Any

from fogml.arrays import FloatArray
from fogml.errors import InputError, quoted
from fogml.json_files import parse_json
from fogml.runs.columns import column_spec, parse_header
from fogml.runs.facts import NAMES, Facts, facts_from
from fogml.runs.findings import Finding
from fogml.runs.reader_process import StoredArray, StoredFile
from fogml.yaml_text import parse_yaml

FACTS_KEY = "fogml.facts"
"""Key of the set-up facts (JSON) in Parquet schema metadata, HDF5 attributes and MAT variables."""


_GYROS = frozenset(("gyro", "gyro_x", "gyro_y", "gyro_z"))
BLOCK_VALUES = 10_000_000
"""Numbers of a block at most, 80 MB; two blocks are held at once, and messages of robots have 45 columns."""


def numbered_row(index: int) -> str:
    """A row by its number from 1."""
    return f"row {index + 1}"


def text_column(name: str) -> Finding:
    """What to say of a column that holds no numbers."""
    return Finding("text_column", f"column {quoted(name)} holds no numbers and is left out", column=name)


def facts_from_json(text: str | bytes, source: str) -> Facts:
    """Set-up facts that a file itself states as JSON.

    Raises
    ------
    InputError
        If it is not JSON, or states what is no set-up fact or a wrong value.
    """
    if not isinstance(text, str | bytes):
        raise InputError(f"{source}: the set-up facts are {quoted(text)}, JSON was expected")
    values = parse_json(text, f"{source}: the set-up facts are not JSON", "write the file again")
    return facts_from(values, source)


def embedded_facts(values: Mapping[str, Any], source: str) -> Facts | None:
    """Set-up facts among a file's metadata: JSON under `FACTS_KEY`, else one key per fact.

    Keys that are no facts belong to others and are left alone. Numbers may stand as text, as
    Parquet holds nothing else; `scale_factor` and a heading stand as JSON text.

    Raises
    ------
    InputError
        If a fact's value is not accepted.
    """
    if FACTS_KEY in values:
        return facts_from_json(values[FACTS_KEY], source)
    stated: dict[str, Any] = {}
    for key in Facts.model_fields:
        value = values.get(key)
        if isinstance(value, bytes):
            value = value.decode("utf-8", errors="replace")
        if isinstance(value, str) and key not in NAMES:
            value = parse_yaml(value, f"{source}, key '{key}'")
        if value is not None:
            stated[key] = value
    return facts_from(stated, source) if stated else None


def wanted_cells(cells: Iterable[str], names: Collection[str] | None) -> list[str]:
    """The header cells of time, gyro and the columns `names`, without a gyro those of axes; all for None."""
    held = {cell: parse_header(cell)[0] for cell in cells}
    if names is None:
        return list(held)
    wanted = {"time", "gyro", *names}
    if not wanted & _GYROS & set(held.values()):
        wanted |= _GYROS
    return [cell for cell, name in held.items() if name in wanted]


def vector_fault(array: StoredArray) -> str | None:
    """Why an array is no column of numbers; None where it is one."""
    if array.fault is None and (array.kind not in "fiub" or not array.is_vector):
        shape = " by ".join(str(size) for size in array.shape) or "one value"
        return f"holds {array.type_name} ({shape}), a vector of numbers was expected"
    return array.fault


def choose_vectors(
    file: str, arrays: Sequence[tuple[str, StoredArray]]
) -> tuple[list[tuple[str, StoredArray]], tuple[Finding, ...]]:
    """The columns among named arrays: numeric vectors as long as ``time``.

    Parameters
    ----------
    file
        Base name, for messages.
    arrays
        Header cell and array.

    Returns
    -------
    columns, findings
        Header cells with their arrays; what is left out, of no column of the run format.

    Raises
    ------
    InputError
        If a column of the run format is no numeric vector or differs from ``time`` in length.
    """
    kept: list[tuple[str, StoredArray]] = []
    findings = []
    time = next((array for cell, array in arrays if parse_header(cell)[0] == "time"), None)
    count = None if time is None or time.fault else max(time.shape, default=0)
    for cell, array in arrays:
        name = parse_header(cell)[0]
        fault = vector_fault(array)
        if fault is None and count is not None and max(array.shape) != count:
            fault = f"holds {max(array.shape)} samples, 'time' holds {count}"
        if fault is None:
            kept.append((cell, array))
        elif column_spec(name) is not None:
            raise InputError(
                f"{file}, column '{name}': {fault}; one number per sample, export it again, or read it by a "
                "profile, as 'fogml import --draft' writes one"
            )
        else:
            findings.append(Finding("left_out", f"{quoted(name)} is left out: it {fault}", column=name))
    return kept, tuple(findings)


def stored_blocks(
    stored: StoredFile,
    vectors: Sequence[tuple[str, StoredArray]],
    findings: tuple[Finding, ...],
    facts: Facts | None,
    rows: int | None,
    columns: Collection[str] | None,
) -> Iterator[RawTable]:
    """Vectors of a stored file in blocks of `rows` rows at most, whole for None; time, gyro, `columns` alone.

    Raises
    ------
    InputError
        If the file states more samples than it can hold, or is damaged.
    """
    wanted = wanted_cells((cell for cell, _ in vectors), columns)
    vectors = [(cell, array) for cell, array in vectors if cell in wanted]
    count = max((max(array.shape) for _, array in vectors), default=0)
    stored.limits.check_size(stored.path, float(count) * len(vectors))
    cells = tuple(cell for cell, _ in vectors)
    step = min(rows, max(BLOCK_VALUES // max(len(vectors), 1), 1)) if rows else max(count, 1)
    for start in range(0, max(count, 1), step):
        stop = min(start + step, count)
        values = {cell: stored.read(array, start, stop) for cell, array in vectors}
        yield RawTable(stored.path.name, cells, values, facts, _shifted(numbered_row, start), findings)


def moment(origin_s: object) -> datetime | None:
    """A moment by its seconds since 1970, None where there are none."""
    if not isinstance(origin_s, int | float) or origin_s <= 0.0:
        return None
    return datetime(1970, 1, 1, tzinfo=UTC) + timedelta(seconds=origin_s)


def no_samples(file: str) -> InputError:
    """What to say of a file without rows."""
    return InputError(
        f"{file}: a header and no samples; rows of numbers were expected below it, export it again"
    )


def empty_file(file: str) -> InputError:
    """What to say of a file that holds nothing."""
    return InputError(f"{file}: the file is empty; a header and samples were expected, export it again")


def no_text(file: str) -> InputError:
    """What to say of a file that is no text, and of no other format."""
    return InputError(
        f"{file}: not a text file (it holds control characters); CSV was expected, as it is none of "
        "Parquet, HDF5 and MATLAB"
    )


def unreadable(path: Path, error: OSError) -> InputError:
    """What to say of a file that the system does not read."""
    return InputError(f"{path.name}: cannot be read ({error.strerror or error}); copy it again")


@dataclass(frozen=True)
class RawTable:
    """Columns as a file holds them.

    Attributes
    ----------
    file
        Base name, for messages.
    cells
        Header cells ``name [unit]`` in order.
    columns
        Header cell to values of shape (n,), float64, in the file's units; NaN where a value was
        missing.
    facts
        Set-up facts that the file itself states, if any.
    row_name
        Names the row at an index the way its user finds it.
    findings
        What was noticed so far.
    started
        When the clock was 0, where the file's times are dates.
    called
        What the file calls a column that is another's here, as ``gyro_y`` for ``gyro``.
    """

    file: str
    cells: tuple[str, ...]
    columns: Mapping[str, FloatArray]
    facts: Facts | None = None
    row_name: Callable[[int], str] = numbered_row
    findings: tuple[Finding, ...] = field(default=())
    started: datetime | None = None
    called: Mapping[str, str] = field(default_factory=dict)

    def __len__(self) -> int:
        return len(next(iter(self.columns.values()))) if self.columns else 0

    def noting(self, findings: Iterable[Finding]) -> RawTable:
        """The table with more findings."""
        return replace(self, findings=(*self.findings, *findings))


def _shifted(row_name: Callable[[int], str], start: int) -> Callable[[int], str]:
    """Names rows of a block that begins at the row with index `start`."""
    return lambda i: row_name(start + i)
