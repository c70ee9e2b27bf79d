"""A PostgreSQL server for tests: a cluster of its own in a folder, on a free port of this machine."""

from __future__ import annotations

import os
import shutil
import socket
import subprocess
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

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
    """Start a server; its URL. Root may not run one, so it runs as nobody there."""
    port, data, log = free_port(), folder / "data", folder / "log"
    folder.mkdir(parents=True, exist_ok=True)
    user: dict[str, object] = {}
    if os.geteuid() == 0:
        import pwd

        nobody = pwd.getpwnam("nobody")
        os.chown(folder, nobody.pw_uid, nobody.pw_gid)
        user = {"user": nobody.pw_uid, "group": nobody.pw_gid, "extra_groups": []}

    def run(*words: str) -> None:
        subprocess.run(
            words,
            check=True,
            stdin=subprocess.DEVNULL,
            stdout=subprocess.DEVNULL,
            cwd="/",
            timeout=60,
            **user,
        )

    initdb, control = program("initdb"), program("pg_ctl")
    assert initdb and control
    run(initdb, "-D", str(data), "-U", "fogml", "-A", "trust", "--no-sync", "-E", "UTF8", "--locale=C")
    options = f"-p {port} -c listen_addresses=127.0.0.1 -c unix_socket_directories='' -c fsync=off"
    run(control, "-D", str(data), "-l", str(log), "-w", "-o", options, "start")
    try:
        yield f"postgresql://fogml@127.0.0.1:{port}/postgres"
    finally:
        run(control, "-D", str(data), "-m", "immediate", "stop")
