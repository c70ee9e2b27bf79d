"""Where the records of units in service are kept: a Parquet file in a folder, or a database of many stations.

A record is known by its key, so that one that comes twice is kept once, as it came last: a side file that was
mended counts, and a command that was interrupted is run again.
"""

from __future__ import annotations

import errno
import time
from abc import ABC, abstractmethod
from collections.abc import Callable, Mapping, Sequence
from contextlib import ExitStack
from dataclasses import asdict, astuple, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar

import numpy as np

from fogml.databases import engine_settings, parse_url, shown_url, told_by
from fogml.errors import InputError, install_words
from fogml.locks import NO_ROOM, sole_writer
from fogml.monitor.record import NUMBERS, TEXTS, RunRecord
from fogml.outputs import folder_to_fill, whole_file

if TYPE_CHECKING:
    from sqlalchemy import Connection, Engine, Table

FILE = "runs.parquet"
TABLE = "fogml_monitor_runs_2"
SCHEMA = "fogml.monitor-runs/2"
_PAUSES_S = (0.05, 0.1, 0.2, 0.5, 1.0, 2.0)
"""Pauses between tries of a store that is away [s]; the last one again and again."""
Answer = TypeVar("Answer")


class Store(ABC):
    """Records of runs, each once."""

    @abstractmethod
    def add(self, records: Sequence[RunRecord]) -> int:
        """Keep records; how many of them were not there yet. Those that were stand as they came last.

        Raises
        ------
        InputError
            If the store can't be written; then none of them was kept, or they are there already.
        """

    @abstractmethod
    def records(self) -> list[RunRecord]:
        """All records, in no order.

        Raises
        ------
        InputError
            If the store can't be read.
        """

    def close(self) -> None:  # noqa: B027
        """End what connections there are."""


def open_store(place: str, patience_s: float = 60.0) -> Store:
    """A store by its URL, or by its folder.

    Parameters
    ----------
    place
        ``postgresql://user@host/database`` or another URL that SQLAlchemy knows; else a folder.
    patience_s
        How long to try again while the store is away, or another process writes it [s].

    Raises
    ------
    InputError
        If the URL is none.
    """
    return DatabaseStore(place, patience_s) if "://" in place else FolderStore(Path(place), patience_s)


class FolderStore(Store):
    """A Parquet file in a folder; processes write it one after another, whole."""

    def __init__(self, folder: Path, patience_s: float) -> None:
        self.folder, self.patience_s = folder, patience_s
        if folder.exists() and not folder.is_dir():
            raise InputError(f"{folder}: is a file, a folder was expected; choose another --store")

    @property
    def _file(self) -> Path:
        return self.folder / FILE

    def add(self, records: Sequence[RunRecord]) -> int:
        from fogml.runs.reading_limits import DEFAULT_LIMITS

        most = DEFAULT_LIMITS.mark_characters
        for record in records:
            for name in TEXTS:
                if len(getattr(record, name)) > most:
                    raise InputError(
                        f"{record.run}: '{name}' has {len(getattr(record, name))} characters; "
                        f"a store keeps {most}"
                    )

        def write() -> int:
            try:
                with ExitStack() as stack:
                    stack.enter_context(folder_to_fill(self.folder))
                    try:
                        stack.enter_context(sole_writer(self._file))
                    except InputError as error:
                        raise _Away(str(error)) from None
                    held = {record.key: record for record in self._read()}
                    new, other = _to_write(records, held)
                    if new or other:
                        self._write([*(held | other).values(), *new])
                    return len(new)
            except OSError as error:
                # A disk that takes no more takes none a little later.
                kind = InputError if error.errno in (*NO_ROOM, errno.EACCES, errno.EPERM) else _Away
                raise kind(
                    f"--store {self.folder}: cannot be written ({error.strerror or error}); nothing is lost: "
                    "run the command again once it can"
                ) from None

        return _patiently(write, self.patience_s)

    def records(self) -> list[RunRecord]:
        return _patiently(self._read, self.patience_s)

    def _read(self) -> list[RunRecord]:
        from fogml.runs.reader_process import DEFAULT_LIMITS, stored_file

        if not self._file.exists():
            return []
        if not self._file.is_file():
            raise InputError(f"{self._file}: is no ordinary file; choose another --store")
        with stored_file(self._file, "parquet", ("schema",), DEFAULT_LIMITS) as stored:
            arrays = {array.name: array for array in stored.arrays}
            if missing := [name for name in (*TEXTS, *NUMBERS) if name not in arrays]:
                raise InputError(
                    f"{self._file}: column '{missing[0]}' is missing; it is no store of this version of "
                    "fogml monitor: choose another --store, and give the runs again"
                )
            rows = max((max(array.shape) for array in stored.arrays), default=0)
            columns: dict[str, Any] = {name: stored.marks(arrays[name], most=rows).tolist() for name in TEXTS}
            columns |= {name: stored.read(arrays[name], 0, rows).tolist() for name in NUMBERS}
        return [
            RunRecord(**dict(zip(columns, row, strict=True))) for row in zip(*columns.values(), strict=True)
        ]

    def _write(self, records: Sequence[RunRecord]) -> None:
        import pyarrow as pa
        import pyarrow.parquet as pq

        columns: dict[str, Any] = {name: [getattr(r, name) for r in records] for name in TEXTS}
        columns |= {name: np.array([getattr(r, name) for r in records]) for name in NUMBERS}
        table = pa.table(columns).replace_schema_metadata({"schema": SCHEMA})
        with whole_file(self._file) as partial:
            pq.write_table(table, partial)


class DatabaseStore(Store):
    """A table of a database that several stations write."""

    def __init__(self, url: str, patience_s: float) -> None:
        self.url, self.patience_s = url, patience_s
        self._parsed = parse_url(url, "--store")
        self._engine: Engine | None = None

    def add(self, records: Sequence[RunRecord]) -> int:
        from sqlalchemy import insert, update
        from sqlalchemy.exc import IntegrityError

        # A server that goes away may have written what it did not confirm: the next try finds it there.
        added: set[str] = set()

        def write() -> int:
            table, engine = self._open()
            with engine.begin() as connection:
                new, other = _to_write(records, _held(connection, table))
                added.update(record.key for record in new)
                if new:
                    connection.execute(insert(table), [asdict(record) for record in new])
                for key, record in other.items():
                    connection.execute(update(table).where(table.c.key == key), asdict(record))
                return len(added)

        def at_once() -> int:
            try:
                return write()
            except IntegrityError:
                # Another station wrote one of them at this moment: the next try finds it.
                added.clear()
                return write()

        return self._told(at_once)

    def records(self) -> list[RunRecord]:
        def read() -> list[RunRecord]:
            table, engine = self._open()
            with engine.connect() as connection:
                return list(_held(connection, table).values())

        return self._told(read)

    def _open(self) -> tuple[Table, Engine]:
        from sqlalchemy import Column, Float, MetaData, String, Table, create_engine

        table = Table(
            TABLE,
            MetaData(),
            *(Column(name, String, primary_key=name == "key", nullable=False) for name in TEXTS),
            *(Column(name, Float) for name in NUMBERS),
        )
        if self._engine is None:
            engine = create_engine(self._parsed, **engine_settings(self._parsed))
            table.create(engine, checkfirst=True)
            self._engine = engine
        return table, self._engine

    def _told(self, action: Callable[[], Answer]) -> Answer:
        from sqlalchemy.exc import NoSuchModuleError, SQLAlchemyError

        def told() -> Answer:
            try:
                return action()
            except (ImportError, NoSuchModuleError) as error:
                raise InputError(
                    f"--store {shown_url(self.url)}: no driver for it ({error}); for PostgreSQL: "
                    f"{install_words('sweep')}"
                ) from None
            except (SQLAlchemyError, OSError) as error:
                raise _Away(
                    f"--store {shown_url(self.url)}: does not answer ({told_by(error)}); nothing is lost: "
                    "run the command again once it does"
                ) from None

        return _patiently(told, self.patience_s)

    def close(self) -> None:
        if self._engine is not None:
            self._engine.dispose()
            self._engine = None


class _Away(InputError):
    """What waiting may mend."""


def _held(connection: Connection, table: Table) -> dict[str, RunRecord]:
    """A database's records by their keys."""
    from sqlalchemy import select

    rows = connection.execute(select(table)).mappings().all()
    values: list[dict[str, Any]] = [{k: np.nan if v is None else v for k, v in row.items()} for row in rows]
    return {str(one["key"]): RunRecord(**one) for one in values}


def _to_write(
    records: Sequence[RunRecord], held: Mapping[str, RunRecord]
) -> tuple[list[RunRecord], dict[str, RunRecord]]:
    """Records that are new, and by their keys those that differ from what is held, monitored when it was."""
    last = {record.key: record for record in records}
    new = [record for key, record in last.items() if key not in held]
    again = {key: replace(last[key], monitored=held[key].monitored) for key in last if key in held}
    return new, {key: record for key, record in again.items() if not _alike(record, held[key])}


def _alike(one: RunRecord, other: RunRecord) -> bool:
    """Whether two records say the same, one NaN being as another."""
    pairs = zip(astuple(one), astuple(other), strict=True)
    return all(a == b or (a != a and b != b) for a, b in pairs)


def _patiently(action: Callable[[], Answer], patience_s: float) -> Answer:
    """Try again while the store is away or busy."""
    until = time.monotonic() + patience_s
    tries = 0
    while True:
        try:
            return action()
        except _Away:
            pause = _PAUSES_S[min(tries, len(_PAUSES_S) - 1)]
            if time.monotonic() + pause > until:
                raise
            time.sleep(pause)
            tries += 1
