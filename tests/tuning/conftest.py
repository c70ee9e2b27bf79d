"""Small training runs, a small space, and a database."""

from __future__ import annotations

import tempfile
from collections.abc import Iterator
from pathlib import Path

import pytest

from experiments.faults.postgres import postgres, program


@pytest.fixture(scope="session")
def database() -> Iterator[str]:
    """URL of a PostgreSQL server of the tests' own."""
    if program("initdb") is None:
        pytest.skip("PostgreSQL is not installed (.ci/run installs it): no initdb found")
    pytest.importorskip("psycopg", reason="psycopg is not installed: pip install -e '.[sweep]'")
    # Not pytest's own folder: its parents are closed to the user that the server runs as.
    with tempfile.TemporaryDirectory(prefix="fogml-postgres-") as name:
        folder = Path(name)
        folder.chmod(0o755)
        with postgres(folder / "server") as url:
            yield url
