"""When the runs of a diagnosis began, by their facts or one after the other."""

from __future__ import annotations

import time
from datetime import UTC, datetime, timedelta
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from fogml.gap.grids import Grids
from fogml.gap.scene import Scene, outstanding_lines


def rows(first_s: float, span_s: float, row_s: float, started: datetime | None) -> SimpleNamespace:
    time = np.array([first_s, first_s + span_s])
    run = SimpleNamespace(time=time, facts=SimpleNamespace(started=started))
    return SimpleNamespace(run=run, row_s=row_s, since_s=first_s)


def begun(*runs: SimpleNamespace) -> Any:
    return Scene.__dict__["begun_s"].func(SimpleNamespace(runs=runs))


def test_runs_of_unknown_start_come_one_after_the_other() -> None:
    day = datetime(2026, 3, 1, tzinfo=UTC)
    runs = [rows(0.0, 990.0, 10.0, day), rows(50.0, 480.0, 20.0, None), rows(0.0, 100.0, 10.0, None)]
    # Each lasts a row longer than from its first to its last; the second clock shows 50 s when it begins.
    assert begun(*runs) == pytest.approx((0.0, 950.0, 1500.0))


def test_runs_of_known_start_lie_as_stated() -> None:
    day = datetime(2026, 3, 1, tzinfo=UTC)
    runs = [rows(0.0, 990.0, 10.0, day + timedelta(hours=h)) for h in (5.0, 0.0, 30.0)]
    assert begun(*runs) == pytest.approx((18_000.0, 0.0, 108_000.0))


def test_a_line_of_a_quiet_run_stands_out_beside_a_loud_run() -> None:
    """Each run's power counts by its own."""
    rng, seconds = np.random.default_rng(4), 60.0 * np.arange(600)
    line = 0.3 * np.sin(2.0 * np.pi * 2e-3 * seconds)
    gaps = [30.0 * rng.standard_normal(600), 0.1 * rng.standard_normal(600) + line]
    fit = tuple(SimpleNamespace(time_s=seconds, constants=np.ones((600, 1)), gap=gap) for gap in gaps)
    scene: Any = SimpleNamespace(grids=Grids(), fit=fit, span_s=36_000.0, row_s=60.0)
    assert outstanding_lines(scene)[0] == pytest.approx(2e-3, abs=1.0 / 36_000.0)


def test_a_clock_without_a_zone_is_not_put_on_this_machines(monkeypatch: pytest.MonkeyPatch) -> None:
    """Over the change to summer time a day of Berlin has 23 h; a clock that states no zone has 24."""
    monkeypatch.setenv("TZ", "Europe/Berlin")
    time.tzset()
    try:
        runs = [rows(0.0, 990.0, 10.0, datetime(2026, 3, day)) for day in (28, 30)]
        assert begun(*runs) == pytest.approx((0.0, 2.0 * 86_400.0))
    finally:
        monkeypatch.undo()
        time.tzset()
