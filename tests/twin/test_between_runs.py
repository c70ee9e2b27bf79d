"""What a unit remembers from run to run, and over a time without power."""

from __future__ import annotations

from dataclasses import replace
from datetime import UTC, datetime, timedelta

import numpy as np
import pytest

from fogml.errors import InputError
from fogml.gap.diagnosis import with_epoch
from fogml.runs.facts import Facts
from fogml.runs.run import Run
from fogml.twin.effect import NoiseEffect, SensorEffect, ThermalEffect
from fogml.twin.inputs import Inputs
from fogml.twin.registry import effect, effects
from fogml.twin.replay import replay
from fogml.twin.replay_after import Storage, replay_after, storage_times
from fogml.twin.set_up import SensorErrors, Sensors
from fogml.twin.simulate import simulate
from fogml.twin.twin import Twin
from fogml.twin.twin_file import load_twin

BEGUN = datetime(2026, 3, 2, 8, 0, tzinfo=UTC)
RAMP = [{"ramp to 55 degC at 1 degC/min": ["turn at 10 deg/s for 60 s from minute 10"]}]
DOWN = [{"soak at 25 degC for 60 min": ["turn at -10 deg/s for 60 s from minute 10"]}]
REMEMBERING = (
    "thermal_hysteresis",
    "stress_relaxation",
    "moisture",
    "ageing",
    "warmup_bias",
    "sf_hysteresis",
    "hidden_thermal_node",
    "shupe_winding",
    "axial_gradient",
    "rate_ramp",
)


def facts(hours: float = 0.0) -> Facts:
    started = BEGUN + timedelta(hours=hours)
    return Facts(unit="FOG-1", latitude=39.9, input_axis="up", started=started)


def unit(*ids: str) -> Twin:
    twin = Twin("unit", plant=load_twin("tactical").plant)
    for id in ids:
        twin = twin.with_effect(id)
    return twin


def test_a_minute_off_brings_back_a_minutes_worth_of_the_warm_up() -> None:
    """An exponential that fades while on and comes back while off, integrated in small steps."""
    time = np.arange(0.0, 7200.0)
    windows = ((0.0, 3600.0), (3660.0, 5000.0), (6500.0, np.inf))
    given = Inputs(
        time,
        {"T": np.full(len(time), 25.0)},
        np.zeros(len(time)),
        powered_on_s=0.0,
        power_ons_s=(3660.0, 6500.0),
        power_offs_s=(3600.0, 5000.0),
    )
    shape = {"fast_time_constant": 200.0, "slow_time_constant": 1500.0, "slow_ratio": 0.8}
    found = effect("warmup_bias").signature(given, **shape)
    cold, wanted, step = np.ones(2), [], 1.0
    for t in time:
        wanted.append(cold[0] + 0.8 * cold[1])
        on = any(start <= t < stop for start, stop in windows)
        kept = np.exp(-step / np.array([200.0, 1500.0]))
        cold = cold * kept if on else 1.0 - (1.0 - cold) * kept
    on = np.array([any(start <= t < stop for start, stop in windows) for t in time])
    assert found[on] == pytest.approx(np.array(wanted)[on], abs=1e-9)
    assert found[3660] < 0.4 < found[6500]


def test_a_run_that_follows_at_once_is_the_rest_of_one_long_run() -> None:
    """No gap and power left on: two runs are one programme, for every effect that has no draw of its own."""
    ids = [
        id
        for id, declared in effects().items()
        if not isinstance(declared, NoiseEffect | SensorEffect | ThermalEffect)
        and declared.stage in ("rig", "bias", "scale_factor", "loop")
        and not declared.seeded
        and not declared.conflicts
        and id not in ("fringe_jump", "loop_gain")
    ]
    twin = unit(*ids)
    # The table's angle would begin anew with a run.
    ramp = ["ramp to 55 degC at 1 degC/min"]
    long = simulate([*ramp, "hold for 30 min"], twin, facts=facts()).run
    first = simulate(ramp, twin, facts=facts())
    second = simulate(
        {"start_temperature": "55 degC", "steps": ["hold for 30 min"]},
        twin,
        facts=facts(len(first.run) / 3600.0),
        after=first,
        storage=Storage(powered=True),
    ).run
    assert second.time[0] == 0.0
    rest = long.gyro[len(first.run) :]
    assert second.gyro == pytest.approx(rest, abs=2e-6)


@pytest.mark.parametrize("id", ["stress_relaxation", "moisture", "hidden_thermal_node", "warmup_bias"])
def test_after_a_very_long_storage_what_fades_has_faded(id: str) -> None:
    twin = unit(id)
    first = simulate(RAMP, twin, facts=facts())
    later = simulate(DOWN, twin, facts=facts(2e5), after=first).run
    (soak,) = DOWN[0]
    alone = simulate({"power": "off", "steps": [{soak: ["power on", *DOWN[0][soak]]}]}, twin).run
    assert later.gyro == pytest.approx(alone.gyro, abs=1e-5)


def test_hysteresis_stays_in_storage_and_ageing_goes_on() -> None:
    twin = Twin().with_effect("thermal_hysteresis")
    first = simulate(["soak at 55 degC for 4 h"], twin, sample_s=10.0, facts=facts())
    later, virgin = (simulate(DOWN, twin, facts=facts(240.0), after=after).run for after in (first, None))
    # Warmed by 30 degC and cooled: the play operator is still on the upper branch.
    amplitude = effect("thermal_hysteresis").amplitude.typical()
    assert later.gyro[-1] - virgin.gyro[-1] == pytest.approx(amplitude, rel=1e-3)
    old = Twin().with_effect("ageing", 1.0, time_constant=36e4)
    aged = simulate(DOWN, old, facts=facts(240.0), after=simulate(RAMP, old, facts=facts())).run
    fresh = simulate(DOWN, Twin(), facts=facts()).run
    wanted = np.log1p((240.0 * 3600.0 + aged.time) / 36e4)
    assert aged.gyro - fresh.gyro == pytest.approx(wanted, abs=1e-9)


@pytest.mark.parametrize("hours", [0.75, 30.0])
@pytest.mark.parametrize("id", REMEMBERING)
def test_replay_after_a_run_is_the_simulation_after_it(id: str, hours: float) -> None:
    twin = unit(id)
    first = simulate(RAMP, twin, facts=facts())
    second = simulate(DOWN, twin, facts=facts(hours), after=first)
    found = replay_after(twin, second.run, [first.run])
    size = np.abs(second.run.gyro - replay_after(twin.without_effect(id), second.run, [first.run])).max()
    assert np.abs(found - second.run.gyro).max() < 2e-3 * size
    only = replay_after(twin, second.run, [first.run], only=id)
    assert np.abs(only).max() == pytest.approx(size, rel=5e-3)


def test_a_unit_ages_from_its_first_run_on_whichever_run_is_replayed() -> None:
    """b_1 ln(1 + t / tau) at the runs' own times, 1000 h apart."""
    twin = unit().with_effect("ageing", 0.3, time_constant=360_000.0)
    first = simulate(DOWN, twin, sample_s=60.0, facts=facts())
    later = simulate(DOWN, twin, sample_s=60.0, facts=facts(1000.0), after=first)
    assert later.run.facts.in_use_since == BEGUN and first.run.facts.in_use_since is None
    wanted = 0.3 * np.log1p((3.6e6 + later.run.time) / 360_000.0)
    assert replay(twin, later.run, only="ageing") == pytest.approx(wanted, rel=1e-9)
    after = replay_after(twin, later.run, [first.run], only="ageing")
    assert after == pytest.approx(wanted, rel=1e-9)
    # A unit that was in use before its first run here.
    old = facts().model_copy(update={"in_use_since": BEGUN - timedelta(hours=500)})
    used = simulate(DOWN, twin, sample_s=60.0, facts=old).run
    wanted = 0.3 * np.log1p((1.8e6 + used.time) / 360_000.0)
    assert replay(twin, used, only="ageing") == pytest.approx(wanted, rel=1e-9)


@pytest.mark.parametrize("id", ["ageing", "warmup_bias", "stress_relaxation", "hidden_thermal_node"])
def test_a_clock_of_dates_is_one_that_begins_with_the_run(id: str) -> None:
    """As loggers write: seconds since 1970."""
    twin = unit(id)
    first = simulate(RAMP, twin, sample_s=10.0, facts=facts())
    runs = [first.run, simulate(DOWN, twin, sample_s=10.0, facts=facts(30.0), after=first).run]
    dated = []
    for run in runs:
        begun, on = run.facts.started.timestamp(), run.facts.powered_on
        own = run.facts.model_copy(update={"powered_on": None if on is None else begun + on})
        dated.append(Run(run.name, {**run.columns, "time": begun + run.time}, own))
    for after in ((), (0,)):
        wanted = replay_after(twin, runs[1], [runs[i] for i in after], only=id)
        found = replay_after(twin, dated[1], [dated[i] for i in after], only=id)
        np.testing.assert_allclose(found, wanted, rtol=1e-6, atol=1e-6 * np.abs(wanted).max())
    np.testing.assert_allclose(replay(twin, dated[1]), replay(twin, runs[1]), rtol=1e-6, atol=1e-6)


def test_a_diagnosis_knows_the_time_between_its_runs() -> None:
    twin = unit().with_effect("ageing", 1.0, time_constant=360_000.0)
    runs = [simulate(DOWN, unit(), sample_s=60.0, facts=facts(hours)).run for hours in (700.0, 0.0, 24.0)]
    (fit, held) = with_epoch(runs[:2], runs[2:])
    assert [run.facts.epoch_s for run in (*fit, *held)] == [700.0 * 3600.0, 0.0, 86_400.0]
    for run in (*fit, *held):
        found = replay(twin, run, only="ageing")
        assert found == pytest.approx(np.log1p((run.facts.epoch_s + run.time) / 360_000.0), rel=1e-9)
    naive = simulate(DOWN, twin, sample_s=60.0, facts=Facts(started=datetime(2026, 3, 2))).run
    with pytest.raises(InputError, match="time zone in some of the runs"):
        with_epoch([naive, runs[0]])
    with pytest.raises(InputError, match="before 'in_use_since'"):
        _ = Facts(started=BEGUN, in_use_since=BEGUN + timedelta(hours=1)).epoch_s


def test_turn_on_biases_of_a_units_runs_differ_and_follow_from_the_first_seed() -> None:
    twin = Twin().with_effect("turn_on_bias", 1.0)
    levels = []
    for seed in (1, 1, 2):
        made = [simulate(["hold for 30 s"], twin, facts=facts(), seed=seed, columns=())]
        for hour in (1.0, 2.0):
            made.append(simulate(["hold for 30 s"], twin, facts=facts(hour), after=made[-1], columns=()))
        levels.append([one.run.gyro[0] for one in made])
    assert levels[0] == levels[1] and levels[0] != levels[2]
    assert len(set(levels[0])) == 3


def test_runs_without_their_times_or_out_of_order_are_refused() -> None:
    first = simulate(RAMP, Twin(), facts=facts())
    with pytest.raises(InputError, match="needs the fact 'started'"):
        simulate(DOWN, Twin(), after=first)
    with pytest.raises(InputError, match="before the unit's run before it has ended"):
        simulate(DOWN, Twin(), facts=facts(0.1), after=first)
    with pytest.raises(InputError, match="one twin"):
        simulate(DOWN, Twin().with_nominal(b0=1.0), facts=facts(5.0), after=first)
    second = simulate(DOWN, Twin(), facts=facts(5.0), after=first)
    with pytest.raises(InputError, match="started before"):
        replay_after(Twin(), first.run, [second.run])


def test_a_run_in_a_cold_chamber_begins_as_warm_as_its_storage() -> None:
    """Settled in air of 60 degC, whatever the chamber has; that air cooled for hours before the run."""
    twin = unit("hidden_thermal_node").with_nominal(m=1.0)
    first = simulate(["hold for 20 min"], twin, sample_s=10.0, facts=facts(), truth=True)
    replayed = []
    for hours in (48.0, 1440.0):
        later = simulate(
            {"start_temperature": "-40 degC", "steps": ["hold for 20 min"]},
            twin,
            sample_s=10.0,
            facts=facts(hours),
            truth=True,
            after=first,
            storage=Storage(60.0),
        )
        assert later.truth is not None
        nodes = {name: values[0] for name, values in later.truth.nodes.items() if name != "T_chamber"}
        assert nodes == pytest.approx(dict.fromkeys(nodes, 60.0), abs=0.2)
        assert later.truth.nodes["T_chamber"][0] == -40.0
        # The hidden node too, but for the minute of the way; it was 3.2 and 6.9 deg/h off.
        assert abs(later.truth.contributions["hidden_thermal_node"][0]) < 0.15
        # The coil's outer face, which is not recorded, goes on from storage as well.
        seen = {name: later.run.columns[name] for name in ("time", "gyro", "T_in", "T_chamber")}
        bare = Run.derived("bare", seen, later.run.facts, "deg/h")
        replayed.append(replay_after(twin, bare, [first.run], storage=Storage(60.0)))
    assert replayed[0] == pytest.approx(replayed[1], abs=1e-3)


def test_samples_of_a_storage_lie_within_it() -> None:
    found = storage_times(100.0, 1e6)
    assert found[0] == 100.0 and found[-1] < 1e6 and np.all(np.diff(found) > 0.0)
    assert not len(storage_times(5.0, 5.0))


def test_an_only_sensor_tells_of_both_runs() -> None:
    """`T` stands for the coil's inner face in storage as in the runs."""
    twin = (
        Twin("unit")
        .with_nominal(b0=1.0, b1=0.1, m=2.0)
        .with_effect("thermal_hysteresis", 0.3, half_width=5.0)
    )

    def made(hours: float, column: str) -> Run:
        run = simulate(RAMP, twin, sample_s=10.0, facts=facts(hours), columns=("T_in", "rate")).run
        columns = {column if name == "T_in" else name: values for name, values in run.columns.items()}
        return Run.derived(run.name, columns, run.facts, "deg/h")

    told = [replay_after(twin, made(5.0, column), [made(0.0, column)]) for column in ("T", "T_in")]
    np.testing.assert_allclose(told[0], told[1], atol=1e-9)


def test_storage_goes_on_from_the_last_sample_of_the_run_before() -> None:
    """Runs of other sample intervals: an unrecorded node cools from when it was last known."""
    twin = Twin("unit", plant=load_twin("tactical").plant).with_effect(
        "electronic_crosstalk", 1.0, supply_ratio=0.0
    )
    hot = [{"ramp to 70 degC at 5 degC/min": []}]
    columns = ("T_chamber", "T_in", "T_out")
    first = simulate(hot, twin, sample_s=60.0, facts=facts(), columns=columns)
    second = simulate(
        ["hold for 1 h"], twin, sample_s=1.0, facts=facts(0.5), columns=columns, after=first, truth=True
    )
    assert second.truth is not None
    told = replay_after(twin, second.run, [first.run])
    np.testing.assert_allclose(told, second.truth.noise_free, atol=0.05)


@pytest.mark.parametrize(("sample_s", "count"), [(1.0 / 3.0, 100), (0.1, 777), (0.01, 777)])
def test_a_run_may_follow_at_once_though_times_are_rounded(sample_s: float, count: int) -> None:
    """Datetimes hold microseconds: of these runs the next begins up to 0.3 us before the one before ends."""
    steps = [f"soak at 25 degC for {sample_s * count!r} s"]
    first = simulate(steps, unit(), sample_s=sample_s, facts=facts())
    at = facts(sample_s * count / 3600.0)
    second = simulate(steps, unit(), sample_s=sample_s, facts=at, after=first)
    assert len(second.run) == count
    assert replay_after(unit(), second.run, [first.run]) == pytest.approx(second.run.gyro, abs=1e-9)
    early = facts(sample_s * (count - 0.01) / 3600.0)
    with pytest.raises(InputError, match="ended"):
        simulate(steps, unit(), sample_s=sample_s, facts=early, after=first)


def test_what_a_thermal_effect_makes_of_a_later_run_needs_the_truth_of_the_one_before() -> None:
    twin = unit("thermal_network").with_nominal(b1=0.1)
    first = simulate(RAMP, twin, sample_s=10.0, facts=facts())
    assert simulate(DOWN, twin, sample_s=10.0, facts=facts(1.0), after=first).truth is None
    with pytest.raises(InputError, match="not kept; ask for the truth of that run"):
        simulate(DOWN, twin, sample_s=10.0, facts=facts(1.0), after=first, truth=True)


@pytest.mark.parametrize("effect_too", [False, True])
def test_a_sensor_goes_on_from_where_the_run_before_left_it(effect_too: bool) -> None:
    """It is late by 60 s in a ramp that goes through both runs, and as late in a later run after storage."""
    twin = replace(unit(*(["sensor_lag"] if effect_too else [])), sensors=Sensors(SensorErrors(lag=60.0)))
    whole = simulate(["ramp to 55 degC at 1 degC/min"], twin, facts=facts()).run
    first = simulate(["ramp to 40 degC at 1 degC/min"], twin, facts=facts())
    rest = {"start_temperature": "40 degC", "steps": ["ramp to 55 degC at 1 degC/min"]}
    on = Storage(40.0, powered=True)
    second = simulate(rest, twin, facts=facts(0.25), after=first, storage=on).run
    for name in ("T_in", "T_case"):
        assert second.columns[name] == pytest.approx(whole.columns[name][900:], abs=1e-9)
    stored = simulate(rest, twin, facts=facts(0.25 + 24.0), after=first, storage=Storage(40.0)).run
    assert stored.columns["T_case"][:2] == pytest.approx(40.0, abs=0.01)


def test_a_dose_stays_in_the_fibre_from_run_to_run() -> None:
    """No gap and power left on: two runs are one programme, of which the first was irradiated."""
    turning = "turn at 10 deg/s for 110 min from minute 5"
    irradiated = {"soak at 25 degC for 2 h": ["radiation at 50 Gy/h for 1 h", turning]}
    after = {"soak at 25 degC for 2 h": [turning]}
    asked = {"sample_s": 10.0, "columns": ("T_in", "rate", "dose")}
    twin, on = unit("radiation"), Storage(powered=True)
    whole = simulate([irradiated, after, after], twin, facts=facts(), **asked).run
    first = simulate([irradiated], twin, facts=facts(), **asked)
    second = simulate([after], twin, facts=facts(2.0), after=first, storage=on, **asked)
    third = simulate([after], twin, facts=facts(4.0), after=second, storage=on, **asked).run
    for name in ("dose", "gyro"):
        assert second.run.columns[name] == pytest.approx(whole.columns[name][720:1440], abs=1e-9)
        assert third.columns[name] == pytest.approx(whole.columns[name][1440:], abs=1e-9)
    assert replay_after(twin, third, [first.run, second.run]) == pytest.approx(third.gyro, abs=1e-9)
    assert third.columns["dose"] == pytest.approx(50.0)


@pytest.mark.parametrize(("before_s", "sample_s"), [(1.0, 20.0), (20.0, 1.0), (5.0, 5.0)])
def test_what_goes_with_the_tables_angle_is_a_mean_over_each_runs_own_samples(
    before_s: float, sample_s: float
) -> None:
    twin = unit("table_rate_error", "azimuthal_gradient", "fringe_jump").with_effect(
        "fringe_jump", onset=407.0
    )
    turning = ["turn at 4 deg/s for 9 min from second 30"]
    first = simulate([{"ramp to 40 degC at 1 degC/min": turning}], twin, sample_s=before_s, facts=facts())
    steps = {"start_temperature": "40 degC", "steps": [{"ramp to 55 degC at 1 degC/min": turning}]}
    second = simulate(
        steps, twin, sample_s=sample_s, facts=facts(1.0), after=first, storage=Storage(40.0)
    ).run
    found = replay_after(twin, second, [first.run], storage=Storage(40.0))
    # Rates at the first sample begin with what is known of the storage.
    assert found[2:] == pytest.approx(second.gyro[2:], abs=2e-3)
