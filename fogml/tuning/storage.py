"""Where studies are kept: a journal file for one machine, a database for many."""

from __future__ import annotations

import time
import warnings
import weakref
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any, cast

from fogml.databases import engine_settings, parse_url, shown_url, told_by
from fogml.errors import InputError, install_words
from fogml.folders import refuse_file
from fogml.outputs import folder_to_fill

if TYPE_CHECKING:
    from collections.abc import Iterator

    from optuna.storages import BaseStorage

JOURNAL = "study.journal"
_SECOND_TRIES_S = (0.2, 0.5, 1.0, 2.0)
"""Waits until workers that began at once have made the tables of a database [s]."""


def open_storage(url: str | None, folder: str | Path) -> BaseStorage:
    """The storage of a study.

    Parameters
    ----------
    url
        ``postgresql://user@host/database`` or another URL that SQLAlchemy knows; None for a journal
        file in `folder`.
    folder
        Where the journal lies; made if it is missing.

    Raises
    ------
    InputError
        If the database does not answer, or the file can't be read or written.
    """
    import_optuna()
    return _journal(Path(folder)) if url is None else _database(url)


def shown(url: str | None) -> str:
    """A storage's name without its password."""
    return JOURNAL if url is None else shown_url(url)


def import_optuna() -> Any:
    """Optuna, silenced: what there is to say, fogml says.

    Raises
    ------
    InputError
        If it is not installed.
    """
    try:
        import optuna
    except ImportError:
        raise InputError(f"a sweep needs Optuna: {install_words('sweep')}") from None
    optuna.logging.set_verbosity(optuna.logging.ERROR)
    return optuna


@contextmanager
def journal_to_fill(url: str | None, folder: str | Path) -> Iterator[None]:
    """Let no empty journal, nor the folder made for it, stay where the block fails."""
    if url is not None:
        yield
        return
    with folder_to_fill(folder):
        try:
            yield
        except BaseException:
            path = Path(folder) / JOURNAL
            if path.is_file() and path.stat().st_size == 0:
                path.unlink()
            raise


@contextmanager
def storage_errors(url: str | None) -> Iterator[None]:
    """Turn what a storage raises when it fails into one clear message.

    Raises
    ------
    InputError
        If the storage stops answering or can't be written.
    """
    from optuna.exceptions import StorageInternalError

    failures: tuple[type[BaseException], ...] = (StorageInternalError,)
    if url is not None:
        from sqlalchemy.exc import SQLAlchemyError

        failures += (SQLAlchemyError,)
    try:
        yield
    except failures as error:
        cause: BaseException = error
        while cause.__cause__ is not None:
            cause = cause.__cause__
        told = str(cause).strip().split("\n")[0]
        raise InputError(
            f"storage {shown(url)}: does not answer ({told}); finished trials are kept, run the "
            "command again once it does"
        ) from error
    except OSError as error:
        if error.filename is not None and Path(error.filename).name != JOURNAL:
            raise
        raise InputError(
            f"{JOURNAL}: cannot be written ({error.strerror or error}); finished trials are kept, make room "
            "and run the command again"
        ) from error


def _journal(folder: Path) -> BaseStorage:
    from optuna.storages import JournalStorage
    from optuna.storages.journal import JournalFileBackend

    from fogml.tuning.journal import WholeLines

    refuse_file(folder)
    try:
        folder.mkdir(parents=True, exist_ok=True)
        path = folder / JOURNAL
        with path.open("ab"):
            pass
    except OSError as error:
        raise InputError(f"{folder}: cannot be written ({error.strerror}); choose another --out") from error
    assert issubclass(WholeLines, JournalFileBackend)
    try:
        return JournalStorage(WholeLines(str(path)))
    except (ValueError, KeyError, TypeError, AttributeError, IndexError, AssertionError):
        raise InputError(f"{path}: is no study's journal; move it away, or choose another --out") from None


def _database(url: str) -> BaseStorage:
    from optuna.storages import RDBStorage
    from sqlalchemy.exc import IntegrityError, NoSuchModuleError, ProgrammingError, SQLAlchemyError

    parsed = parse_url(url)
    engine = engine_settings(parsed)
    text = parsed.render_as_string(hide_password=False)
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            for wait_s in _SECOND_TRIES_S:
                try:
                    return _closing(RDBStorage(text, engine_kwargs=engine))
                except (IntegrityError, ProgrammingError):
                    # Somebody else makes the tables at this moment.
                    time.sleep(wait_s)
            return _closing(RDBStorage(text, engine_kwargs=engine))
    except (ImportError, NoSuchModuleError) as error:
        raise InputError(
            f"--storage {shown(url)}: no driver for it ({error}); for PostgreSQL: {install_words('sweep')}"
        ) from None
    except (SQLAlchemyError, OSError, RuntimeError) as error:
        raise InputError(
            f"--storage {shown(url)}: does not answer ({told_by(error)}); start the database, or state "
            "another"
        ) from None


def _closing(storage: Any) -> BaseStorage:
    """The storage, its connections closed once nobody holds it any more."""
    weakref.finalize(storage, storage.engine.dispose)
    return cast("BaseStorage", storage)
