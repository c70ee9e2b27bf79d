"""What the acceptance report is tested with."""

from __future__ import annotations

import pytest
import yaml

from fogml.lab.acceptance_rows import read_limits
from fogml.runs.run import Run
from tests.lab.units import Unit


@pytest.fixture(scope="module")
def cycle() -> Run:
    return Unit().run()


@pytest.fixture
def limits(tmp_path):
    def write(**stated):
        path = tmp_path / "limits.yaml"
        path.write_text(yaml.safe_dump({"customer": "ACME", "document": "SPEC 7", "limits": stated}))
        return read_limits(path)

    return write
