"""The last net: an error that nobody expected becomes one line and a report file."""

from __future__ import annotations

import os
import platform
import shlex
import tempfile
import traceback
from collections.abc import Sequence
from datetime import UTC, datetime
from itertools import pairwise
from pathlib import Path

from fogml import __version__
from fogml.entry_points import others
from fogml.errors import printable

_FRAMES = 50
# Innermost frames that a report holds.


def report_unexpected(error: BaseException, arguments: Sequence[str]) -> str:
    """Write a report of an error, and give the line that says so.

    The report holds the traceback, the version, the command line and the platform; no data. It is
    written beside the command's output, else among temporary files.
    """
    text = printable(str(error).strip().split("\n")[0])
    line = f"fogml: unexpected error ({type(error).__name__}{': ' if text else ''}{text})"
    path = _written(_report(error, arguments), arguments)
    where = f"report written to {path}" if path else "no report could be written"
    if (package := _raised_by(error)) is not None:
        return (
            f"{line} in {package}, which is no part of fogml: {where}; please send it to the makers of "
            f"{package}: the checks of fogml.testing say what is expected of what it adds"
        )
    return f"{line}: {where}; please send it to the authors"


def _raised_by(error: BaseException) -> str | None:
    """The package of others that adds to fogml and whose code an error came through; None for none."""
    added = others()
    through = [frame.f_globals.get("__name__", "") for frame, _ in traceback.walk_tb(error.__traceback__)]
    return next((added[top] for name in through if (top := name.partition(".")[0]) in added), None)


def _report(error: BaseException, arguments: Sequence[str]) -> str:
    # A recursion's thousand frames say no more than its ends.
    trace = "".join(traceback.TracebackException.from_exception(error, limit=-_FRAMES, compact=True).format())
    return "\n".join(
        [
            f"fogml {__version__}",
            f"command: {shlex.join(['fogml', *arguments])}",
            f"platform: {platform.platform()}, Python {platform.python_version()}",
            f"time: {datetime.now(UTC).isoformat(timespec='seconds')}",
            "",
            trace,
        ]
    )


def _written(text: str, arguments: Sequence[str]) -> Path | None:
    """Where the report lies; None if it can be written nowhere."""
    for folder in (_beside_output(arguments), Path(tempfile.gettempdir())):
        if folder is None:
            continue
        try:
            handle, name = tempfile.mkstemp(".txt", f"fogml-report-{os.getpid()}-", folder.absolute())
            with open(handle, "w", encoding="utf-8", errors="backslashreplace") as file:
                file.write(text)
        except OSError:
            continue
        return Path(name)
    return None


def _beside_output(arguments: Sequence[str]) -> Path | None:
    """The parent of what ``--out`` names; None where it is not given."""
    for option, value in pairwise(arguments):
        if option in ("-o", "--out"):
            return Path(value).parent
    stated = [text.partition("=")[2] for text in arguments if text.startswith("--out=")]
    return Path(stated[0]).parent if stated else None
