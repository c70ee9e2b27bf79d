"""A small blind suite with gates: what the diagnosis must not fall behind.

The figures of the full suite are under ``experiments/gap_blind``; so few cases bound them loosely.
"""

from __future__ import annotations

from typing import Any

import pytest

from fogml.blind.folders import BlindFolder
from fogml.blind.make import make_cases
from fogml.blind.run import RunPlan, run_cases
from fogml.blind.score import gate, gather
from fogml.blind.scoring.values import score_values

SEED = 20
COUNTS = {"nothing": 1, "one": 2}


@pytest.fixture(scope="module")
def values(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Any]:
    """The score of the small suite."""
    folder = tmp_path_factory.mktemp("blind")
    scored = {}
    for number, (kind, count) in enumerate(COUNTS.items()):
        suite = BlindFolder(folder / kind)
        make_cases(suite.path, count, SEED + number, sample_s=20.0, workers=1, kinds=[kind])
        assert run_cases(RunPlan(suite, workers=1)) == (count, 0)
        scored[kind] = score_values(gather(suite))
    return scored


def _reached(values: dict[str, Any], kind: str, key: str, limit: float) -> None:
    outcome = gate(values[kind], {key: limit}, "diagnosis")[0]
    assert outcome["met"], outcome


def test_nothing_is_named_where_nothing_is_missing(values: dict[str, Any]) -> None:
    _reached(values, "nothing", "nothing_named", 0.0)


def test_single_effects_are_named(values: dict[str, Any]) -> None:
    _reached(values, "one", "one_top", 0.5)


@pytest.mark.parametrize("kind", COUNTS)
def test_classes_are_small(values: dict[str, Any], kind: str) -> None:
    rows = {row["key"]: row for row in values[kind]["methods"]["diagnosis"]["rows"]}
    size = rows["class_size"]["value"]
    assert size is None or size <= 3.0
