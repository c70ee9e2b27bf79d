"""A PostgreSQL server: a cluster of its own in a folder, on a free port of this machine."""

from __future__ import annotations

import os
import shutil
import socket
import subprocess
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

_HOMES = ("/usr/lib/postgresql", "/usr/local/pgsql")


def program(name: str) -> str | None:
    """A program of PostgreSQL: on the path, or where Debian puts it; the newest version."""
    found = shutil.which(name)
    if found:
        return found
    installed = [path for home in _HOMES for path in Path(home).glob(f"**/bin/{name}")]
    return str(max(installed, key=_version)) if installed else None


def _version(path: Path) -> list[int]:
    return [int(part) for part in path.parts if part.isdigit()]


def free_port() -> int:
    """A port that nothing listens on."""
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        return int(probe.getsockname()[1])


@contextmanager
def postgres(folder: Path) -> Iterator[str]:
    """Start a server; its URL."""
    port, data, log = free_port(), folder / "data", folder / "log"
    folder.mkdir(parents=True, exist_ok=True)
    if user := _user():
        os.chown(folder, user["user"], user["group"])
    initdb = program("initdb")
    assert initdb
    _run(initdb, "-D", str(data), "-U", "fogml", "-A", "trust", "--no-sync", "-E", "UTF8", "--locale=C")
    options = f"-p {port} -c listen_addresses=127.0.0.1 -c unix_socket_directories='' -c fsync=off"
    _control(data, "-l", str(log), "-w", "-o", options, "start")
    try:
        yield f"postgresql://fogml@127.0.0.1:{port}/postgres"
    finally:
        _control(data, "-m", "immediate", "stop")


def restart(folder: Path) -> None:
    """End the server in a folder as a crash would, and start it again with the same options."""
    _control(folder / "data", "-l", str(folder / "log"), "-w", "-m", "immediate", "restart")


def _control(data: Path, *words: str) -> None:
    control = program("pg_ctl")
    assert control
    _run(control, "-D", str(data), *words)


def _user() -> dict[str, Any]:
    """Whom the server runs as: root may not run one, so nobody there."""
    if os.geteuid() != 0:
        return {}
    import pwd

    nobody = pwd.getpwnam("nobody")
    return {"user": nobody.pw_uid, "group": nobody.pw_gid, "extra_groups": []}


def _run(*words: str) -> None:
    quiet = subprocess.DEVNULL
    subprocess.run(words, check=True, stdin=quiet, stdout=quiet, cwd="/", timeout=60, **_user())
