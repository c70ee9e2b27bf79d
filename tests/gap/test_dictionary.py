"""The unknown as groups of columns: each spans what its words say, and nothing that is not there."""

from __future__ import annotations

import numpy as np
import pytest

from fogml.gap.dictionary import PRICES, unknown_groups
from fogml.gap.observation import observe
from fogml.twin.memory import Memory
from tests.gap.small_model import SmallModel, ramps


@pytest.fixture(scope="module")
def observations():
    runs = [ramps("a", count=1500, step=10.0, turns=3), ramps("b", count=1200, step=10.0, turns=4, high=30.0)]
    return [observe(run, SmallModel()) for run in runs]


@pytest.fixture(scope="module")
def groups(observations):
    return {g.name: g for g in unknown_groups(observations)}


def left_share(group, signals) -> float:
    """Energy of a signal that a group can't show, a constant of its own beside it."""
    columns = np.concatenate(group.columns)
    columns = np.concatenate([columns, np.ones((len(columns), 1))], axis=1)
    signal = np.concatenate(signals)
    signal = signal - signal.mean()
    left = signal - columns @ np.linalg.lstsq(columns, signal, rcond=None)[0]
    return float(left @ left) / float(signal @ signal)


def test_groups_have_words_and_columns_for_every_run(groups, observations):
    for group in groups.values():
        assert group.looks_like
        assert [len(c) for c in group.columns] == [len(o) for o in observations]
        assert len({c.shape[1] for c in group.columns}) == 1
        assert all(np.isfinite(c).all() for c in group.columns)


def test_each_group_spans_its_kind_of_cause_and_others_do_not(groups, observations):
    rise = [np.gradient(o.temperature, o.time) for o in observations]
    # The rate over a minute or so, as a node of that time constant follows it.
    rise = [Memory().lag("r", o.time, r, 100.0) for o, r in zip(observations, rise)]
    signals = {
        "temperature": [np.tanh((o.temperature - 12.0) / 8.0) for o in observations],
        "temperature_rate": [r * (1.0 + 0.02 * o.temperature) for o, r in zip(observations, rise)],
        "direction": [Memory().play("p", o.temperature, 6.0) - o.temperature for o in observations],
        "past": [Memory().lag("l", o.time, o.temperature, 2500.0) - o.temperature for o in observations],
        "start": [np.exp(-(o.time - o.time[0]) / 900.0) for o in observations],
        "time": [np.sqrt((o.time - o.time[0]) / 3600.0) for o in observations],
        "power_cycle": [np.full(len(o), value) for o, value in zip(observations, (0.3, -1.0))],
    }
    for name, signal in signals.items():
        assert left_share(groups[name], signal) < 0.03, name
    assert left_share(groups["temperature"], signals["direction"]) > 0.5
    assert left_share(groups["start"], signals["temperature"]) > 0.5
    assert left_share(groups["time"], signals["temperature"]) > 0.5


def test_wandering_of_each_run_is_its_own(groups, observations):
    slow, fast = groups["time_slow"], groups["time_fast"]
    first, second = slow.columns
    assert not np.any(first[:, np.any(second != 0.0, axis=0)])
    rng = np.random.default_rng(0)
    wander = []
    for o in observations:
        t = o.time - o.time[0]
        waves = [np.sin(2.0 * np.pi * t / rng.uniform(5000.0, 9000.0) + p) for p in rng.uniform(0, 6, 3)]
        wander.append(sum(waves))
    assert left_share(fast, wander) < 0.05
    assert left_share(fast, [np.sin(2.0 * np.pi * o.time / 300.0) for o in observations]) > 0.9


def test_a_power_on_within_a_run_starts_another_constant():
    run = ramps("p", count=600, step=10.0)
    switched = np.where(run.time < 2000.0, 500.0 + run.time, run.time - 2000.0)
    o = observe(run.with_columns(time_on=switched), SmallModel())
    group = next(g for g in unknown_groups([o]) if g.name == "power_cycle")
    assert left_share(group, [np.where(o.time < 2000.0, 0.3, -0.1)]) < 1e-9
    assert left_share(group, [np.where(o.time < 3000.0, 0.3, -0.1)]) > 0.2


def test_groups_are_only_there_where_their_cause_moves():
    still = observe(ramps("s", low=20.0, high=20.5), SmallModel())
    names = {g.name for g in unknown_groups([still])}
    assert "temperature" not in names and "direction" not in names and "table_rate" not in names
    run = ramps("t", count=600)
    rate = np.where(np.arange(600) % 100 < 20, 10.0, 0.0)
    turning = observe(run.with_columns(rate=rate), SmallModel())
    table = next(g for g in unknown_groups([turning]) if g.name == "table_rate")
    assert left_share(table, [np.abs(rate) ** 1.5]) < 0.02


def test_every_price_is_of_a_kind_that_runs_can_show_and_no_other_kind_has_one():
    run = ramps("d", count=900, step=10.0, turns=2)
    told = {"T_case": run.temperature("T") + 1.0, "humidity": 50.0 + 10.0 * np.sin(run.time / 3000.0)}
    o = observe(run.with_columns(rate=np.sin(run.time / 500.0), **told), SmallModel())
    assert {g.name: g.price for g in unknown_groups([o]) if g.price} == PRICES
