"""Databases by their URL: how it is written, shown and opened."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from fogml.errors import InputError, install_words

if TYPE_CHECKING:
    from sqlalchemy.engine import URL

_ANSWER_S = 10
"""Time that a database has to answer when it is opened [s]."""
_SECRETS = frozenset(("password", "passwd", "pwd", "sslpassword"))


def parse_url(url: str, given_as: str = "--storage") -> URL:
    """A database's URL; of PostgreSQL without a driver, psycopg's.

    Parameters
    ----------
    url
        ``postgresql://user@host/database`` or another URL that SQLAlchemy knows.
    given_as
        The option that it was given by, for the message.
    """
    try:
        from sqlalchemy.engine import make_url
        from sqlalchemy.exc import ArgumentError
    except ImportError:
        raise InputError(f"{given_as}: a database needs SQLAlchemy: {install_words('sweep')}") from None
    try:
        parsed = make_url(url)
    except ArgumentError:
        raise InputError(
            f"{given_as}: no URL of a database; write it as postgresql://user@host/database"
        ) from None
    if parsed.drivername in ("postgresql", "postgres"):
        parsed = parsed.set(drivername="postgresql+psycopg")
    return parsed


def engine_settings(url: URL) -> dict[str, Any]:
    """Settings of an engine: connections are tried before they are used, and answer within 10 s."""
    settings: dict[str, Any] = {"pool_pre_ping": True}
    if url.get_backend_name() == "postgresql":
        settings["connect_args"] = {"connect_timeout": _ANSWER_S}
    return settings


def shown_url(url: str) -> str:
    """A URL without its password, for messages."""
    return _without_secrets(url).render_as_string(hide_password=True)


def without_password(url: str) -> str:
    """A URL as it may be written to a file: libpq finds the password in PGPASSWORD or ~/.pgpass."""
    return _without_secrets(url)._replace(password=None).render_as_string(hide_password=False)


def _without_secrets(url: str) -> URL:
    """A URL without the passwords that drivers also take among its options."""
    from sqlalchemy.engine import make_url

    parsed = make_url(url)
    return parsed.difference_update_query([name for name in parsed.query if name.lower() in _SECRETS])


def told_by(error: BaseException) -> str:
    """What a database says of a failure, in one line."""
    return str(getattr(error, "orig", None) or error).strip().split("\n")[0]
