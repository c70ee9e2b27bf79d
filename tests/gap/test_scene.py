"""When the runs of a diagnosis began, by their facts or one after the other."""

from __future__ import annotations

import time
from datetime import UTC, datetime, timedelta
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from fogml.gap.scene import Scene, outstanding_lines
from fogml.gap.settings import Grids
from fogml.gap.unknown import unknown_families


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


class _OfLength(SimpleNamespace):
    """Rows of a run of a length, as what happens in a run's own time asks for them."""

    def __init__(self, count: int, row_s: float) -> None:
        end_s = row_s * (1.0 + np.arange(count))
        super().__init__(end_s=end_s, time_s=end_s - 0.5 * row_s, row_s=row_s)

    def __len__(self) -> int:
        return len(self.end_s)


@pytest.mark.parametrize(
    ("runs", "count", "row_s", "fastest_s"),
    [
        (1, 1200, 30.0, 400.0),  # ten hours
        (1, 1200, 216.0, 864.0),  # three days
        (1, 1200, 2628.0, 10_512.0),  # a month
        (40, 75, 144.0, 600.0),  # many runs of three hours
    ],
)
def test_what_is_in_a_runs_own_time_costs_no_more_than_its_rows(
    runs: int, count: int, row_s: float, fastest_s: float
) -> None:
    held: Any = Scene(tuple(_OfLength(count, row_s) for _ in range(runs)), runs, "tactical")  # type: ignore[arg-type]
    drawn = {f.id: f for f in unknown_families(Grids()) if f.id == "steps" or f.id.startswith("time_")}
    blocks = {id: list(f.build(held.runs[0], held)) for id, f in drawn.items()}
    widest = {id: max(b.columns.shape[1] for b in own) for id, own in blocks.items() if own}
    assert runs * max(widest.values()) <= runs * count / 4.0
    assert count * row_s / max(w for id, w in widest.items() if id != "steps") == pytest.approx(
        fastest_s, rel=0.06
    )
    # None of them is another one once more, and the slowest is always among them.
    waves = [w for id, w in widest.items() if id != "steps"]
    assert len(set(waves)) == len(waves) and "time_7200" in widest
