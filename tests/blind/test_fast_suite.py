"""A small blind suite with gates: what the diagnosis must not fall behind.

The figures of the full suite are under ``experiments/gap_blind``; so few cases bound them loosely.
"""

from __future__ import annotations

from typing import Any

import pytest

from fogml.blind.folders import BlindFolder
from fogml.blind.make import make_cases
from fogml.blind.run import RunPlan, run_cases
from fogml.blind.score import gate, score

SEED = 20
COUNTS = {"nothing": 1, "one": 2}


@pytest.fixture(scope="module")
def values(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Any]:
    """The score of the small suite."""
    suite, first = BlindFolder(tmp_path_factory.mktemp("blind")), 1
    for kind, count in COUNTS.items():
        make_cases(suite.path, count, SEED, sample_s=30.0, workers=1, kinds=[kind], first=first)
        first += count
    assert run_cases(RunPlan(suite, workers=1)) == (sum(COUNTS.values()), 0)
    return score(suite)


@pytest.mark.parametrize(("key", "limit"), [("nothing_named", 0.0), ("one_top", 0.5)])
def test_nothing_is_named_where_nothing_is_missing_and_single_effects_are(
    values: dict[str, Any], key: str, limit: float
) -> None:
    outcome = gate(values, {key: limit}, "diagnosis")[0]
    assert outcome["met"], outcome


def test_classes_are_small(values: dict[str, Any]) -> None:
    rows = {row["key"]: row for row in values["methods"]["diagnosis"]["rows"]}
    size = rows["class_size"]["value"]
    assert size is None or size <= 3.0
